"""The schema of a NoDL v2 document, as a table of small checkers over lined YAML values. Performs no I/O.

The rules of ros-tooling/nodl's ``nodl.schema.yaml`` and ``parameter.schema.yaml`` (JSON Schema, draft 7),
reported with file and line. Written by hand because the dry run must not pay for a JSON-Schema library. Our own
section of the opaque ``codegen`` has its rules in ``v2_section``.
"""

from __future__ import annotations

from collections.abc import Mapping

from nodl.document.checks import (
    Checker,
    anything,
    boolean,
    either,
    fail,
    integer,
    list_of,
    map_of,
    null,
    number,
    one_of,
    text_of,
)
from nodl.document.v2_section import IDENTITY_KEY, SECTION
from nodl.yaml_text import YamlMap, YamlScalar, YamlValue


def check_document(root: YamlValue) -> YamlMap:
    """Return ``root`` if it is a NoDL v2 document. Raises ``InvalidNoDLDocumentError`` for the first difference."""
    _DOCUMENT(root, "the document")
    assert isinstance(root, YamlMap)
    return root


def _depth_with_keep_last(qos: YamlMap, what: str) -> None:
    history = qos.items["history"]
    if isinstance(history, YamlScalar) and history.value == "KEEP_LAST" and "depth" not in qos.items:
        fail(qos, f"{what} needs the key 'depth' because history is KEEP_LAST, for example depth: 10")


def _bytes_by_default(parameter: YamlMap, what: str) -> None:
    kind = parameter.items["type"]
    default = parameter.items.get("default_value")
    if isinstance(kind, YamlScalar) and kind.value == "byte_array" and default is not None:
        list_of(integer(0, 255))(default, f"{what}.default_value")


_REFERENCE = map_of(
    {"ref": text_of(r"^[a-z][a-z0-9+.-]*://[^\s/][^\s]*$", "a reference such as nodl://package/name")},
    required=("ref",),
)
NAME_PATTERN = r"^[A-Za-z]$|^[/~A-Za-z][A-Za-z0-9_/]*[A-Za-z0-9_]$"
TYPE_PATTERN = r"^[a-zA-Z][a-zA-Z0-9_]*(/(msg|srv|action))?/[A-Z][a-zA-Z0-9]*$(?!\n)"
_NAME = text_of(
    NAME_PATTERN,
    "a ROS name (letters, digits, '_' and '/', starting with '/', '~' or a letter; no wildcards)",
)
_TYPE = text_of(TYPE_PATTERN, "an interface type such as std_msgs/msg/String")
_QOS_EXAMPLE = "{history: KEEP_LAST, depth: 10, reliability: RELIABLE}"
_QOS = map_of(
    {
        "history": one_of("KEEP_LAST", "KEEP_ALL", "SYSTEM_DEFAULT"),
        "depth": integer(1),
        "reliability": one_of("RELIABLE", "BEST_EFFORT", "SYSTEM_DEFAULT", "BEST_AVAILABLE"),
        "durability": one_of("TRANSIENT_LOCAL", "VOLATILE", "SYSTEM_DEFAULT", "BEST_AVAILABLE"),
        "deadline_ns": integer(0),
        "lifespan_ns": integer(0),
        "liveliness": one_of("AUTOMATIC", "MANUAL_BY_TOPIC", "SYSTEM_DEFAULT", "BEST_AVAILABLE"),
        "liveliness_lease_duration_ns": integer(0),
    },
    required=("history", "reliability"),
    also=_depth_with_keep_last,
    example=_QOS_EXAMPLE,
)
_TOPIC = map_of(
    {"name": _NAME, "type": _TYPE, "qos": _QOS, "description": text_of()},
    ("name", "type", "qos"),
    example=f"{{name: scan, type: sensor_msgs/msg/LaserScan, qos: {_QOS_EXAMPLE}}}",
)
_SERVICE = map_of({"name": _NAME, "type": _TYPE, "qos": _QOS, "description": text_of()}, ("name", "type"))
_ACTION = map_of({"name": _NAME, "type": _TYPE, "description": text_of()}, ("name", "type"))

# Validators of generate_parameter_library; each may be written with or without a trailing "<>".
_BOUNDS = list_of(number, length=2)
_ONE_NUMBER = either(number, list_of(number, length=1))
_ONE_SIZE = either(integer(0), list_of(integer(0), length=1))
_NOTHING = either(null, list_of(anything, length=0))
_CHOICES = list_of(list_of(anything, minimum=1), length=1)
_VALIDATORS: dict[str, Checker] = {
    "bounds": _BOUNDS,
    "lt": _ONE_NUMBER,
    "gt": _ONE_NUMBER,
    "lt_eq": _ONE_NUMBER,
    "gt_eq": _ONE_NUMBER,
    "one_of": _CHOICES,
    "not_empty": _NOTHING,
    "fixed_size": _ONE_SIZE,
    "size_gt": _ONE_SIZE,
    "size_lt": _ONE_SIZE,
    "unique": _NOTHING,
    "subset_of": _CHOICES,
    "element_bounds": _BOUNDS,
    "lower_element_bounds": _ONE_NUMBER,
    "upper_element_bounds": _ONE_NUMBER,
}
PARAMETER_TYPES = (
    *("bool", "int", "double", "string", "none"),
    *("bool_array", "byte_array", "int_array", "double_array", "string_array"),
)

# Parameter types as v1 files write them freely -> those of v2.
PARAMETER_TYPE_OF = {
    **{name: name for name in PARAMETER_TYPES},
    **dict.fromkeys(("boolean",), "bool"),
    **dict.fromkeys(
        ("integer", "int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64"), "int"
    ),
    **dict.fromkeys(("float", "float32", "float64"), "double"),
    **dict.fromkeys(("str", "std::string"), "string"),
    **dict.fromkeys(("integer_array", "int64_array"), "int_array"),
    **dict.fromkeys(("float_array", "float64_array"), "double_array"),
    **dict.fromkeys(("boolean_array",), "bool_array"),
}


def plain_types(written: Mapping[str, str]) -> tuple[tuple[str, str], ...]:
    """Return the parameters whose type is a plain one of v2, with that type; the others are not known exactly."""
    found = ((name, PARAMETER_TYPE_OF.get(kind, "none")) for name, kind in written.items())
    return tuple((name, kind) for name, kind in found if kind != "none")


_PARAMETER = map_of(
    {
        "type": text_of(
            rf"^({'|'.join(PARAMETER_TYPES)}|(string|(int|double|string)_array)_fixed_[1-9][0-9]*)$",
            f"a parameter type ({', '.join(PARAMETER_TYPES)} or such as string_fixed_25)",
        ),
        "default_value": anything,
        "description": text_of(),
        "read_only": boolean,
        "additional_constraints": text_of(),
        "validation": map_of(
            {**_VALIDATORS, **{f"{name}<>": checker for name, checker in _VALIDATORS.items()}},
            patterns={r"[a-zA-Z_][a-zA-Z0-9_]*(::[a-zA-Z_][a-zA-Z0-9_]*)+": anything},
        ),
    },
    required=("type",),
    also=_bytes_by_default,
)


def _version(value: YamlValue, what: str) -> None:
    if not isinstance(value, YamlScalar) or isinstance(value.value, bool) or value.value != 2:
        fail(value, f"{what} must be 2; other versions are not supported")


_DOCUMENT = map_of(
    {
        "nodl_version": _version,
        "description": text_of(),
        "codegen": map_of({IDENTITY_KEY: SECTION}, others=map_of(others=anything)),
        "include": list_of(_REFERENCE),
        "parameters": map_of(others=_PARAMETER),
        "publishers": list_of(_TOPIC),
        "subscriptions": list_of(_TOPIC),
        "service_servers": list_of(_SERVICE),
        "service_clients": list_of(_SERVICE),
        "action_servers": list_of(_ACTION),
        "action_clients": list_of(_ACTION),
    },
    required=("nodl_version",),
)
