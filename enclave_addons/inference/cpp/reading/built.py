"""The definitions that a build compiles each target with. Reads files.

CMake leaves the ``flags.make`` of each target below ``build/<package>``, where colcon has it build with make.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from enclave_common.files import text_or_nothing
from enclave_common.shell_words import split_words

_FLAGS = re.compile(r"^CXX_(?:DEFINES|FLAGS) = (.*)$", re.MULTILINE)
_CUSTOM = re.compile(r"^# Custom \w+: ", re.MULTILINE)


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


def named_in(source: str, definitions: Definitions) -> Definitions:
    """Return the part of ``definitions`` that decides how ``source`` alone is read."""
    symbols = tuple(each for each in definitions.symbols if each[0] in source)
    return Definitions(
        symbols, definitions.complete, tuple(name for name in definitions.open if name in source)
    )


UNBUILT = Definitions()


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


def built_targets(build_folders: Iterable[str]) -> dict[tuple[str, str], Definitions]:
    """Return what targets were compiled with, by their package and name."""
    found: dict[tuple[str, str], Definitions] = {}
    for folder in build_folders:
        for path in build_files(folder):
            target = path.parent.name.removesuffix(".dir")
            found[path.relative_to(folder).parts[0], target] = _definitions(text_or_nothing(path))
    return found


def build_files(folder: str) -> Iterator[Path]:
    """Yield the files below a folder of builds that say how targets are compiled."""
    for below in ("*", "*/*"):
        yield from sorted(Path(folder).glob(f"{below}/CMakeFiles/*.dir/flags.make"))


def _definitions(flags: str) -> Definitions:
    """Return what a ``flags.make`` defines; nothing is certain where one of the sources has flags of its own."""
    try:
        words = split_words(" ".join(_FLAGS.findall(flags)).replace("$$", "$").replace("\\#", "#"))
    except ValueError:
        return UNBUILT
    found = defined_on(words)
    own = _CUSTOM.search(flags) is not None
    return Definitions(open=tuple(name for name, _ in found.symbols)) if own else found
