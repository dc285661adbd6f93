"""Normalize what users write as ``parameters=``, without a context.

A normalized file is a ``ParameterFile``; a normalized dict maps tuples of substitutions to

- a scalar, bytes, or a tuple of equal scalars: nothing left to evaluate;
- a tuple of substitutions: their joined text is read as YAML;
- a tuple of sequences of substitutions: each is one item, read as YAML;
- a ``ParameterValue``, which evaluates itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from enclave_launch.description.absent_modules import OpaqueValue
from enclave_launch.description.argument_types import ensure_argument_type
from enclave_launch.description.parameters.descriptions import Parameter, ParameterFile, ParameterValue
from enclave_launch.description.parameters.yaml_text import YamlConstant
from enclave_launch.description.substitution import (
    SomeSubstitutionsType_types_tuple,
    Substitution,
    TextSubstitution,
    normalize_to_list_of_substitutions,
)

if TYPE_CHECKING:
    from enclave_launch.description.parameters.types import (
        Parameters,
        ParametersDict,
        SomeParameters,
        SomeParametersDict,
    )

_ITEM_TYPES = (float, int, str, bool, *SomeSubstitutionsType_types_tuple)


def normalize_parameters(parameters: SomeParameters) -> Parameters:
    """Bring parameters into one form; raises ``TypeError`` for a lone string or another non-sequence."""
    if isinstance(parameters, OpaqueValue):
        return (parameters,)
    if isinstance(parameters, str) or not isinstance(parameters, Sequence):
        raise TypeError(f"Expecting list of parameters, got {parameters}")
    return tuple(_normalize(item) for item in parameters)


def _normalize(item: Any) -> ParameterFile | Parameter | ParametersDict | OpaqueValue:
    if isinstance(item, Mapping):
        return normalize_parameter_dict(item)
    if isinstance(item, (Parameter, ParameterFile, OpaqueValue)):
        return item
    return ParameterFile(item)


def normalize_parameter_dict(
    parameters: SomeParametersDict, *, _prefix: Sequence[Substitution] = ()
) -> ParametersDict:
    """Normalize parameters; nested dicts become dotted names. Raises TypeError."""
    if not isinstance(parameters, Mapping):
        raise TypeError("expected dict")
    normalized: ParametersDict = {}
    for key, value in parameters.items():
        own_name = normalize_to_list_of_substitutions(key)
        name = (*_prefix, TextSubstitution(text="."), *own_name) if _prefix else tuple(own_name)
        if isinstance(value, Mapping):
            normalized.update(normalize_parameter_dict(value, _prefix=name))
        else:
            normalized[name] = _normalize_value(value)
    return normalized


def _normalize_value(value: Any) -> Any:
    if isinstance(value, str):
        return (YamlConstant(value),)
    if isinstance(value, Substitution):
        return (value,)
    if isinstance(value, (ParameterValue, bool, int, float, bytes)):
        return value
    if isinstance(value, Sequence):
        return _normalize_sequence(value)
    raise TypeError(f"Unexpected type for parameter value {value!r}")


def _normalize_sequence(items: Sequence[Any]) -> tuple[Any, ...]:
    """Keep equal numbers numbers, join text and substitutions to one text, take all else item by item."""
    kinds = {_kind(item) for item in items}
    if kinds in ({int}, {bool}):
        return tuple(items)
    if kinds in ({float}, {int, float}):
        return tuple(float(item) for item in items)
    if Substitution in kinds and kinds <= {str, Substitution}:
        return tuple(normalize_to_list_of_substitutions(items))
    return tuple(
        (YamlConstant(item),)
        if isinstance(item, (float, int, str))
        else tuple(normalize_to_list_of_substitutions(item))
        for item in items
    )


def _kind(item: Any) -> type:
    ensure_argument_type(item, _ITEM_TYPES, "subvalue")
    for kind in (Substitution, str, bool, int, float):
        if isinstance(item, kind):
            return kind
    if isinstance(item, Sequence):
        return tuple
    raise RuntimeError(f"Failed to handle type {item!r}")
