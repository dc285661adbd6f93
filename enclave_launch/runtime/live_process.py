"""One process action of a live run: what happens to the process becomes launch events, and these become calls on it."""

from __future__ import annotations

import time
from collections.abc import Awaitable, Callable, Iterable, Mapping, Sequence
from signal import Signals
from typing import Any

from enclave_common.terminal import printable
from enclave_launch.description.actions.processes import ExecuteLocal
from enclave_launch.description.conditions import evaluate_condition_expression
from enclave_launch.description.events.event import (
    ProcessExited,
    ProcessStarted,
    ProcessStderr,
    ProcessStdin,
    ProcessStdout,
    ProcessTargetedEvent,
    Shutdown,
    ShutdownProcess,
    SignalProcess,
)
from enclave_launch.description.events.handlers import EventHandler, OnShutdown
from enclave_launch.description.launch_context import LaunchContext
from enclave_launch.description.substitution import normalize_to_list_of_substitutions, perform_substitutions
from enclave_launch.process import ResolvedProcess
from enclave_launch.ros_rules.output import Routes
from enclave_launch.runtime import run_events
from enclave_launch.runtime.launch_log import LaunchLog, Level
from enclave_launch.runtime.process_tree import Hold, ProcessSpec, ProcessTree, Stream
from enclave_launch.runtime.run_events import Observer
from enclave_launch.runtime.sinks import Sink
from enclave_launch.runtime.supervision import LifeRules, Patience, ProcessEnd, SupervisedProcess


class LiveProcess:
    """One process action of a live launch.

    :raises ValueError: an output setting, ``emulate_tty`` value or ``output_format`` that launch cannot use.
    """

    def __init__(
        self,
        action: ExecuteLocal,
        process: ResolvedProcess,
        context: LaunchContext,
        tree: ProcessTree,
        log: LaunchLog,
        prepare: Callable[[bool], Awaitable[ProcessSpec]],
        observe: Observer,
    ) -> None:
        self.process = process
        self._observe = observe
        self._action = action
        self._context = context
        self._log = log
        self._details: dict[str, Any] = action.process_details or {}
        self._router = OutputRouter(log, process.process_name, action.final_routes, _line_renderer(action))
        emulate_tty = _emulate_tty(action, context)
        self._supervised = SupervisedProcess(
            process.process_name,
            lambda: prepare(emulate_tty),
            tree,
            LifeRules(bool(action.respawn), action.respawn_delay or 0.0, action.respawn_max_retries),
            self,
            self._say,
        )
        self._registered = self._handlers()
        for handler in self._registered:
            context.register_event_handler(handler)

    async def run(self) -> ProcessEnd:
        """Run to its last exit; afterwards no handler of it is left, however often a launch starts something new."""
        try:
            return await self._run()
        finally:
            for handler in self._registered:
                self._context.unregister_event_handler(handler)

    async def _run(self) -> ProcessEnd:
        if self._action.log_cmd:
            command = " ".join(word for word in self.process.cmd if word.strip())
            self._say("INFO", f"process details: cmd='{command}', cwd='{self.process.cwd}', custom_env?=True")
        return await self._supervised.run()

    @property
    def pid(self) -> int | None:
        """Return the pid of the running incarnation, if any."""
        child = self._supervised.child
        return child.pid if child is not None and child.running else None

    def interrupt_again(self) -> None:
        """Pass on another Ctrl-C, as a terminal would."""
        self._supervised.signal(Signals.SIGINT, quiet=True)

    # Watcher

    @property
    def waits_for(self) -> Mapping[Stream, frozenset[Hold]]:
        return self._router.waits_for

    def on_started(self, pid: int) -> None:
        self._details["pid"] = pid
        self._observe(run_events.ProcessStarted(self.process.process_name, pid))
        self._context.emit_event_sync(ProcessStarted(**self._details))

    def on_output(self, stream: Stream, data: bytes) -> None:
        self._router.feed(stream, data)
        self._observe(run_events.ProcessOutput(self.process.process_name, stream, data))
        if self._action.cached_output:
            self._action.captured_output[stream == "stderr"].append(data.decode(errors="replace"))
        event = (ProcessStdout if stream == "stdout" else ProcessStderr)(text=data, **self._details)
        if self._context.would_handle_event(event):
            self._context.emit_event_sync(event)

    def on_exited(self, pid: int, returncode: int) -> None:
        self._router.flush()
        self._action.final_return_code = returncode
        self._observe(run_events.ProcessExited(self.process.process_name, pid, returncode))
        self._context.emit_event_sync(ProcessExited(returncode=returncode, **self._details))

    # Events to it

    def _handlers(self) -> list[Any]:
        def addressed(cls: type[ProcessTargetedEvent]) -> Callable[[Any], bool]:
            return lambda event: isinstance(event, cls) and event.process_matcher(self._action)

        return [
            CalledAtEvent(ShutdownProcess, addressed(ShutdownProcess), lambda _: self._end(quiet=False)),
            CalledAtEvent(SignalProcess, addressed(SignalProcess), self._on_signal),
            CalledAtEvent(ProcessStdin, lambda event: event.action is self._action, self._on_stdin),
            OnShutdown(on_shutdown=self._on_shutdown),
        ]

    def _on_signal(self, event: Any) -> None:
        self._supervised.signal(Signals[event.signal_name], whole_group=False)

    def _on_stdin(self, event: Any) -> None:
        child = self._supervised.child
        if child is not None:
            child.write_stdin(event.text)

    def _on_shutdown(self, event: Shutdown, context: LaunchContext) -> None:
        self._end(quiet=event.due_to_sigint and not context.noninteractive)

    def _end(self, *, quiet: bool) -> None:
        patience = Patience(
            self._seconds(self._action.sigterm_timeout), self._seconds(self._action.sigkill_timeout)
        )
        self._supervised.end(patience, quiet=quiet)

    def _seconds(self, substitutions: Any) -> float:
        return float(perform_substitutions(self._context, substitutions))

    def _say(self, level: Level, message: str) -> None:
        self._log.log(level, self.process.process_name, message)


class CalledAtEvent(EventHandler):
    """Calls a function at an event; there is nothing to visit."""

    def __init__(self, cls: type, matcher: Callable[[Any], bool], react: Callable[[Any], None]) -> None:
        super().__init__(matcher=matcher)
        self.event_class = cls
        self._react = react

    def handle(self, event: Any, context: LaunchContext) -> None:
        super().handle(event, context)
        self._react(event)


def _emulate_tty(action: ExecuteLocal, context: LaunchContext) -> bool:
    if "emulate_tty" not in context.launch_configurations:
        return bool(action.emulate_tty)
    text = context.launch_configurations["emulate_tty"]
    return evaluate_condition_expression(context, normalize_to_list_of_substitutions(text))


def _line_renderer(action: ExecuteLocal) -> Callable[[str], str] | None:
    # The format is tried once here, so that no output is lost to a format error later.
    output_format = action.output_format
    if output_format == DEFAULT_FORMAT:
        return None
    try:
        output_format.format(line="", this=action)
    except (LookupError, ValueError, AttributeError, TypeError) as error:
        reason = f"{type(error).__name__}: {error}"
        raise ValueError(
            f"output_format {output_format!r} cannot be used ({reason}); it may name {{line}} and {{this}}"
        ) from error
    return lambda line: output_format.format(line=line, this=action)


DEFAULT_FORMAT = "[{this.process_description.final_name}] {line}"
LONGEST_LINE = 1 << 20  # bytes that wait for a line end


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

    Rules of launch/logging/__init__.py (``get_output_loggers``) and launch/actions/execute_local.py. Lines are rendered
    by the chunk: tens of megabytes a second pass without a Python loop over lines.

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
