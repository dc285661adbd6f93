"""ROS arguments of a command line or given in code (``rclpy.init(args=...)``), as rcl reads them. Performs no I/O."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

from nodl.remap import InvalidRemapRuleError, parse_rule

REMAP = ("-r", "--remap")
PARAMETER = ("-p", "--param")
_FILE = "--params-file"
_WITH_VALUE = frozenset(
    {*REMAP, *PARAMETER, _FILE, "-e", "--enclave", "--log-level", "--log-config-file", "--log-file-name"}
)


class GivenParameter(NamedTuple):
    """``-p [NODE:]NAME:=VALUE``; ``node`` is empty where every node gets it."""

    node: str
    name: str
    value: str


class WrittenRosArguments(NamedTuple):
    """``rules`` as written; ``files``: parameter files."""

    rules: tuple[str, ...] = ()
    parameters: tuple[GivenParameter, ...] = ()
    files: tuple[str, ...] = ()


def ros_arguments(words: Iterable[str]) -> WrittenRosArguments:
    """Read the flags among ``words``. What rcl would refuse is left out: the program ends there."""
    pairs = [(REMAP[0], word) if not flag and _is_rule(word) else (flag, word) for flag, word in flags(words)]
    parameters = (_parameter(value) for flag, value in pairs if flag in PARAMETER)
    return WrittenRosArguments(
        tuple(value for flag, value in pairs if flag in REMAP),
        tuple(parameter for parameter in parameters if parameter is not None),
        tuple(value for flag, value in pairs if flag == _FILE),
    )


def flags(words: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Yield each flag that takes a value, with it; a word that is not among ROS arguments with no flag."""
    reading = False
    left = iter(words)
    for word in left:
        if word == "--ros-args":
            reading = True
        elif not reading:
            yield "", word
        elif word == "--":
            reading = False
        elif word in _WITH_VALUE:
            yield word, next(left, "")


def _is_rule(word: str) -> bool:
    try:
        parse_rule(word)
    except InvalidRemapRuleError:
        return False
    return True


def _parameter(text: str) -> GivenParameter | None:
    left, separator, value = text.partition(":=")
    node, _, name = left.rpartition(":")
    return GivenParameter(node, name, value) if separator and name else None
