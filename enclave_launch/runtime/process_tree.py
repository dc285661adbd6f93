"""All processes of one launch: spawned, signalled and awaited through the warden, in one asyncio loop."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import os
import signal
import termios
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from types import MappingProxyType
from typing import Literal, NamedTuple

from enclave_launch.errors import RuntimeFailure
from enclave_launch.runtime.survivors import Survivors
from enclave_launch.runtime.warden_process import Message, WardenChannel, WardenProcess

Stream = Literal["stdout", "stderr"]
Hold = Literal["files", "screen", "screen only"]  # why a stream may have to wait (BackPressure)
OnOutput = Callable[[Stream, bytes], None]

NO_HOLDS: Mapping[Stream, frozenset[Hold]] = MappingProxyType({})
CHUNK = 1 << 16  # bytes; what a Linux pipe holds by default


class ProcessSpec(NamedTuple):
    """A program to execute. ``environment`` is complete: nothing is inherited. ``shell``: the words, joined, are a
    shell's command line.
    """

    cmd: tuple[str, ...]
    environment: Mapping[str, str]
    cwd: str | None = None
    shell: bool = False
    emulate_tty: bool = False

    @property
    def argv(self) -> tuple[str, ...]:
        return ("/bin/sh", "-c", " ".join(self.cmd)) if self.shell else self.cmd

    def encoded(self) -> tuple[list[bytes], dict[bytes, bytes], bytes]:
        """Encode command line, environment and working directory for the kernel; raises OSError (EINVAL)."""
        environment = {}
        for name, value in self.environment.items():
            if not name or "=" in name:
                raise OSError(errno.EINVAL, "the name of an environment variable is empty or holds '='", name)
            encoded = _encoded(name, "an environment variable's name")
            environment[encoded] = _encoded(value, f"environment variable {name}")
        words = [_encoded(word, f"argument {number}") for number, word in enumerate(self.argv)]
        return words, environment, _encoded(self.cwd or os.getcwd(), "the working directory")


def _encoded(text: str, what: str) -> bytes:
    if "\0" in text:
        raise OSError(errno.EINVAL, f"{what} holds a NUL character", text)
    try:
        return os.fsencode(text)
    except UnicodeEncodeError as error:
        reason = f"{what} does not fit the locale's encoding ({error.encoding}); set LC_ALL to a UTF-8 locale"
        raise OSError(errno.EINVAL, reason, text) from None


class OutputPump:
    """Reads one stream of a child whenever there is something, unless paused; ``closed`` at its end.

    ``waits_for``: the holds that pause it.
    """

    def __init__(
        self,
        descriptor: int,
        receive: Callable[[bytes], None],
        loop: asyncio.AbstractEventLoop,
        waits_for: frozenset[Hold] = frozenset(),
    ) -> None:
        self.waits_for = waits_for
        os.set_blocking(descriptor, False)
        self._descriptor = descriptor
        self._receive = receive
        self._loop = loop
        self._reading = False
        self.closed = False

    def resume(self) -> None:
        if not self.closed and not self._reading:
            self._loop.add_reader(self._descriptor, self._read)
            self._reading = True

    def pause(self) -> None:
        if self._reading:
            self._loop.remove_reader(self._descriptor)
            self._reading = False

    def drain(self) -> None:
        """Take all that the kernel holds by now. A pipe's content is bounded, so this ends."""
        for _ in range(64):
            if self.closed or not self._read():
                return

    def close(self) -> None:
        self.pause()
        if not self.closed:
            self.closed = True
            os.close(self._descriptor)

    def _read(self) -> bool:
        try:
            data = os.read(self._descriptor, CHUNK)
        except BlockingIOError:
            return False
        except OSError as error:
            if error.errno != errno.EIO:  # a pseudo terminal whose last user is gone
                raise
            data = b""
        if data:
            self._receive(data)
        else:
            self.close()
        return bool(data)


class Child:
    """One started process. ``returncode`` is negative for a signal, as in ``subprocess``."""

    def __init__(self, tree: ProcessTree, identifier: int, stdin: int, pumps: tuple[OutputPump, ...]) -> None:
        loop = asyncio.get_running_loop()
        self._tree = tree
        self.identifier = identifier
        self._stdin = stdin
        self.pumps = pumps
        self.started: asyncio.Future[int] = loop.create_future()
        self.exited: asyncio.Future[int] = loop.create_future()

    @property
    def pid(self) -> int:
        return self.started.result()

    @property
    def running(self) -> bool:
        return self.started.done() and not self.exited.done()

    def signal(self, number: int, *, whole_group: bool = True) -> None:
        """Signal its whole process group, or it alone. Nothing happens once the process has ended."""
        if self.running:
            self._tree.send("signal" if whole_group else "signal_one", self.identifier, int(number))

    def write_stdin(self, data: bytes) -> None:
        """Write as much as the pipe takes: a process that does not read its stdin must not block the launch."""
        if self._stdin >= 0:
            with contextlib.suppress(BlockingIOError, BrokenPipeError):
                os.write(self._stdin, data)

    async def wait(self) -> int:
        """Wait for the process and all output it wrote; return its exit status."""
        status = await asyncio.shield(self.exited)
        for pump in self.pumps:
            pump.drain()
        return status

    def sweep(self) -> None:
        """Kill what the ended process left running, so that a successor finds its devices free."""
        self._tree.send("sweep", self.identifier, self.pid)

    def retire(self) -> None:
        """Release the streams of an exited process, but those that its descendants still write to."""
        if all(pump.closed for pump in self.pumps):
            self.release()
        else:
            self._close_stdin()

    def release(self) -> None:
        """Close our ends of its streams; the tree forgets it."""
        self._tree.forget(self.identifier)
        for pump in self.pumps:
            pump.close()
        self._close_stdin()

    def _close_stdin(self) -> None:
        if self._stdin >= 0:
            os.close(self._stdin)
            self._stdin = -1


class ProcessTree:
    """Use as an async context manager: leaving it ends everything that is still running."""

    def __init__(self, warden: WardenProcess | None = None) -> None:
        started = warden or WardenProcess()
        self._process = started.process
        self._survivors = Survivors(started.process.pid)
        self._channel = WardenChannel(started.connection, self._on_message, self._on_lost)
        self._children: dict[int, Child] = {}
        self._count = 0
        self._holds: set[Hold] = set()
        self.lost: asyncio.Future[None] | None = None
        # Ctrl-C, given to the child that had the terminal
        self.on_interrupt: Callable[[], None] = lambda: None

    async def __aenter__(self) -> ProcessTree:
        self.lost = asyncio.get_running_loop().create_future()
        self._channel.open()
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    @property
    def warden_pid(self) -> int:
        return self._process.pid

    async def spawn(
        self, spec: ProcessSpec, on_output: OnOutput, waits_for: Mapping[Stream, frozenset[Hold]] = NO_HOLDS
    ) -> Child:
        """Start a process; returns once it has been executed. Raises OSError as ``exec`` and ``encoded`` do."""
        loop = asyncio.get_running_loop()
        argv, environment, cwd = spec.encoded()
        stdin, stdin_ours, opened = _open_streams(spec.emulate_tty)
        names: tuple[Stream, Stream] = ("stdout", "stderr")
        pumps = tuple(
            OutputPump(ours, partial(on_output, name), loop, waits_for.get(name, frozenset()))
            for name, (ours, _) in zip(names, opened, strict=True)
        )
        self._count += 1
        child = Child(self, self._count, stdin_ours, pumps)
        self._children[self._count] = child
        theirs = [stdin, *(descriptor for _, descriptor in opened)]
        self.send("spawn", self._count, argv, environment, cwd, descriptors=theirs)
        try:
            await asyncio.shield(child.started)
        except BaseException:  # cancelled: whatever may have started has no owner
            self.send("signal", child.identifier, int(signal.SIGKILL))
            child.release()
            raise
        for pump in pumps:
            if not pump.waits_for & self._holds:
                pump.resume()
        return child

    def send(self, *message: Message, descriptors: Sequence[int] = ()) -> None:
        self._channel.send(*message, descriptors=descriptors)

    def hold_output(self, hold: Hold) -> None:
        """Read nothing more from streams that wait for it, of present and coming children, until it is released."""
        self._holds.add(hold)
        for child in self._children.values():
            for pump in child.pumps:
                if hold in pump.waits_for:
                    pump.pause()

    def release_output(self, *holds: Hold) -> None:
        self._holds.difference_update(holds)
        for child in self._children.values():
            for pump in child.pumps:
                if child.started.done() and not pump.waits_for & self._holds:
                    pump.resume()

    def forget(self, identifier: int) -> None:
        self._children.pop(identifier, None)

    async def close(self) -> None:
        """End the whole tree; return when nothing of it is left."""
        self._channel.close()
        loop = asyncio.get_running_loop()
        await asyncio.shield(loop.run_in_executor(None, self._process.wait))
        self._survivors.close()
        for child in list(self._children.values()):
            child.release()
            if not child.exited.done():
                child.exited.cancel()

    def _on_message(self, kind: str, identifier: int, rest: list[object]) -> None:
        if kind == "interrupted":
            self.on_interrupt()
        child = self._children.get(identifier)
        if child is None:
            return  # given up in the meantime
        if kind == "started":
            child.started.set_result(int(str(rest[0])))
        elif kind == "failed":
            number, path = int(str(rest[0])), rest[1]
            assert isinstance(path, bytes)
            child.started.set_exception(OSError(number, os.strerror(number), os.fsdecode(path)))
        elif kind == "exited" and not child.exited.done():
            child.exited.set_result(int(str(rest[0])))

    def _on_lost(self) -> None:
        """Kill what is left after the warden was killed: its children died with it, what they had started did not."""
        for child in list(self._children.values()):
            if child.running:
                with contextlib.suppress(ProcessLookupError, PermissionError):
                    os.killpg(child.pid, signal.SIGKILL)
                child.exited.set_result(-signal.SIGKILL)
            elif not child.started.done():
                child.started.set_exception(RuntimeFailure("the warden process was killed"))
        self._survivors.end()
        if self.lost is not None and not self.lost.done():
            self.lost.set_result(None)


def _open_streams(emulate_tty: bool) -> tuple[int, int, list[tuple[int, int]]]:
    """Open the child's end of its standard input and ours, and both ends of its two outputs; all or none."""
    with contextlib.ExitStack() as opened:
        stdin, ours = _closed_with(opened, os.pipe())
        outputs = [_closed_with(opened, _open_output(emulate_tty)) for _ in range(2)]
        opened.pop_all()
    os.set_blocking(ours, False)
    return stdin, ours, outputs


def _closed_with(opened: contextlib.ExitStack, pair: tuple[int, int]) -> tuple[int, int]:
    for descriptor in pair:
        opened.callback(os.close, descriptor)
    return pair


def _open_output(emulate_tty: bool) -> tuple[int, int]:
    if not emulate_tty:
        return os.pipe()
    ours, theirs = os.openpty()
    mode = termios.tcgetattr(theirs)
    mode[1] &= ~termios.OPOST  # lines end as the process wrote them, without a carriage return
    termios.tcsetattr(theirs, termios.TCSANOW, mode)
    return ours, theirs
