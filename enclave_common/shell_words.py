"""Split command lines that others wrote."""

from __future__ import annotations

import shlex

MAX_WORD = 2**17
"""Characters. Linux passes no longer word to a program, and shlex takes quadratic time for one."""


def split_words(text: str) -> list[str]:
    """Split ``text`` as a POSIX shell does; raises ``ValueError``, also for a word longer than ``MAX_WORD``."""
    if _longest_word(text) > MAX_WORD:
        raise ValueError(f"a word of a command line has more than {MAX_WORD} characters")
    return shlex.split(text)


def _longest_word(text: str) -> int:
    if any(mark in text for mark in "'\"\\"):
        return len(text)
    return max(map(len, text.split()), default=0)
