"""The warden: a small single-threaded process between the launcher and everything it starts.

Runs as a script of its own (``python -I -S warden.py FD [TERMINAL]``), imports nothing of this project, and talks
over one Unix stream socket, its descriptor ``FD``. Touches the world: forks, executes, signals, reaps.

Why it exists. No orphan may survive the launcher, even when that is killed with SIGKILL and cannot clean up:

* every child is forked by the warden and so dies with it (``PR_SET_PDEATHSIG``, set in a process without
  threads, where running code between fork and exec is safe);
* the warden is a child subreaper (``PR_SET_CHILD_SUBREAPER``): grandchildren that lose their parent, daemons
  included, become its own children and are found and reaped, so there are no zombies either;
* when the launcher's end of the socket closes, for whatever reason, the warden ends the whole tree and then
  itself;
* it is the last process that a kernel short of memory should kill (``oom_score_adj``, where allowed). If it is killed
  all the same, the launcher clears away what it leaves (``survivors``).

Sessions and the terminal. A child leads a session of its own, so that its group can be signalled as a whole. In an
interactive launch (``TERMINAL``, a descriptor of the controlling terminal) it leads a process group in the launcher's
session instead and may use the terminal: when the kernel stops it for reading a password from there (SIGTTIN,
SIGTTOU), the warden makes its group the foreground one, as a shell does for ``fg``, until it ends.

Messages are marshalled tuples behind a four-byte length. ``id`` is the launcher's number for a child.

    launcher -> warden   ("spawn", id, argv, env, cwd)   with three descriptors: stdin, stdout, stderr
                         ("signal", id, number)          to the process group of the child
                         ("signal_one", id, number)      to the child alone
                         ("sweep", id, pid)              SIGKILL to what it left running when it ended
                         ("remove_at_end", 0, folder)    when the launcher is gone: parameter files
    warden -> launcher   ("started", id, pid) | ("failed", id, errno, file) | ("exited", id, returncode)
                         ("interrupted", id)             Ctrl-C was given to the child that had the terminal
"""

from __future__ import annotations

import array
import contextlib
import ctypes
import errno
import fcntl
import marshal
import os
import select
import shutil
import signal
import socket
import struct
import sys
import time
from collections.abc import Callable, Mapping
from typing import Any

HEADER = struct.Struct("!I")
PR_SET_PDEATHSIG = 1  # linux/prctl.h
PR_SET_CHILD_SUBREAPER = 36
IGNORED = (
    *(signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGPIPE),
    *(signal.SIGTTIN, signal.SIGTTOU),  # else handing the terminal over would stop us
)
SAFE_FROM_OOM = -900  # oom_score_adj: -1000 is never, 0 is as everybody
# What Python itself ignores or we ignore above must be default again in a child; nohup's SIGHUP stays
# ignored.
RESTORED = {*IGNORED, signal.SIGXFSZ, signal.SIGCHLD}
# The end of an abandoned tree: ask, insist, kill. Seconds after each signal.
ABANDONED = ((signal.SIGINT, 2.0), (signal.SIGTERM, 2.0), (signal.SIGKILL, 5.0))


def prctl(option: int, value: int) -> None:
    """Call prctl(2). Linux only; elsewhere process groups must do."""
    if LIBC is not None:
        LIBC.prctl(option, value, 0, 0, 0)


def load_libc() -> Any:
    """Return the C library, loaded before the first fork; None on systems without prctl."""
    if not sys.platform.startswith("linux"):
        return None

    return ctypes.CDLL(None)


LIBC: Any = None


class Terminal:
    """The controlling terminal of an interactive launch, lent to one process group at a time."""

    def __init__(self, descriptor: int) -> None:
        self.descriptor = descriptor
        self.owner = os.tcgetpgrp(descriptor)  # the launcher's group
        self.holder = 0
        self.waiting: list[int] = []

    def lend(self, group: int) -> None:
        """Lend it to ``group`` now, or once the present holder has ended."""
        if self.holder not in (0, group):
            self.waiting.append(group)
            return
        self.holder = group
        self._bring_forward(group)
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(group, signal.SIGCONT)

    def ended(self, group: int) -> bool:
        """Give the terminal to the next one if it was the holder's, else the launcher has it back."""
        self.waiting = [other for other in self.waiting if other != group]
        if self.holder != group:
            return False
        self.holder = 0
        if self.waiting:
            self.lend(self.waiting.pop(0))
        else:
            self._bring_forward(self.owner)
        return True

    def _bring_forward(self, group: int) -> None:
        with contextlib.suppress(OSError):  # the terminal is gone
            os.tcsetpgrp(self.descriptor, group)


class Warden:
    """The loop of this process: obeys ``connection``, reaps children, and ends them all when it closes."""

    def __init__(self, connection: socket.socket, terminal: Terminal | None) -> None:
        self.connection = connection
        self.terminal = terminal
        self.buffer = b""
        self.descriptors: list[int] = []
        self.pids: dict[int, int] = {}  # id -> pid, of children that have not been reaped
        self.identifiers: dict[int, int] = {}  # pid -> id
        self.folders: list[str] = []  # removed at the end

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
        """Receive a message; False once the launcher is gone."""
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
            try:
                self.spawn(identifier, rest, streams)
            except OSError as error:  # no more processes or descriptors
                self.send("failed", identifier, error.errno or errno.EAGAIN, rest[0][0])
            finally:
                for descriptor in streams:
                    os.close(descriptor)
        elif kind == "signal":
            self.signal_group(identifier, rest[0])
        elif kind == "signal_one":
            self.signal_one(identifier, rest[0])
        elif kind == "sweep":
            self.sweep(rest[0])
        elif kind == "remove_at_end":
            self.folders.append(rest[0])

    def send(self, *message: str | int | bytes) -> None:
        data = marshal.dumps(message)
        with contextlib.suppress(OSError):  # the launcher is gone: receive() will notice
            self.connection.sendall(HEADER.pack(len(data)) + data)

    def spawn(self, identifier: int, program: list[Any], streams: list[int]) -> None:
        """Start a program: argv, env, cwd."""
        parent = os.getpid()
        report, report_writer = os.pipe()  # close-on-exec: end of file means that exec succeeded
        with open(report, "rb") as reader:
            try:
                pid = os.fork()
                if pid == 0:
                    become(program, streams, report_writer, parent, own_session=self.terminal is None)
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
        """Signal while the leader is not reaped: until then its number cannot belong to anybody else."""
        pid = self.pids.get(identifier)
        if pid is None:
            return
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(pid, number)
        if number == signal.SIGKILL:
            kill_all(descendants(pid), number)

    def signal_one(self, identifier: int, number: int) -> None:
        pid = self.pids.get(identifier)
        if pid is not None:
            kill_all({pid}, number)

    def sweep(self, leader: int) -> None:
        """Send SIGKILL to what a child left running in its session, or group, when it ended."""
        if leader not in self.identifiers:
            belongs = os.getsid if self.terminal is None else os.getpgid
            left = {pid for pid in descendants(os.getpid()) if group_of(belongs, pid) == leader}
            kill_all(left, signal.SIGKILL)

    def reap(self) -> bool:
        """Collect all that ended. False when nothing is left to wait for."""
        while True:
            try:
                pid, status = os.waitpid(-1, os.WNOHANG | (os.WUNTRACED if self.terminal else 0))
            except ChildProcessError:
                return False
            if pid == 0:
                return True
            if os.WIFSTOPPED(status):
                self.on_stopped(pid, os.WSTOPSIG(status))
                continue
            held_terminal = self.terminal is not None and self.terminal.ended(pid)
            identifier = self.identifiers.pop(pid, None)
            if identifier is not None:  # else an orphan of one of our children
                del self.pids[identifier]
                code = os.waitstatus_to_exitcode(status)
                self.send("exited", identifier, code)
                if held_terminal and code == -signal.SIGINT:  # Ctrl-C was meant for the launch, too
                    self.send("interrupted", identifier)

    def on_stopped(self, pid: int, number: int) -> None:
        """Lend the terminal to a child that was stopped for using it; a child stopped for other reasons stays so."""
        if self.terminal is not None and number in (signal.SIGTTIN, signal.SIGTTOU):
            self.terminal.lend(pid)

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


def become(program: list[Any], streams: list[int], report: int, parent: int, *, own_session: bool) -> None:
    """Turn the forked child into the program; on failure write the reason to ``report`` and exit."""
    argv, env, cwd = program
    path = argv[0]
    try:
        if own_session:
            os.setsid()
        else:
            os.setpgid(0, 0)
        set_oom_score(OOM_SCORE)
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
    except ValueError:
        # The launcher looks for what no exec takes; whatever it missed must not pass for a start.
        os.write(report, marshal.dumps((errno.EINVAL, path)))
    finally:
        os._exit(127)


def move_above(streams: list[int]) -> list[int]:
    """Copy any descriptor 0 to 2 that sits there: they are about to be overwritten."""
    return [
        fcntl.fcntl(descriptor, fcntl.F_DUPFD_CLOEXEC, 3) if descriptor < 3 else descriptor
        for descriptor in streams
    ]


def group_of(call: Callable[[int], int], pid: int) -> int:
    """Return ``os.getsid`` or ``os.getpgid`` of ``pid``, -1 if it is gone."""
    try:
        return call(pid)
    except ProcessLookupError:
        return -1


def kill_all(pids: set[int], number: int) -> None:
    """Signal each of ``pids``; what is gone or belongs to others is passed over."""
    for pid in pids:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.kill(pid, number)


def children_by_parent() -> dict[int, set[int]]:
    """Return the pids of all live processes of the machine by the pid of their parent, from /proc."""
    children: dict[int, set[int]] = {}
    for entry in os.listdir("/proc") if proc_is_ours() else ():
        if entry.isdigit():
            with contextlib.suppress(OSError):
                with open(f"/proc/{entry}/stat", "rb") as stat:
                    # "pid (name) state ppid": the name may hold spaces and parentheses
                    fields = stat.read().rpartition(b")")[2].split()
                children.setdefault(int(fields[1]), set()).add(int(entry))
    return children


def proc_is_ours() -> bool:
    """Return whether /proc shows our PID namespace."""
    try:
        return os.readlink("/proc/self") == str(os.getpid())
    except OSError:
        return False


def descendants(root: int, children: Mapping[int, set[int]] | None = None) -> set[int]:
    """Return the pids of all live processes below ``root``."""
    children = children_by_parent() if children is None else children
    found: set[int] = set()
    waiting = [root]
    while waiting:
        below = children.get(waiting.pop(), set())
        found.update(below)
        waiting.extend(below)
    return found


def set_oom_score(score: str) -> None:
    """Set it. Raising one's own score is always allowed, lowering it takes a privilege (proc(5), oom_score_adj)."""
    with contextlib.suppress(OSError), open("/proc/self/oom_score_adj", "w", encoding="ascii") as file:
        file.write(score)


def own_oom_score() -> str:
    """Return ``oom_score_adj`` as this process inherited it, ``0`` if it cannot be read."""
    try:
        with open("/proc/self/oom_score_adj", encoding="ascii") as file:
            return file.read().strip()
    except OSError:
        return "0"


OOM_SCORE = own_oom_score()  # what children get back


def main() -> None:
    """Become a subreaper, take the descriptors of the command line, and serve until the launcher goes."""
    global LIBC
    if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
        RESTORED.discard(signal.SIGHUP)
    for number in IGNORED:
        signal.signal(number, signal.SIG_IGN)
    LIBC = load_libc()
    prctl(PR_SET_CHILD_SUBREAPER, 1)
    if int(OOM_SCORE) > SAFE_FROM_OOM:
        set_oom_score(str(SAFE_FROM_OOM))
    connection = socket.socket(fileno=int(sys.argv[1]))
    connection.set_inheritable(False)
    terminal = None
    if len(sys.argv) > 2:
        os.setpgid(0, 0)
        os.set_inheritable(int(sys.argv[2]), False)
        terminal = Terminal(int(sys.argv[2]))
    warden = Warden(connection, terminal)
    try:
        warden.run()
    finally:
        warden.end_everything()
        for folder in warden.folders:
            shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
