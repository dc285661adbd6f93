"""``PathSubstitution``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from enclave_launch.description.launch.substitution import Substitution
from enclave_launch.description.launch.substitutions.path_operator import PathOperator

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_context import LaunchContext


class PathSubstitution(PathOperator, Substitution):
    """A ``pathlib.Path`` as a substitution, or anything that gives a path, with the operator ``/``."""

    def __init__(self, path: object) -> None:
        from enclave_launch.description.launch.utilities import normalize_to_list_of_substitutions

        self.__path = path
        text = str(path) if isinstance(path, Path) else path
        self.__parts = normalize_to_list_of_substitutions(text)  # type: ignore[arg-type]

    @property
    def path(self) -> object:
        return self.__path

    def describe(self) -> str:
        return f"'{self.__path}'"

    def perform(self, context: LaunchContext) -> str:
        return "".join([sub.perform(context) for sub in self.__parts])
