"""A command line as text -> its words, as a POSIX shell splits and unquotes them. Pure.

``shlex.split`` of the standard library gives the same, but in time quadratic in the longest word: a megabyte takes it
a minute. ``tests/boundary/test_shell_words.py`` holds the two equal.
"""

from __future__ import annotations

import re

from enclave_launch.boundary.light import late_pattern

_BLANKS = " \t\r\n"
_PIECE = late_pattern(
    r"""
    (?P<blank>[ \t\r\n]+)
  | (?P<plain>[^ \t\r\n'"\\]+)
  | \\(?P<escaped>.)
  | '(?P<single>[^']*)'
  | "(?P<double>[^"\\]*(?:\\.[^"\\]*)*)"
    """,
    re.VERBOSE | re.DOTALL,
)
_ESCAPED_IN_QUOTES = late_pattern(r'\\([\\"])')


def split_words(text: str) -> list[str]:
    """The words of ``text``. Raises ``ValueError`` for a quotation or an escape that does not end."""
    words: list[str] = []
    word: list[str] | None = None  # pieces of the word being read
    position = 0
    while position < len(text):
        piece = _PIECE.match(text, position)
        if piece is None:
            raise ValueError(
                "No escaped character" if _ends_in_escape(text, position) else "No closing quotation"
            )
        position = piece.end()
        if piece["blank"] is None:
            word = word or []
            word.append(_unquoted(piece))
        elif word is not None:
            words.append("".join(word))
            word = None
    return words if word is None else [*words, "".join(word)]


def _unquoted(piece: re.Match[str]) -> str:
    if piece["double"] is not None:
        return _ESCAPED_IN_QUOTES.sub(r"\1", piece["double"])
    return piece["plain"] or piece["escaped"] or piece["single"] or ""


def _ends_in_escape(text: str, position: int) -> bool:
    """Whether what begins at ``position`` ends with a backslash that escapes nothing."""
    if text[position] == "'":
        return False
    trailing = len(text) - len(text.rstrip("\\"))
    return min(trailing, len(text) - position) % 2 == 1
