"""The error of a condition that is neither true nor false."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from enclave_launch.description.launch.substitution import Substitution


class InvalidConditionExpressionError(ValueError):
    """``reason``: without the substitutions, which upstream's text shows as objects."""

    def __init__(
        self, expression: str, unexpanded_expression: Iterable[Substitution], valid_expressions: Iterable[str]
    ) -> None:
        expected = ", ".join(valid_expressions)
        self.reason = f"invalid condition expression, expected one of [{expected}] but got '{expression}'"
        super().__init__(f"{self.reason}, expanded from '{' + '.join(map(str, unexpanded_expression))}'")
