"""The reading of a condition: true, 1, false or 0."""

from __future__ import annotations

from typing import TYPE_CHECKING

from enclave_launch.description.launch.conditions.invalid_condition_expression_error import (
    InvalidConditionExpressionError,
)
from enclave_launch.description.launch.utilities import perform_substitutions

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_context import LaunchContext
    from enclave_launch.description.launch.substitution import Substitution

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
