"""What a build says that each source is compiled with, by target. Reads files.

colcon leaves what CMake writes below ``build/<package>``: ``compile_commands.json`` if it is asked for, and always the
``flags.make`` of each target or Ninja's ``build.ninja``. All three name the folder ``CMakeFiles/<target>.dir``.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import NamedTuple, TypeAlias

from enclave_common.files import read_text, text_or_nothing
from enclave_common.shell_words import split_words

_TARGET = re.compile(r"CMakeFiles/([^/\s]+)\.dir/")
_MAKE_FLAGS = re.compile(r"^CXX_(?:DEFINES|FLAGS) = (.*)$", re.MULTILINE)
_MAKE_SOURCE = re.compile(r'^\s*"([^"]+)" "([^"]+\.o)" "', re.MULTILINE)
_MAKE_CUSTOM = re.compile(r"^# Custom \w+: (\S+)_[A-Z]+ = ", re.MULTILINE)
_NINJA_SOURCE = re.compile(
    r"^build (\S+\.o): CXX_COMPILER\S* ((?:[^\s$]|\$.)+).*\n((?:  .*\n)*)", re.MULTILINE
)
_NINJA_FLAGS = re.compile(r"^  (?:DEFINES|FLAGS) = (.*)$", re.MULTILINE)


class Definitions(NamedTuple):
    """What the sources of one program are compiled with.

    ``symbols``: those that all define alike; ``open``: what only some define, or as something else; ``complete``:
    nothing else is defined on the command line. ``package``: whose sources have these, where all of its libraries
    together have others; empty if that makes no difference.
    """

    symbols: tuple[tuple[str, str], ...] = ()
    complete: bool = False
    open: tuple[str, ...] = ()
    package: str = ""


def joined(several: Iterable[Definitions]) -> Definitions:
    """Return what sources are compiled with of which each has one of ``several`` definitions."""
    every = list(several)
    common = set(every[0].symbols).intersection(*(each.symbols for each in every)) if every else set()
    named = {name for each in every for name in (*dict(each.symbols), *each.open)}
    return Definitions(
        symbols=tuple(sorted(common)),
        complete=bool(every) and all(each.complete for each in every),
        open=tuple(sorted(named - dict(common).keys())),
        package=every[0].package if every else "",
    )


UNBUILT = Definitions()

Compiled: TypeAlias = "dict[str, dict[str, Definitions]]"
"""Real path of a source -> target -> what it is compiled with."""


def defined_on(words: Sequence[str]) -> Definitions:
    """Return what a command line of a compiler defines: not all, if it has the compiler read more of it from files."""
    found: dict[str, str] = {}
    waiting = list(words)
    while waiting:
        word = waiting.pop(0)
        if word.startswith(("-include", "-imacros", "@")):
            return UNBUILT
        if word == "-D" and waiting:
            word += waiting.pop(0)
        if word.startswith("-D"):
            name, given, value = word[2:].partition("=")
            found[name] = value if given else "1"
        elif word.startswith("-U"):
            found.pop(word[2:], None)
    return Definitions(tuple(sorted(found.items())), complete=True)


def compiled_sources(build_folders: Iterable[str]) -> Compiled:
    """Return what each source is compiled with below the folders that hold a build, or one for each package."""
    found: Compiled = {}
    for path in (each for folder in build_folders for each in build_files(folder)):
        for source, target, command in _READERS[path.name](path):
            found.setdefault(os.path.realpath(source), {})[target] = _definitions(command)
    return found


def build_files(folder: str) -> Iterator[Path]:
    """Yield the files below a folder of builds that say how sources are compiled."""
    for each in (Path(folder), *sorted(Path(folder).glob("*/"))):
        commands = each / "compile_commands.json"
        if commands.is_file():
            yield commands
            continue
        yield from each.glob("build.ninja")
        below = (each.glob(f"{at}CMakeFiles/*.dir/flags.make") for at in ("", "*/"))
        for flags in sorted(chain.from_iterable(below)):
            yield flags
            yield flags.with_name(_SOURCES_OF_FLAGS)


_SOURCES_OF_FLAGS = "DependInfo.cmake"
Command: TypeAlias = "str | list[str] | None"
"""The compiler's command line, as one text or in words; ``None`` if it is not known."""
Compilation: TypeAlias = "tuple[str, str, Command]"
"""A source, the target that it is compiled for, and how."""


def _definitions(command: Command) -> Definitions:
    try:
        words = split_words(command) if isinstance(command, str) else command
    except ValueError:
        words = None
    return defined_on(words) if words is not None else UNBUILT


def _of_commands(path: Path) -> Iterator[Compilation]:
    try:
        entries = json.loads(read_text(path))
    except (OSError, ValueError, RecursionError):
        return
    for entry in entries if isinstance(entries, list) else []:
        if isinstance(entry, dict):
            words = entry.get("arguments") or str(entry.get("command", ""))
            named = _TARGET.search(" ".join(words) if isinstance(words, list) else words)
            source = os.path.normpath(os.path.join(entry.get("directory", ""), entry.get("file", "")))
            yield source, named[1] if named else "", words


def _of_make(path: Path) -> Iterator[Compilation]:
    content = text_or_nothing(path)
    flags = " ".join(_MAKE_FLAGS.findall(content)).replace("$$", "$").replace("\\#", "#")
    custom = set(_MAKE_CUSTOM.findall(content))
    for source, made in _MAKE_SOURCE.findall(text_or_nothing(path.with_name(_SOURCES_OF_FLAGS))):
        yield source, path.parent.name.removesuffix(".dir"), None if made in custom else flags


def _of_ninja(path: Path) -> Iterator[Compilation]:
    for made, source, variables in _NINJA_SOURCE.findall(text_or_nothing(path)):
        named = _TARGET.search(made)
        flags = " ".join(_NINJA_FLAGS.findall(variables))
        yield os.path.join(path.parent, _unescaped(source)), named[1] if named else "", _unescaped(flags)


def _unescaped(text: str) -> str:
    """Return a value of Ninja as it is meant ([Ninja manual, lexical syntax])."""
    return re.sub(r"\$([$ :])", r"\1", text)


_READERS: dict[str, Callable[[Path], Iterable[Compilation]]] = {
    "compile_commands.json": _of_commands,
    "build.ninja": _of_ninja,
    "flags.make": _of_make,
    _SOURCES_OF_FLAGS: lambda path: (),  # read with the flags
}
