"""``PathJoinSubstitution``, ``$(path-join ...)``."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.frontend.expose import expose_substitution
from enclave_launch.description.launch.substitution import Substitution
from enclave_launch.description.launch.utilities import normalize_to_list_of_substitutions
from enclave_launch.host.current import current_release
from enclave_launch.ros_rules.distro import Feature

if TYPE_CHECKING:
    from collections.abc import Iterable

    from enclave_launch.description.launch.launch_context import LaunchContext
    from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType


@expose_substitution("path-join", feature=Feature.JOIN_IN_FRONTENDS)
class PathJoinSubstitution(Substitution):
    """Joins its parts as ``os.path.join`` does: an absolute part discards what is before it.

    Since launch 3.8.1 a part may be a sequence, which is concatenated first.
    """

    def __init__(self, substitutions: Iterable[Any]) -> None:
        self.__parts = [_part(item) for item in _items(substitutions)]

    @classmethod
    def parse(cls, data: Sequence[SomeSubstitutionsType]) -> tuple[type[Substitution], dict[str, Any]]:
        if len(data) < 1:
            raise TypeError("path-join substitution expects at least 1 argument")
        return cls, {"substitutions": data}

    @property
    def substitutions(self) -> list[Any]:
        return [part[0] if len(part) == 1 else part for part in self.__parts]

    def describe(self) -> str:
        parts = (" + ".join(sub.describe() for sub in part) for part in self.__parts)
        return f"PathJoin('{' + '.join(parts)}')"

    def perform(self, context: LaunchContext) -> str:
        return os.path.join(*("".join([sub.perform(context) for sub in part]) for part in self.__parts))

    def __truediv__(self, other: SomeSubstitutionsType) -> PathJoinSubstitution:
        return PathJoinSubstitution([*self.substitutions, other])


def _items(substitutions: Any) -> Iterable[Any]:
    if isinstance(substitutions, (str, Substitution)):
        return [substitutions]
    return substitutions  # type: ignore[no-any-return]


def _part(item: Any) -> list[Substitution]:
    if isinstance(item, (str, Substitution)) or current_release().has(Feature.NESTED_PATH_JOIN):
        return normalize_to_list_of_substitutions(item)
    return normalize_to_list_of_substitutions([item])
