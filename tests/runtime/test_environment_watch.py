"""The environment of what really runs is held against the plan; what differs is ended."""

from __future__ import annotations

import asyncio
import os
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from enclave_launch.runtime.environment_watch import (
    EnvironmentWatch,
    Watched,
    environment_of,
    unplanned,
)
from enclave_launch.runtime.warden import children_by_parent
from tests.programs import PYTHON

pytestmark = pytest.mark.skipif(not Path("/proc/self/environ").exists(), reason="there is no /proc")

PLANNED = {"ROS_SECURITY_ENABLE": "true", "ROS_SECURITY_KEYSTORE": "/ks"}
SLEEP = f"{PYTHON} -c 'import time; print(1, flush=True); time.sleep(60)'"
Start = Callable[..., Watched]


@pytest.fixture
def start() -> Iterator[Start]:
    """Run a shell command until it has printed something."""
    started: list[subprocess.Popen[bytes]] = []

    def run(command: str, **more: str) -> Watched:
        process = subprocess.Popen(
            ["/bin/sh", "-c", f"exec {command}"],
            env={**os.environ, **PLANNED, **more},
            stdout=subprocess.PIPE,
            start_new_session=True,
        )
        started.append(process)
        assert process.stdout is not None and process.stdout.readline()
        return Watched("n-1", process.pid, PLANNED)

    yield run
    for process in started:
        os.killpg(process.pid, 9)
        process.communicate()


def found(watched: Watched) -> list[str]:
    return [item.why for item in unplanned(watched, children_by_parent())]


@pytest.mark.parametrize(
    ("command", "why"),
    [
        ("env -u ROS_SECURITY_ENABLE", ["ROS_SECURITY_ENABLE is not set"]),
        ("env -i", ["ROS_SECURITY_ENABLE is not set"]),
        ("env -i ONLY=this", ["ROS_SECURITY_ENABLE is not set"]),
        ("env ROS_SECURITY_KEYSTORE=/other", ["ROS_SECURITY_KEYSTORE is '/other', not '/ks'"]),
        ("nice -n 1", []),
        ("env MORE=1", []),
    ],
)
def test_a_program_behind_a_prefix_must_have_what_was_planned(
    command: str, why: list[str], start: Start
) -> None:
    assert found(start(f"{command} {SLEEP}")) == why


def test_a_descendant_matters_once_it_speaks_dds(start: Start, tmp_path: Path) -> None:
    behind_a_shell = f"sh -c 'env -u ROS_SECURITY_ENABLE {SLEEP.replace(chr(39), chr(34))}; true'"
    assert found(start(behind_a_shell)) == []
    library = tmp_path / "librcl.so"
    library.write_bytes(b"x" * 4096)
    program = tmp_path / "node.py"
    program.write_text(
        "import mmap, time\n"
        f"file = open({str(library)!r}, 'rb')\nheld = mmap.mmap(file.fileno(), 0, prot=mmap.PROT_READ)\n"
        "print(1, flush=True)\ntime.sleep(60)\n"
    )
    node = f"{PYTHON} {program}; true"
    assert found(start(f"sh -c {shlex.quote(f'env -u ROS_SECURITY_ENABLE {node}')}")) == [
        "ROS_SECURITY_ENABLE is not set"
    ]
    assert found(start(f"sh -c {shlex.quote(node)}")) == []


def test_a_process_that_wrote_over_its_environment_is_left_alone(start: Start) -> None:
    """As programs do that change their title: nothing can be told then."""
    code = (
        "import ctypes, time; libc = ctypes.CDLL(None); "
        'first = ctypes.cast(ctypes.c_char_p.in_dll(libc, "environ"), ctypes.c_void_p); '
        'stat = open("/proc/self/stat").read().rpartition(")")[2].split(); '
        "begin, end = int(stat[47]), int(stat[48]); ctypes.memset(begin, 120, end - begin - 1); "
        "print(1, flush=True); time.sleep(60)"
    )
    watched = start(f"{PYTHON} -c '{code}'")
    assert environment_of(watched.pid) is None and found(watched) == []


def test_a_process_that_is_gone_is_nobodys_business() -> None:
    assert found(Watched("n-1", 2**22 - 1, PLANNED)) == []


@pytest.mark.dds
def test_a_node_whose_prefix_drops_its_enclave_is_ended(tmp_path: Path) -> None:
    """The prefix was vouched for by name; what it did is seen all the same."""
    demo = Path(__file__).parents[2] / "fixtures/demo_ws"
    file = tmp_path / "a.launch.xml"
    file.write_text(
        '<launch><node pkg="demo_nodes" exec="talker" launch-prefix="{}" output="screen">'
        '<param name="seconds" value="4"/></node></launch>'
    )

    def run(prefix: str) -> subprocess.CompletedProcess[str]:
        own = tmp_path / "own.launch.xml"
        own.write_text(file.read_text().format(prefix))
        words = ["--prefix", str(demo), "--accept-prefix", "env", "--secure", "--keystore", "ks", str(own)]
        command = [sys.executable, "-m", "enclave_launch", *words]
        environment = {**os.environ, "ROS_LOG_DIR": str(tmp_path / "log")}
        return subprocess.run(
            command, capture_output=True, text=True, cwd=tmp_path, env=environment, timeout=60, check=False
        )

    refused = run("env -u ROS_SECURITY_ENABLE")
    assert refused.returncode == 1 and "ROS_SECURITY_ENABLE is not set; it was stopped" in refused.stdout
    kept = run("env MORE=1")
    assert kept.returncode == 0, kept.stdout
    assert "was ended" not in kept.stdout


def test_a_launch_that_ends_as_something_starts_ends() -> None:
    """A process that cannot be started is one that was going to be: the watch is woken and cancelled at once."""

    async def main() -> None:
        watch = EnvironmentWatch(list, lambda found: None)
        task = asyncio.ensure_future(watch.run())
        await asyncio.sleep(0)
        watch.process_started()
        await asyncio.sleep(0)
        task.cancel()
        await asyncio.wait({task}, timeout=5)
        assert task.cancelled()

    asyncio.run(main())


FOREIGN = """
import subprocess, sys
from enclave_launch.runtime.environment_watch import Watched, unplanned
from enclave_launch.runtime.warden import children_by_parent, descendants
with subprocess.Popen(["sleep", "60"], env={"ROS_SECURITY_ENABLE": "true"}) as child:
    found = list(unplanned(Watched("a", child.pid, {"ROS_SECURITY_ENABLE": "true"}), children_by_parent()))
    print(found, children_by_parent(), descendants(1))
    child.kill()
"""


def test_the_proc_of_another_pid_namespace_is_not_believed() -> None:
    """As in a sandbox that makes a PID namespace and mounts no /proc in it: numbers there are of other processes."""
    namespace = ["unshare", "--user", "--map-root-user", "--pid", "--fork"]
    if subprocess.run([*namespace, "true"], capture_output=True, check=False).returncode != 0:
        pytest.skip("this machine permits no namespaces")
    told = subprocess.run(
        [*namespace, sys.executable, "-c", FOREIGN], capture_output=True, text=True, check=False
    )
    assert (told.stdout, told.stderr) == ("[] {} set()\n", "")
