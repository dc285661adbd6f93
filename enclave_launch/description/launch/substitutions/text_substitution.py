"""Plain text."""

from __future__ import annotations

from typing import TYPE_CHECKING

from enclave_launch.description.launch.substitution import Substitution

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_context import LaunchContext


class TextSubstitution(Substitution):
    """Stands for itself."""

    def __init__(self, *, text: str) -> None:
        if not isinstance(text, str):
            raise TypeError(f"TextSubstitution expected Text object got '{type(text)}' instead.")
        self.__text = text

    @property
    def text(self) -> str:
        return self.__text

    def describe(self) -> str:
        return f"'{self.__text}'"

    def perform(self, context: LaunchContext) -> str:
        return self.__text
