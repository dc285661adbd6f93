"""The log of the launch itself: ``[INFO] [talker-1]: process started with pid [42]``, on screen and in
launch.log.

Formats as in launch/logging/__init__.py, ``OVERRIDE_LAUNCH_SCREEN_FORMAT`` and ``OVERRIDE_LAUNCH_LOG_FORMAT``
included. Launch colours nothing by itself; escape codes in those two formats are interpreted. Where the logs go is laid
out as by launch, too (``_get_logging_directory``, ``_make_unique_log_dir``, ``_renew_latest_log_dir`` there).
"""

from __future__ import annotations

import asyncio
import logging
import os
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import Literal, NamedTuple

from enclave_common.terminal import printable, printable_lines
from enclave_common.words import counted
from enclave_launch.errors import RuntimeFailure
from enclave_launch.runtime.overlap import Overlap
from enclave_launch.runtime.process_tree import ProcessTree
from enclave_launch.runtime.sinks import FileSink, ScreenSink, Sink, SinkWriter

Level = Literal["DEBUG", "INFO", "WARNING", "ERROR", "CRITICAL"]
LEVELS: dict[Level, int] = {"DEBUG": 10, "INFO": 20, "WARNING": 30, "ERROR": 40, "CRITICAL": 50}
Format = Callable[[Level, str, str], str]


class Writers(NamedTuple):
    """A thread each, since a screen can stand still."""

    screen: SinkWriter
    files: SinkWriter


class LaunchLog:
    """Sinks of one run. ``directory`` is where launch.log and the processes' own logs are.

    ``limit``: bytes after which a new log file is begun, ``None`` for never.

    :raises RuntimeFailure: a format in ``environment`` that cannot be used.
    """

    def __init__(
        self,
        directory: Path,
        screen: ScreenSink,
        writers: Writers,
        environment: Mapping[str, str],
        debug: bool = False,
        limit: int | None = None,
    ) -> None:
        self.directory = directory
        self.screen: Sink = screen
        self._limit = limit
        self._writers = writers
        self._shows_less = False
        self._not_shown = 0  # lines
        self.launch_file = self._file_sink("launch.log")
        self.debug = debug
        self._files: dict[str, FileSink] = {"launch.log": self.launch_file}
        self._on_screen = _format_from(environment, "OVERRIDE_LAUNCH_SCREEN_FORMAT", _plain)
        self._in_file = _format_from(environment, "OVERRIDE_LAUNCH_LOG_FORMAT", _with_time)

    def log(self, level: Level, name: str, message: str) -> None:
        if LEVELS[level] < LEVELS["INFO"] and not self.debug:
            return
        for sink, render in ((self.screen, self._on_screen), (self.launch_file, self._in_file)):
            line = render(level, printable(name), printable_lines(message))
            self.write(sink, (line + "\n").encode(errors="replace"), logged=True)

    def write(self, sink: Sink, lines: bytes, *, logged: bool) -> None:
        """Queue whole lines. ``logged``: a file gets them too, so a screen that cannot follow may do without."""
        if sink is not self.screen:
            self._writers.files.write(sink, lines)
        elif self._shows_less and logged:
            self._not_shown += lines.count(b"\n")
        else:
            self._writers.screen.write(sink, lines)

    def show_less(self, less: bool) -> None:
        """Give the screen only what goes nowhere else from now on; or everything again, and how much it lacks."""
        self._shows_less = less
        if not less and self._not_shown:
            missing, self._not_shown = self._not_shown, 0
            self.log(
                "WARNING",
                "launch",
                f"{counted(missing, 'line')} not shown, the screen was too slow; the logs have all",
            )

    def file(self, name: str) -> FileSink:
        """Return the sink for ``name`` in the log directory; slashes (of a fully qualified node name) become ``_``."""
        name = name.replace("/", "_")
        if name not in self._files:
            self._files[name] = self._file_sink(name)
        return self._files[name]

    def _file_sink(self, name: str) -> FileSink:
        return FileSink(self.directory / name, self._report_on_screen, self._limit)

    def _report_on_screen(self, text: str) -> None:
        self._writers.screen.write(self.screen, (self._on_screen("ERROR", "launch", text) + "\n").encode())

    def close(self) -> None:
        self.show_less(False)
        self._writers.files.close()
        self._writers.screen.close()
        for sink in self._files.values():
            sink.close()


@contextmanager
def captured_logging(log: LaunchLog, ours: Callable[[], bool] = lambda: True) -> Iterator[None]:
    """Send what launch files and launch's own actions log to where the launch's own lines go, within the block.

    That is ``launch.logging.get_logger`` and Python's ``logging``, as far as it is ``ours`` and not another launch's.
    """

    class Forward(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            if ours():
                level: Level = next(
                    (name for name in reversed(LEVELS) if record.levelno >= LEVELS[name]), "DEBUG"
                )
                log.log(level, record.name, record.getMessage())

    root, handler = logging.getLogger(), Forward()
    with _talkative():
        if log.debug:
            root.setLevel(logging.DEBUG)
        root.addHandler(handler)
        try:
            yield
        finally:
            root.removeHandler(handler)


@contextmanager
def _root_level() -> Iterator[None]:
    root = logging.getLogger()
    before = root.level
    root.setLevel(logging.INFO)
    try:
        yield
    finally:
        root.setLevel(before)


_talkative = Overlap(_root_level)


def _plain(level: Level, name: str, message: str) -> str:
    return f"[{level}] [{name}]: {message}"


def _with_time(level: Level, name: str, message: str) -> str:
    return f"{time.time():.7f} [{level}] [{name}]: {message}"


def _format_from(environment: Mapping[str, str], variable: str, default: Format) -> Format:
    """Return the line format that ``variable`` selects: a ``{``-style format over the attributes of a
    ``logging.LogRecord``, or one of launch's two aliases."""
    override = environment.get(variable)
    if not override or override == "default":
        return default
    if override == "default_with_timestamp":
        return _with_time
    try:
        render = _format_of_records(override)
        render("INFO", "launch", "tried before it is needed")
    except (ValueError, AttributeError, TypeError) as error:
        raise RuntimeFailure(
            f"{variable}={override!r} cannot be used: {error}; it is a format over the fields of a log record, "
            "such as '[{levelname}] [{name}]: {message}'"
        ) from error
    return render


def _format_of_records(text: str) -> Format:
    formatter = logging.Formatter(text.encode("latin1", "replace").decode("unicode_escape"), style="{")

    def render(level: Level, name: str, message: str) -> str:
        return formatter.format(logging.LogRecord(name, LEVELS[level], "", 0, message, None, None))

    return render


def make_log_directory(base: Path, now: datetime, host: str, pid: int) -> Path:
    """Create ``<date>-<host>-<pid>`` and point the link ``latest`` there; raises RuntimeFailure."""
    directory = base / f"{now.strftime('%Y-%m-%d-%H-%M-%S-%f')}-{host}-{pid}"
    try:
        directory.mkdir(parents=True)
    except OSError as error:
        raise RuntimeFailure(
            f"cannot create the log directory {directory}: {error.strerror}; "
            "set ROS_LOG_DIR to a directory that can be written"
        ) from error
    _renew_latest(base / "latest", directory)
    return directory


def _renew_latest(link: Path, directory: Path) -> None:
    """Replace the link atomically, because other launches do the same; keep a file that is not a link."""
    if link.exists() and not link.is_symlink():
        return
    fresh = link.with_name(f".latest-{os.getpid()}")
    try:
        fresh.symlink_to(directory, target_is_directory=True)
        fresh.replace(link)
    except OSError:
        fresh.unlink(missing_ok=True)


PATIENCE = 5.0  # seconds


class BackPressure:
    """Decides who waits if lines come faster than they can be written. Call ``attach`` before anything is written.

    Streams that go to a file wait for the files, streams that go to the screen for the screen; but one that stays full
    for ``PATIENCE`` seconds (Ctrl-S, a slow link) holds up only the streams that go nowhere else. The others go on into
    their logs, and the screen shows how many lines it lacks.
    """

    def __init__(self, tree: ProcessTree) -> None:
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
