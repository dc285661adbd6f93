"""ROS arguments of a command line, or given in code, as rcl reads them (ros2/rcl ``arguments.c``). Performs no I/O.

They stand between ``--ros-args`` and ``--`` (or the end); elsewhere ``a:=b`` is a remap rule, deprecated.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Sequence
from itertools import takewhile
from typing import NamedTuple

from enclave_common.shell_words import split_words
from nodl.remap import InvalidRemapRuleError, parse_rule

REMAP = ("-r", "--remap")
PARAMETER = ("-p", "--param")
_FILE = "--params-file"
_ENCLAVE = ("-e", "--enclave")
_WITH_VALUE = frozenset(
    {*REMAP, *PARAMETER, _FILE, *_ENCLAVE, "--log-level", "--log-config-file", "--log-file-name"}
)


class ParameterFileArgument(NamedTuple):
    """The argument ``--params-file PATH``."""

    path: str


class ParameterRule(NamedTuple):
    """The argument ``-p [NODE:]NAME:=VALUE``; ``value`` is YAML."""

    name: str
    value: str
    node: str | None = None


class RosArguments(NamedTuple):
    """In command-line order. Of remap rules the first match wins, of parameters and enclaves the last."""

    remaps: tuple[str, ...] = ()
    parameters: tuple[ParameterFileArgument | ParameterRule, ...] = ()
    enclave: str | None = None


def parse_ros_arguments(arguments: Iterable[str]) -> RosArguments:
    """Read the words after the executable. What rcl would refuse is skipped: the process says so itself."""
    remaps: list[str] = []
    parameters: list[ParameterFileArgument | ParameterRule] = []
    enclave: str | None = None
    for _, flag, value in _with_bare_rules(arguments):
        if flag in REMAP:
            remaps.append(value)
        elif flag == _FILE:
            parameters.append(ParameterFileArgument(value))
        elif flag in _ENCLAVE:
            enclave = value
        elif flag in PARAMETER and ":=" in value:
            parameters.append(_parameter_rule(value))
    return RosArguments(tuple(remaps), tuple(parameters), enclave)


def remap_arguments(arguments: Sequence[str]) -> dict[int, str]:
    """Return the remap rules of ``parse_ros_arguments``, in their order, each by the index of its word."""
    return {index: value for index, flag, value in _with_bare_rules(arguments) if flag in REMAP}


def words_after_program(cmd: Sequence[str], prefix_length: int, *, shell: bool) -> list[str]:
    """Return the words that the program itself gets; a shell splits its command line again."""
    return (shell_words(cmd) if shell else list(cmd))[prefix_length + 1 :]


def shell_words(cmd: Sequence[str]) -> list[str]:
    """Split a command that goes through a shell. What the shell would refuse stays as it is."""
    try:
        return split_words(" ".join(cmd))
    except ValueError:
        return list(cmd)


def flags(words: Iterable[str]) -> Iterator[tuple[int, str, str]]:
    """Yield the index of a value, its flag and the value; a word that is not among ROS arguments has no flag."""
    inside = False
    left = enumerate(words)
    for index, word in left:
        if word == "--ros-args":
            inside = True
        elif not inside:
            yield index, "", word
        elif word == "--":
            inside = False
        elif word in _WITH_VALUE:
            value = next(left, None)
            if value is not None:
                yield value[0], word, value[1]


def _with_bare_rules(words: Iterable[str]) -> Iterator[tuple[int, str, str]]:
    for index, flag, word in flags(words):
        if flag or is_bare_rule(word):
            yield index, flag or REMAP[0], word


def is_bare_rule(word: str) -> bool:
    """Return True if rcl takes ``word`` outside of its arguments as a remap rule."""
    if ":=" not in word:
        return False
    try:
        parse_rule(word)
    except InvalidRemapRuleError:
        return False
    return True


def _parameter_rule(text: str) -> ParameterRule:
    target, _, value = text.partition(":=")
    node, colon, name = target.rpartition(":")
    return ParameterRule(name, value, node if colon else None)


def split_options(
    words: Iterable[str], with_value: Container[str]
) -> tuple[list[tuple[str, str]], list[str]]:
    """Return each option of ``with_value`` with its value (``--a 1``, ``--a=1``), in order, and all other words."""
    options: list[tuple[str, str]] = []
    others: list[str] = []
    rest = iter(words)
    for word in rest:
        option, equals, value = word.partition("=")
        if option in with_value:
            options.append((option, value if equals else next(rest, "")))
        else:
            others.append(word)
    return options, others


def words_without_ros_arguments(words: Iterable[str]) -> list[str]:
    """Return the words after the executable that are not rcl's."""
    return [word for _, flag, word in flags(words) if not flag and not is_bare_rule(word)]


def arguments_as_inputs(words: Sequence[str]) -> dict[str, str]:
    """Return the words of a program, without ROS arguments, as its inputs: before any option by their place from
    ``<1>``, and the values of options by their names.

    The value of an option follows ``=`` or is the next word without a dash, else it is empty. Behind an option, which
    may take the next word, a place means nothing.
    """
    leading = takewhile(lambda word: not is_option(word), words)
    inputs = {f"<{place}>": word for place, word in enumerate(leading, 1)}
    for word, following in zip(words, (*words[1:], ""), strict=False):
        if is_option(word):
            option, equals, value = word.partition("=")
            inputs[option] = value if equals or is_option(following) else following
    return inputs


def is_option(word: str) -> bool:
    """Return True for a word that begins with a dash and is more than that."""
    return word.startswith("-") and word not in ("-", "--")
