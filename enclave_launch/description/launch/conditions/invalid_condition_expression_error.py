"""The error of a condition that is neither true nor false."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from enclave_launch.description.launch.substitution import Substitution


class InvalidConditionExpressionError(ValueError):
    def __init__(
        self, expression: str, unexpanded_expression: Iterable[Substitution], valid_expressions: Iterable[str]
    ) -> None:
        super().__init__(
            f"invalid condition expression, expected one of [{', '.join(valid_expressions)}] "
            f"but got '{expression}', expanded from '{' + '.join(map(str, unexpanded_expression))}'"
        )
