"""Switch the process between the environments of several launches.

Variables, imported modules and ``sys.path`` exist once in a process. A launch visits its description in turns; before
another one becomes active its environment is saved. A launch that is alone stays active, so that turns cost nothing.
"""

from __future__ import annotations

from _thread import RLock
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager

from enclave_launch.description.install import installed
from enclave_launch.host.environment import Environment, environment_snapshot, environment_untouched


class LaunchEnvironment:
    """The environment of one running launch.

    ``prepare`` is called when it becomes active for the first time; ``prefixes`` returns the prefixes whose Python
    packages the launch may import.
    """

    def __init__(self, prepare: Callable[[], None], prefixes: Callable[[], Sequence[str]]) -> None:
        self._prepare = prepare
        self._prefixes = prefixes
        self._saved: Mapping[str, str] | None = None  # its variables, while it is not active
        self._stack = ExitStack()

    def enter(self) -> None:
        """Put it in the place of the program's own."""
        self._stack.enter_context(environment_untouched())
        if self._saved is None:
            self._prepare()
        else:
            Environment().assign(self._saved)
        self._stack.enter_context(installed(self._prefixes()))

    def leave(self) -> None:
        """Save it and restore the program's own."""
        self._saved = environment_snapshot()
        self._stack.close()


class EnvironmentSwitch:
    """Knows which launch is active. There is one, ``ENVIRONMENT_SWITCH``; it may be used from any thread."""

    def __init__(self) -> None:
        self._lock = RLock()
        self._depth = 0  # of turns and evaluations in progress, in the thread that has the lock
        self._active: LaunchEnvironment | None = None

    @contextmanager
    def active(self, environment: LaunchEnvironment) -> Iterator[None]:
        """Make ``environment`` active within the block, which must not wait for anything."""
        with self._exclusive():
            if self._depth == 1 and self._active is not environment:
                self._restore()
                environment.enter()
                self._active = environment
            yield

    @contextmanager
    def restored(self) -> Iterator[None]:
        """Restore the program's own environment within the block; inside of a turn, leave that of the turn."""
        with self._exclusive():
            if self._depth == 1:
                self._restore()
            yield

    def is_active(self, environment: LaunchEnvironment) -> bool:
        """Return True if the current or the last turn is that of ``environment``."""
        return self._active is environment

    def leave(self, environment: LaunchEnvironment) -> None:
        """Note that ``environment`` has no more turns."""
        with self._lock:
            if self._active is environment:
                self._restore()

    @contextmanager
    def _exclusive(self) -> Iterator[None]:
        with self._lock:
            self._depth += 1
            try:
                yield
            finally:
                self._depth -= 1

    def _restore(self) -> None:
        if self._active is not None:
            self._active.leave()
            self._active = None


ENVIRONMENT_SWITCH = EnvironmentSwitch()
