"""``not``, ``and``, ``or``, ``any``, ``all`` over booleans in YAML's sense."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.frontend.expose import expose_substitution
from enclave_launch.description.launch.substitution import Substitution
from enclave_launch.description.launch.substitutions.substitution_failure import SubstitutionFailure
from enclave_launch.description.launch.utilities import normalize_to_list_of_substitutions
from enclave_launch.description.launch.utilities.type_utils import perform_typed_substitution
from enclave_launch.host.current import current_release
from enclave_launch.ros_rules.distro import Feature

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_context import LaunchContext
    from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType

Parsed = tuple[type[Substitution], dict[str, Any]]


def perform_boolean(context: LaunchContext, value: list[Substitution]) -> bool:
    """Raises ``SubstitutionFailure`` for what is no YAML boolean."""
    try:
        return bool(perform_typed_substitution(context, value, bool))
    except (TypeError, ValueError) as error:
        raise SubstitutionFailure(error) from error


def _text(value: bool) -> str:
    return "true" if value else "false"


@expose_substitution("not")
class NotSubstitution(Substitution):
    def __init__(self, value: SomeSubstitutionsType) -> None:
        self.__value = normalize_to_list_of_substitutions(value)

    @classmethod
    def parse(cls, data: Sequence[SomeSubstitutionsType]) -> Parsed:
        if len(data) != 1:
            raise TypeError("not substitution expects 1 argument")
        return cls, {"value": data[0]}

    @property
    def value(self) -> list[Substitution]:
        return self.__value

    def describe(self) -> str:
        return f"NotSubstitution({self.__value})"

    def perform(self, context: LaunchContext) -> str:
        return _text(not perform_boolean(context, self.__value))


class _Binary(Substitution):
    """Both operands are always performed."""

    def __init__(self, left: SomeSubstitutionsType, right: SomeSubstitutionsType) -> None:
        self.__left = normalize_to_list_of_substitutions(left)
        self.__right = normalize_to_list_of_substitutions(right)

    @classmethod
    def parse(cls, data: Sequence[SomeSubstitutionsType]) -> Parsed:
        if len(data) != 2:
            raise TypeError("and substitution expects 2 arguments")
        return cls, {"left": data[0], "right": data[1]}

    @property
    def left(self) -> list[Substitution]:
        return self.__left

    @property
    def right(self) -> list[Substitution]:
        return self.__right

    def describe(self) -> str:
        return f"{type(self).__name__}({self.__left} {self.__right})"

    def _operands(self, context: LaunchContext) -> tuple[bool, bool]:
        return perform_boolean(context, self.__left), perform_boolean(context, self.__right)


@expose_substitution("and")
class AndSubstitution(_Binary):
    def perform(self, context: LaunchContext) -> str:
        return _text(all(self._operands(context)))


@expose_substitution("or")
class OrSubstitution(_Binary):
    def perform(self, context: LaunchContext) -> str:
        return _text(any(self._operands(context)))


class _Variadic(Substitution):
    """All operands are always performed."""

    def __init__(self, *args: SomeSubstitutionsType) -> None:
        self.__args = [normalize_to_list_of_substitutions(arg) for arg in args]

    @classmethod
    def parse(
        cls, data: Sequence[SomeSubstitutionsType]
    ) -> tuple[Callable[..., Substitution], dict[str, Any]]:
        """Older releases pass the arguments by a keyword that the constructor does not have."""
        if current_release().has(Feature.ANY_ALL_ARGUMENTS):
            return partial(cls, *data), {}
        return cls, {"args": data}

    @property
    def args(self) -> list[list[Substitution]]:
        return self.__args

    def describe(self) -> str:
        return f"{type(self).__name__}({' '.join(str(arg) for arg in self.__args)})"

    def _operands(self, context: LaunchContext) -> list[bool]:
        return [perform_boolean(context, arg) for arg in self.__args]


@expose_substitution("any", feature=Feature.EQUALS_IF)
class AnySubstitution(_Variadic):
    def __init__(self, *args: SomeSubstitutionsType) -> None:
        super().__init__(*args)

    def perform(self, context: LaunchContext) -> str:
        return _text(any(self._operands(context)))


@expose_substitution("all", feature=Feature.EQUALS_IF)
class AllSubstitution(_Variadic):
    def __init__(self, *args: SomeSubstitutionsType) -> None:
        super().__init__(*args)

    def perform(self, context: LaunchContext) -> str:
        return _text(all(self._operands(context)))
