"""``if``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from enclave_launch.description.launch.condition import Condition
from enclave_launch.description.launch.conditions.evaluate_condition_expression_impl import (
    evaluate_condition_expression,
)
from enclave_launch.description.launch.utilities import normalize_to_list_of_substitutions

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_context import LaunchContext
    from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType


class IfCondition(Condition):
    """Holds when the expression performs to ``true`` or ``1``."""

    def __init__(self, predicate_expression: SomeSubstitutionsType) -> None:
        self.__expression = normalize_to_list_of_substitutions(predicate_expression)
        super().__init__(predicate=self._predicate_func)

    def _predicate_func(self, context: LaunchContext) -> bool:
        return evaluate_condition_expression(context, self.__expression)
