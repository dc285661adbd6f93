"""Whose turn it is: what launch files see of the process (environment, modules, path) is there once, launches are many.

A launch that runs visits its description in turns: an event at a time, without waiting in between. For its turn the
process looks as that launch left it; before another one's turn, or an evaluation, that is put away and the program's
own state comes back. A launch that is alone stays on the stage, so turns cost nothing.
"""

from __future__ import annotations

from _thread import RLock
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager

from enclave_launch.description.install import installed
from enclave_launch.frontend.fast_yaml import libyaml_for_launch_files
from enclave_launch.host.environment import Environment, environment_snapshot, environment_untouched


class Actor:
    """One running launch. ``prepare`` is called on its first entrance, ``prefixes`` gives those whose Python packages
    it may import."""

    def __init__(self, prepare: Callable[[], None], prefixes: Callable[[], Sequence[str]]) -> None:
        self._prepare = prepare
        self._prefixes = prefixes
        self._environment: Mapping[str, str] | None = None  # its own, while it is not on the stage
        self._stack = ExitStack()

    def enter(self) -> None:
        self._stack.enter_context(environment_untouched())
        if self._environment is None:
            self._prepare()
        else:
            Environment().assign(self._environment)
        self._stack.enter_context(installed(self._prefixes()))
        self._stack.enter_context(libyaml_for_launch_files())

    def leave(self) -> None:
        self._environment = environment_snapshot()
        self._stack.close()


class Stage:
    """There is one, ``STAGE``. May be used from any thread."""

    def __init__(self) -> None:
        self._lock = RLock()
        self._depth = 0  # of turns and evaluations that are under way, in the thread that has the lock
        self._actor: Actor | None = None

    @contextmanager
    def turn(self, actor: Actor) -> Iterator[None]:
        """Within the block, which must not wait for anything, the process looks as ``actor`` left it."""
        with self._alone():
            if self._depth == 1 and self._actor is not actor:
                self._clear()
                actor.enter()
                self._actor = actor
            yield

    @contextmanager
    def cleared(self) -> Iterator[None]:
        """Within the block the process is as the program has it; within a turn, as that turn has it."""
        with self._alone():
            if self._depth == 1:
                self._clear()
            yield

    def is_on(self, actor: Actor) -> bool:
        """Was the last turn, or is the present one, that of ``actor``?"""
        return self._actor is actor

    def leave(self, actor: Actor) -> None:
        """``actor`` has no more turns."""
        with self._lock:
            if self._actor is actor:
                self._clear()

    @contextmanager
    def _alone(self) -> Iterator[None]:
        with self._lock:
            self._depth += 1
            try:
                yield
            finally:
                self._depth -= 1

    def _clear(self) -> None:
        if self._actor is not None:
            self._actor.leave()
            self._actor = None


STAGE = Stage()
