"""Type names for parameters: as users write them, normalized, and evaluated."""

from __future__ import annotations

import pathlib
from collections.abc import Mapping, Sequence
from typing import Any, Union

from enclave_launch.description.absent_modules import OpaqueValue
from enclave_launch.description.parameters.descriptions import (
    EvaluatedParameterValue as EvaluatedParameterValue,
)
from enclave_launch.description.parameters.descriptions import Parameter as ParameterDescription
from enclave_launch.description.parameters.descriptions import ParameterFile
from enclave_launch.description.parameters.descriptions import ParameterValue as ParameterValueDescription
from enclave_launch.description.substitution import (
    SomeSubstitutionsType,
    SomeSubstitutionsType_types_tuple,
    Substitution,
)
from enclave_launch.process import UnknownParameters

# ruff: noqa: UP007  (aliases evaluated at run time, as upstream's are)


_Scalar = Union[str, int, float, bool]
_Several = Union[Sequence[str], Sequence[int], Sequence[float], Sequence[bool], bytes]

SomeParameterFile = Union[SomeSubstitutionsType, pathlib.Path, ParameterFile]
SomeParameterName = Union[SomeSubstitutionsType, Sequence[Union[Substitution, str]]]
SomeParameterValue = Union[
    ParameterValueDescription, SomeSubstitutionsType, Sequence[SomeSubstitutionsType], _Scalar, _Several
]
SomeParameterValue_types_tuple = (*SomeSubstitutionsType_types_tuple, str, int, float, bool, bytes)
SomeParametersDict = Mapping[Any, Any]  # name -> value, or a mapping of the same kind
SomeParameters = Sequence[Union[SomeParameterFile, ParameterDescription, SomeParametersDict]]

ParameterName = tuple[Substitution, ...]
ParameterValue = Union[
    Sequence[Substitution], Sequence[Sequence[Substitution]], _Scalar, _Several, ParameterValueDescription
]
ParametersDict = dict[ParameterName, ParameterValue]
Parameters = Sequence[Union[ParameterFile, ParametersDict, ParameterDescription, OpaqueValue]]

EvaluatedParameter = Union[
    pathlib.Path, ParameterDescription, dict[str, EvaluatedParameterValue], UnknownParameters
]
EvaluatedParameters = Sequence[EvaluatedParameter]
