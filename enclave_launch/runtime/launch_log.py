"""The log of the launch itself: ``[INFO] [talker-1]: process started with pid [42]``, on screen and in
launch.log.

Formats as in launch/logging/__init__.py, ``OVERRIDE_LAUNCH_SCREEN_FORMAT`` and ``OVERRIDE_LAUNCH_LOG_FORMAT``
included. Launch colours nothing by itself; escape codes in those two formats are interpreted.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Literal

from enclave_launch.boundary.terminal import printable, printable_lines
from enclave_launch.runtime.sinks import FileSink, ScreenSink, Sink, SinkWriter

Level = Literal["DEBUG", "INFO", "WARNING", "ERROR", "CRITICAL"]
LEVELS: dict[Level, int] = {"DEBUG": 10, "INFO": 20, "WARNING": 30, "ERROR": 40, "CRITICAL": 50}
Format = Callable[[Level, str, str], str]


class LaunchLog:
    """Sinks of one run. ``directory`` is where launch.log and the processes' own logs are."""

    def __init__(
        self,
        directory: Path,
        screen: ScreenSink,
        writer: SinkWriter,
        environment: Mapping[str, str],
        debug: bool = False,
    ) -> None:
        self.directory = directory
        self.screen: Sink = screen
        self.launch_file = FileSink(directory / "launch.log")
        self.writer = writer
        self.debug = debug
        self._files: dict[str, FileSink] = {"launch.log": self.launch_file}
        self._on_screen = _format_from(environment.get("OVERRIDE_LAUNCH_SCREEN_FORMAT"), _plain)
        self._in_file = _format_from(environment.get("OVERRIDE_LAUNCH_LOG_FORMAT"), _with_time)

    def log(self, level: Level, name: str, message: str) -> None:
        if LEVELS[level] < LEVELS["INFO"] and not self.debug:
            return
        for sink, render in ((self.screen, self._on_screen), (self.launch_file, self._in_file)):
            line = render(level, printable(name), printable_lines(message))
            self.writer.write(sink, (line + "\n").encode(errors="replace"))

    def file(self, name: str) -> FileSink:
        """The one sink for ``name`` in the log directory."""
        return self._files.setdefault(name, FileSink(self.directory / name))

    def close(self) -> None:
        self.writer.close()
        for sink in self._files.values():
            sink.close()


@contextmanager
def captured_logging(log: LaunchLog) -> Iterator[None]:
    """Within the block, what launch files and launch's own actions log (``launch.logging.get_logger``, and Python's
    ``logging``) goes where the launch's own lines go."""
    import logging

    class Forward(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            level: Level = next(
                (name for name in reversed(LEVELS) if record.levelno >= LEVELS[name]), "DEBUG"
            )
            log.log(level, record.name, record.getMessage())

    root, handler = logging.getLogger(), Forward()
    before = root.level
    root.addHandler(handler)
    root.setLevel(logging.DEBUG if log.debug else logging.INFO)
    try:
        yield
    finally:
        root.removeHandler(handler)
        root.setLevel(before)


def _plain(level: Level, name: str, message: str) -> str:
    return f"[{level}] [{name}]: {message}"


def _with_time(level: Level, name: str, message: str) -> str:
    return f"{time.time():.7f} [{level}] [{name}]: {message}"


def _format_from(override: str | None, default: Format) -> Format:
    """``{``-style format over the attributes of a ``logging.LogRecord``, or one of launch's two aliases."""
    if not override or override == "default":
        return default
    if override == "default_with_timestamp":
        return _with_time
    import logging

    formatter = logging.Formatter(override.encode("latin1", "replace").decode("unicode_escape"), style="{")

    def render(level: Level, name: str, message: str) -> str:
        record = logging.LogRecord(name, LEVELS[level], "", 0, message.replace("%", "%%"), None, None)
        record.msg = message
        return formatter.format(record)

    return render
