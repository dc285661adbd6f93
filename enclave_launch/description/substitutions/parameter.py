"""``param``: the value of a parameter that ``set_parameter`` set."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from enclave_launch.boundary.light import Any
from enclave_launch.description.launch_context import LaunchContext
from enclave_launch.description.markup.expose import expose_substitution
from enclave_launch.description.substitution import (
    SomeSubstitutionsType,
    Substitution,
    SubstitutionFailure,
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.host.current import current_release
from enclave_launch.ros_rules.distro import Feature


@expose_substitution("param")
class Parameter(Substitution):
    """The first global parameter of that name, as ``str``. Parameter files are not searched."""

    def __init__(self, name: SomeSubstitutionsType, *, default: Any = None):
        super().__init__()
        if default is not None and not _takes_default():
            raise TypeError("Parameter.__init__() got an unexpected keyword argument 'default'")
        self.__name = normalize_to_list_of_substitutions(name)
        self.__default = None if default is None else _as_substitutions(default)

    @classmethod
    def parse(cls, data: Sequence[SomeSubstitutionsType]) -> tuple[type[Parameter], dict[str, Any]]:
        if len(data) != 1 and not _takes_default():
            raise AttributeError("param substitutions expect 1 argument")
        if not 1 <= len(data) <= 2:
            raise TypeError("param substitution expects 1 or 2 arguments")
        return cls, dict(zip(("name", "default"), data, strict=False))

    @property
    def name(self) -> list[Substitution]:
        return self.__name

    def describe(self) -> str:
        name = " + ".join(part.describe() for part in self.name)
        return f"{type(self).__name__}(name={name})"

    def perform(self, context: LaunchContext) -> str:
        """Raises ``SubstitutionFailure`` when there is no such parameter and no default."""
        name = perform_substitutions(context, self.__name)
        no_parameters: Any = [] if _takes_default() else None  # without defaults, iterating None fails
        for item in context.launch_configurations.get("global_params", no_parameters):
            if isinstance(item, tuple) and item[0] == name:
                return str(item[1])
        if self.__default is None:
            raise SubstitutionFailure(f"parameter '{name}' not found")
        return perform_substitutions(context, self.__default)


def _takes_default() -> bool:
    return current_release().has(Feature.PARAMETER_DEFAULT)


def _as_substitutions(default: Any) -> list[Substitution]:
    """Items that are neither text nor substitutions count as their ``str``."""
    items = default if isinstance(default, Iterable) else (default,)
    return normalize_to_list_of_substitutions(
        [item if isinstance(item, (str, Substitution)) else str(item) for item in items]
    )
