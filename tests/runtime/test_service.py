"""The live launch as a whole: launch files in, real children, what is on the screen, the exit status.

Each case is a program of its own with a launch description, as users write them.
"""

from __future__ import annotations

import os
import pty
import re
import select
import signal
import stat
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import pytest

from tests.runtime.conftest import alive, eventually, read_pid, require_descriptors

PROGRAM = """
import sys
from pathlib import Path
from enclave_launch import RunSettings, launch_source, run_unsecured
sys.exit(run_unsecured(launch_source(sys.argv[1]), options=RunSettings(noninteractive={noninteractive}, debug={debug})))
"""

PRELUDE = """
import sys
from launch import Event, EventHandler, LaunchDescription
from launch.actions import *
from launch.event_handlers import *
from launch.events import Shutdown as ShutdownEvent
from launch.events.process import *

def sh(script, **options):
    return ExecuteProcess(cmd=[script], shell=True, **{"output": "screen", "name": "a", **options})

def py(script, **options):
    return ExecuteProcess(cmd=[sys.executable, "-c", script], **{"output": "screen", "name": "a", **options})
"""


class Launch:
    """A launch in a process of its own, with everything it writes in ``screen``."""

    def __init__(
        self,
        directory: Path,
        actions: str,
        *,
        noninteractive: bool = False,
        debug: bool = False,
        prelude: str = "",
    ) -> None:
        file = directory / "test.launch.py"
        file.write_text(
            f"{PRELUDE}\n{textwrap.dedent(prelude)}\n"
            f"def generate_launch_description():\n    return LaunchDescription([{actions}])\n"
        )
        self.logs = directory / "log"
        self.screen_file = directory / "screen"
        environment = {**os.environ, "ROS_LOG_DIR": str(self.logs), "PYTHONDONTWRITEBYTECODE": "1"}
        with self.screen_file.open("wb") as screen:
            self.process = subprocess.Popen(
                [sys.executable, "-c", PROGRAM.format(noninteractive=noninteractive, debug=debug), str(file)],
                stdout=screen,
                stderr=subprocess.STDOUT,
                env=environment,
                start_new_session=True,
            )

    @property
    def screen(self) -> str:
        return self.screen_file.read_text(errors="replace")

    def wait(self, timeout: float = 20.0) -> int:
        try:
            return self.process.wait(timeout)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise AssertionError(f"still running; on the screen:\n{self.screen}") from None

    def until(self, text: str) -> None:
        assert eventually(lambda: text in self.screen or self.process.poll() is not None), self.screen
        assert text in self.screen, self.screen

    def lines(self) -> list[str]:
        """What is on the screen without the two lines about logging; pids as PID."""
        shown = re.sub(r"pid \[?\d+", lambda found: found[0].rstrip("0123456789") + "PID", self.screen)
        return shown.splitlines()[2:]


def finished(directory: Path, actions: str, **options: object) -> tuple[int, list[str]]:
    launch = Launch(directory, actions, **options)  # type: ignore[arg-type]
    return launch.wait(), launch.lines()


def test_one_process_from_start_to_end(tmp_path: Path) -> None:
    assert finished(tmp_path, 'sh("echo hello")') == (
        0,
        [
            "[INFO] [a-1]: process started with pid [PID]",
            "[a-1] hello",
            "[INFO] [a-1]: process has finished cleanly [pid PID]",
        ],
    )


def test_launch_log_and_latest(tmp_path: Path) -> None:
    launch = Launch(tmp_path, 'sh("echo hello; echo trouble >&2", output="log")')
    assert launch.wait() == 0
    assert "hello" not in launch.screen
    assert "[a-1] trouble" in launch.screen
    text = (launch.logs / "latest" / "launch.log").read_text()
    assert re.search(r"(?m)^\d+\.\d{7} \[INFO\] \[launch\]: All log files can be found below ", text)
    assert re.search(r"(?m)^\d+\.\d{7} \[a-1\] hello$", text)


@pytest.mark.parametrize(
    ("script", "status"), [("exit 0", 0), ("exit 1", 1), ("exit 77", 1), ("kill -SEGV $$", 1)]
)
def test_a_process_that_ends_badly_on_its_own_shows_in_the_exit_status(
    script: str, status: int, tmp_path: Path
) -> None:
    assert finished(tmp_path, f'sh("{script}")')[0] == status


def test_an_executable_that_is_missing_is_one_message_and_the_rest_runs(tmp_path: Path) -> None:
    status, lines = finished(tmp_path, 'ExecuteProcess(cmd=["/no/such"]), sh("echo other", name="b")')
    assert status == 1
    assert "[ERROR] [such-1]: cannot start process: No such file or directory: '/no/such'" in lines
    assert "[b-2] other" in lines
    assert not any("Traceback" in line for line in lines)


def test_on_exit_actions_and_events_run_in_launchs_order(tmp_path: Path) -> None:
    actions = """
        first := sh("sleep 0.2; echo one", on_exit=[LogInfo(msg="on_exit of first")]),
        RegisterEventHandler(OnProcessExit(
            target_action=first, on_exit=[LogInfo(msg="newest"), sh("echo two", name="b")])),
        RegisterEventHandler(OnProcessStart(target_action=first, on_start=[LogInfo(msg="started")])),
        RegisterEventHandler(OnShutdown(on_shutdown=[LogInfo(msg="shutdown")])),
    """
    status, lines = finished(tmp_path, f"*({actions})")
    told = [line for line in lines if "launch.user" in line or line.startswith(("[a-1]", "[b-2]"))]
    assert (status, told) == (
        0,
        [
            "[INFO] [launch.user]: started",
            "[a-1] one",
            "[INFO] [launch.user]: newest",
            "[INFO] [launch.user]: on_exit of first",
            "[b-2] two",
            "[INFO] [launch.user]: shutdown",
        ],
    )


def test_output_reaches_handlers(tmp_path: Path) -> None:
    actions = """
        talker := sh("echo magic; sleep 30"),
        RegisterEventHandler(OnProcessIO(target_action=talker, on_stdout=lambda event:
            [EmitEvent(event=ShutdownEvent(reason="heard it"))] if b"magic" in event.text else None)),
    """
    status, lines = finished(tmp_path, f"*({actions})")
    assert status == 0
    assert "[INFO] [a-1]: sending signal 'SIGINT' to process[a-1]" in lines


def test_a_timer_fires_after_its_period(tmp_path: Path) -> None:
    status, lines = finished(
        tmp_path, 'TimerAction(period=0.2, actions=[LogInfo(msg="late")]), LogInfo(msg="early")'
    )
    assert (status, lines) == (0, ["[INFO] [launch.user]: early", "[INFO] [launch.user]: late"])


def test_shutdown_on_exit_ends_the_others(tmp_path: Path) -> None:
    status, lines = finished(tmp_path, 'sh("sleep 0.2", on_exit=[Shutdown()]), sh("exec sleep 60", name="b")')
    assert status == 0
    assert "[INFO] [b-2]: sending signal 'SIGINT' to process[b-2]" in lines


def test_respawn_under_kill_9(tmp_path: Path) -> None:
    launch = Launch(
        tmp_path,
        f"sh('echo $$ > {tmp_path}/pid.new; mv {tmp_path}/pid.new {tmp_path}/pid; exec sleep 60', respawn=True)",
    )
    seen: set[int] = set()
    for _ in range(3):
        assert eventually(lambda: (tmp_path / "pid").exists() and read_pid(tmp_path / "pid") not in seen)
        pid = read_pid(tmp_path / "pid")
        seen.add(pid)
        os.kill(pid, signal.SIGKILL)
    assert eventually(lambda: read_pid(tmp_path / "pid") not in seen)
    launch.process.send_signal(signal.SIGINT)
    assert launch.wait() == 0
    assert launch.screen.count("exit code -9") == 3


def test_respawn_gives_up_after_its_retries(tmp_path: Path) -> None:
    status, lines = finished(tmp_path, 'sh("exit 3", respawn=True, respawn_max_retries=2)')
    assert status == 1
    assert sum("exit code 3" in line for line in lines) == 3


def test_ctrl_c_ends_every_child_and_is_no_failure(tmp_path: Path) -> None:
    launch = Launch(tmp_path, 'sh("echo up; exec sleep 60"), sh("echo up too; exec sleep 60", name="b")')
    launch.until("up\n")
    launch.until("up too\n")
    launch.process.send_signal(signal.SIGINT)
    assert launch.wait() == 0
    assert "[WARNING] [launch]: user interrupted with ctrl-c (SIGINT)" in launch.lines()
    assert launch.screen.count("exit code -2") == 2


TICKS = """
class Tick(Event):
    def __init__(self, left=None):
        self.left = left

class OnTick(EventHandler):
    def __init__(self):
        super().__init__(matcher=lambda event: isinstance(event, Tick))

    def handle(self, tick, context):
        super().handle(tick, context)
        if tick.left != 0:
            return EmitEvent(event=Tick(tick.left and tick.left - 1))

ticks = RegisterEventHandler(OnTick())
"""


def test_ctrl_c_ends_a_launch_whose_events_never_end(tmp_path: Path) -> None:
    launch = Launch(tmp_path, 'ticks, EmitEvent(event=Tick()), sh("echo up; exec sleep 60")', prelude=TICKS)
    launch.until("up\n")
    launch.process.send_signal(signal.SIGINT)
    assert launch.wait() == 0
    assert "100 events after the end of all processes led to more: left out" in launch.screen


def test_events_of_a_shutdown_that_come_to_an_end_are_all_handled(tmp_path: Path) -> None:
    after = "OnShutdown(on_shutdown=lambda *_: EmitEvent(event=Tick(60)))"
    status, lines = finished(tmp_path, f'ticks, RegisterEventHandler({after}), sh("true")', prelude=TICKS)
    assert status == 0 and not any("left out" in line for line in lines)


def test_ctrl_c_twice_reaches_the_children_twice(tmp_path: Path) -> None:
    script = (
        "import signal, time\\n"
        "def first(*_):\\n"
        "    signal.signal(signal.SIGINT, lambda *_: exit(0))\\n"
        "    print('once', flush=True)\\n"
        "signal.signal(signal.SIGINT, first)\\n"
        "print('up', flush=True)\\n"
        "while True: time.sleep(0.05)\\n"
    )
    launch = Launch(tmp_path, f'py("{script}")')
    launch.until("[a-1] up")
    launch.process.send_signal(signal.SIGINT)
    launch.until("[a-1] once")
    launch.process.send_signal(signal.SIGINT)
    assert launch.wait(4) == 0  # before the five seconds to SIGTERM
    assert "(SIGINT) again" in launch.screen


COUNTING = (
    "import signal, time\\n"
    "count = 0\\n"
    "def interrupted(*_):\\n"
    "    global count; count += 1\\n"
    "    print('interrupted', count, flush=True)\\n"
    "signal.signal(signal.SIGINT, interrupted)\\n"
    "print('up', flush=True)\\n"
    "while not count: time.sleep(0.02)\\n"
    "time.sleep(0.5)\\n"
)


def test_ctrl_c_in_a_terminal_reaches_each_child_once(tmp_path: Path) -> None:
    """A terminal signals its whole foreground process group; children must not get that and ours as well."""
    file = tmp_path / "test.launch.py"
    file.write_text(
        f'{PRELUDE}\ndef generate_launch_description():\n    return LaunchDescription([py("{COUNTING}")])\n'
    )
    program = PROGRAM.format(noninteractive=False, debug=False)
    pid, terminal = pty.fork()
    if pid == 0:
        os.environ["ROS_LOG_DIR"] = str(tmp_path / "log")
        os.execv(sys.executable, [sys.executable, "-c", program, str(file)])
    try:
        seen = read_until(terminal, b"[a-1] up")
        os.write(terminal, b"\x03")
        seen += read_until(terminal, None)
    finally:
        os.close(terminal)
    assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 0, seen
    assert b"[a-1] interrupted 1" in seen
    assert b"interrupted 2" not in seen
    assert b"process has finished cleanly" in seen


def read_until(terminal: int, text: bytes | None) -> bytes:
    """What a program shows in its terminal, up to ``text`` or to its end."""
    seen = b""
    deadline = time.monotonic() + 20
    while text is None or text not in seen:
        assert select.select([terminal], [], [], max(0, deadline - time.monotonic()))[0], seen
        try:
            data = os.read(terminal, 1 << 16)
        except OSError:  # nobody has it open any more
            data = b""
        if not data:
            assert text is None, seen
            break
        seen += data
    return seen


def test_events_of_all_kinds_in_a_live_run(tmp_path: Path) -> None:
    prelude = """
        import asyncio
        from launch import Event, LaunchDescription
        class Mine(Event):
            name = "mine"
        async def later(context):
            await asyncio.sleep(0.1)
            context.emit_event_sync(Mine())
        first = sh("echo one; sleep 0.3; printf two; exit 3")
    """
    actions = """
        RegisterEventHandler(EventHandler(
            matcher=lambda event: isinstance(event, Mine), entities=[LogInfo(msg="custom event")])),
        RegisterEventHandler(OnProcessStart(target_action=first, on_start=[sh("echo from a handler", name="b")])),
        RegisterEventHandler(OnProcessIO(
            target_action=first, on_stdout=lambda event: LogInfo(msg=f"output {event.text}"))),
        RegisterEventHandler(OnProcessExit(
            target_action=first, on_exit=lambda event, context: LogInfo(msg=f"exit {event.returncode}"))),
        RegisterEventHandler(OnExecutionComplete(target_action=first, on_completion=[
            LogInfo(msg="complete"), TimerAction(period=0.1, actions=[Shutdown(reason="enough")])])),
        RegisterEventHandler(OnShutdown(on_shutdown=lambda event, context: LogInfo(msg=f"end: {event.reason}"))),
        first,
        OpaqueCoroutine(coroutine=later),
        TimerAction(period=60.0, actions=[LogInfo(msg="never")]),
    """
    status, lines = finished(tmp_path, f"*({actions})", prelude=prelude)
    told = [line.removeprefix("[INFO] [launch.user]: ") for line in lines if "[launch.user]" in line]
    assert sorted(told[:2]) == ["custom event", "output b'one\\n'"]
    assert told[2:] == ["output b'two'", "exit 3", "complete", "end: enough"]
    assert "[b-2] from a handler" in lines and "[a-1] two" in lines
    assert status == 1


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT])
def test_other_signals_shut_down_in_order_and_leave_nobody(number: signal.Signals, tmp_path: Path) -> None:
    launch = Launch(
        tmp_path,
        f"sh('trap \"echo bye; exit 0\" INT; echo $$ > {tmp_path}/pid; echo up; while true; do sleep 0.05; done')",
    )
    launch.until("[a-1] up")
    launch.process.send_signal(number)
    assert launch.wait() == 1
    assert "[a-1] bye" in launch.screen
    assert not alive(read_pid(tmp_path / "pid"))


def test_under_nohup_the_end_of_the_terminal_ends_neither_launch_nor_children(tmp_path: Path) -> None:
    asked = f"trap 'exit 3' USR1; echo $$ > {tmp_path}/pid; echo up; while true; do sleep 0.05; done"
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)  # what nohup does, and what exec keeps
    try:
        launch = Launch(tmp_path, f'sh("{asked}")')
    finally:
        signal.signal(signal.SIGHUP, before)
    launch.until("[a-1] up")
    for pid in (read_pid(tmp_path / "pid"), launch.process.pid):
        os.kill(pid, signal.SIGHUP)
    os.kill(read_pid(tmp_path / "pid"), signal.SIGUSR1)
    assert launch.wait() == 1
    assert "exit code 3" in launch.screen and "SIGHUP" not in launch.screen


def test_a_child_that_ignores_sigint_is_escalated(tmp_path: Path) -> None:
    launch = Launch(
        tmp_path,
        "sh('trap \"\" INT TERM; echo up; while true; do sleep 0.05; done', "
        "sigterm_timeout='0.2', sigkill_timeout='0.2')",
    )
    launch.until("[a-1] up")
    launch.process.send_signal(signal.SIGINT)
    assert launch.wait() == 0
    assert "escalating to 'SIGTERM'" in launch.screen
    assert "escalating to 'SIGKILL'" in launch.screen
    assert "exit code -9" in launch.screen


def test_killing_the_launcher_leaves_nobody(tmp_path: Path) -> None:
    launch = Launch(
        tmp_path, f"sh('sleep 60 & echo $! > {tmp_path}/inner; echo $$ > {tmp_path}/outer; wait')"
    )
    pids = [read_pid(tmp_path / name) for name in ("inner", "outer")]
    launch.process.kill()
    launch.process.wait()
    assert eventually(lambda: not any(map(alive, pids)))


def test_killing_the_launcher_leaves_no_parameter_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    marker = tmp_path / "prefix/share/ament_index/resource_index/packages/robot"
    program = tmp_path / "prefix/lib/robot/driver"
    for path in (marker, program):
        path.parent.mkdir(parents=True)
    marker.touch()
    program.write_text(f"#!/bin/sh\necho $$ > {tmp_path}/pid; exec sleep 60\n")
    program.chmod(0o755)
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "prefix"))
    monkeypatch.setenv("TMPDIR", str(temporary))
    node = 'Node(package="robot", executable="driver", parameters=[{"password": "letmein"}])'
    launch = Launch(tmp_path, node, prelude="from launch_ros.actions import Node")
    read_pid(tmp_path / "pid")
    (written,) = temporary.glob("launch_params_*/*")
    assert "letmein" in written.read_text() and stat.S_IMODE(written.parent.stat().st_mode) == 0o700
    launch.process.kill()
    launch.process.wait()
    assert eventually(lambda: not list(temporary.iterdir()))


def test_an_error_in_the_visit_ends_what_was_started_before_it(tmp_path: Path) -> None:
    status, lines = finished(
        tmp_path,
        'sh("exec sleep 60"), SetLaunchConfiguration("x", LaunchConfiguration("absent"))',
        prelude="from launch.substitutions import LaunchConfiguration",
    )
    assert status == 1
    assert any("launch configuration 'absent' does not exist" in line for line in lines)
    assert not any("Traceback" in line for line in lines)


def test_debug_shows_the_traceback(tmp_path: Path) -> None:
    status, lines = finished(tmp_path, "OpaqueFunction(function=lambda context: 1 / 0)", debug=True)
    assert status == 1
    assert any("ZeroDivisionError" in line for line in lines)


def test_processes_in_on_shutdown_start_after_an_explicit_shutdown_only(tmp_path: Path) -> None:
    handler = 'RegisterEventHandler(OnShutdown(on_shutdown=[sh("echo farewell")]))'
    (tmp_path / "explicit").mkdir()
    (tmp_path / "idle").mkdir()
    assert "[a-1] farewell" in finished(tmp_path / "explicit", f"{handler}, Shutdown()")[1]
    assert "[a-1] farewell" not in finished(tmp_path / "idle", handler)[1]


def test_emulate_tty_and_cwd_and_environment(tmp_path: Path) -> None:
    _, lines = finished(
        tmp_path,
        f'sh("[ -t 1 ] && echo tty", emulate_tty=True), sh("pwd -P", name="b", cwd="{tmp_path}"), '
        'sh("echo $EXTRA", name="c", additional_env={"EXTRA": "more"})',
    )
    assert "[a-1] tty" in lines
    assert f"[b-2] {tmp_path.resolve()}" in lines
    assert "[c-3] more" in lines


def test_two_hundred_processes_in_one_launch(tmp_path: Path) -> None:
    require_descriptors(1000)
    status, lines = finished(tmp_path, '*[sh(f"echo {n}") for n in range(200)]')
    assert status == 0
    assert sum("process has finished cleanly" in line for line in lines) == 200
    assert sorted(int(line.split()[-1]) for line in lines if re.match(r"\[a-\d+\] \d+$", line)) == list(
        range(200)
    )


def test_processes_for_which_descriptors_are_lacking_are_told_and_the_others_run(tmp_path: Path) -> None:
    prelude = """
        import resource
        def narrow(context):
            resource.setrlimit(resource.RLIMIT_NOFILE, (60, resource.getrlimit(resource.RLIMIT_NOFILE)[1]))
    """
    actions = """
        OpaqueFunction(function=narrow),
        *[sh("read line", name=f"p{n}", output="log") for n in range(30)],
        TimerAction(period=1.0, actions=[Shutdown()]),
    """
    status, lines = finished(tmp_path, actions, prelude=prelude)
    assert status == 1
    told = [line for line in lines if "cannot start process: Too many open files; each" in line]
    started = [line for line in lines if "process started" in line]
    assert told and started and len(told) + len(started) == 30


def test_two_hundred_respawns_leak_neither_descriptors_nor_memory_nor_handlers(tmp_path: Path) -> None:
    prelude = """
        import os, sys
        from enclave_launch.runtime import supervision
        supervision.TOLERATED = 1000  # short lives in a row, before starts are put off
        def measure(context):
            pages = int(open("/proc/self/statm").read().split()[1])
            handlers = len(context._event_handlers.all())
            line = f"MEASURED {len(os.listdir('/proc/self/fd'))} {handlers} {pages * 4}"
            sys.stdout.write(line + chr(10))  # in one piece: launch's own lines come from another thread
            sys.stdout.flush()
    """
    action = 'sh("true", respawn=True, respawn_max_retries=200, on_exit=[OpaqueFunction(function=measure)])'
    status, lines = finished(tmp_path, action, prelude=prelude)
    measured = [[int(word) for word in line.split()[1:]] for line in lines if line.startswith("MEASURED")]
    assert status == 0
    assert len(measured) == 201
    early, late = measured[20], measured[180]
    assert early[:2] == late[:2]
    assert late[2] - early[2] < 2048, "kilobytes in 160 processes"


def test_fifty_megabytes_to_the_screen_and_the_log_without_loss(tmp_path: Path) -> None:
    launch = Launch(tmp_path, "sh('seq 1 6500000', output='both')")
    assert launch.wait(30) == 0
    screen = launch.screen_file.read_bytes()
    assert screen.count(b"\n[a-1] ") == 6_500_000
    assert b"\n[a-1] 6500000\n[INFO] [a-1]: process has finished cleanly" in screen
    assert (launch.logs / "latest" / "launch.log").read_bytes().count(b" [a-1] ") == 6_500_000


def in_a_terminal(tmp_path: Path, actions: str, *, noninteractive: bool = False) -> tuple[int, int]:
    """A launch in the foreground of a terminal of its own: its pid and the terminal's other end."""
    file = tmp_path / "test.launch.py"
    file.write_text(
        f"{PRELUDE}\ndef generate_launch_description():\n    return LaunchDescription([{actions}])\n"
    )
    program = PROGRAM.format(noninteractive=noninteractive, debug=False)
    pid, terminal = pty.fork()
    if pid == 0:
        os.environ["ROS_LOG_DIR"] = str(tmp_path / "log")
        os.execv(sys.executable, [sys.executable, "-c", program, str(file)])
    return pid, terminal


ASKS = "import getpass; print('got', getpass.getpass('secret? '), flush=True)"


def test_a_child_of_an_interactive_launch_can_ask_for_a_password(tmp_path: Path) -> None:
    """As sudo, ssh and gdb do: through the controlling terminal, whatever its streams are."""
    pid, terminal = in_a_terminal(tmp_path, f'py("{ASKS}")')
    try:
        seen = read_until(terminal, b"secret? ")
        time.sleep(0.2)  # it turns the echo off, which discards what was typed before
        os.write(terminal, b"open sesame\n")
        seen += read_until(terminal, None)
    finally:
        os.close(terminal)
    assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 0, seen
    assert b"[a-1] got open sesame" in seen


def test_children_of_a_launch_without_a_terminal_have_none(tmp_path: Path) -> None:
    pid, terminal = in_a_terminal(
        tmp_path, """sh("(: < /dev/tty) 2>/dev/null && echo one || echo none")""", noninteractive=True
    )
    try:
        seen = read_until(terminal, None)
    finally:
        os.close(terminal)
    os.waitpid(pid, 0)
    assert b"[a-1] none" in seen


def test_two_children_that_ask_get_the_terminal_one_after_the_other(tmp_path: Path) -> None:
    pid, terminal = in_a_terminal(tmp_path, f'py("{ASKS}"), py("{ASKS}", name="b")')
    try:
        seen = b""
        for number in (1, 2):
            while seen.count(b"secret? ") < number:
                seen += os.read(terminal, 1 << 16)
            time.sleep(0.2)
            os.write(terminal, b"open sesame\n")
        seen += read_until(terminal, None)
    finally:
        os.close(terminal)
    assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 0, seen
    assert b"[a-1] got open sesame" in seen
    assert b"[b-2] got open sesame" in seen


def test_ctrl_c_at_a_childs_prompt_ends_the_launch(tmp_path: Path) -> None:
    prompt = (
        "import getpass, signal; signal.signal(signal.SIGINT, signal.SIG_DFL); getpass.getpass('secret? ')"
    )
    pid, terminal = in_a_terminal(tmp_path, f'py("{prompt}"), sh("exec sleep 60", name="b")')
    try:
        seen = read_until(terminal, b"secret? ")
        time.sleep(0.2)
        os.write(terminal, b"\x03")
        seen += read_until(terminal, None)
    finally:
        os.close(terminal)
    os.waitpid(pid, 0)
    assert b"user interrupted with ctrl-c (SIGINT)" in seen


@pytest.mark.parametrize(
    ("output_format", "why"),
    [
        ("{nothing} {line}", "KeyError"),
        ("{line", "ValueError"),
        ("{0}", "IndexError"),
        ("{this.x}", "AttributeError"),
    ],
)
def test_an_output_format_that_cannot_be_used_is_told_and_shows_in_the_exit_status(
    output_format: str, why: str, tmp_path: Path
) -> None:
    status, lines = finished(tmp_path, f'sh("echo hello", output_format="{output_format}")')
    assert status == 1
    assert any("output_format" in line and why in line for line in lines), lines
    assert "[a-1] hello" not in lines


def test_a_custom_output_format_is_used(tmp_path: Path) -> None:
    status, lines = finished(tmp_path, """sh("echo hello", output_format="<{this.name}> {line}")""")
    assert (status, lines[1]) == (0, "<a-1> hello")


def test_an_argument_that_the_locale_cannot_encode_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"}.items():
        monkeypatch.setenv(name, value)
    status, lines = finished(
        tmp_path, 'ExecuteProcess(cmd=["echo", "gr\\u00fc\\u00df"]), sh("echo other", name="b")'
    )
    assert status == 1
    assert any(
        "does not fit the locale's encoding (ascii); set LC_ALL to a UTF-8 locale" in line for line in lines
    ), lines
    assert "[b-2] other" in lines


def test_own_log_of_a_process_that_is_called_by_a_full_name(tmp_path: Path) -> None:
    launch = Launch(tmp_path, 'sh("echo hello", name="/robot/talker", output="own_log")')
    assert launch.wait() == 0
    logs = {path.name: path.read_text() for path in (launch.logs / "latest").iterdir()}
    assert logs["_robot_talker-1.log"] == "[/robot/talker-1] hello\n"
    assert not any("cannot write" in line for line in launch.lines())


def test_a_launch_files_signal_goes_to_the_process_and_not_to_what_it_started(tmp_path: Path) -> None:
    script = f"sleep 60 & echo $! > {tmp_path}/pid; trap 'exit 7' USR1; while true; do sleep 0.05; done"
    actions = f"""
        shell := sh("{script}", on_exit=[OpaqueFunction(function=is_alive)]),
        TimerAction(period=0.5, actions=[EmitEvent(event=SignalProcess(
            signal_number="SIGUSR1", process_matcher=lambda action: action is shell))]),
    """
    prelude = f"""
        import os
        def is_alive(context):
            os.kill(int(open("{tmp_path}/pid").read()), 0)
            print("still there", flush=True)
    """
    _, lines = finished(tmp_path, f"*({actions})", prelude=prelude)
    assert any("exit code 7" in line for line in lines)
    assert "still there" in lines


def test_debug_shows_the_events(tmp_path: Path) -> None:
    _, lines = finished(tmp_path, 'sh("true")', debug=True)
    events = [line.removeprefix("[DEBUG] [launch]: processing event: launch.events.") for line in lines]
    assert "process.ProcessStarted of a-1" in events
    assert "process.ProcessExited of a-1" in events


def test_a_stopped_screen_holds_up_neither_the_processes_nor_their_logs(tmp_path: Path) -> None:
    """As Ctrl-S does it: nobody reads what the launcher shows."""
    file = tmp_path / "test.launch.py"
    file.write_text(
        f"{PRELUDE}\nfrom enclave_launch.runtime import launch_log\nlaunch_log.PATIENCE = 0.2\n"
        "def generate_launch_description():\n    return LaunchDescription(["
        f"sh('seq 1 2000000; touch {tmp_path}/both', output='both'), "
        f"sh('seq 1 2000000; touch {tmp_path}/log', output='log', name='b')])\n"
    )
    environment = {**os.environ, "ROS_LOG_DIR": str(tmp_path / "log_directory")}
    program = [sys.executable, "-c", PROGRAM.format(noninteractive=True, debug=False), str(file)]
    with subprocess.Popen(program, stdout=subprocess.PIPE, env=environment) as launch:
        assert launch.stdout is not None
        assert eventually(lambda: (tmp_path / "both").exists() and (tmp_path / "log").exists(), 60)
        screen = launch.stdout.read()
        assert launch.wait() == 0
    log = (tmp_path / "log_directory" / "latest" / "launch.log").read_bytes()
    assert log.count(b" [a-1] ") == log.count(b" [b-2] ") == 2_000_000
    missing = re.search(rb"(\d+) lines? not shown, the screen was too slow", screen)
    assert missing is not None
    assert screen.count(b"[a-1] ") >= 2_000_000 - int(missing[1])
