"""Route each stream of a process to its sinks, and render its lines there. Performs no I/O of its own.

Rules of launch/logging/__init__.py (``get_output_loggers``) and launch/actions/execute_local.py. Lines are
rendered by the chunk, not one by one: tens of megabytes a second pass without a Python loop over lines.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence

from enclave_common.terminal import printable
from enclave_launch.ros_rules.output import Routes
from enclave_launch.runtime.launch_log import LaunchLog
from enclave_launch.runtime.process_tree import Hold, Stream
from enclave_launch.runtime.sinks import Sink

DEFAULT_FORMAT = "[{this.process_description.final_name}] {line}"
LONGEST_LINE = 1 << 20  # bytes kept waiting for a line end


class LineBuffer:
    """Cuts a byte stream into runs of complete lines."""

    def __init__(self) -> None:
        self._rest: list[bytes] = []
        self._length = 0

    def feed(self, data: bytes) -> bytes:
        """Return the complete lines that ``data`` finishes, each with its line end; empty if there is none yet."""
        cut = data.rfind(b"\n") + 1
        if not cut and self._length + len(data) < LONGEST_LINE:
            self._rest.append(data)
            self._length += len(data)
            return b""
        lines = b"".join((*self._rest, data[:cut])) if cut else b"".join((*self._rest, data, b"\n"))
        remainder = data[cut:] if cut else b""
        self._rest, self._length = [remainder], len(remainder)
        return lines

    def flush(self) -> bytes:
        """Return the unfinished rest as a line."""
        rest = b"".join(self._rest)
        self._rest, self._length = [], 0
        return rest + b"\n" if rest else b""


class OutputRouter:
    """Takes the output of one process, every incarnation of it, to its sinks.

    ``render_line`` turns one line into what is shown, for a custom ``output_format``; None is launch's
    default, the process name in brackets.
    """

    def __init__(
        self, log: LaunchLog, name: str, routes: Routes, render_line: Callable[[str], str] | None = None
    ) -> None:
        self._log = log
        self._prefix = f"[{printable(name)}] ".encode()
        self._render_line = render_line
        self._buffers: dict[Stream, LineBuffer] = {"stdout": LineBuffer(), "stderr": LineBuffer()}
        self._sinks = {stream: tuple(_sinks_of(log, name, stream, routes)) for stream in self._buffers}

    @property
    def waits_for(self) -> Mapping[Stream, frozenset[Hold]]:
        """Return what may pause each stream: a full queue of the files, or of the screen."""
        return {
            stream: _holds(self._log, [sink for sink, _ in sinks]) for stream, sinks in self._sinks.items()
        }

    def feed(self, stream: Stream, data: bytes) -> None:
        self._emit(stream, self._buffers[stream].feed(data))

    def flush(self) -> None:
        """Pass on, at the end of a process, a last line without a line end."""
        for stream, buffer in self._buffers.items():
            self._emit(stream, buffer.flush())

    def _emit(self, stream: Stream, lines: bytes) -> None:
        if not lines:
            return
        if not lines.isascii():
            lines = lines.decode(errors="replace").encode()
        for sink, timed in self._sinks[stream]:
            text = self._render(lines, f"{time.time():.7f} " if timed else "")
            self._log.write(sink, text, logged=len(self._sinks[stream]) > 1)

    def _render(self, lines: bytes, time_stamp: str) -> bytes:
        if self._render_line is None:
            return prefixed(lines, time_stamp.encode() + self._prefix)
        rendered = (self._render_line(line) for line in lines[:-1].decode().split("\n"))
        return "".join(f"{time_stamp}{line}\n" for line in rendered).encode(errors="replace")


def prefixed(lines: bytes, prefix: bytes) -> bytes:
    """Put ``prefix`` before each of ``lines``, whose last one ends with a line end."""
    return prefix + lines[:-1].replace(b"\n", b"\n" + prefix) + b"\n"


def _holds(log: LaunchLog, sinks: Sequence[Sink]) -> frozenset[Hold]:
    if log.screen not in sinks:
        return frozenset({"files"} if sinks else set())
    return frozenset({"screen", "screen only"}) if len(sinks) == 1 else frozenset({"screen", "files"})


def _sinks_of(log: LaunchLog, name: str, stream: Stream, routes: Routes) -> Iterable[tuple[Sink, bool]]:
    wanted = routes["both"] | routes[stream]
    if "screen" in wanted:
        yield log.screen, False
    if "log" in wanted:
        yield log.launch_file, True
    if "own_log" in routes[stream]:
        yield log.file(f"{name}-{stream}.log"), False
    if "own_log" in routes["both"]:
        yield log.file(f"{name}.log"), False
