"""``$(anon name)``."""

from __future__ import annotations

from collections.abc import Sequence
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


@expose_substitution("anon")
class AnonName(Substitution):
    """A unique name; the same for the same argument within one scope of launch configurations."""

    def __init__(self, name: SomeSubstitutionsType) -> None:
        self.__name = normalize_to_list_of_substitutions(name)

    @classmethod
    def parse(cls, data: Sequence[SomeSubstitutionsType]) -> tuple[type[Substitution], dict[str, Any]]:
        if len(data) != 1:
            raise TypeError("anon substitution expects 1 argument")
        return cls, {"name": data[0]}

    @property
    def name(self) -> list[Substitution]:
        return self.__name

    def describe(self) -> str:
        return f"AnonName({' + '.join(sub.describe() for sub in self.__name)})"

    def perform(self, context: LaunchContext) -> str:
        name = perform_substitutions(context, self.__name)
        configurations = context.launch_configurations
        if context.host.release.has(Feature.FLAT_ANONYMOUS_NAMES):
            known, key = configurations, f"anon{name}"
        else:
            known, key = configurations.setdefault("anon", {}), name
        if key not in known:
            known[key] = context.host.anonymous_name(name)
        value: str = known[key]
        return value
