"""What a call of user code at an event depended on: whether what it gave while planning still holds when that happens.

A plan must know what an event would start, so functions that an event or a timer calls are called for the plan. They
ask about that moment: what they gave is taken at the event only where all that they looked at is as it was: launch
configurations, environment, files and folders, and the files named on the command lines of programs that they ran. What
looked at the event itself, or at what leaves no trace when it changes (the network, another process, ``/proc`` and
``/sys``, a device), is called again.
"""

from __future__ import annotations

import os
import stat
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

from enclave_launch.boundary.light import TYPE_CHECKING, Any, NamedTuple, late_pattern
from enclave_launch.host.environment import environment_snapshot

if TYPE_CHECKING:
    from enclave_launch.description.launch_context import LaunchContext

FileState = tuple[int, int, int, int] | None
"""Change time, size, inode and mode; ``None`` where there is nothing."""


class Moment(NamedTuple):
    """All that a call is known to have looked at, as it was when the call had ended."""

    configurations: Mapping[str, Any] | None
    environment: Mapping[str, str]
    files: Mapping[str, FileState]

    def holds(self, context: LaunchContext | None) -> bool:
        """Would the call see the same now?"""
        configurations = None if context is None else dict(context.launch_configurations)
        if configurations != self.configurations:
            return False
        if environment_snapshot() != self.environment:
            return False
        return all(_file_state(path) == state for path, state in self.files.items())


class Looks:
    """What one call looks at. ``elsewhere``: at what cannot be looked at again from here."""

    def __init__(self) -> None:
        self.paths: set[str] = set()
        self.elsewhere = False

    def moment(self, context: LaunchContext | None) -> Moment | None:
        """``None``: what the call gave holds for no other moment."""
        if self.elsewhere:
            return None
        configurations = None if context is None else dict(context.save().configurations)
        states = {path: _file_state(path) for path in self.paths}
        return Moment(configurations, environment_snapshot(), states)

    def look(self, path: object) -> None:
        if isinstance(path, (str, bytes, os.PathLike)):
            self.paths.add(os.path.abspath(os.fsdecode(path)))

    def read(self, path: object) -> None:
        self.look(path)
        if isinstance(path, (str, bytes, os.PathLike)):
            self.elsewhere = self.elsewhere or _changes_unseen(os.path.abspath(os.fsdecode(path)))

    def run(self, words: object) -> None:
        """A program reads what its command line names; more of it nobody can know."""
        for word in words if isinstance(words, (list, tuple)) else (words,):
            if isinstance(word, (str, bytes, os.PathLike)):
                for part in _SEPARATORS.split(_WRITTEN.sub(" ", os.fsdecode(word))):
                    if part and not part.startswith("-"):
                        self.look(part)


_WRITTEN = late_pattern(r">+\s*[^\s;&|>]+")  # by a shell: what it writes, it does not look at
_SEPARATORS = late_pattern(r"[\s;&|<>()'\"`]+")
_OF_PROCESSES = ("os.kill", "os.killpg")  # does it still run?
_OF_THIS_MACHINE = ("socket.__new__", "socket.gethostname")
_WITHOUT_CONTENT = ("/dev/null", "/dev/zero", "/dev/random", "/dev/urandom")
_looks: Looks | None = None
_listening = False


@contextmanager
def looked_at(context: LaunchContext | None) -> Iterator[Looks]:
    """Note what the code within the block looks at."""
    global _looks
    _listen()
    looks = _looks = Looks()
    asked: dict[str, Callable[..., Any]] = {name: getattr(os, name) for name in ("stat", "lstat", "access")}
    for name, function in asked.items():
        setattr(os, name, _noting(looks, function))
    if context is not None:
        context.event_looked_at = False
    try:
        yield looks
    finally:
        _looks = None
        for name, function in asked.items():
            setattr(os, name, function)
        if context is not None and context.event_looked_at:
            looks.elsewhere = True


def _noting(looks: Looks, function: Callable[..., Any]) -> Callable[..., Any]:
    def noting(path: Any, *args: Any, **kwargs: Any) -> Any:
        looks.look(path)
        return function(path, *args, **kwargs)

    return noting


def _listen() -> None:
    """Python tells of files and programs; whoever listens cannot stop again, so this one listens when asked first."""
    global _listening
    if not _listening:
        _listening = True
        sys.addaudithook(_hear)


def _hear(event: str, args: tuple[Any, ...]) -> None:
    if _looks is None:
        return
    if event == "open":
        if _reads(args[1], args[2]):
            _looks.read(args[0])
    elif event in ("os.listdir", "os.scandir"):
        _looks.look(args[0] if args[0] is not None else ".")
    elif event in ("os.getxattr", "os.listxattr", "sqlite3.connect"):
        _looks.look(args[0])
    elif event in ("subprocess.Popen", "os.posix_spawn"):
        _looks.run(args[1])
    elif event in ("os.system", "os.exec"):
        _looks.run(args[0])
    elif event in _OF_PROCESSES or (event.startswith("socket.") and event not in _OF_THIS_MACHINE):
        _looks.elsewhere = True


def _reads(mode: object, flags: object) -> bool:
    if isinstance(mode, str):
        return "r" in mode or "+" in mode
    return isinstance(flags, int) and flags & os.O_ACCMODE != os.O_WRONLY


def _changes_unseen(path: str) -> bool:
    """Is it something whose content changes while size and time do not?"""
    if path.startswith(("/proc/", "/sys/")):
        return True
    state = _file_state(path)
    regular = state is None or stat.S_ISREG(state[3]) or stat.S_ISDIR(state[3])
    return not regular and path not in _WITHOUT_CONTENT


def _file_state(path: str) -> FileState:
    try:
        state = os.stat(path)
    except (OSError, ValueError):
        return None
    return state.st_mtime_ns, state.st_size, state.st_ino, state.st_mode
