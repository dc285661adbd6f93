"""Conditions: decide at each visit whether an action is executed."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from enclave_launch.description.substitution import normalize_to_list_of_substitutions, perform_substitutions
from enclave_launch.host.current import current_release
from enclave_launch.ros_rules.distro import Feature

if TYPE_CHECKING:
    from enclave_launch.description.launch_context import LaunchContext
    from enclave_launch.description.substitution import SomeSubstitutionsType, Substitution


class Condition:
    """True when its predicate is; without a predicate it is false. Evaluated at each visit."""

    def __init__(self, *, predicate: Callable[[LaunchContext], bool] | None = None) -> None:
        self._predicate = predicate

    def describe(self) -> str:
        return repr(self)

    def evaluate(self, context: LaunchContext) -> bool:
        return self._predicate is not None and self._predicate(context)


class InvalidConditionExpressionError(ValueError):
    """A condition that is neither true nor false. ``reason``: without the substitutions, which upstream's text shows
    as objects."""

    def __init__(
        self, expression: str, unexpanded_expression: Iterable[Substitution], valid_expressions: Iterable[str]
    ) -> None:
        expected = ", ".join(valid_expressions)
        self.reason = f"invalid condition expression, expected one of [{expected}] but got '{expression}'"
        super().__init__(f"{self.reason}, expanded from '{' + '.join(map(str, unexpanded_expression))}'")


VALID_TRUE_EXPRESSIONS = ["true", "1"]
VALID_FALSE_EXPRESSIONS = ["false", "0"]


def evaluate_condition_expression(context: LaunchContext, expression: list[Substitution]) -> bool:
    """Perform, strip, ignore case. Raises ``InvalidConditionExpressionError`` for any other text."""
    text = perform_substitutions(context, expression).strip().lower()
    if text in VALID_TRUE_EXPRESSIONS:
        return True
    if text in VALID_FALSE_EXPRESSIONS:
        return False
    valid = VALID_TRUE_EXPRESSIONS + VALID_FALSE_EXPRESSIONS
    raise InvalidConditionExpressionError(text, expression, valid)


class IfCondition(Condition):
    """Holds when the expression performs to ``true`` or ``1``."""

    def __init__(self, predicate_expression: SomeSubstitutionsType) -> None:
        self.__expression = normalize_to_list_of_substitutions(predicate_expression)
        super().__init__(predicate=self._predicate_func)

    def _predicate_func(self, context: LaunchContext) -> bool:
        return evaluate_condition_expression(context, self.__expression)


class UnlessCondition(IfCondition):
    """Holds when the expression performs to ``false`` or ``0``."""

    def _predicate_func(self, context: LaunchContext) -> bool:
        return not super()._predicate_func(context)


class LaunchConfigurationEquals(Condition):
    """Holds when a launch configuration has this value; ``None``: when it is not set."""

    def __init__(self, launch_configuration_name: str, expected_value: SomeSubstitutionsType | None) -> None:
        if current_release().has(Feature.DEPRECATED_CONFIGURATION_EQUALS):
            warnings.warn(
                "The 'LaunchConfigurationEquals' and 'LaunchConfigurationNotEquals' Conditions are deprecated. "
                "Use the 'EqualsSubstitution' and 'NotEqualsSubstitution' substitutions instead",
                UserWarning,
                stacklevel=2,
            )
        self.__name = launch_configuration_name
        self.__expected = (
            None if expected_value is None else normalize_to_list_of_substitutions(expected_value)
        )
        super().__init__(predicate=self._predicate_func)

    def _predicate_func(self, context: LaunchContext) -> bool:
        expected = None if self.__expected is None else perform_substitutions(context, self.__expected)
        return bool(context.launch_configurations.get(self.__name) == expected)


class LaunchConfigurationNotEquals(LaunchConfigurationEquals):
    """Holds when ``LaunchConfigurationEquals`` does not."""

    def _predicate_func(self, context: LaunchContext) -> bool:
        return not super()._predicate_func(context)
