"""Lay out text for people: for the width of a terminal, whole in a pipe; always without control characters."""

from __future__ import annotations

import os
import shutil
import textwrap
from collections.abc import Iterable, Sequence
from typing import NamedTuple, TextIO

from enclave_common.terminal import message, printable, short_paths
from enclave_launch.diagnostics import Diagnostic

_NARROWEST = 40
_LISTED = 4  # diagnostics of one kind, before the others are counted
_FOLDED = 3  # lines of one list of names


class TerminalStyle(NamedTuple):
    """The layout of text for people. ``width``: columns, ``None`` for lines of any length; ``full``: nothing is folded
    or counted; ``folder``: a path that is left out where it begins one."""

    width: int | None = None
    full: bool = False
    folder: str = ""

    def one_line(self, text: str) -> str:
        """Escape ``text`` and shorten the paths of files below ``folder`` to those that a person would type."""
        return printable(self._shortened(text))

    def wrapped(self, text: str, first: str, further: str, *, fold: bool = False) -> list[str]:
        """Wrap ``text`` into lines, the first one behind ``first``, later ones behind ``further``; words stay whole.

        :param fold: after some lines, count the remaining words instead of showing them"""
        if self.width is None:
            return [first + text]
        room = max(self.width, len(first) + _NARROWEST)

        lines = textwrap.wrap(
            text, room, initial_indent=first, subsequent_indent=further,
            break_long_words=False, break_on_hyphens=False,
        ) or [first]  # fmt: skip
        if fold and not self.full and len(lines) > _FOLDED + 1:
            hidden = len(" ".join(line.removeprefix(further) for line in lines[_FOLDED:]).split())
            lines = [*lines[:_FOLDED], f"{further}… and {hidden} more (-v shows them)"]
        return lines

    def listed(self, kind: str, diagnostics: Sequence[Diagnostic]) -> list[str]:
        """Format ``diagnostics`` as ``kind: text``; of many with one code some, a shared remedy once."""
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


def terminal_style_of(stream: TextIO, *, verbose: bool = False) -> TerminalStyle:
    """Return the style for ``stream``: a terminal has a width."""
    width = shutil.get_terminal_size().columns if stream.isatty() else None
    return TerminalStyle(width, verbose, os.path.join(os.getcwd(), ""))
