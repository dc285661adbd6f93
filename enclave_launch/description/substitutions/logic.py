"""Substitutions that decide: ``not``, ``and``, ``or``, ``any``, ``all``, ``equals``, ``not-equals``, ``if``."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from enclave_launch.description.markup.expose import expose_substitution
from enclave_launch.description.substitution import (
    Substitution,
    SubstitutionFailure,
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.description.typed_values import is_substitution, perform_typed_substitution
from enclave_launch.host.current import current_release
from enclave_launch.ros_rules.distro import Feature

if TYPE_CHECKING:
    from enclave_launch.description.launch_context import LaunchContext
    from enclave_launch.description.substitution import SomeSubstitutionsType


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


_TRUE, _FALSE = ("true", "1"), ("false", "0")


@expose_substitution("equals", feature=Feature.EQUALS_IF)
class EqualsSubstitution(Substitution):
    """``true`` when both are the same boolean, else the same number, else the same text."""

    def __init__(self, left: Any, right: Any) -> None:
        self.__left = normalize_to_list_of_substitutions(_as_text(left))
        self.__right = normalize_to_list_of_substitutions(_as_text(right))

    @classmethod
    def parse(cls, data: Sequence[SomeSubstitutionsType]) -> tuple[type[Substitution], dict[str, Any]]:
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

    def perform(self, context: LaunchContext) -> str:
        left = perform_substitutions(context, self.__left)
        right = perform_substitutions(context, self.__right)
        return "true" if _equal(left, right) else "false"


def _as_text(value: Any) -> Any:
    if is_substitution(value):
        return value
    if value is None:
        return ""
    return str(value).lower() if isinstance(value, bool) else str(value)


def _equal(left: str, right: str) -> bool:
    words = (*_TRUE, *_FALSE)
    if left.lower() in words and right.lower() in words:
        return (left.lower() in _TRUE) == (right.lower() in _TRUE)
    try:
        return math.isclose(float(left), float(right))
    except ValueError:
        return left == right


@expose_substitution("not-equals", feature=Feature.EQUALS_IF)
class NotEqualsSubstitution(EqualsSubstitution):
    """``true`` when ``equals`` is not."""

    def perform(self, context: LaunchContext) -> str:
        return "false" if super().perform(context) == "true" else "true"


@expose_substitution("if", feature=Feature.EQUALS_IF)
class IfElseSubstitution(Substitution):
    """One of two values; only that one is performed."""

    def __init__(
        self,
        condition: SomeSubstitutionsType,
        if_value: SomeSubstitutionsType = "",
        else_value: SomeSubstitutionsType = "",
    ) -> None:
        if if_value == else_value == "":
            raise RuntimeError("One of if_value and else_value must be specified")
        self._condition = normalize_to_list_of_substitutions(condition)
        self._if_value = normalize_to_list_of_substitutions(if_value)
        self._else_value = normalize_to_list_of_substitutions(else_value)

    @classmethod
    def parse(cls, data: Sequence[SomeSubstitutionsType]) -> tuple[type[Substitution], dict[str, Any]]:
        if not 2 <= len(data) <= 3:
            raise TypeError("if substitution expects from 2 or 3 arguments")
        return cls, dict(zip(("condition", "if_value", "else_value"), data, strict=False))

    @property
    def condition(self) -> list[Substitution]:
        return self._condition

    @property
    def if_value(self) -> list[Substitution]:
        return self._if_value

    @property
    def else_value(self) -> list[Substitution]:
        return self._else_value

    def describe(self) -> str:
        return f"IfElseSubstitution({self._condition}, {self._if_value}, {self._else_value})"

    def perform(self, context: LaunchContext) -> str:
        chosen = self._if_value if perform_boolean(context, self._condition) else self._else_value
        return perform_substitutions(context, chosen)
