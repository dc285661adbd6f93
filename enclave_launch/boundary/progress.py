"""What is still being done, on a terminal, once it has taken more than a second; it leaves no trace."""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass, field

from enclave_launch.boundary.terminal import printable, raw

_PATIENCE = 1.0  # seconds
_BAR_WIDTH = 30
_CLEAR = "\r\033[K"


def wanted(quiet: bool) -> bool:
    """Whether a person may be looking at stderr."""
    return sys.stderr.isatty() and not quiet


@dataclass
class ProgressBar:
    """Called with how many of how many are done; on stderr."""

    what: str
    _started: float = field(default_factory=time.monotonic)

    def __call__(self, done: int, total: int) -> None:
        if time.monotonic() - self._started < _PATIENCE:
            return
        filled = _BAR_WIDTH * done // max(total, 1)
        bar = f"\r[{'#' * filled}{'.' * (_BAR_WIDTH - filled)}] {done}/{total} {self.what}"
        print(bar + (_CLEAR if done == total else ""), end="", file=raw(sys.stderr), flush=True)


@dataclass
class ProgressLine:
    """Called with what is done next; on stderr. ``clear`` at the end."""

    doing: str
    _started: float = field(default_factory=time.monotonic)
    _shown: bool = False

    def __call__(self, subject: str) -> None:
        if time.monotonic() - self._started >= _PATIENCE:
            print(f"{_CLEAR}{self.doing} {printable(subject)} ...", end="", file=raw(sys.stderr), flush=True)
            self._shown = True

    def clear(self) -> None:
        """Take the line away, if there is one."""
        if self._shown:
            print(_CLEAR, end="", file=raw(sys.stderr), flush=True)
