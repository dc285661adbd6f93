"""``$(string-join delimiter a b ...)``."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.frontend.expose import expose_substitution
from enclave_launch.description.launch.substitution import Substitution
from enclave_launch.description.launch.utilities import (
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.ros_rules.distro import Feature

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_context import LaunchContext
    from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType


@expose_substitution("string-join", feature=Feature.JOIN_IN_FRONTENDS)
class StringJoinSubstitution(Substitution):
    """Concatenates each component, then joins them with the delimiter."""

    def __init__(
        self, substitutions: Iterable[SomeSubstitutionsType], delimiter: SomeSubstitutionsType = ""
    ) -> None:
        self.__substitutions = [normalize_to_list_of_substitutions(component) for component in substitutions]
        self.__delimiter = normalize_to_list_of_substitutions(delimiter)

    @classmethod
    def parse(cls, data: Sequence[SomeSubstitutionsType]) -> tuple[type[Substitution], dict[str, Any]]:
        if len(data) < 2:
            raise TypeError(
                "string-join substitution expects at least 2 arguments: 1 delimiter + at least 1 component"
            )
        return cls, {"delimiter": data[0], "substitutions": data[1:]}

    @property
    def substitutions(self) -> list[list[Substitution]]:
        return self.__substitutions

    @property
    def delimiter(self) -> list[Substitution]:
        return self.__delimiter

    def describe(self) -> str:
        components = [" + ".join(sub.describe() for sub in component) for component in self.__substitutions]
        delimiter = " + ".join(sub.describe() for sub in self.__delimiter)
        return f"StringJoinSubstitution([{', '.join(components)}], delimiter={delimiter})"

    def perform(self, context: LaunchContext) -> str:
        components = [perform_substitutions(context, component) for component in self.__substitutions]
        return perform_substitutions(context, self.__delimiter).join(components)
