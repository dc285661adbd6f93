"""A machine with a systemd of its own, booted in namespaces of this one: no virtual machine, no image, no network.

Its root has this machine's programs and this repository, read-only; /etc is a copy that can be written. What is
written there is there again when the same root is booted once more.
Needs root and the permission to make namespaces and mounts.
"""

from __future__ import annotations

import contextlib
import os
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.addons.deployment.kit import tool

ROOT = Path(__file__).resolve().parents[3]
SYSTEMD = "/lib/systemd/systemd"
_BOOT_SECONDS = 60.0
_TOOLS = ("nsenter", "--mount", "--uts", "--ipc", "--net", "--pid", "--cgroup", "--root", "--wdns=/")
_SETUP = """
set -eu
root=$1; shift
mount --make-rprivate /
mount --bind "$root" "$root"
for name in bin lib lib32 lib64 libx32 sbin usr opt; do
    if [ -L "/$name" ]; then ln -sfn "$(readlink "/$name")" "$root/$name"
    elif [ -d "/$name" ]; then
        mkdir -p "$root/$name"
        mount --rbind "/$name" "$root/$name"
        mount -o remount,bind,ro "$root/$name"
    fi
done
for name in proc sys dev run tmp srv root var/log etc/systemd/system; do mkdir -p "$root/$name"; done
chmod 1777 "$root/tmp"
for name in passwd group nsswitch.conf ld.so.cache ld.so.conf ld.so.conf.d alternatives ssl; do
    [ -e "$root/etc/$name" ] || [ ! -e "/etc/$name" ] || cp -a "/etc/$name" "$root/etc/$name"
done
echo booted > "$root/etc/hostname"
printf '%s\\n' ID=test VERSION_ID=1 > "$root/etc/os-release"
[ -e "$root/etc/machine-id" ] || systemd-id128 new > "$root/etc/machine-id"
mount -t proc proc "$root/proc"
mount -t sysfs sysfs "$root/sys"
mount -t cgroup2 cgroup2 "$root/sys/fs/cgroup"
mount -t tmpfs -o mode=755 tmpfs "$root/dev"
for name in null zero full random urandom; do touch "$root/dev/$name"; mount --bind "/dev/$name" "$root/dev/$name"; done
mkdir "$root/dev/pts" "$root/dev/shm"
mount -t devpts -o newinstance,ptmxmode=0666 devpts "$root/dev/pts"
ln -s pts/ptmx "$root/dev/ptmx"
mount -t tmpfs -o mode=1777 tmpfs "$root/dev/shm"
mount -t tmpfs -o mode=755 tmpfs "$root/run"
for folder; do mkdir -p "$root$folder"; mount --rbind "$folder" "$root$folder"; done
mount --bind "$1" "$root/srv"
ip link set lo up
printf '[Unit]\\nRequires=basic.target\\nAfter=basic.target\\n' > "$root/etc/systemd/system/test.target"
# In a container systemd leaves this to who made it; without it credentials do not reach the units.
mount --make-rshared "$root"
cd "$root"
export container=test
exec chroot "$root" SYSTEMD --system --unit=test.target --log-target=null --show-status=no
""".replace("SYSTEMD", SYSTEMD)


class Machine:
    """A booted machine."""

    def __init__(self, pid: int):
        self._pid = pid

    def run(self, *command: str | Path, status: int | None = 0, timeout: float = 60.0) -> str:
        """Run ``command`` there as root; return what it printed, standard error included."""
        words = [*_TOOLS[:1], f"--target={self._pid}", *_TOOLS[1:], *map(str, command)]
        done = subprocess.run(
            words,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=timeout,
            stdin=subprocess.DEVNULL,
        )
        if status is not None and done.returncode != status:
            raise AssertionError(
                f"{shlex.join(map(str, command))} returned {done.returncode}:\n{done.stdout}"
            )
        return done.stdout

    def cable(self, other: Machine) -> None:
        """Join the networks of the two: 10.77.0.1 here, 10.77.0.2 there, each on ``eth``.

        Here it is a bridge, so that it stays when the other machine is switched off, as a network card does.
        """
        enter = ("nsenter", f"--target={self._pid}", "--net", "ip")
        if "eth:" not in self.run("ip", "link"):
            bridge = ("link", "add", "eth", "type", "bridge", "mcast_snooping", "0")
            subprocess.run([*enter, *bridge], check=True, timeout=30)
            _configure(self, "10.77.0.1")
        pair = ("link", "add", "port", "type", "veth", "peer", "name", "eth", "netns", str(other._pid))
        subprocess.run([*enter, *pair], check=True, timeout=30)
        self.run("ip", "link", "set", "port", "master", "eth", "up")
        _configure(other, "10.77.0.2")

    def write(self, path: str, text: str) -> None:
        """Write a file there."""
        self.run("sh", "-c", 'printf %s "$2" > "$1"', "sh", path, text)

    def journal(self, unit: str) -> str:
        """Return what ``unit`` has said since it was started last."""
        self.run("journalctl", "--sync")
        invocation = self.run("systemctl", "show", "--property=InvocationID", "--value", unit).strip()
        return self.run(
            "journalctl", "--no-pager", f"_SYSTEMD_INVOCATION_ID={invocation}", "--output=cat", status=None
        )

    def property(self, unit: str, name: str) -> str:
        """Return a property of ``unit``."""
        return self.run("systemctl", "show", f"--property={name}", "--value", unit).strip()


def _configure(machine: Machine, address: str) -> None:
    machine.run("ip", "address", "add", f"{address}/24", "dev", "eth")
    machine.run("ip", "link", "set", "eth", "up")


@contextlib.contextmanager
def booted(folder: Path, shared: Path) -> Iterator[Machine]:
    """Boot systemd to ``basic.target`` with its root at ``folder``.

    ``shared`` is at the same path there, and for services at /srv.

    Args:
        folder: A new one, or that of a machine that was booted before and is off.
        shared: That this machine and the booted one both see.

    If this machine does not permit it, the test is skipped with what is missing.
    """
    tool(SYSTEMD, "apt-get install systemd")
    if missing := _missing_permission():
        pytest.skip(f"this machine cannot boot systemd in namespaces: {missing}")
    folder.mkdir(exist_ok=True)
    log = folder.with_suffix(".log")
    command = ("unshare", "--mount", "--pid", "--fork", "--kill-child", "--uts", "--ipc", "--net", "--cgroup")
    script = ("sh", "-c", _SETUP, "sh", str(folder), str(shared), *repository_folders())
    with log.open("w") as stream:
        outer = subprocess.Popen([*command, *script], stdin=subprocess.DEVNULL, stdout=stream, stderr=stream)
    try:
        machine = Machine(_first_process(outer, log))
        _wait_until_up(machine, log)
        _show_repository(machine)
        yield machine
    finally:
        outer.send_signal(signal.SIGKILL)  # --kill-child: and with it the first process of the machine
        outer.wait()


def _missing_permission() -> str:
    """Return what this machine does not permit, empty if nothing: no package brings it, so CI skips as well."""
    if os.geteuid() != 0:
        return "only root may make mounts and namespaces"
    tried = subprocess.run(
        ["unshare", "--mount", "--pid", "--fork", "--net", "--cgroup", "sh", "-c",
         "mount --make-rprivate / && mount -t cgroup2 cgroup2 /sys/fs/cgroup"],
        capture_output=True, text=True, timeout=_BOOT_SECONDS,
    )  # fmt: skip
    return (
        f"namespaces and a cgroup2 mount (CAP_SYS_ADMIN): {tried.stderr.strip()}" if tried.returncode else ""
    )


def repository_folders() -> list[str]:
    """Where this repository, its interpreter and Cyclone DDS are, as far as that is not below /usr."""
    named = [str(ROOT), sys.prefix, sys.base_prefix, os.environ.get("CYCLONEDDS_HOME", str(ROOT))]
    real = dict.fromkeys(os.path.realpath(one) for one in named)
    below = [one for one in real if not one.startswith("/usr")]
    return [one for one in below if not any(one.startswith(f"{other}/") for other in below)]


def _show_repository(machine: Machine) -> None:
    """Let services see what of a developer's machine is below a home directory or /tmp, which units hide."""
    hidden = [
        one for one in repository_folders() if one.startswith(("/root/", "/home/", "/tmp/", "/var/tmp/"))
    ]
    if hidden:
        machine.run("mkdir", "-p", "/etc/systemd/system/service.d")
        homes = "ProtectHome=tmpfs\n" if any(one.startswith(("/root/", "/home/")) for one in hidden) else ""
        shown = " ".join(f'"{one}"' for one in hidden)
        text = f"[Service]\n{homes}BindReadOnlyPaths={shown}\n"
        machine.write("/etc/systemd/system/service.d/repository.conf", text)


def _first_process(outer: subprocess.Popen[bytes], log: Path) -> int:
    children = Path(f"/proc/{outer.pid}/task/{outer.pid}/children")
    end = time.monotonic() + _BOOT_SECONDS
    while time.monotonic() < end and outer.poll() is None:
        for child in children.read_text().split():
            with contextlib.suppress(OSError):
                if Path(f"/proc/{child}/comm").read_text().strip() == "systemd":
                    return int(child)
        time.sleep(0.05)
    raise AssertionError(f"systemd was not started: {log.read_text()}")


def _wait_until_up(machine: Machine, log: Path) -> None:
    end = time.monotonic() + _BOOT_SECONDS
    state = ""
    while time.monotonic() < end:
        state = machine.run("systemctl", "is-system-running", status=None).strip()
        if state in ("running", "degraded"):
            return
        time.sleep(0.1)
    raise AssertionError(f"systemd did not come up: {state}\n{log.read_text()}")
