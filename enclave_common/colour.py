"""Colours for a terminal: of severities, enclaves, repairs, and places in files.

Colours are put on finished lines, in the one place where all output passes (``terminal.safe_output``). What is printed
elsewhere is plain text, so a file, a pipe and a test see the same words.
"""

from __future__ import annotations

import os
import re
from typing import TextIO

_CODES = {"bad": "1;31", "warn": "33", "good": "32", "step": "1", "enclave": "36", "place": "34"}
_PATTERN = re.compile(
    r"""(?mx)
    ^(?!\[)                                                  # lines of a launch's processes stay as they are
    (?: (?P<program>secure-[a-z]+(?:[ ][a-z-]+)?:[ ])?
        (?: (?P<bad>error|exposure|alarm|missing)(?=[: ])
          | (?P<warn>warning|note)(?=[: ])
          | (?P<good>ok)(?=[ ])
          | (?P<step>\ *try:)(?=[ ]) ) )
    | (?<=[ ]enclave[ ])(?P<enclave>/\S*)
    | (?<![\w.~/-])(?P<place>[\w.~/-]{1,300}\.(?:py|xml|ya?ml|[ch]pp|hxx|cc|h|p7s|pem|json5?):\d+)
    """
)


def wants_colour(mode: str, stream: TextIO) -> bool:
    """Return whether ``stream`` gets colours.

    Args:
        mode: ``always``, ``never``, or ``auto`` for a terminal on which ``NO_COLOR`` is not set (no-color.org).
        stream: Where text is written.
    """
    if mode != "auto":
        return mode == "always"
    return stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


def coloured(text: str) -> str:
    """Return ``text`` with the codes of colours."""
    return _PATTERN.sub(_with_code, text)


def _with_code(found: re.Match[str]) -> str:
    name = next((each for each in _CODES if found[each]), None)
    if name is None:
        return found[0]
    before = found["program"] or ""
    return f"{before}\x1b[{_CODES[name]}m{found[name]}\x1b[0m"
