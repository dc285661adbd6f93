"""The warden: a small single-threaded process between the launcher and everything it starts.

Runs as a script of its own (``python -I -S warden.py FD``), imports nothing of this project, and talks over
one Unix stream socket, its descriptor ``FD``. Touches the world: forks, executes, signals, reaps.

Why it exists. No orphan may survive the launcher, even when that is killed with SIGKILL and cannot clean up:

* every child is forked by the warden and so dies with it (``PR_SET_PDEATHSIG``, set in a process without
  threads, where running code between fork and exec is safe);
* the warden is a child subreaper (``PR_SET_CHILD_SUBREAPER``): grandchildren that lose their parent, daemons
  included, become its own children and are found and reaped, so there are no zombies either;
* when the launcher's end of the socket closes, for whatever reason, the warden ends the whole tree and then
  itself.

Messages are marshalled tuples behind a four-byte length. ``id`` is the launcher's number for a child.

    launcher -> warden   ("spawn", id, argv, env, cwd)   with three descriptors: stdin, stdout, stderr
                         ("signal", id, number)          to the process group of the child
                         ("sweep", id, pid)              SIGKILL to what it left running when it ended
    warden -> launcher   ("started", id, pid) | ("failed", id, errno, file) | ("exited", id, returncode)
"""

from __future__ import annotations

import array
import contextlib
import errno
import fcntl
import marshal
import os
import select
import signal
import socket
import struct
import sys
import time

TYPE_CHECKING = False  # ``typing`` costs start-up time and is not needed to run
if TYPE_CHECKING:
    from typing import Any

HEADER = struct.Struct("!I")
PR_SET_PDEATHSIG = 1  # linux/prctl.h
PR_SET_CHILD_SUBREAPER = 36
IGNORED = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGPIPE)
# What Python itself ignores or we ignore above must be default again in a child; nohup's SIGHUP stays
# ignored.
RESTORED = {*IGNORED, signal.SIGXFSZ, signal.SIGCHLD}
# The end of an abandoned tree: ask, insist, kill. Seconds after each signal.
ABANDONED = ((signal.SIGINT, 2.0), (signal.SIGTERM, 2.0), (signal.SIGKILL, 5.0))


def prctl(option: int, value: int) -> None:
    """Linux only; elsewhere process groups must do."""
    if LIBC is not None:
        LIBC.prctl(option, value, 0, 0, 0)


def load_libc() -> Any:
    """A ``ctypes.CDLL``, before the first fork; None where there is no prctl."""
    if not sys.platform.startswith("linux"):
        return None
    import ctypes

    return ctypes.CDLL(None)


LIBC: Any = None


class Warden:
    def __init__(self, connection: socket.socket) -> None:
        self.connection = connection
        self.buffer = b""
        self.descriptors: list[int] = []
        self.pids: dict[int, int] = {}  # id -> pid, of children that have not been reaped
        self.identifiers: dict[int, int] = {}  # pid -> id

    def run(self) -> None:
        wakeup, wakeup_writer = os.pipe()
        os.set_blocking(wakeup, False)
        os.set_blocking(wakeup_writer, False)
        signal.set_wakeup_fd(wakeup_writer, warn_on_full_buffer=False)
        signal.signal(signal.SIGCHLD, lambda *_: None)
        poller = select.poll()
        poller.register(self.connection, select.POLLIN)
        poller.register(wakeup, select.POLLIN)
        while True:
            ready = {descriptor for descriptor, _ in poller.poll()}
            if wakeup in ready:
                with contextlib.suppress(BlockingIOError):
                    os.read(wakeup, 4096)
            self.reap()
            if self.connection.fileno() in ready and not self.receive():
                return

    def receive(self) -> bool:
        """False once the launcher is gone."""
        space = socket.CMSG_SPACE(16 * array.array("i").itemsize)
        try:
            data, ancillary, _, _ = self.connection.recvmsg(1 << 16, space, socket.MSG_CMSG_CLOEXEC)
        except ConnectionError:
            return False
        for level, kind, payload in ancillary:
            if level == socket.SOL_SOCKET and kind == socket.SCM_RIGHTS:
                received = array.array("i")
                received.frombytes(payload[: len(payload) - len(payload) % received.itemsize])
                self.descriptors.extend(received)
        self.buffer += data
        while (message := self.next_message()) is not None:
            self.handle(message)
        return bool(data)

    def next_message(self) -> tuple[Any, ...] | None:
        if len(self.buffer) < HEADER.size:
            return None
        end = HEADER.size + HEADER.unpack_from(self.buffer)[0]
        if len(self.buffer) < end:
            return None
        message: tuple[Any, ...] = marshal.loads(self.buffer[HEADER.size : end])
        self.buffer = self.buffer[end:]
        return message

    def handle(self, message: tuple[Any, ...]) -> None:
        kind, identifier, *rest = message
        if kind == "spawn":
            streams, self.descriptors = self.descriptors[:3], self.descriptors[3:]
            argv, env, cwd = rest
            try:
                self.spawn(identifier, argv, env, cwd, streams)
            except OSError as error:  # no more processes or descriptors
                self.send("failed", identifier, error.errno or errno.EAGAIN, argv[0])
            finally:
                for descriptor in streams:
                    os.close(descriptor)
        elif kind == "signal":
            self.signal_group(identifier, rest[0])
        elif kind == "sweep":
            self.sweep(rest[0])

    def send(self, *message: str | int | bytes) -> None:
        data = marshal.dumps(message)
        with contextlib.suppress(OSError):  # the launcher is gone: receive() will notice
            self.connection.sendall(HEADER.pack(len(data)) + data)

    def spawn(
        self, identifier: int, argv: list[bytes], env: dict[bytes, bytes], cwd: bytes, streams: list[int]
    ) -> None:
        parent = os.getpid()
        report, report_writer = os.pipe()  # close-on-exec: end of file means that exec succeeded
        with open(report, "rb") as reader:
            try:
                pid = os.fork()
                if pid == 0:
                    become(argv, env, cwd, streams, report_writer, parent)
            finally:
                os.close(report_writer)
            failure = reader.read()
        if failure:
            os.waitpid(pid, 0)
            number, path = marshal.loads(failure)
            self.send("failed", identifier, number, path)
            return
        self.pids[identifier], self.identifiers[pid] = pid, identifier
        self.send("started", identifier, pid)

    def signal_group(self, identifier: int, number: int) -> None:
        """Only while the leader is not reaped: until then its number cannot belong to anybody else."""
        pid = self.pids.get(identifier)
        if pid is None:
            return
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(pid, number)
        if number == signal.SIGKILL:
            kill_all(descendants(pid), number)

    def sweep(self, session: int) -> None:
        """SIGKILL to what a child left running in its session when it ended."""
        if session not in self.identifiers:
            kill_all({pid for pid in descendants(os.getpid()) if session_of(pid) == session}, signal.SIGKILL)

    def reap(self) -> bool:
        """Collect all that ended. False when nothing is left to wait for."""
        while True:
            try:
                pid, status = os.waitpid(-1, os.WNOHANG)
            except ChildProcessError:
                return False
            if pid == 0:
                return True
            identifier = self.identifiers.pop(pid, None)
            if identifier is not None:  # else an orphan of one of our children
                del self.pids[identifier]
                self.send("exited", identifier, os.waitstatus_to_exitcode(status))

    def end_everything(self) -> None:
        # What children left behind when they ended has no use for SIGINT, and shells make it ignore that.
        for number, grace in ABANDONED if self.identifiers else ABANDONED[1:]:
            deadline = time.monotonic() + grace
            self.signal_tree(number)
            while time.monotonic() < deadline:
                if not self.reap():
                    return
                time.sleep(0.005)
                if number == signal.SIGKILL:
                    self.signal_tree(number)  # what was forked meanwhile

    def signal_tree(self, number: int) -> None:
        tree = descendants(os.getpid())
        kill_all(tree, number)
        if not tree:  # no /proc: process groups must do
            for pid in self.identifiers:
                with contextlib.suppress(ProcessLookupError, PermissionError):
                    os.killpg(pid, number)


def become(
    argv: list[bytes], env: dict[bytes, bytes], cwd: bytes, streams: list[int], report: int, parent: int
) -> None:
    """In the forked child: turn into the program; on failure tell why through ``report`` and end."""
    path = argv[0]
    try:
        os.setsid()
        prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:  # the warden died before the line above took effect
            os._exit(1)
        for target, descriptor in enumerate(move_above(streams)):
            os.dup2(descriptor, target)
        signal.set_wakeup_fd(-1)
        for number in RESTORED:
            signal.signal(number, signal.SIG_DFL)
        path = cwd
        os.chdir(cwd)
        path = argv[0]
        os.execvpe(argv[0], argv, env)
    except OSError as error:
        os.write(report, marshal.dumps((error.errno or errno.EIO, path)))
    finally:
        os._exit(127)


def move_above(streams: list[int]) -> list[int]:
    """Descriptors 0 to 2 are about to be overwritten: copy any that sit there."""
    return [
        fcntl.fcntl(descriptor, fcntl.F_DUPFD_CLOEXEC, 3) if descriptor < 3 else descriptor
        for descriptor in streams
    ]


def session_of(pid: int) -> int:
    try:
        return os.getsid(pid)
    except ProcessLookupError:
        return -1


def kill_all(pids: set[int], number: int) -> None:
    for pid in pids:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.kill(pid, number)


def descendants(root: int) -> set[int]:
    """All live processes below ``root``, from /proc; empty where there is none."""
    children: dict[int, list[int]] = {}
    try:
        entries = os.listdir("/proc")
    except OSError:
        return set()
    for entry in entries:
        if entry.isdigit():
            with contextlib.suppress(OSError):
                with open(f"/proc/{entry}/stat", "rb") as stat:
                    # "pid (name) state ppid": the name may hold spaces and parentheses
                    fields = stat.read().rpartition(b")")[2].split()
                children.setdefault(int(fields[1]), []).append(int(entry))
    found: set[int] = set()
    waiting = [root]
    while waiting:
        below = children.get(waiting.pop(), [])
        found.update(below)
        waiting.extend(below)
    return found


def main() -> None:
    global LIBC
    if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
        RESTORED.discard(signal.SIGHUP)
    for number in IGNORED:
        signal.signal(number, signal.SIG_IGN)
    LIBC = load_libc()
    prctl(PR_SET_CHILD_SUBREAPER, 1)
    connection = socket.socket(fileno=int(sys.argv[1]))
    connection.set_inheritable(False)
    warden = Warden(connection)
    try:
        warden.run()
    finally:
        warden.end_everything()


if __name__ == "__main__":
    main()
