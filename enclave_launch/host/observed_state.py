"""Observe what a call of the user's code reads, to know later whether its cached result is still valid.

A plan must know what an event would start, so functions that an event or a timer calls are called for the plan. The
result is used again at the event only if all that the function read is unchanged: launch configurations, environment,
files and folders, and the files named on the command lines of programs that it ran. A function that read the event
itself, or something that leaves no trace when it changes (the network, another process, ``/proc`` and ``/sys``, a
device), is called again.
"""

from __future__ import annotations

import os
import re
import stat
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NamedTuple

from enclave_launch.host.environment import environment_snapshot

if TYPE_CHECKING:
    from enclave_launch.description.launch_context import LaunchContext

FileState = tuple[int, int, int, int] | None
"""Change time, size, inode and mode; ``None`` where there is nothing."""


class ObservedState(NamedTuple):
    """The state on which a cached result depends: all that a call is known to have read, when it had ended."""

    configurations: Mapping[str, Any] | None
    environment: Mapping[str, str]
    files: Mapping[str, FileState]

    def is_unchanged(self, context: LaunchContext | None) -> bool:
        """Return True if all of it is unchanged."""
        configurations = None if context is None else dict(context.launch_configurations)
        if configurations != self.configurations:
            return False
        if environment_snapshot() != self.environment:
            return False
        return all(_file_state(path) == state for path, state in self.files.items())


class CallObservation:
    """The paths that one call reads. ``untraceable``: it read something whose changes leave no trace."""

    def __init__(self) -> None:
        self.paths: set[str] = set()
        self.untraceable = False

    def state(self, context: LaunchContext | None) -> ObservedState | None:
        """Return the state of what was read; None if its changes leave no trace."""
        if self.untraceable:
            return None
        configurations = None if context is None else dict(context.save().configurations)
        states = {path: _file_state(path) for path in self.paths}
        return ObservedState(configurations, environment_snapshot(), states)

    def note_path(self, path: object) -> None:
        if isinstance(path, (str, bytes, os.PathLike)):
            self.paths.add(os.path.abspath(os.fsdecode(path)))

    def note_reading(self, path: object) -> None:
        self.note_path(path)
        if isinstance(path, (str, bytes, os.PathLike)):
            self.untraceable = self.untraceable or _changes_unseen(os.path.abspath(os.fsdecode(path)))

    def note_program(self, words: object) -> None:
        """Note the paths that a program's command line names; more cannot be known."""
        for word in words if isinstance(words, (list, tuple)) else (words,):
            if isinstance(word, (str, bytes, os.PathLike)):
                for part in _SEPARATORS.split(_WRITTEN.sub(" ", os.fsdecode(word))):
                    if part and not part.startswith("-"):
                        self.note_path(part)


_WRITTEN = re.compile(r">+\s*[^\s;&|>]+")  # by a shell: written, not read
_SEPARATORS = re.compile(r"[\s;&|<>()'\"`]+")
_OF_PROCESSES = ("os.kill", "os.killpg")
_OF_THIS_MACHINE = ("socket.__new__", "socket.gethostname")
_WITHOUT_CONTENT = ("/dev/null", "/dev/zero", "/dev/random", "/dev/urandom")
_observation: CallObservation | None = None
_listening = False


@contextmanager
def observing(context: LaunchContext | None) -> Iterator[CallObservation]:
    """Observe what the code within the block reads."""
    global _observation
    _listen()
    observation = _observation = CallObservation()
    functions: dict[str, Callable[..., Any]] = {
        name: getattr(os, name) for name in ("stat", "lstat", "access")
    }
    for name, function in functions.items():
        setattr(os, name, _noting(observation, function))
    if context is not None:
        context.event_read = False
    try:
        yield observation
    finally:
        _observation = None
        for name, function in functions.items():
            setattr(os, name, function)
        if context is not None and context.event_read:
            observation.untraceable = True


def _noting(observation: CallObservation, function: Callable[..., Any]) -> Callable[..., Any]:
    def noting(path: Any, *args: Any, **kwargs: Any) -> Any:
        observation.note_path(path)
        return function(path, *args, **kwargs)

    return noting


def _listen() -> None:
    """Add an audit hook, which reports files and programs, when first needed: a hook cannot be removed."""
    global _listening
    if not _listening:
        _listening = True
        sys.addaudithook(_hear)


def _hear(event: str, args: tuple[Any, ...]) -> None:
    if _observation is None:
        return
    if event == "open":
        if _reads(args[1], args[2]):
            _observation.note_reading(args[0])
    elif event in ("os.listdir", "os.scandir"):
        _observation.note_path(args[0] if args[0] is not None else ".")
    elif event in ("os.getxattr", "os.listxattr", "sqlite3.connect"):
        _observation.note_path(args[0])
    elif event in ("subprocess.Popen", "os.posix_spawn"):
        _observation.note_program(args[1])
    elif event in ("os.system", "os.exec"):
        _observation.note_program(args[0])
    elif event in _OF_PROCESSES or (event.startswith("socket.") and event not in _OF_THIS_MACHINE):
        _observation.untraceable = True


def _reads(mode: object, flags: object) -> bool:
    if isinstance(mode, str):
        return "r" in mode or "+" in mode
    return isinstance(flags, int) and flags & os.O_ACCMODE != os.O_WRONLY


def _changes_unseen(path: str) -> bool:
    """Return True if its content can change without its size and time."""
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
