"""Regular expressions that are compiled when something is searched with them.

A pattern takes as long to compile as a small module to import, and a launch meets the texts for a few of the patterns
only; docs/speed.md has what that saves. Pure.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any


class LatePattern:
    """What ``re.compile`` gives, as soon as it is asked for anything."""

    def __init__(self, text: str, flags: int = 0) -> None:
        self._given = text, flags

    def __getattr__(self, name: str) -> Any:
        found = vars(self)[name] = getattr(re.compile(*vars(self)["_given"]), name)
        return found


if TYPE_CHECKING:

    def late_pattern(text: str, flags: int = 0) -> re.Pattern[str]:
        """As ``re.compile``; errors of ``text`` come at the first use."""

else:
    late_pattern = LatePattern
