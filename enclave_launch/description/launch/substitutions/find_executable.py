"""``$(find-exec name)``."""

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

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_context import LaunchContext
    from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType


@expose_substitution("find-exec")
class FindExecutable(Substitution):
    """The path of a program on the ``PATH``."""

    def __init__(self, *, name: SomeSubstitutionsType) -> None:
        self.__name = normalize_to_list_of_substitutions(name)

    @classmethod
    def parse(cls, data: Sequence[SomeSubstitutionsType]) -> tuple[type[Substitution], dict[str, Any]]:
        if len(data) != 1:
            raise AttributeError("find-exec substitution expects 1 argument")
        return cls, {"name": data[0]}

    @property
    def name(self) -> list[Substitution]:
        return self.__name

    def describe(self) -> str:
        return f"FindExec({' + '.join(sub.describe() for sub in self.__name)})"

    def perform(self, context: LaunchContext) -> str:
        name = perform_substitutions(context, self.__name)
        path = context.host.find_program(name)
        if path is None:
            raise SubstitutionFailure(f"executable '{name}' not found on the PATH")
        return path
