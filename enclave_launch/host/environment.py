"""``os.environ`` with the stack that groups need, and cheap snapshots.

The process environment is the state itself, as upstream: Python launch files, their helpers and the commands
they run must see what ``set_env`` did. A snapshot for each of thousands of processes would be slow to decode,
so the last one is cached while nothing changes.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

_last: tuple[dict[bytes, bytes], dict[str, str]] | None = None


def environment_snapshot() -> dict[str, str]:
    """Return the current variables. Shared between calls while nothing changes: do not modify."""
    global _last
    raw: dict[bytes, bytes] | None = getattr(os.environ, "_data", None)
    if raw is None:
        return dict(os.environ)
    if _last is None or _last[0] != raw:
        _last = dict(raw), dict(os.environ)
    return _last[1]


class Environment:
    """The process environment with a stack of saved ones. ``start`` is the environment when the context was made: what
    ``reset_env`` goes back to."""

    def __init__(self) -> None:
        self.start = environment_snapshot()
        self._stack: list[dict[str, str]] = []
        self._changes: tuple[dict[str, str], dict[str, str]] | None = None

    def snapshot(self) -> dict[str, str]:
        """Return ``environment_snapshot()``."""
        return environment_snapshot()

    def changes(self) -> dict[str, str]:
        """Return the variables that differ from ``start``; shared like ``snapshot``."""
        now = environment_snapshot()
        if self._changes is None or self._changes[0] is not now:
            self._changes = now, changed(self.start, now)
        return self._changes[1]

    def assign(self, variables: Mapping[str, str]) -> None:
        """Make ``os.environ`` exactly ``variables``, touching only what differs."""
        now = environment_snapshot()
        if now is variables:
            return
        for name in now.keys() - variables.keys():
            del os.environ[name]
        os.environ.update(changed(now, variables))

    def push(self) -> None:
        self._stack.append(environment_snapshot())

    def pop(self) -> None:
        if not self._stack:
            raise RuntimeError("environment stack unexpectedly empty")
        self.assign(self._stack.pop())

    def reset(self) -> None:
        self.assign(self.start)


def changed(before: Mapping[str, str], after: Mapping[str, str]) -> dict[str, str]:
    """Return the entries of ``after`` that ``before`` has not, or has with another value."""
    return {name: value for name, value in after.items() if before.get(name) != value}


@contextmanager
def environment_untouched() -> Iterator[None]:
    """Undo whatever the block does to ``os.environ``."""
    environment = Environment()
    try:
        yield
    finally:
        environment.reset()
