"""``$(equals a b)``."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.frontend.expose import expose_substitution
from enclave_launch.description.launch.substitution import Substitution
from enclave_launch.description.launch.utilities import (
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.description.launch.utilities.type_utils import is_substitution
from enclave_launch.ros_rules.distro import Feature

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_context import LaunchContext
    from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType

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
