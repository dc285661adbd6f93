"""The parameters that a node ends up with, merged from its command line as rcl merges them.

Sources in, values out; reads the parameter files that the command line names. Rules from ros2/rcl
``rcl_yaml_param_parser`` (``parse.c``: what a YAML scalar is) and ``rcl/arguments.c``, ``rclcpp``
``parameter_map.cpp`` (how sections apply):

- all sources are merged first, section by section, in the order in which sections first appear;
- a section applies when its name matches the fully qualified name: ``*`` is one token, ``**`` any number;
- later sections override earlier ones, whatever their specificity;
- within a section a parameter keeps one slot per type, and readers take the first of bool, int, double,
  string, then arrays.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import lru_cache
from typing import Any

from enclave_launch.boundary.files import read_text
from enclave_launch.boundary.named_tuple import NamedTuple
from enclave_launch.ros_rules.parameter_value import ParameterValue
from enclave_launch.ros_rules.ros_arguments import ParameterFileArgument, ParameterRule

Section = Mapping[str, ParameterValue]


class UnreadableParameters(Exception):
    """A parameter file of which nothing is known: rcl would refuse to start the node, or it is only there later."""

    def __init__(self, path: str, why: str) -> None:
        self.path, self.why = path, why
        super().__init__(f"{path}: {why}")


class ResolvedParameters(NamedTuple):
    """What a node sees; ``unread`` are files that may say more, each with the reason."""

    values: dict[str, ParameterValue]
    unread: tuple[tuple[str, str], ...] = ()


Generated = Callable[[str], Mapping[str, Section] | None]

EVERY_NODE = "/**"
_BOOLEANS = {
    **dict.fromkeys(("Y", "y", "yes", "Yes", "YES", "true", "True", "TRUE", "on", "On", "ON"), True),
    **dict.fromkeys(("N", "n", "no", "No", "NO", "false", "False", "FALSE", "off", "Off", "OFF"), False),
}
# strtoll with base 0 and strtod; the blanks they skip are those of ASCII
_INTEGER = re.compile(r"\s*[+-]?(?:0[xX][0-9a-fA-F]+|0[0-7]*|[1-9][0-9]*)", re.ASCII)
_DOUBLE = re.compile(
    r"\s*[+-]?(?:(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?|inf(?:inity)?|nan)",
    re.IGNORECASE | re.ASCII,
)
_NAMED_DOUBLE = re.compile(r"([+-]?)\.(inf|Inf|INF|nan|NaN|NAN)")
_PLAIN = re.compile(r"[A-Za-z0-9_./+-]+")  # no YAML syntax in it
_KINDS: tuple[type, ...] = (bool, int, float, str)


def resolve_parameters(
    fqn_tokens: Sequence[str | None],
    sources: Iterable[ParameterFileArgument | ParameterRule],
    generated: Generated = lambda path: None,
    directory: str | None = None,
) -> ResolvedParameters:
    """``fqn_tokens``: namespace tokens and name; ``None`` for one that launch does not know (only
    wildcards match it). ``generated`` gives the content of files that launch writes itself; ``directory`` is where
    the process runs (``None``: here).
    """
    sections: dict[str, dict[str, dict[int, ParameterValue]]] = {}
    unread: list[tuple[str, str]] = []
    for source in sources:
        try:
            found = _sections_of(source, generated, directory or "")
        except UnreadableParameters as error:
            unread.append((error.path, error.why))
            continue
        for section, values in found.items():
            if not section_applies(section, fqn_tokens):
                continue
            slots = sections.setdefault(section, {})
            for name, value in values.items():
                slots.setdefault(name, {})[_slot(value)] = value
    resolved: dict[str, ParameterValue] = {}
    for parameters in sections.values():
        resolved.update({name: slots[min(slots)] for name, slots in parameters.items()})
    return ResolvedParameters(resolved, tuple(unread))


def _sections_of(
    source: ParameterFileArgument | ParameterRule, generated: Generated, directory: str
) -> Mapping[str, Section]:
    if isinstance(source, ParameterRule):
        value = _parse_value(source.value)
        return {source.node or EVERY_NODE: {source.name: value}} if value is not None else {}
    known = generated(source.path)
    return _read_file(os.path.join(directory, source.path)) if known is None else known


def _slot(value: ParameterValue) -> int:
    """Position in rcl's order of types: scalars, bytes, then arrays."""
    if isinstance(value, tuple):
        return 10 + (_KINDS.index(type(value[0])) if value and type(value[0]) in _KINDS else 9)
    return 5 if isinstance(value, bytes) else _KINDS.index(type(value))


def section_applies(section: str, fqn_tokens: Sequence[str | None]) -> bool:
    """Whether a section of a parameter file is for the node with these name tokens."""
    if section == EVERY_NODE:
        return True
    return _matches([token for token in section.split("/") if token], fqn_tokens)


def _matches(pattern: Sequence[str], tokens: Sequence[str | None]) -> bool:
    """Keeps the set of token counts that the pattern read so far can stand for: no pattern takes long."""
    reached = {0}
    for part in pattern:
        if part == "**":
            reached = set(range(min(reached), len(tokens) + 1))
        else:
            reached = {at + 1 for at in reached if at < len(tokens) and part in ("*", tokens[at])}
        if not reached:
            return False
    return len(tokens) in reached


def as_rcl_reads(value: Any) -> ParameterValue:
    """A value that launch writes with PyYAML, as rcl's parser reads it back.

    The two disagree on a few plain words: PyYAML writes the text ``1e3`` without quotes, rcl reads 1000.0.
    """
    if isinstance(value, (list, tuple)):
        return tuple(as_rcl_reads(item) for item in value)  # type: ignore[misc]  # items are scalars
    if not isinstance(value, str):
        return value  # type: ignore[no-any-return]
    typed = _scalar(value)
    if isinstance(typed, str):
        return value
    from yaml import safe_load

    return typed if typed is not None and isinstance(safe_load(value), str) else value


def _parse_value(text: str) -> ParameterValue | None:
    """The value of ``-p``. ``None`` for what rcl refuses: nothing, mappings, errors."""
    if _PLAIN.fullmatch(text):
        return _scalar(text)
    import yaml

    from enclave_launch.boundary.yaml_nodes import compose

    try:
        node = compose(text)
    except yaml.YAMLError:
        return None
    return _value(node)


@lru_cache(maxsize=256)
def _read_cached(path: str, _modified: int, _size: int) -> Mapping[str, Section]:
    try:
        text = read_text(path)
    except (OSError, UnicodeDecodeError) as error:
        raise UnreadableParameters(path, str(error)) from error
    return parameters_of_text(text, path)


def parameters_of_text(text: str, path: str) -> Mapping[str, Section]:
    """The sections of the parameter file ``path``. Raises ``UnreadableParameters`` where it is no YAML."""
    import yaml

    try:
        return _sections_of_text(text)
    except yaml.YAMLError as error:
        raise UnreadableParameters(path, f"not YAML: {' '.join(str(error).split())}") from error


@lru_cache(maxsize=256)
def _sections_of_text(text: str) -> Mapping[str, Section]:
    from enclave_launch.boundary.yaml_nodes import compose

    document = compose(text)
    sections: dict[str, dict[str, ParameterValue]] = {}
    if document is not None:
        _collect_sections(document, (), sections)
    return sections


def _read_file(path: str) -> Mapping[str, Section]:
    try:
        status = os.stat(path)
    except OSError as error:
        raise UnreadableParameters(path, str(error)) from error
    return _read_cached(os.path.abspath(path), status.st_mtime_ns, status.st_size)


def _collect_sections(
    node: Any, path: tuple[str, ...], sections: dict[str, dict[str, ParameterValue]]
) -> None:
    if node.id != "mapping":
        return
    for key, value in node.value:
        if key.value == "ros__parameters":
            _collect_parameters(value, "", sections.setdefault("/".join(path), {}))
        else:
            _collect_sections(value, (*path, key.value), sections)


def _collect_parameters(node: Any, prefix: str, parameters: dict[str, ParameterValue]) -> None:
    if node.id != "mapping":
        return
    for key, item in node.value:
        name = f"{prefix}{key.value}"
        if item.id == "mapping":
            _collect_parameters(item, f"{name}.", parameters)
        else:
            value = _value(item)
            if value is not None:
                parameters[name] = value


def _value(node: Any) -> ParameterValue | None:
    if node is None or node.id == "mapping":
        return None
    if node.id == "scalar":
        return str(node.value) if node.style else _scalar(node.value)  # a plain scalar has no style
    items = [_value(item) for item in node.value]
    if any(item is None or isinstance(item, tuple) for item in items):
        return None
    return tuple(items)  # type: ignore[arg-type]  # scalars only, checked above


def _scalar(text: str) -> bool | int | float | str | None:
    """A plain YAML scalar by rcl's rules, which are not YAML 1.1's. ``None`` for no value at all."""
    if text in _BOOLEANS:
        return _BOOLEANS[text]
    if not text:
        return None
    if _INTEGER.fullmatch(text):
        number = _strtoll(text.strip())
        return number if -(2**63) <= number < 2**63 else float(number)
    named = _NAMED_DOUBLE.fullmatch(text)
    if named:
        return float(named[1] + named[2])
    return float(text) if _DOUBLE.fullmatch(text) else text


def _strtoll(text: str) -> int:
    digits = text.lstrip("+-")
    base = 16 if digits[:2] in ("0x", "0X") else 8 if digits.startswith("0") else 10
    number = int(digits, base)
    return -number if text.startswith("-") else number
