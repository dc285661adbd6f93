"""The parameters that a node ends up with, merged from its command line as rcl merges them.

Sources in, values out; reads the parameter files that the command line names. Rules from ros2/rcl
``rcl/arguments.c``, ``rclcpp`` ``parameter_map.cpp`` (how sections apply); what a file says has ``parameter_file``:

- all sources are merged first, section by section, in the order in which sections first appear;
- a section applies when its name matches the fully qualified name: ``*`` is one token, ``**`` any number;
- later sections override earlier ones, whatever their specificity;
- within a section a parameter keeps one slot per type, and readers take the first of bool, int, double,
  string, then arrays.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import lru_cache
from typing import NamedTuple, TypeVar

import yaml

from enclave_common.files import read_text
from enclave_launch.ros_rules.parameter_file import (
    MAX_BYTES,
    RefusedParameters,
    sections_of_text,
    value_of_text,
)
from enclave_launch.ros_rules.parameter_value import ParameterValue, plain_scalar, type_slot
from nodl.ros_arguments import ParameterFileArgument, ParameterRule

Section = Mapping[str, ParameterValue]
Read = TypeVar("Read")


class UnreadableParameters(Exception):
    """A parameter file, or ``-p``, of which nothing is known: rcl would refuse it, or it is only there later."""

    def __init__(self, path: str, why: str) -> None:
        self.path, self.why = path, why
        super().__init__(f"{path}: {why}")


class ResolvedParameters(NamedTuple):
    """The parameters that a node sees; ``unread`` are files that may say more, each with the reason."""

    values: dict[str, ParameterValue]
    unread: tuple[tuple[str, str], ...] = ()


Generated = Callable[[str], Mapping[str, Section] | None]

EVERY_NODE = "/**"
_WITHOUT_MARKS = str.maketrans("", "", "_./+-")  # which are no YAML syntax beside a letter or digit


def resolve_parameters(
    fqn_tokens: Sequence[str | None],
    sources: Iterable[ParameterFileArgument | ParameterRule],
    generated: Generated = lambda path: None,
    directory: str | None = None,
) -> ResolvedParameters:
    """Return the parameters that rcl gives a node.

    :param fqn_tokens: namespace tokens and name; None for one that launch does not know, which only wildcards match
    :param generated: content of files that launch writes itself
    :param directory: where the process runs; None for the current directory"""
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
                slots.setdefault(name, {})[type_slot(value)] = value
    resolved: dict[str, ParameterValue] = {}
    for parameters in sections.values():
        resolved.update({name: slots[min(slots)] for name, slots in parameters.items()})
    return ResolvedParameters(resolved, tuple(unread))


def _sections_of(
    source: ParameterFileArgument | ParameterRule, generated: Generated, directory: str
) -> Mapping[str, Section]:
    if isinstance(source, ParameterRule):
        value = _value_of_rule(source)
        return {source.node or EVERY_NODE: {source.name: value}} if value is not None else {}
    known = generated(source.path)
    return _read_file(os.path.join(directory, source.path)) if known is None else known


def section_applies(section: str, fqn_tokens: Sequence[str | None]) -> bool:
    """Return True if a section of a parameter file is for the node with these name tokens."""
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


def _value_of_rule(rule: ParameterRule) -> ParameterValue | None:
    """Return the value; None if rcl takes the rule and no value comes of it. Raises ``UnreadableParameters``."""
    letters = rule.value.translate(_WITHOUT_MARKS)
    if letters.isascii() and letters.isalnum():
        return plain_scalar(rule.value)
    return _read(f"-p {rule.name}:={rule.value}", rule.value, value_of_text)


@lru_cache(maxsize=256)
def _read_cached(path: str, _modified: int, _size: int) -> Mapping[str, Section]:
    try:
        text = read_text(path, MAX_BYTES)
    except (OSError, UnicodeDecodeError) as error:
        raise UnreadableParameters(path, str(error)) from error
    return parameters_of_text(text, path)


def parameters_of_text(text: str, path: str) -> Mapping[str, Section]:
    """Read the sections of the parameter file ``path``. Raises ``UnreadableParameters`` for what rcl refuses."""
    return _read(path, text, sections_of_text)


def _read(what: str, text: str, read: Callable[[str], Read]) -> Read:
    try:
        return read(text)
    except RefusedParameters as error:
        raise UnreadableParameters(what, str(error)) from error
    except yaml.YAMLError as error:
        raise UnreadableParameters(what, f"not YAML: {' '.join(str(error).split())}") from error


def _read_file(path: str) -> Mapping[str, Section]:
    try:
        status = os.stat(path)
    except OSError as error:
        raise UnreadableParameters(path, str(error)) from error
    return _read_cached(os.path.abspath(path), status.st_mtime_ns, status.st_size)
