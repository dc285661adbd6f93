"""Coercion and checking of typed attributes and parameter values (functions of ``launch.utilities.type_utils``).

Allowed are ``int``, ``float``, ``bool``, ``str`` and uniform ``List``s of them. A value on its way is

* text, possibly with ``$(...)``             -> ``coerce_to_type`` (front ends, ``can_be_str``)
* a mix of substitutions and plain values    -> ``normalize_typed_substitution`` (constructors)
* normalized                                 -> ``perform_typed_substitution`` (execution)
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, List  # noqa: UP035  (upstream names typing.List)

from enclave_common.yaml_reader import load_yaml
from enclave_launch.description.argument_types import ensure_argument_type
from enclave_launch.description.substitution import (
    Substitution,
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.host.current import current_release
from enclave_launch.ros_rules.distro import Feature

if TYPE_CHECKING:
    from enclave_launch.description.launch_context import LaunchContext


ScalarTypesTuple = (int, float, bool, str)


def is_typing_list(data_type: Any) -> bool:
    """Return True if ``data_type`` is ``typing.List`` or a subscription of it or of ``list``."""
    return data_type is List or (  # noqa: UP006
        getattr(data_type, "__origin__", None) is list and hasattr(data_type, "__args__")
    )


def is_valid_scalar_type(data_type: Any) -> bool:
    """Return True if ``data_type`` is one of ``ScalarTypesTuple``."""
    return data_type in ScalarTypesTuple


def extract_type(data_type: Any) -> tuple[Any, bool]:
    """Split ``List[int]`` into ``(int, True)`` and ``bool`` into ``(bool, False)``; raises ValueError."""
    if is_valid_scalar_type(data_type):
        return data_type, False
    items = getattr(data_type, "__args__", None)
    if not items or not is_typing_list(data_type) or not is_valid_scalar_type(items[0]):
        raise ValueError(f"Unrecognized data type: {data_type}")
    return items[0], True


def is_instance_of_valid_type(value: Any, *, can_be_str: bool = False) -> bool:
    """Return True for an allowed scalar or a uniform list, with ``can_be_str`` also mixed with text.

    The first item that is not text decides the type; a bool passes as int but not the other way round.
    """
    if not isinstance(value, list):
        return isinstance(value, ScalarTypesTuple)
    if not value:
        return True
    member_type = next((type(item) for item in value if type(item) is not str), str)
    if member_type not in ScalarTypesTuple:
        return False
    allowed = (member_type, str) if can_be_str else (member_type,)
    return all(isinstance(item, allowed) for item in value)


def is_instance_of(value: Any, data_type: Any = None, *, can_be_str: bool = False) -> bool:
    """Return True for a ``data_type`` (None: any allowed type), or for text if ``can_be_str``."""
    if data_type is None:
        return is_instance_of_valid_type(value, can_be_str=can_be_str)
    scalar_type, is_list = extract_type(data_type)
    allowed = (str, scalar_type) if can_be_str else scalar_type
    if not is_list:
        return isinstance(value, allowed)
    return isinstance(value, list) and all(isinstance(item, allowed) for item in value)


def coerce_to_type(value: str, data_type: Any = None, *, can_be_str: bool = False) -> Any:
    """Convert text to ``data_type``, for ``None`` to the type that YAML 1.1 gives it.

    With ``can_be_str`` text that does not convert is returned unchanged; otherwise it raises ``ValueError``, as an
    invalid ``data_type`` does. Raises ``TypeError`` for a ``value`` that is not text.
    """
    ensure_argument_type(value, str, "value", "coerce_to_type")
    if data_type is str:
        return value
    if data_type is None:
        return _from_yaml(value, f"Failed to convert '{value}' using yaml rules", can_be_str)
    scalar_type, is_list = extract_type(data_type)
    if is_list:
        return _list_from_yaml(value, scalar_type, can_be_str)
    if scalar_type is bool:
        return _bool_from_yaml(value, can_be_str)
    try:
        return scalar_type(value)
    except ValueError:
        if can_be_str:
            return value
        raise


def _from_yaml(value: str, complaint: str, can_be_str: bool) -> Any:
    if not value:
        return value
    try:
        result = load_yaml(value)
    except Exception as error:  # PyYAML also lets ValueError, OverflowError and others of its converters out
        if can_be_str:
            return value
        raise ValueError(f"{complaint}: yaml.safe_load() failed\n{error}") from error
    if not is_instance_of_valid_type(result, can_be_str=can_be_str):
        raise ValueError(f"{complaint}: output type is not allowed, got {type(result)}")
    return result


def _list_from_yaml(value: str, scalar_type: Any, can_be_str: bool) -> Any:
    allowed = (str, scalar_type) if can_be_str else scalar_type
    complaint = f"Cannot convert value '{value}' to a list of '{allowed}'"
    result = _from_yaml(value, complaint, can_be_str)
    if not isinstance(result, list):
        raise ValueError(complaint)
    if not all(isinstance(item, allowed) for item in result):
        raise ValueError(f"{complaint}, got {result}")
    return result


def _bool_from_yaml(value: str, can_be_str: bool) -> Any:
    if value in ("0", "1") and current_release().has(Feature.BOOLEAN_DIGITS):
        return value == "1"
    result = _from_yaml(value, f"Failed to convert '{value}' to '{bool}'", can_be_str)
    if isinstance(result, (str, bool) if can_be_str else bool):
        return result
    raise ValueError(f"Cannot convert value '{value}' to '{bool}'")


def coerce_list(value: list[str], data_type: Any = None, *, can_be_str: bool = False) -> Any:
    """Convert each text of a list to ``data_type``. Raises ``ValueError`` if the result is not uniform."""
    ensure_argument_type(value, list, "value", "coerce_list")
    result = [coerce_to_type(item, data_type, can_be_str=can_be_str) for item in value]
    if not is_instance_of_valid_type(result, can_be_str=can_be_str):
        raise ValueError(f"cannot convert value to {data_type}. Got value=`{value}`")
    return result


def get_typed_value(value: str | list[str], data_type: Any, *, can_be_str: bool = False) -> Any:
    """Convert text or a list of texts to ``data_type``; raises TypeError for a list and a scalar type."""
    if not isinstance(value, list):
        return coerce_to_type(value, data_type, can_be_str=can_be_str)
    if data_type is not None:
        data_type, is_list = extract_type(data_type)
        if not is_list:
            raise TypeError(f"Cannot convert input '{value}' of type '{type(value)}' to '{data_type}'")
    return coerce_list(value, data_type, can_be_str=can_be_str)


def is_substitution(x: Any) -> bool:
    """Return True for a substitution, or a mix of text and at least one substitution."""
    if isinstance(x, Substitution):
        return True
    if not isinstance(x, Iterable) or len(x) == 0:  # type: ignore[arg-type]  # as upstream: needs a length
        return False
    found = False
    for item in x:
        if isinstance(item, Substitution):
            found = True
        elif not isinstance(item, str):
            return False
    return found


def is_normalized_substitution(x: Any) -> bool:
    """Return True for a non-empty list of substitutions only."""
    return isinstance(x, list) and len(x) > 0 and all(isinstance(item, Substitution) for item in x)


def normalize_typed_substitution(value: Any, data_type: Any) -> Any:
    """Return a scalar, a list of substitutions, or a list of scalars and those lists; raises TypeError.

    What can be read as one substitution is: a list of two texts needs ``['a', [TextSubstitution(text='b')]]``."""
    if isinstance(value, ScalarTypesTuple):
        if not is_instance_of(value, data_type):
            raise TypeError(f"value='{value}' is not an instance of {data_type}")
        return value
    if is_substitution(value):
        return normalize_to_list_of_substitutions(value)
    if not isinstance(value, Iterable):
        raise TypeError(
            "value should be either a scalar, a substitutions, or a mixed list of scalars and substitutions. "
            f"Got `value={value}` of type `{type(value)}`. "
        )
    return _normalize_list(value, data_type)


def _normalize_list(value: Iterable[Any], data_type: Any) -> list[Any]:
    kinds = {_kind_of_item(item, value) for item in value}
    if data_type is not None:
        data_type, is_list = extract_type(data_type)
        if not is_list:
            raise TypeError(
                "The provided value resolves to a list, though the required type is a scalar. "
                f"Got value='{value}', data_type='{data_type}'."
            )
    item_type = _common_item_type(kinds - {Substitution}) if kinds else str  # an empty list counts as text
    if item_type is None and kinds != {Substitution}:
        raise TypeError(f"Input value is not an acceptable 'SomeValueType'.Got value='{value}'")
    if item_type is not None and data_type not in (None, item_type):
        raise TypeError(f"Got a list of '{item_type}', expected a list of '{data_type}'. value='{value}'")
    return [_normalize_item(item, item_type) for item in value]


def _kind_of_item(item: Any, value: Any) -> type:
    if isinstance(item, ScalarTypesTuple):
        return type(item)
    if is_substitution(item):
        return Substitution
    raise TypeError(
        "value is a list, and one of the items is not a scalar, a Substitution or a list of substitutions. "
        f"Got value='{value}'"
    )


def _common_item_type(kinds: set[type]) -> type | None:
    for item_type in (str, bool, int):
        if kinds == {item_type}:
            return item_type
    return float if kinds and kinds <= {int, float} else None


def _normalize_item(item: Any, item_type: type | None) -> Any:
    if isinstance(item, ScalarTypesTuple):
        return float(item) if item_type is float else item
    return normalize_to_list_of_substitutions(item)


def perform_typed_substitution(context: LaunchContext, value: Any, data_type: Any) -> Any:
    """Perform what ``normalize_typed_substitution`` returned and coerce it; raises TypeError, ValueError."""
    if isinstance(value, ScalarTypesTuple):
        if data_type is not None and not is_instance_of(value, data_type):
            raise TypeError(f"value=`{value}` is a scalar and not an instance of `{data_type}`")
        return value
    if is_normalized_substitution(value):
        return coerce_to_type(perform_substitutions(context, value), data_type)
    if isinstance(value, list):
        return _perform_list(context, value, data_type)
    raise TypeError(f"Input value is not an acceptable 'NormalizedValueType'.Got value='{value}'")


def _perform_list(context: LaunchContext, value: list[Any], data_type: Any) -> list[Any]:
    scalar_type = None
    if data_type is not None:
        scalar_type, is_list = extract_type(data_type)
        if not is_list:
            raise ValueError(
                "The input value is a list, cannot convert it to a scalar. "
                f"Got value='{value}', expected type {scalar_type}."
            )
    result = [
        coerce_to_type(perform_substitutions(context, item), scalar_type)
        if is_normalized_substitution(item)
        else item
        for item in value
    ]
    if not is_instance_of(result, data_type):
        if scalar_type is None:
            raise ValueError("The output list is not uniform")
        raise ValueError(
            f"The output list does not match the expected type Got value='{value}', "
            f"expected type {scalar_type}."
        )
    return result
