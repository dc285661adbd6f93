"""API of ``launch.utilities.type_utils``: the functions of ``typed_values``, and the types that they speak of."""

from __future__ import annotations

from collections.abc import Sequence
from typing import List, TypeAlias  # noqa: UP035  (upstream names typing.List)

from enclave_launch.description.substitution import SomeSubstitutionsType, Substitution
from enclave_launch.description.typed_values import *  # noqa: F403
from enclave_launch.description.typed_values import ScalarTypesTuple

ListTypesTuple = (List[int], List[float], List[bool], List[str])  # noqa: UP006
AllowedTypesTuple = (*ScalarTypesTuple, *ListTypesTuple)

ScalarTypesType: TypeAlias = type[int | float | bool | str]
ListTypesType: TypeAlias = type[list[int] | list[float] | list[bool] | list[str]]
AllowedTypesType: TypeAlias = ScalarTypesType | ListTypesType
ScalarValueType: TypeAlias = int | float | bool | str
ListValueType: TypeAlias = list[int] | list[float] | list[bool] | list[str]
SequenceValueType: TypeAlias = Sequence[int] | Sequence[float] | Sequence[bool] | Sequence[str]
AllowedValueType: TypeAlias = ScalarValueType | SequenceValueType
SomeScalarType: TypeAlias = SomeSubstitutionsType | ScalarValueType
SomeSequenceType: TypeAlias = Sequence[int | float | bool | str | SomeSubstitutionsType]
SomeValueType: TypeAlias = SomeScalarType | SomeSequenceType
NormalizedScalarType: TypeAlias = list[Substitution] | ScalarValueType
NormalizedSequenceType: TypeAlias = list[int | float | bool | str | list[Substitution]]
NormalizedValueType: TypeAlias = NormalizedScalarType | NormalizedSequenceType
StrSomeScalarType: TypeAlias = SomeScalarType
StrSomeSequenceType: TypeAlias = Sequence[int | float | bool | str]
StrSomeValueType: TypeAlias = StrSomeScalarType | StrSomeSequenceType
