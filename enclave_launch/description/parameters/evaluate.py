"""Normalized parameters with a context: paths, and names with their typed values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import yaml

from enclave_common.yaml_reader import load_yaml
from enclave_launch.description.argument_types import ensure_argument_type
from enclave_launch.description.launch_context import LaunchContext
from enclave_launch.description.parameters import yaml_text
from enclave_launch.description.parameters.descriptions import Parameter, ParameterFile, ParameterValue
from enclave_launch.description.substitution import OpaqueValueUsed, Substitution, perform_substitutions
from enclave_launch.host.current import current_release
from enclave_launch.process import UnknownParameters
from enclave_launch.ros_rules.distro import Feature

if TYPE_CHECKING:
    from enclave_launch.description.parameters.types import (
        EvaluatedParameter,
        EvaluatedParameters,
        EvaluatedParameterValue,
        Parameters,
        ParametersDict,
    )

_SCALARS = (bool, int, float, str)


def evaluate_parameters(context: LaunchContext, parameters: Parameters) -> EvaluatedParameters:
    """Return files as paths, dicts with their values, ``Parameter`` descriptions unchanged, in the given order.

    What a Python module that is not installed would give is ``UnknownParameters``.
    """
    evaluated: list[EvaluatedParameter] = []
    for item in parameters:
        if isinstance(item, Parameter):
            evaluated.append(item)
        elif isinstance(item, Mapping):
            unknown: list[UnknownParameters] = []
            evaluated.append(evaluate_parameter_dict(context, item, unknown))
            evaluated += unknown
        elif isinstance(item, ParameterFile):
            try:
                evaluated.append(item.evaluate(context))
            except OpaqueValueUsed as error:
                evaluated.append(UnknownParameters(error.value, error.module))
        else:
            evaluated.append(UnknownParameters(item.opaque_text, item.opaque_module))
    return tuple(evaluated)


def evaluate_parameter_dict(
    context: LaunchContext, parameters: ParametersDict, unknown: list[UnknownParameters] | None = None
) -> dict[str, EvaluatedParameterValue]:
    """Perform names and values of a normalized dict; raises ``TypeError`` for what cannot be a parameter.

    Values that a Python module which is not installed would give are added to ``unknown``, where it is given.
    """
    if not isinstance(parameters, Mapping):
        raise TypeError("expected dict")
    evaluated: dict[str, EvaluatedParameterValue] = {}
    for key, value in parameters.items():
        if not isinstance(key, tuple):
            raise TypeError(f"Expecting tuple of substitutions got {key!r}")
        name = perform_substitutions(context, list(key))
        try:
            evaluated[name] = _evaluate_value(context, name, value)
        except OpaqueValueUsed as error:
            if unknown is None:
                raise
            unknown.append(UnknownParameters(error.value, error.module))
    return evaluated


def _evaluate_value(context: LaunchContext, name: str, value: Any) -> Any:
    if isinstance(value, ParameterValue):
        return value.evaluate(context)
    if not isinstance(value, tuple) or not value:
        ensure_argument_type(value, (float, int, str, bool, bytes), "value")
        return value
    if isinstance(value[0], Substitution):
        return _checked(name, _read(context, name, value))
    if isinstance(value[0], Sequence) and not isinstance(value[0], (str, bytes)):
        return _uniform(name, [_read_item(context, item) for item in value])
    return value


def _read(context: LaunchContext, name: str, substitutions: tuple[Substitution, ...]) -> Any:
    if len(substitutions) == 1 and isinstance(substitutions[0], yaml_text.YamlConstant):
        return substitutions[0].value
    text = perform_substitutions(context, list(substitutions))
    try:
        return load_yaml(text) if text else ""
    except yaml.YAMLError:
        raise TypeError(
            f"Unable to parse the value of parameter {name} as yaml. {_WRAP_IT_AS_TEXT}"
        ) from None


def _read_item(context: LaunchContext, item: Sequence[Substitution]) -> Any:
    if len(item) == 1 and isinstance(item[0], yaml_text.YamlConstant):
        return item[0].value
    return load_yaml(perform_substitutions(context, list(item)))


def _checked(name: str, value: Any) -> Any:
    if type(value) in (*_SCALARS, bytes):
        return value
    if isinstance(value, Sequence):
        return _uniform(name, value)
    is_named = current_release().has(Feature.PARAMETER_NAME_IN_ERRORS)
    names_parameter = f' for "{name}". ' if is_named else "."
    raise TypeError(
        "Allowed value types are bytes, bool, int, float, str, Sequence[bool], Sequence[int], "
        f"Sequence[float], Sequence[str]. Got {type(value)}{names_parameter}{_WRAP_IT_AS_TEXT}"
    )


def _uniform(name: str, items: Sequence[Any]) -> tuple[Any, ...]:
    kind = type(items[0]) if items else None
    if kind not in _SCALARS or not all(isinstance(item, kind) for item in items):
        is_named = current_release().has(Feature.PARAMETER_NAME_IN_ERRORS)
        raise TypeError(
            "Expected a non-empty sequence, with items of uniform type. Allowed sequence item types are "
            "bool, int, float, str." + (f' Got inconsistent input for "{name}"' if is_named else "")
        )
    return tuple(items)


_WRAP_IT_AS_TEXT = (
    "If the parameter is meant to be a string, try wrapping it in "
    "launch_ros.parameter_descriptions.ParameterValue(value, value_type=str)"
)
