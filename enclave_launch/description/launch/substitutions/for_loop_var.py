"""``$(for-var name [default])`` and ``$(index name)``."""

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


def local_name(name: str) -> str:
    """The local that carries the value of loop variable ``name``."""
    return f"ForEachVar__{name}"


@expose_substitution("for-var", feature=Feature.FOR_EACH)
class ForEachVar(Substitution):
    """A value of the round of ``for_each`` that is being visited."""

    def __init__(
        self, name: SomeSubstitutionsType, *, default_value: SomeSubstitutionsType | None = None
    ) -> None:
        self._name = normalize_to_list_of_substitutions(name)
        self._default_value = (
            None if default_value is None else normalize_to_list_of_substitutions(default_value)
        )

    @classmethod
    def parse(cls, data: Sequence[SomeSubstitutionsType]) -> tuple[type[Substitution], dict[str, Any]]:
        if not 1 <= len(data) <= 2:
            raise ValueError(f"{cls.__name__} substitution expects 1 or 2 arguments")
        return cls, dict(zip(("name", "default_value"), data, strict=False))

    @property
    def name(self) -> list[Substitution]:
        return self._name

    @property
    def default_value(self) -> list[Substitution] | None:
        return self._default_value

    def describe(self) -> str:
        return f"{type(self).__name__}(name={' + '.join(sub.describe() for sub in self._name)})"

    def perform(self, context: LaunchContext) -> str:
        name = perform_substitutions(context, self._name)
        value: str | None = context.get_locals_as_dict().get(local_name(name))
        if value is not None:
            return value
        if self._default_value is None:
            raise RuntimeError(
                f"No value available for {type(self).__name__} '{name}' and no default value provided"
            )
        return perform_substitutions(context, self._default_value)


@expose_substitution("index", feature=Feature.FOR_LOOP)
class ForLoopIndex(ForEachVar):
    """The number of the round of ``for`` that is being visited."""

    def __init__(self, name: SomeSubstitutionsType, **_: Any) -> None:
        super().__init__(name)
