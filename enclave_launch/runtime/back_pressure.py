"""Back pressure: decide who waits if lines come faster than they can be written. Runs in the event loop.

Streams that go to a file wait for the files. Streams that go to the screen wait for the screen; but one that stays full
for ``PATIENCE`` seconds (Ctrl-S, a slow link) holds up only the streams that go nowhere else. The others go on into
their logs, and the screen shows how many lines it lacks.
"""

from __future__ import annotations

import asyncio
from typing import Protocol

from enclave_launch.runtime.launch_log import LaunchLog
from enclave_launch.runtime.process_tree import Hold

PATIENCE = 5.0  # seconds


class Pausable(Protocol):
    """The processes whose output can be left in its pipes for a while."""

    def hold_output(self, hold: Hold) -> None: ...

    def release_output(self, *holds: Hold) -> None: ...


class BackPressure:
    """Call ``attach`` before anything is written."""

    def __init__(self, tree: Pausable) -> None:
        self._loop = asyncio.get_running_loop()
        self._tree = tree
        self._giving_up: asyncio.TimerHandle | None = None
        self._log: LaunchLog

    def attach(self, log: LaunchLog) -> None:
        self._log = log

    def on_files_full(self) -> None:
        self._tree.hold_output("files")

    def on_files_drained(self) -> None:
        """Release the output paused for the files; called in the writer's thread."""
        self._loop.call_soon_threadsafe(self._tree.release_output, "files")

    def on_screen_full(self) -> None:
        self._tree.hold_output("screen")
        self._giving_up = self._loop.call_later(PATIENCE, self._give_up)

    def on_screen_drained(self) -> None:
        self._loop.call_soon_threadsafe(self._go_on)

    def _give_up(self) -> None:
        self._log.show_less(True)
        self._tree.hold_output("screen only")
        self._tree.release_output("screen")

    def _go_on(self) -> None:
        if self._giving_up is not None:
            self._giving_up.cancel()
        self._log.show_less(False)
        self._tree.release_output("screen", "screen only")
