"""``LocalSubstitution``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from enclave_launch.description.launch.substitution import Substitution
from enclave_launch.description.launch.utilities import ensure_argument_type

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_context import LaunchContext


class LocalSubstitution(Substitution):
    """A Python expression on the locals of the context: ``event.process_name``."""

    def __init__(self, expression: str, description: str | None = None) -> None:
        ensure_argument_type(expression, str, "expression", "LocalSubstitution")
        self.__expression = expression
        self.__description = description

    @property
    def expression(self) -> str:
        return self.__expression

    @property
    def description(self) -> str | None:
        return self.__description

    def describe(self) -> str:
        return f"LocalVar('{self.__expression if self.__description is None else self.__description}')"

    def perform(self, context: LaunchContext) -> str:
        # Only Python launch files, which are code themselves, can make one of these.
        value: str = eval(f"context.locals.{self.__expression}", {"context": context})
        return value
