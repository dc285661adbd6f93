"""``$(file-content path)``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.frontend.expose import expose_substitution
from enclave_launch.description.launch.substitution import Substitution
from enclave_launch.description.launch.substitutions.substitution_failure import SubstitutionFailure
from enclave_launch.description.launch.utilities import (
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.ros_rules.distro import Feature

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_context import LaunchContext
    from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType


@expose_substitution("file-content", feature=Feature.FILE_CONTENT)
class FileContent(Substitution):
    """The text of a file, unstripped."""

    def __init__(self, path: SomeSubstitutionsType) -> None:
        self.__path = normalize_to_list_of_substitutions(path)

    @classmethod
    def parse(cls, data: Sequence[SomeSubstitutionsType]) -> tuple[type[Substitution], dict[str, Any]]:
        if len(data) != 1:
            raise AttributeError("file content substitutions expect 1 argument")
        return cls, {"path": data[0]}

    @property
    def path(self) -> list[Substitution]:
        return self.__path

    def describe(self) -> str:
        return f"FileContent({', '.join(sub.describe() for sub in self.__path)})"

    def perform(self, context: LaunchContext) -> str:
        path = perform_substitutions(context, self.__path)
        try:
            with open(path) as file:
                return file.read()
        except FileNotFoundError:
            raise SubstitutionFailure(f"File not found: {path}") from None
