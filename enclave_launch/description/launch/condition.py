"""Base of the conditions that decide whether an action is executed."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_context import LaunchContext


class Condition:
    """True when its predicate is; without a predicate it is false. Evaluated anew at each visit."""

    def __init__(self, *, predicate: Callable[[LaunchContext], bool] | None = None) -> None:
        self._predicate = predicate

    def describe(self) -> str:
        return repr(self)

    def evaluate(self, context: LaunchContext) -> bool:
        return self._predicate is not None and self._predicate(context)
