"""What is still being done, on a terminal, once it has taken more than a second; it leaves no trace."""

from __future__ import annotations

import sys
import time

from enclave_launch.boundary.terminal import printable, raw

_PATIENCE = 1.0  # seconds
_BAR_WIDTH = 30
_CLEAR = "\r\033[K"


def wanted(quiet: bool) -> bool:
    """Whether a person may be looking at stderr."""
    return sys.stderr.isatty() and not quiet


class ProgressBar:
    """Called with how many of how many are done; on stderr."""

    def __init__(self, what: str) -> None:
        self.what = what
        self._started = time.monotonic()

    def __call__(self, done: int, total: int) -> None:
        if time.monotonic() - self._started < _PATIENCE:
            return
        filled = _BAR_WIDTH * done // max(total, 1)
        bar = f"\r[{'#' * filled}{'.' * (_BAR_WIDTH - filled)}] {done}/{total} {self.what}"
        print(bar + (_CLEAR if done == total else ""), end="", file=raw(sys.stderr), flush=True)


class ProgressLine:
    """Called with what is done next; on stderr. ``clear`` at the end."""

    def __init__(self, doing: str, _started: float | None = None) -> None:
        self.doing = doing
        self._started = time.monotonic() if _started is None else _started
        self._shown = False

    def __call__(self, subject: str) -> None:
        if time.monotonic() - self._started >= _PATIENCE:
            print(f"{_CLEAR}{self.doing} {printable(subject)} ...", end="", file=raw(sys.stderr), flush=True)
            self._shown = True

    def clear(self) -> None:
        """Take the line away, if there is one."""
        if self._shown:
            print(_CLEAR, end="", file=raw(sys.stderr), flush=True)
