"""How text for people is laid out: for the width of a terminal and in colour there, whole and plain in a pipe.

Everything that launch files chose is escaped before it is coloured (``terminal``), so that the only control
characters in a report are ours.
"""

from __future__ import annotations

import os
import re
import shutil
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple, TextIO

from enclave_common.terminal import message, printable, short_paths
from enclave_launch.diagnostics import Diagnostic

_NARROWEST = 40
_LISTED = 4  # diagnostics of one kind, before the others are counted
_FOLDED = 3  # lines of one list of names

_RESET, _BOLD, _RED, _YELLOW, _CYAN = "\033[0m", "\033[1m", "\033[1;31m", "\033[33m", "\033[36m"
_COLOURS = (
    (re.compile(r"^error(?: under --secure)?:"), _RED),
    (re.compile(r"^warning:"), _YELLOW),
    (re.compile(r"(?<=── )enclave \S+"), _BOLD),
    (re.compile(r"(?<=── )\[[^\]]+\]"), _CYAN),
    (re.compile(r"permissions unknown"), _YELLOW),
)


class TerminalStyle(NamedTuple):
    """``width``: columns, ``None`` for lines of any length; ``full``: nothing is folded or counted; ``folder``: a
    path that is left out where it begins one."""

    width: int | None = None
    colour: bool = False
    full: bool = False
    folder: str = ""

    def one_line(self, text: str) -> str:
        """Escape ``text`` and shorten the paths of files below ``folder`` to those that a person would type."""
        return printable(self._shortened(text))

    def wrapped(self, text: str, first: str, further: str, *, fold: bool = False) -> list[str]:
        """Wrap ``text`` into lines, the first one behind ``first``, later ones behind ``further``; words stay whole.

        :param fold: after some lines, count the remaining words instead of showing them"""
        if self.width is None:
            return [self.painted(first + text)]
        room = max(self.width, len(first) + _NARROWEST)

        lines = textwrap.wrap(
            text, room, initial_indent=first, subsequent_indent=further,
            break_long_words=False, break_on_hyphens=False,
        ) or [first]  # fmt: skip
        if fold and not self.full and len(lines) > _FOLDED + 1:
            hidden = len(" ".join(line.removeprefix(further) for line in lines[_FOLDED:]).split())
            lines = [*lines[:_FOLDED], f"{further}… and {hidden} more (-v shows them)"]
        return [self.painted(line) for line in lines]

    def painted(self, line: str) -> str:
        """Colour the parts of ``line``, if colours are requested."""
        if self.colour:
            for pattern, colour in _COLOURS:
                line = pattern.sub(rf"{colour}\g<0>{_RESET}", line)
        return line

    def listed(self, kind: str, diagnostics: Sequence[Diagnostic]) -> list[str]:
        """Format ``diagnostics``, each as ``kind: text``.

        Of many with the same code some are shown and the others counted; a remedy that several share is printed
        once."""
        lines: list[str] = []
        for group in _by_code(diagnostics):
            remedies = {each.remedy for each in group}
            once = len(group) > 1 and len(remedies) == 1 and "" not in remedies
            shown = group if self.full or len(group) <= _LISTED + 1 else group[:_LISTED]
            for each in shown:
                lines += self._message(kind, str(each._replace(remedy="") if once else each))
            if hidden := len(group) - len(shown):
                lines += self._message(kind, f"{hidden} more like these ({group[0].code}; -v shows them)")
            if once:
                lines += self._message("    what to do", group[0].remedy)
        return lines

    def _message(self, kind: str, text: str) -> list[str]:
        first, *later = message(self._shortened(text)).split("\n")
        lines = self.wrapped(first, f"{kind}: ", "    ")
        return [*lines, *(line for more in later for line in self.wrapped(more.strip(), "    ", "    "))]

    def _shortened(self, text: str) -> str:
        return short_paths(text, self.folder)


def _by_code(diagnostics: Iterable[Diagnostic]) -> list[list[Diagnostic]]:
    groups: dict[str, list[Diagnostic]] = {}
    for each in diagnostics:
        groups.setdefault(each.code, []).append(each)
    return list(groups.values())


def terminal_style_of(
    stream: TextIO, environment: Mapping[str, str], *, verbose: bool = False
) -> TerminalStyle:
    """Return the style that ``stream`` can show: a terminal has a width, and colours unless ``NO_COLOR``
    (no-color.org) is set."""
    folder = os.path.join(os.getcwd(), "")
    if not stream.isatty():
        return TerminalStyle(full=verbose, folder=folder)

    plain = bool(environment.get("NO_COLOR")) or environment.get("TERM") == "dumb"
    return TerminalStyle(shutil.get_terminal_size().columns, not plain, verbose, folder)
