"""``$(if condition a [b])``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.frontend.expose import expose_substitution
from enclave_launch.description.launch.substitution import Substitution
from enclave_launch.description.launch.substitutions.boolean_substitution import perform_boolean
from enclave_launch.description.launch.utilities import (
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.ros_rules.distro import Feature

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_context import LaunchContext
    from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType


@expose_substitution("if", feature=Feature.EQUALS_IF)
class IfElseSubstitution(Substitution):
    """One of two values; only that one is performed."""

    def __init__(
        self,
        condition: SomeSubstitutionsType,
        if_value: SomeSubstitutionsType = "",
        else_value: SomeSubstitutionsType = "",
    ) -> None:
        if if_value == else_value == "":
            raise RuntimeError("One of if_value and else_value must be specified")
        self._condition = normalize_to_list_of_substitutions(condition)
        self._if_value = normalize_to_list_of_substitutions(if_value)
        self._else_value = normalize_to_list_of_substitutions(else_value)

    @classmethod
    def parse(cls, data: Sequence[SomeSubstitutionsType]) -> tuple[type[Substitution], dict[str, Any]]:
        if not 2 <= len(data) <= 3:
            raise TypeError("if substitution expects from 2 or 3 arguments")
        return cls, dict(zip(("condition", "if_value", "else_value"), data, strict=False))

    @property
    def condition(self) -> list[Substitution]:
        return self._condition

    @property
    def if_value(self) -> list[Substitution]:
        return self._if_value

    @property
    def else_value(self) -> list[Substitution]:
        return self._else_value

    def describe(self) -> str:
        return f"IfElseSubstitution({self._condition}, {self._if_value}, {self._else_value})"

    def perform(self, context: LaunchContext) -> str:
        chosen = self._if_value if perform_boolean(context, self._condition) else self._else_value
        return perform_substitutions(context, chosen)
