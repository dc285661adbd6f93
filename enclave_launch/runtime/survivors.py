"""Find and end the processes that are left when the warden itself is killed.

Children of a warden die with it. What they had moved into sessions of their own (daemons) does not, and would go to
init. Two things keep it in reach: the launcher is a second child subreaper (prctl(2)), so that such processes become
its children; and where a cgroup was delegated to us (systemd's ``Delegate=``), everything is started in one below it,
which the kernel empties at one word.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path

from enclave_launch.runtime.overlap import Overlap
from enclave_launch.runtime.warden import (
    PR_SET_CHILD_SUBREAPER,
    children_by_parent,
    descendants,
    group_of,
    kill_all,
    load_libc,
)

PR_GET_CHILD_SUBREAPER = 37  # linux/prctl.h
CLEARING = 5.0  # seconds until what cannot be killed (uninterruptible sleep) is left to the kernel
DELEGATED = ("user.delegate", "trusted.delegate")  # systemd.resource-control(5): extended attributes, "1"


class Survivors:
    """Ready from its making until ``close``; ``end`` is for the day on which the warden was killed."""

    def __init__(self, warden: int) -> None:
        self._warden = warden
        _wardens.add(warden)
        self._reaping = _subreaping()
        self._reaping.__enter__()
        self._own = children_by_parent().get(os.getpid(), set())
        self._cgroup = Cgroup.below_ours()
        if self._cgroup is not None:
            self._cgroup.take(warden)

    def end(self) -> None:
        """Kill all that the launch left, but not the program's earlier children and its own session."""
        if self._cgroup is not None:
            self._cgroup.kill()
        deadline = time.monotonic() + CLEARING
        while time.monotonic() < deadline and not _has_ended(self._warden):
            time.sleep(0.005)  # its end of the socket closes before its children become ours
        while time.monotonic() < deadline and (adopted := self._adopted()):
            kill_all({pid for one in adopted for pid in (one, *descendants(one))}, signal.SIGKILL)
            time.sleep(0.005)
            for pid in adopted:
                with contextlib.suppress(ChildProcessError):
                    os.waitpid(pid, os.WNOHANG)

    def close(self) -> None:
        """Stop reaping, once nothing of the launch is left."""
        _wardens.discard(self._warden)
        self._reaping.__exit__(None, None, None)
        if self._cgroup is not None:
            self._cgroup.remove()

    def _adopted(self) -> set[int]:
        children = children_by_parent().get(os.getpid(), set()) - self._own - _wardens
        return {pid for pid in children if group_of(os.getsid, pid) not in (os.getsid(0), -1)}


def _has_ended(child: int) -> bool:
    """Return whether ``child`` has ended, reaped or not. It stays as it is."""
    try:
        return os.waitid(os.P_PID, child, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None
    except ChildProcessError:
        return True


_wardens: set[int] = set()  # of every launch that runs in this program


@contextlib.contextmanager
def _subreaper() -> Iterator[None]:
    """Become the parent of processes below us that lose theirs. Does nothing without prctl."""
    libc = load_libc()
    if libc is None:
        yield
        return

    before = ctypes.c_int()
    libc.prctl(PR_GET_CHILD_SUBREAPER, ctypes.byref(before), 0, 0, 0)
    libc.prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    try:
        yield
    finally:
        libc.prctl(PR_SET_CHILD_SUBREAPER, before.value, 0, 0, 0)


_subreaping = Overlap(_subreaper)


class Cgroup:
    """A cgroup (version 2) of this launch's processes."""

    def __init__(self, directory: Path) -> None:
        self._directory = directory

    @classmethod
    def below_ours(cls) -> Cgroup | None:
        """Create a cgroup below that of this process; return None if that was not delegated to us."""
        ours = own_cgroup()
        if ours is None or not is_delegated(ours):
            return None
        directory = ours / f"enclave-launch-{os.getpid()}"
        try:
            directory.mkdir()
        except OSError:
            return None
        return cls(directory)

    def take(self, pid: int) -> None:
        with contextlib.suppress(OSError):  # it has ended
            (self._directory / "cgroup.procs").write_text(str(pid))

    def kill(self) -> None:
        """Kill everything in it (cgroup.kill, Linux 5.14)."""
        with contextlib.suppress(OSError):
            (self._directory / "cgroup.kill").write_text("1")

    def remove(self) -> None:
        """Remove the cgroup if it is empty; one that the kernel has not finished with stays."""
        with contextlib.suppress(OSError):
            self._directory.rmdir()


def own_cgroup() -> Path | None:
    """Return the folder of this process's cgroup in the version 2 hierarchy, None if there is none."""
    try:
        places = Path("/proc/self/cgroup").read_text().splitlines()
        mounts = Path("/proc/self/mountinfo").read_text().splitlines()
    except OSError:
        return None
    place = next((line[len("0::/") :] for line in places if line.startswith("0::/")), None)
    mounted = (fields for fields in map(str.split, mounts) if fields[fields.index("-") + 1] == "cgroup2")
    root = next(mounted, None)
    return None if place is None or root is None else Path(root[4], place)


def is_delegated(cgroup: Path) -> bool:
    """Return True if systemd has delegated ``cgroup`` to this user (``Delegate=``) and groups may be made in it."""
    for name in DELEGATED:
        with contextlib.suppress(OSError):
            if os.getxattr(cgroup, name) == b"1":
                return os.access(cgroup, os.W_OK)
    return False
