"""Substitutions that decide: ``not``, ``and``, ``or``, ``any``, ``all``, ``equals``, ``not-equals``, ``if``."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from enclave_launch.description import read_only
from enclave_launch.description.markup.expose import expose_substitution
from enclave_launch.description.substitution import (
    SomeSubstitutionsType,
    Substitution,
    SubstitutionFailure,
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.description.templates import TemplateSubstitution, template
from enclave_launch.description.typed_values import is_substitution, perform_typed_substitution
from enclave_launch.host.current import current_release
from enclave_launch.ros_rules.distro import Feature

if TYPE_CHECKING:
    from enclave_launch.description.launch_context import LaunchContext


Parsed = tuple[type[Substitution], dict[str, Any]]


def perform_boolean(context: LaunchContext, value: list[Substitution]) -> bool:
    """Evaluate to a boolean; raises ``SubstitutionFailure`` for other values than YAML booleans."""
    try:
        return bool(perform_typed_substitution(context, value, bool))
    except (TypeError, ValueError) as error:
        raise SubstitutionFailure(error) from error


def _text(value: bool) -> str:
    return "true" if value else "false"


@expose_substitution("not")
class NotSubstitution(TemplateSubstitution):
    """Negation: ``true`` when the value is false."""

    value = template()
    refusal = (TypeError, "not substitution expects 1 argument")

    def describe(self) -> str:
        return f"NotSubstitution({self.value})"

    def perform(self, context: LaunchContext) -> str:
        return _text(not perform_boolean(context, self.value))


class _Binary(TemplateSubstitution):
    """Both operands are always performed."""

    left = template()
    right = template()
    refusal = (TypeError, "and substitution expects 2 arguments")

    def describe(self) -> str:
        return f"{type(self).__name__}({self.left} {self.right})"

    def _operands(self, context: LaunchContext) -> tuple[bool, bool]:
        return perform_boolean(context, self.left), perform_boolean(context, self.right)


@expose_substitution("and")
class AndSubstitution(_Binary):
    """Conjunction: ``true`` when both are."""

    def perform(self, context: LaunchContext) -> str:
        return _text(all(self._operands(context)))


@expose_substitution("or")
class OrSubstitution(_Binary):
    """Disjunction: ``true`` when one of two is."""

    def perform(self, context: LaunchContext) -> str:
        return _text(any(self._operands(context)))


@read_only("args")
class _Variadic(Substitution):
    """All operands are always performed."""

    args: list[list[Substitution]]

    def __init__(self, *args: SomeSubstitutionsType) -> None:
        self.__args = [normalize_to_list_of_substitutions(arg) for arg in args]

    @classmethod
    def parse(
        cls, data: Sequence[SomeSubstitutionsType]
    ) -> tuple[Callable[..., Substitution], dict[str, Any]]:
        """Parse the arguments; older releases pass them by a keyword that the constructor does not have."""
        if current_release().has(Feature.ANY_ALL_ARGUMENTS):
            return partial(cls, *data), {}
        return cls, {"args": data}

    def describe(self) -> str:
        return f"{type(self).__name__}({' '.join(str(arg) for arg in self.__args)})"

    def _operands(self, context: LaunchContext) -> list[bool]:
        return [perform_boolean(context, arg) for arg in self.__args]


@expose_substitution("any", feature=Feature.EQUALS_IF)
class AnySubstitution(_Variadic):
    """Disjunction of any number of values: ``true`` when at least one is."""

    def __init__(self, *args: SomeSubstitutionsType) -> None:  # its own: Python's error names it, as upstream
        super().__init__(*args)

    def perform(self, context: LaunchContext) -> str:
        return _text(any(self._operands(context)))


@expose_substitution("all", feature=Feature.EQUALS_IF)
class AllSubstitution(_Variadic):
    """Conjunction of any number of values: ``true`` when each is."""

    def __init__(self, *args: SomeSubstitutionsType) -> None:  # its own: Python's error names it, as upstream
        super().__init__(*args)

    def perform(self, context: LaunchContext) -> str:
        return _text(all(self._operands(context)))


_TRUE, _FALSE = ("true", "1"), ("false", "0")


def _read(value: Any) -> list[Substitution]:
    if is_substitution(value):
        return normalize_to_list_of_substitutions(value)
    if value is None:
        value = ""
    text = str(value)
    return normalize_to_list_of_substitutions(text.lower() if isinstance(value, bool) else text)


@expose_substitution("equals", feature=Feature.EQUALS_IF)
class EqualsSubstitution(TemplateSubstitution):
    """Equality: ``true`` when both are the same boolean, else the same number, else the same text."""

    left = template(read=_read)
    right = template(read=_read)
    refusal = (TypeError, "and substitution expects 2 arguments")

    def describe(self) -> str:
        return f"{type(self).__name__}({self.left} {self.right})"

    def perform(self, context: LaunchContext) -> str:
        left = perform_substitutions(context, self.left)
        right = perform_substitutions(context, self.right)
        return _text(_equal(left, right))


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
    """Inequality: ``true`` when ``equals`` is not."""

    def perform(self, context: LaunchContext) -> str:
        return _text(super().perform(context) == "false")


@expose_substitution("if", feature=Feature.EQUALS_IF)
class IfElseSubstitution(TemplateSubstitution):
    """One of two values; only that one is performed."""

    condition = template()
    if_value = template(default="")
    else_value = template(default="")
    refusal = (TypeError, "if substitution expects from 2 or 3 arguments")

    def __init__(
        self,
        condition: SomeSubstitutionsType,
        if_value: SomeSubstitutionsType = "",
        else_value: SomeSubstitutionsType = "",
    ) -> None:
        if if_value == else_value == "":
            raise RuntimeError("One of if_value and else_value must be specified")
        super().__init__(condition, if_value, else_value)

    @classmethod
    def parse(cls, data: Sequence[SomeSubstitutionsType]) -> tuple[type[Substitution], dict[str, Any]]:
        if len(data) < 2:
            raise TypeError(cls.refusal[1])
        return super().parse(data)

    def describe(self) -> str:
        return f"IfElseSubstitution({self.condition}, {self.if_value}, {self.else_value})"

    def perform(self, context: LaunchContext) -> str:
        chosen = self.if_value if perform_boolean(context, self.condition) else self.else_value
        return perform_substitutions(context, chosen)
