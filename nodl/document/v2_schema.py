"""What a NoDL v2 document may hold, as a table of small checkers over lined YAML values. Pure.

The rules of ros-tooling/nodl's ``nodl.schema.yaml`` and ``parameter.schema.yaml`` (JSON Schema, draft 7),
told with file and line. Written by hand because the dry run must not pay for a JSON-Schema library.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping

from nodl.document.yaml_text import YamlList, YamlMap, YamlScalar, YamlValue
from nodl.errors import InvalidNoDLDocumentError
from nodl.names import shown

Checker = Callable[[YamlValue, str], None]


def check_document(root: YamlValue) -> YamlMap:
    """``root`` if it is a NoDL v2 document. Raises ``InvalidNoDLDocumentError`` for the first difference."""
    _DOCUMENT(root, "the document")
    assert isinstance(root, YamlMap)
    return root


def _fail(value: YamlValue, message: str) -> None:
    raise InvalidNoDLDocumentError.at(value.source, message)


def _text(pattern: str | None = None, meaning: str = "") -> Checker:
    compiled = re.compile(pattern) if pattern else None

    def check(value: YamlValue, what: str) -> None:
        if not isinstance(value, YamlScalar) or not isinstance(value.value, str):
            _fail(value, f"{what} must be text")
        elif compiled and not compiled.search(value.value):
            _fail(value, f"{what} {shown(value.value)} is not {meaning}")

    return check


def _one_of(*allowed: str) -> Checker:
    def check(value: YamlValue, what: str) -> None:
        if not isinstance(value, YamlScalar) or value.value not in allowed:
            _fail(value, f"{what} must be one of {', '.join(allowed)}")

    return check


def _integer(minimum: int, maximum: int | None = None) -> Checker:
    def check(value: YamlValue, what: str) -> None:
        number = value.value if isinstance(value, YamlScalar) else None
        if isinstance(number, bool) or not isinstance(number, int):
            _fail(value, f"{what} must be an integer")
        elif number < minimum or (maximum is not None and number > maximum):
            limit = f"at least {minimum}" if maximum is None else f"between {minimum} and {maximum}"
            _fail(value, f"{what} must be {limit}")

    return check


def _boolean(value: YamlValue, what: str) -> None:
    if not isinstance(value, YamlScalar) or not isinstance(value.value, bool):
        _fail(value, f"{what} must be true or false")


def _number(value: YamlValue, what: str) -> None:
    number = value.value if isinstance(value, YamlScalar) else None
    if isinstance(number, bool) or not isinstance(number, (int, float)):
        _fail(value, f"{what} must be a number")


def _anything(value: YamlValue, what: str) -> None:
    """No rule."""


def _list(item: Checker, length: int | None = None, minimum: int = 0) -> Checker:
    def check(value: YamlValue, what: str) -> None:
        if not isinstance(value, YamlList):
            _fail(value, f"{what} must be a list")
            return
        if length is not None and len(value.items) != length:
            _fail(value, f"{what} must have exactly {length} elements")
        if len(value.items) < minimum:
            _fail(value, f"{what} must have at least {minimum} elements")
        for index, each in enumerate(value.items):
            item(each, f"{what}[{index}]")

    return check


def _map(
    keys: Mapping[str, Checker] | None = None,
    required: tuple[str, ...] = (),
    others: Checker | None = None,
    patterns: Mapping[str, Checker] | None = None,
    also: Callable[[YamlMap, str], None] | None = None,
) -> Checker:
    """A mapping: known ``keys``, else by ``patterns``, else ``others``; an unknown key is an error."""

    def check(value: YamlValue, what: str) -> None:
        if not isinstance(value, YamlMap):
            _fail(value, f"{what} must be a mapping")
            return
        for name in required:
            if name not in value.items:
                _fail(value, f"{what} needs the key '{name}'")
        for name, each in value.items.items():
            by_pattern = (c for p, c in (patterns or {}).items() if re.fullmatch(p, name))
            checker = (keys or {}).get(name) or next(by_pattern, others)
            if checker is None:
                known = ", ".join(keys or ())
                raise InvalidNoDLDocumentError.at(
                    value.keys[name], f"{what} has no key {shown(name)}; known: {known}"
                )
            checker(each, name if what == "the document" else f"{what}.{name}")
        if also:
            also(value, what)

    return check


def _either(*checkers: Checker) -> Checker:
    """The first checker that is content; the complaint of the last one otherwise."""

    def check(value: YamlValue, what: str) -> None:
        for checker in checkers[:-1]:
            try:
                return checker(value, what)
            except InvalidNoDLDocumentError:
                continue
        return checkers[-1](value, what)

    return check


def _null(value: YamlValue, what: str) -> None:
    if not isinstance(value, YamlScalar) or value.value is not None:
        _fail(value, f"{what} takes no argument")


def _depth_with_keep_last(qos: YamlMap, what: str) -> None:
    history = qos.items["history"]
    if isinstance(history, YamlScalar) and history.value == "KEEP_LAST" and "depth" not in qos.items:
        _fail(qos, f"{what} needs the key 'depth' because history is KEEP_LAST")


def _bytes_by_default(parameter: YamlMap, what: str) -> None:
    kind = parameter.items["type"]
    default = parameter.items.get("default_value")
    if isinstance(kind, YamlScalar) and kind.value == "byte_array" and default is not None:
        _list(_integer(0, 255))(default, f"{what}.default_value")


_LISTS = (
    *("publishers", "subscriptions", "service_servers"),
    *("service_clients", "action_servers", "action_clients"),
)
_REFERENCE = _map(
    {"ref": _text(r"^[a-z][a-z0-9+.-]*://[^\s/][^\s]*$", "a reference such as nodl://package/name")},
    required=("ref",),
)
NAME_PATTERN = r"^[A-Za-z]$|^[/~A-Za-z][A-Za-z0-9_/]*[A-Za-z0-9_]$"
TYPE_PATTERN = r"^[a-zA-Z][a-zA-Z0-9_]*(/(msg|srv|action))?/[A-Z][a-zA-Z0-9]*$"
_NAME = _text(
    NAME_PATTERN,
    "a ROS name (letters, digits, '_' and '/', starting with '/', '~' or a letter; no wildcards)",
)
_TYPE = _text(TYPE_PATTERN, "an interface type such as std_msgs/msg/String")
_QOS = _map(
    {
        "history": _one_of("KEEP_LAST", "KEEP_ALL", "SYSTEM_DEFAULT"),
        "depth": _integer(1),
        "reliability": _one_of("RELIABLE", "BEST_EFFORT", "SYSTEM_DEFAULT", "BEST_AVAILABLE"),
        "durability": _one_of("TRANSIENT_LOCAL", "VOLATILE", "SYSTEM_DEFAULT", "BEST_AVAILABLE"),
        "deadline_ns": _integer(0),
        "lifespan_ns": _integer(0),
        "liveliness": _one_of("AUTOMATIC", "MANUAL_BY_TOPIC", "SYSTEM_DEFAULT", "BEST_AVAILABLE"),
        "liveliness_lease_duration_ns": _integer(0),
    },
    required=("history", "reliability"),
    also=_depth_with_keep_last,
)
_TOPIC = _map({"name": _NAME, "type": _TYPE, "qos": _QOS, "description": _text()}, ("name", "type", "qos"))
_SERVICE = _map({"name": _NAME, "type": _TYPE, "qos": _QOS, "description": _text()}, ("name", "type"))
_ACTION = _map({"name": _NAME, "type": _TYPE, "description": _text()}, ("name", "type"))

# Validators of generate_parameter_library; each may be written with or without a trailing "<>".
_BOUNDS = _list(_number, length=2)
_ONE_NUMBER = _either(_number, _list(_number, length=1))
_ONE_SIZE = _either(_integer(0), _list(_integer(0), length=1))
_NOTHING = _either(_null, _list(_anything, length=0))
_CHOICES = _list(_list(_anything, minimum=1), length=1)
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
_PARAMETER = _map(
    {
        "type": _text(
            rf"^({'|'.join(PARAMETER_TYPES)}|(string|(int|double|string)_array)_fixed_[1-9][0-9]*)$",
            f"a parameter type ({', '.join(PARAMETER_TYPES)} or such as string_fixed_25)",
        ),
        "default_value": _anything,
        "description": _text(),
        "read_only": _boolean,
        "additional_constraints": _text(),
        "validation": _map(
            {**_VALIDATORS, **{f"{name}<>": checker for name, checker in _VALIDATORS.items()}},
            patterns={r"[a-zA-Z_][a-zA-Z0-9_]*(::[a-zA-Z_][a-zA-Z0-9_]*)+": _anything},
        ),
    },
    required=("type",),
    also=_bytes_by_default,
)
# Our own section in the opaque ``codegen``: who runs the node, and what was learnt of its names from runs, which
# NoDL v2 has no fields for.
_LEARNT_ENDPOINT = _map(
    {
        "in": _one_of(*_LISTS),
        "name": _text(),
        "written": _text(),
        "parameter": _text(),
        "each": _boolean,
        "default": _text(),
        "proof": _text(),
        "undecided": _list(_text()),
        "introspection": _boolean,
        "runs": _list(_text()),
    },
    required=("in", "name"),
)
_IDENTITY = _map(
    {
        "package": _text(),
        "node": _text(),
        "namespace": _text(),
        "executable": _text(),
        "plugin": _text(),
        "library": _one_of("rclcpp", "rclpy"),
        "lifecycle": _boolean,
        "logger_services": _boolean,
        "incomplete": _list(_text()),
        "runs": _list(_map(others=_anything)),
        "endpoints": _list(_LEARNT_ENDPOINT),
    }
)
IDENTITY_KEY = "enclave_launch"


def _version(value: YamlValue, what: str) -> None:
    if not isinstance(value, YamlScalar) or isinstance(value.value, bool) or value.value != 2:
        _fail(value, f"{what} must be 2; other versions are not supported")


_DOCUMENT = _map(
    {
        "nodl_version": _version,
        "description": _text(),
        "codegen": _map({IDENTITY_KEY: _IDENTITY}, others=_map(others=_anything)),
        "include": _list(_REFERENCE),
        "parameters": _map(others=_PARAMETER),
        "publishers": _list(_TOPIC),
        "subscriptions": _list(_TOPIC),
        "service_servers": _list(_SERVICE),
        "service_clients": _list(_SERVICE),
        "action_servers": _list(_ACTION),
        "action_clients": _list(_ACTION),
    },
    required=("nodl_version",),
)
