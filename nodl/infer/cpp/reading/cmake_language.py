"""The language of ``CMakeLists.txt``: commands with their arguments, variables, what conditions are known. Pure."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence

_ARGUMENT = re.compile(r'\[(=*)\[((?:.|\n)*?)\]\1\]|"((?:\\.|[^"\\])*)"|([^\s()"]+)|([()])')
_COMMAND = re.compile(r"[ \t]*(\w+)\s*\(")
_VARIABLE = re.compile(r"\$\{([\w.\-]+)\}")
LINK_WORDS = frozenset({"PUBLIC", "PRIVATE", "INTERFACE", "SYSTEM"})
BLOCK_ENDS = {name: f"end{name}" for name in ("if", "foreach", "function", "macro", "while")}

Command = tuple[str, list[str]]


def commands(source: str) -> Iterator[Command]:
    """Every command with its arguments, parentheses kept as arguments of their own."""
    source = re.sub(r"#\[(=*)\[(?:.|\n)*?\]\1\]|(?<!\\)#[^\n]*", "", source)
    position = 0
    while True:
        match = _COMMAND.search(source, position)
        if match is None:
            return
        words: list[str] = []
        depth, position = 1, match.end()
        while depth and (found := _ARGUMENT.search(source, position)):
            position = found.end()
            if found[5]:
                depth += 1 if found[5] == "(" else -1
                if depth:
                    words.append(found[5])
            elif found[3] is not None:
                words.append('"' + found[3])
            else:
                words.append(found[2] or found[4] or "")
        yield match[1].lower(), words
        if depth:
            return


class Layer(dict[str, str]):
    """Variables of a loop or macro: new ones here, all others written through."""

    def __init__(self, outer: dict[str, str], own: dict[str, str]):
        super().__init__({**outer, **own})
        self._outer, self._own = outer, set(own)

    def __setitem__(self, name: str, value: str) -> None:
        super().__setitem__(name, value)
        if name not in self._own:
            self._outer[name] = value


def end_of_block(listed: Sequence[Command], start: int) -> int:
    """The index of the command that closes the block at ``start``; of the last command if none does."""
    name = listed[start][0]
    depth = 0
    for index in range(start, len(listed)):
        depth += (listed[index][0] == name) - (listed[index][0] == BLOCK_ENDS[name])
        if depth == 0:
            return index
    return len(listed) - 1


def expand(words: list[str], variables: dict[str, str]) -> list[str]:
    """Variables filled in; lists become several arguments unless they stand in quotes."""
    found: list[str] = []
    for word in words:
        quoted = word.startswith('"')
        for _ in range(8):
            filled = _VARIABLE.sub(lambda match: variables.get(match[1], ""), word)
            if filled == word:
                break
            word = filled
        found += [word[1:]] if quoted else [part for part in word.split(";") if part]
    return found


def condition_state(condition: list[str]) -> bool | None:
    """Whether a condition holds on Linux without tests; ``None`` for all but a few simple ones."""
    words = [word.lstrip('"') for word in condition if word not in ("(", ")")]
    written = " ".join(words)
    if written in ("BUILD_TESTING", "CATKIN_ENABLE_TESTING", "WIN32", "APPLE", "MSVC", "ANDROID", "FALSE"):
        return False
    if written in ("NOT WIN32", "UNIX", "TRUE", "NOT APPLE"):
        return True
    return False if "BUILD_TESTING" in words and "NOT" not in words and "OR" not in words else None


def absolute(word: str, variables: dict[str, str]) -> str:
    """A path as seen from ``CMAKE_CURRENT_SOURCE_DIR``, normalised; an absolute one stays where it is."""
    return os.path.normpath(os.path.join(variables.get("CMAKE_CURRENT_SOURCE_DIR", ""), word))


def recursive_pattern(pattern: str, how: str) -> str:
    """For ``GLOB_RECURSE`` the pattern with ``**`` before the file name; else the pattern as it is."""
    folder, name = os.path.split(pattern)
    return os.path.join(folder, "**", name) if how == "GLOB_RECURSE" else pattern


def compile_definitions(words: list[str], only_flags: bool = False) -> dict[str, str]:
    """Macros with their values, ``1`` by default; with ``only_flags`` only words that start with ``-D``."""
    found = {}
    for word in words:
        if word.startswith("-D"):
            word = word[2:]
        elif only_flags or word.startswith(("-", "$")) or word in LINK_WORDS:
            continue
        name, _, value = word.partition("=")
        found[name] = value.replace('\\"', '"') or "1"
    return found
