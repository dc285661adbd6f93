"""Processes through the warden: streams, exit statuses, signals, and nothing left behind."""

from __future__ import annotations

import asyncio
import os
import resource
import signal
import subprocess
import sys
import textwrap
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest

from enclave_launch.runtime.process_tree import Child, ProcessSpec, ProcessTree, Stream
from enclave_launch.runtime.survivors import own_cgroup
from enclave_launch.runtime.warden import children_by_parent
from tests.programs import PYTHON
from tests.runtime.conftest import alive, descriptors, eventually, read_pid, require_descriptors

Body = Callable[[ProcessTree], Awaitable[None]]


class Recorder:
    def __init__(self) -> None:
        self.received: dict[Stream, bytes] = {"stdout": b"", "stderr": b""}

    def __call__(self, stream: Stream, data: bytes) -> None:
        self.received[stream] += data


def in_tree(body: Body) -> None:
    async def main() -> None:
        async with ProcessTree() as tree:
            await asyncio.wait_for(body(tree), 30)

    asyncio.run(main())


def shell(script: str, **options: object) -> ProcessSpec:
    return ProcessSpec((script,), dict(os.environ), shell=True, **options)  # type: ignore[arg-type]


def python(script: str) -> ProcessSpec:
    return ProcessSpec((sys.executable, "-c", textwrap.dedent(script)), dict(os.environ))


async def finished(tree: ProcessTree, spec: ProcessSpec) -> tuple[int, dict[Stream, bytes]]:
    recorder = Recorder()
    child = await tree.spawn(spec, recorder)
    status = await child.wait()
    child.release()
    return status, recorder.received


def test_both_streams_and_the_exit_status_arrive_apart() -> None:
    async def body(tree: ProcessTree) -> None:
        status, received = await finished(tree, shell("echo out; echo err >&2; exit 3"))
        assert (status, received) == (3, {"stdout": b"out\n", "stderr": b"err\n"})

    in_tree(body)


@pytest.mark.parametrize(
    ("script", "status"),
    [("exit 0", 0), ("exit 1", 1), ("exit 255", 255), ("kill -KILL $$", -9), ("kill -SEGV $$", -11)],
)
def test_exit_status_as_subprocess_gives_it(script: str, status: int) -> None:
    async def body(tree: ProcessTree) -> None:
        assert (await finished(tree, shell(script)))[0] == status

    in_tree(body)


def test_an_executable_that_is_not_there_is_an_os_error_naming_it() -> None:
    async def body(tree: ProcessTree) -> None:
        with pytest.raises(FileNotFoundError) as raised:
            await tree.spawn(ProcessSpec(("/no/such/program",), {}), Recorder())
        assert raised.value.filename == "/no/such/program"

    in_tree(body)


def test_a_directory_that_is_not_there_is_an_os_error_naming_it(tmp_path: Path) -> None:
    async def body(tree: ProcessTree) -> None:
        with pytest.raises(FileNotFoundError) as raised:
            await tree.spawn(shell("true", cwd=str(tmp_path / "absent")), Recorder())
        assert raised.value.filename == str(tmp_path / "absent")

    in_tree(body)


def test_a_file_that_is_not_executable_is_a_permission_error(tmp_path: Path) -> None:
    program = tmp_path / "program"
    program.write_text("#!/bin/sh\n")

    async def body(tree: ProcessTree) -> None:
        with pytest.raises(PermissionError):
            await tree.spawn(ProcessSpec((str(program),), {}), Recorder())

    in_tree(body)


def test_environment_and_directory_are_exactly_what_was_given(tmp_path: Path) -> None:
    async def body(tree: ProcessTree) -> None:
        spec = ProcessSpec(("/usr/bin/env",), {"ONLY": "this", "BYTES": "\udcff"}, cwd=str(tmp_path))
        assert (await finished(tree, spec))[1]["stdout"] == b"ONLY=this\nBYTES=\xff\n"
        assert (await finished(tree, shell("pwd -P", cwd=str(tmp_path))))[1]["stdout"].strip() == bytes(
            tmp_path.resolve()
        )

    in_tree(body)


def test_the_program_is_searched_in_the_path_of_its_own_environment(tmp_path: Path) -> None:
    (tmp_path / "mine").write_text("#!/bin/sh\necho found\n")
    (tmp_path / "mine").chmod(0o755)

    async def body(tree: ProcessTree) -> None:
        _, received = await finished(tree, ProcessSpec(("mine",), {"PATH": str(tmp_path)}))
        assert received["stdout"] == b"found\n"

    in_tree(body)


def test_a_child_starts_with_default_signals_and_no_descriptor_but_its_three() -> None:
    async def body(tree: ProcessTree) -> None:
        script = """
            import os, signal
            ignored = [s.name for s in signal.Signals if s not in (9, 19, 13, 25) and
                       signal.getsignal(s) is signal.SIG_IGN]
            print(ignored, len(os.listdir("/proc/self/fd")) - 1, os.getpid() == os.getsid(0))
        """
        assert (await finished(tree, python(script)))[1]["stdout"] == b"[] 3 True\n"

    in_tree(body)


def test_emulate_tty_is_a_terminal_and_keeps_line_ends() -> None:
    async def body(tree: ProcessTree) -> None:
        script = "[ -t 1 ] && [ -t 2 ] && [ ! -t 0 ] && echo terminal"
        assert (await finished(tree, shell(script, emulate_tty=True)))[1]["stdout"] == b"terminal\n"
        assert (await finished(tree, shell("[ -t 1 ] || echo pipe")))[1]["stdout"] == b"pipe\n"

    in_tree(body)


def test_standard_input_stays_open_and_can_be_written() -> None:
    async def body(tree: ProcessTree) -> None:
        recorder = Recorder()
        child = await tree.spawn(shell("read line; echo got $line"), recorder)
        await asyncio.sleep(0.1)
        assert child.running
        child.write_stdin(b"text\n")
        assert await child.wait() == 0
        assert recorder.received["stdout"] == b"got text\n"

    in_tree(body)


def test_a_signal_reaches_the_whole_process_group(tmp_path: Path) -> None:
    async def body(tree: ProcessTree) -> None:
        child = await tree.spawn(
            python(f"""
                import subprocess, sys
                inner = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
                open({str(tmp_path / "pid")!r}, "w").write(str(inner.pid))
                inner.wait()
            """),
            Recorder(),
        )
        inner = await asyncio.to_thread(read_pid, tmp_path / "pid")
        child.signal(signal.SIGTERM)
        assert await child.wait() == -signal.SIGTERM
        assert await asyncio.to_thread(eventually, lambda: not alive(inner))

    in_tree(body)


def test_a_signal_for_the_process_alone_leaves_what_it_started(tmp_path: Path) -> None:
    async def body(tree: ProcessTree) -> None:
        script = f"sleep 60 & echo $! > {tmp_path}/pid; trap 'exit 7' USR1; while true; do sleep 0.05; done"
        child = await tree.spawn(shell(script), Recorder())
        inner = await asyncio.to_thread(read_pid, tmp_path / "pid")
        await asyncio.sleep(0.2)
        child.signal(signal.SIGUSR1, whole_group=False)
        assert await child.wait() == 7
        assert alive(inner)

    in_tree(body)


def test_all_output_arrives_before_the_exit_is_told_even_from_a_paused_reader() -> None:
    async def body(tree: ProcessTree) -> None:
        recorder = Recorder()
        child = await tree.spawn(shell("sleep 0.1; head -c 60000 /dev/zero"), recorder)
        for pump in child.pumps:
            pump.pause()
        await child.wait()
        assert len(recorder.received["stdout"]) == 60000

    in_tree(body)


def test_500_megabytes_arrive_complete() -> None:
    async def body(tree: ProcessTree) -> None:
        count = 0

        def receive(_: Stream, data: bytes) -> None:
            nonlocal count
            count += len(data)

        child = await tree.spawn(shell("head -c 500000000 /dev/zero"), receive)
        assert await child.wait() == 0
        assert count == 500_000_000

    in_tree(body)


def test_leaving_the_tree_ends_daemons_that_left_their_session(tmp_path: Path) -> None:
    async def body(tree: ProcessTree) -> None:
        status, _ = await finished(
            tree, shell(f"setsid sh -c 'echo $$ > {tmp_path}/pid; exec sleep 60' >/dev/null 2>&1 &")
        )
        assert status == 0
        assert alive(await asyncio.to_thread(read_pid, tmp_path / "pid"))

    in_tree(body)
    assert not alive(read_pid(tmp_path / "pid"))


def test_sweep_ends_what_a_child_left_in_its_session(tmp_path: Path) -> None:
    async def body(tree: ProcessTree) -> None:
        child = await tree.spawn(
            shell(f"sh -c 'echo $$ > {tmp_path}/pid; exec sleep 60' >/dev/null 2>&1 &"), Recorder()
        )
        await child.wait()
        left = await asyncio.to_thread(read_pid, tmp_path / "pid")
        assert alive(left)
        child.sweep()
        assert await asyncio.to_thread(eventually, lambda: not alive(left))

    in_tree(body)


@pytest.mark.parametrize("spare", range(6))
def test_a_start_for_which_descriptors_are_lacking_keeps_none(spare: int) -> None:
    async def body(tree: ProcessTree) -> None:
        assert (await finished(tree, shell("true")))[0] == 0
        limits = resource.getrlimit(resource.RLIMIT_NOFILE)
        before, next_free = descriptors(), os.dup(0)
        os.close(next_free)
        try:
            resource.setrlimit(resource.RLIMIT_NOFILE, (next_free + spare, limits[1]))
            with pytest.raises(OSError, match="Too many open files"):
                await tree.spawn(shell("true"), Recorder())
        finally:
            resource.setrlimit(resource.RLIMIT_NOFILE, limits)
        assert descriptors() == before
        assert (await finished(tree, shell("true")))[0] == 0

    in_tree(body)


def test_two_hundred_processes_leave_no_descriptor_and_no_zombie() -> None:
    require_descriptors(1000)

    async def batch(tree: ProcessTree, count: int) -> None:
        children: list[Child] = [await tree.spawn(shell("echo x"), Recorder()) for _ in range(count)]
        for child in children:
            assert await child.wait() == 0
            child.release()

    async def body(tree: ProcessTree) -> None:
        await batch(tree, 5)
        ours, wardens = descriptors(), _descriptors_of(tree.warden_pid)
        await batch(tree, 200)
        for _ in range(
            100
        ):  # the end of an output is closed when the loop sees it, which may be after the wait
            if descriptors() <= ours and _descriptors_of(tree.warden_pid) <= wardens:
                break
            await asyncio.sleep(0.05)
        assert descriptors() <= ours
        assert _descriptors_of(tree.warden_pid) <= wardens
        assert _children_of(tree.warden_pid) == []

    in_tree(body)


LAUNCHER = """
import asyncio, os, sys
from enclave_launch.runtime.process_tree import ProcessSpec, ProcessTree

async def main():
    async with ProcessTree() as tree:
        for script in sys.argv[2:]:
            await tree.spawn(ProcessSpec((script,), dict(os.environ), shell=True), lambda *_: None)
        open(sys.argv[1], "w").write(str(tree.warden_pid))
        await asyncio.sleep(60)

asyncio.run(main())
"""


def _start_launcher(tmp_path: Path, *scripts: str) -> tuple[subprocess.Popen[bytes], int]:
    launcher = subprocess.Popen([sys.executable, "-c", LAUNCHER, str(tmp_path / "warden"), *scripts])
    return launcher, read_pid(tmp_path / "warden")


def test_killing_the_launcher_ends_children_grandchildren_and_daemons(tmp_path: Path) -> None:
    launcher, warden = _start_launcher(
        tmp_path,
        f"echo $$ > {tmp_path}/child; sleep 60",
        f"sh -c 'echo $$ > {tmp_path}/grandchild; sleep 60; true'; true",
        f"setsid sh -c 'echo $$ > {tmp_path}/daemon; exec sleep 60' & wait",
        f"trap '' INT TERM; echo $$ > {tmp_path}/stubborn; while true; do sleep 0.1; done",
    )
    pids = [read_pid(tmp_path / name) for name in ("child", "grandchild", "daemon", "stubborn")]
    launcher.kill()
    launcher.wait()
    assert eventually(lambda: not any(map(alive, [warden, *pids])))


def test_killing_the_warden_ends_its_children_and_is_noticed(tmp_path: Path) -> None:
    async def body(tree: ProcessTree) -> None:
        child = await tree.spawn(shell(f"sh -c 'echo $$ > {tmp_path}/pid; exec sleep 60'; true"), Recorder())
        inner = await asyncio.to_thread(read_pid, tmp_path / "pid")
        os.kill(tree.warden_pid, signal.SIGKILL)
        assert await child.wait() == -signal.SIGKILL
        assert tree.lost is not None and tree.lost.done()
        assert await asyncio.to_thread(eventually, lambda: not alive(inner))

    in_tree(body)


def _descriptors_of(pid: int) -> int:
    return len(os.listdir(f"/proc/{pid}/fd"))


def _children_of(pid: int) -> list[int]:
    return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


DAEMON = "setsid sh -c 'echo $$ > {pid}; exec sleep 60' >/dev/null 2>&1 & sleep 60"


async def _lose_the_warden(tree: ProcessTree) -> None:
    assert tree.lost is not None
    os.kill(tree.warden_pid, signal.SIGKILL)
    await asyncio.wait_for(tree.lost, 10)


@pytest.mark.parametrize("attempt", range(6))  # its socket closes before its children become ours: a race
def test_a_killed_warden_takes_its_children_and_even_their_daemons_with_it(
    attempt: int, tmp_path: Path
) -> None:
    async def body(tree: ProcessTree) -> None:
        child = await tree.spawn(shell(DAEMON.format(pid=tmp_path / "pid")), Recorder())
        daemon = await asyncio.to_thread(read_pid, tmp_path / "pid")
        await _lose_the_warden(tree)
        assert await asyncio.to_thread(eventually, lambda: not alive(daemon) and not alive(child.pid))

    in_tree(body)


def test_children_that_the_program_had_before_survive_a_killed_warden(tmp_path: Path) -> None:
    own = subprocess.Popen(["sleep", "60"], start_new_session=True)
    try:

        async def body(tree: ProcessTree) -> None:
            await tree.spawn(shell("sleep 60"), Recorder())
            await _lose_the_warden(tree)

        in_tree(body)
        assert own.poll() is None
    finally:
        own.kill()
        own.wait()


def test_a_program_is_a_subreaper_only_while_its_launch_runs(tmp_path: Path) -> None:
    async def body(tree: ProcessTree) -> None:
        await finished(tree, shell("true"))

    before = children_by_parent().get(os.getpid(), set())
    in_tree(body)
    subprocess.run(
        ["sh", "-c", f"setsid sh -c 'echo $$ > {tmp_path}/pid; exec sleep 60' >/dev/null 2>&1 &"], check=True
    )
    orphan = read_pid(tmp_path / "pid")
    try:
        assert children_by_parent().get(os.getpid(), set()) <= before
    finally:
        os.kill(orphan, signal.SIGKILL)


IN_A_CGROUP = """
import asyncio, os, sys
from pathlib import Path
from enclave_launch.runtime.process_tree import ProcessSpec, ProcessTree

async def main():
    async with ProcessTree() as tree:
        spec = ProcessSpec(("cat", "/proc/self/cgroup"), dict(os.environ))
        child = await tree.spawn(spec, lambda _, data: sys.stdout.write(data.decode()))
        await child.wait()

asyncio.run(main())
print(sorted(path.name for path in Path("{delegated}").glob("enclave-launch-*")))
"""


@pytest.mark.skipif(os.geteuid() != 0, reason="only root may mark a cgroup as delegated here")
def test_in_a_delegated_cgroup_the_launch_has_one_of_its_own_and_leaves_none(tmp_path: Path) -> None:
    """Run by a shell in a cgroup that is marked as systemd marks it."""
    ours = own_cgroup()
    if ours is None:
        pytest.skip("this machine has no version 2 hierarchy of cgroups")
    delegated = ours / f"delegated-{os.getpid()}"
    delegated.mkdir()
    try:
        os.setxattr(delegated, "user.delegate", b"1")
        program = tmp_path / "program.py"
        program.write_text(IN_A_CGROUP.format(delegated=delegated))
        script = f"echo $$ > {delegated}/cgroup.procs; exec {PYTHON} {program}"
        result = subprocess.run(["sh", "-c", script], capture_output=True, text=True)
        assert f"/{delegated.name}/enclave-launch-" in result.stdout, result
        assert result.stdout.splitlines()[-1] == "[]"
    finally:
        delegated.rmdir()


def test_children_keep_the_oom_score_that_we_were_started_with() -> None:
    async def body(tree: ProcessTree) -> None:
        own = Path("/proc/self/oom_score_adj").read_bytes()
        assert (await finished(tree, shell("cat /proc/self/oom_score_adj")))[1]["stdout"] == own
        allowed = subprocess.run(
            ["sh", "-c", "echo -900 > /proc/self/oom_score_adj"], stderr=subprocess.DEVNULL
        )
        expected = b"-900\n" if allowed.returncode == 0 else own
        assert Path(f"/proc/{tree.warden_pid}/oom_score_adj").read_bytes() == expected

    in_tree(body)
