"""Code that an event or a timer calls: for the plan if it may start something, and at its event in any case."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

HEAD = """
import os
from launch import Action, LaunchDescription, Substitution
from launch.actions import *
from launch.event_handlers import *
from launch.substitutions import *

HERE = os.path.dirname(os.path.abspath(__file__))


def note(label):
    with open(os.path.join(HERE, "counts"), "a") as file:
        file.write(label + "\\n")


def echo(*words):
    return ExecuteProcess(cmd=["echo", *words], output="screen")


def at_exit(*entities):
    first = ExecuteProcess(cmd=["sh", "-c", f"echo fresh > {HERE}/answer"])
    return [first, RegisterEventHandler(OnProcessExit(target_action=first, on_exit=list(entities)))]
"""


def launch(folder: Path, text: str, *options: str, expected: int = 0) -> tuple[str, dict[str, int]]:
    """What ``text`` as a launch file said, and how often its code was called, by label."""
    file = folder / "test.launch.py"
    file.write_text(HEAD + text)
    (folder / "counts").write_text("")
    environment = {**os.environ, "ROS_LOG_DIR": str(folder / "log"), "HOME": str(folder)}
    command = [sys.executable, "-m", "enclave_launch", *options, str(file)]
    run = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60, check=False)
    assert run.returncode == expected, run.stdout + run.stderr
    labels = (folder / "counts").read_text().splitlines()
    return run.stdout + run.stderr, {label: labels.count(label) for label in labels}


def secured(folder: Path) -> tuple[str, ...]:
    return "--secure", "--keystore", str(folder / "ks")


EVERY_CLASS = """
def gives(label):
    def function(context):
        note(f"{label} function with entities")
        return [echo(label)]
    return OpaqueFunction(function=function)


def acts(label):
    def function(context):
        note(f"{label} function without entities")
    return OpaqueFunction(function=function)


def callback(label):
    def function(event, context):
        note(f"{label} callback")
        return [echo(label)]
    return function


class Mine(Substitution):
    def __init__(self, label):
        self.label = label

    def perform(self, context):
        note(f"{self.label} substitution")
        return self.label


class MyAction(Action):
    def __init__(self, label):
        super().__init__()
        self.label = label

    def execute(self, context):
        note(f"{self.label} action")


def each(label):
    command = Command(["sh -c 'echo ", label, " command >> ", HERE, "/counts; echo said'"])
    return [gives(label), acts(label), echo(Mine(label)), MyAction(label), echo(command)]


def generate_launch_description():
    first = ExecuteProcess(cmd=["true"])
    quick = LogInfo(msg="quick")
    return LaunchDescription([
        RegisterEventHandler(OnExecutionComplete(target_action=quick, on_completion=callback("completed"))),
        first,
        quick,
        TimerAction(period=0.1, actions=each("timer")),
        RegisterEventHandler(OnProcessExit(target_action=first, on_exit=each("exit"))),
        RegisterEventHandler(OnProcessStart(target_action=first, on_start=each("start"))),
        RegisterEventHandler(OnShutdown(on_shutdown=[acts("shutdown")])),
        RegisterEventHandler(OnShutdown(on_shutdown=callback("shutdown"))),
    ])
"""


KINDS = "function with entities", "function without entities", "substitution", "action", "command"
EVENTS = {f"{event} {kind}" for event in ("timer", "exit", "start") for kind in KINDS}
COMPLETED = "completed callback"
AT_THE_END = {"shutdown callback", "shutdown function without entities"}


def starts_nothing(label: str) -> bool:
    return "without" in label or "action" in label


def test_a_plain_launch_calls_each_class_of_code_once(tmp_path: Path) -> None:
    _, counts = launch(tmp_path, EVERY_CLASS, "-a")
    assert counts == dict.fromkeys(EVENTS | AT_THE_END | {COMPLETED}, 1)


def test_a_secured_launch_calls_it_for_the_plan_too_if_it_may_start_something(tmp_path: Path) -> None:
    said, counts = launch(tmp_path, EVERY_CLASS, "-a", *secured(tmp_path))
    assert counts == {
        **{label: 1 if starts_nothing(label) else 2 for label in EVENTS | {COMPLETED}},
        **dict.fromkeys(AT_THE_END, 1),
    }
    assert "gives.function is called for the plan, to know what it starts, and again at timer" in said
    assert "acts.function is called" not in said


def test_what_starts_nothing_and_what_a_shutdown_calls_is_not_called_by_a_dry_run(tmp_path: Path) -> None:
    _, counts = launch(tmp_path, EVERY_CLASS, "--dry-run")
    assert not [label for label in counts if starts_nothing(label) or "shutdown" in label]
    assert counts["exit function with entities"] == 1, "what it starts must be in the plan"


ASKS = """
open(os.path.join(HERE, "answer"), "w").write("stale")


def reads(context):
    note("reads")
    return [echo("function", open(os.path.join(HERE, "answer")).read().strip())]


def exists(context):
    note("exists")
    return [echo("found" if os.path.exists(os.path.join(HERE, "answer.old")) else "missing")]


def looks_at_the_event(context):
    note("event")
    return [echo("ended", str(context.locals.event.returncode))]


def untouched(context):
    note("untouched")
    return [echo("read", open(__file__).readline().strip() or "nothing")]


def generate_launch_description():
    functions = [OpaqueFunction(function=each) for each in (reads, exists, looks_at_the_event, untouched)]
    return LaunchDescription(at_exit(*functions, echo("command", Command(["cat ", HERE, "/answer"]))))
"""


def test_what_a_process_left_is_asked_for_when_it_has_ended(tmp_path: Path) -> None:
    """A file of the run before lies there; the plan must not decide by it what is started."""
    said, counts = launch(tmp_path, ASKS, *secured(tmp_path))
    assert "function fresh" in said and "command fresh" in said
    assert "stale" not in said
    assert "ended 0" in said
    assert counts == dict.fromkeys(("reads", "exists", "event", "untouched"), 2)


CHANGED = """
def configured(context):
    note("configured")
    return [echo("mode", context.launch_configurations["mode"])]


def change(event, context):
    if event.returncode == 0:
        context.launch_configurations["mode"] = "after"


def generate_launch_description():
    slow = ExecuteProcess(cmd=["true"])
    return LaunchDescription([
        SetLaunchConfiguration("mode", "before"),
        slow,
        RegisterEventHandler(OnProcessExit(target_action=slow, on_exit=change)),
        TimerAction(period=1.0, actions=[OpaqueFunction(function=configured)]),
    ])
"""


def test_launch_configurations_of_that_moment_count(tmp_path: Path) -> None:
    # Since launch 3.4.5 a timer keeps the configurations of its group.
    said, counts = launch(tmp_path, CHANGED, *secured(tmp_path), "--distro", "jazzy@2024-12")
    assert "mode after" in said and "mode before" not in said
    assert counts == {"configured": 2}


IN_VAIN = """
def perhaps(context):
    note("perhaps")
    return [echo("there")] if os.path.exists(os.path.join(HERE, "answer")) else None


def generate_launch_description():
    return LaunchDescription(at_exit(OpaqueFunction(function=perhaps)))
"""


def test_what_started_nothing_for_the_plan_is_called_at_its_event(tmp_path: Path) -> None:
    told = "perhaps is called for the plan, to know what it starts, and again at OnProcessExit sh-1"
    said, counts = launch(tmp_path, IN_VAIN, "--dry-run")
    assert told in said and counts == {"perhaps": 1}
    said, counts = launch(tmp_path, IN_VAIN, *secured(tmp_path))
    assert told in said and "] there" in said
    assert counts == {"perhaps": 2}


def test_a_folder_that_a_timer_makes_is_made_for_the_plan_and_again(tmp_path: Path) -> None:
    text = """
def function(context):
    os.makedirs(os.path.join(HERE, "by_a_timer"), exist_ok=EXIST_OK)
    return [echo("made")]


def generate_launch_description():
    return LaunchDescription([TimerAction(period=0.1, actions=[OpaqueFunction(function=function)])])
"""
    said, _ = launch(tmp_path, text.replace("EXIST_OK", "True"), *secured(tmp_path))
    assert "[echo-1] made" in said
    (tmp_path / "by_a_timer").rmdir()
    said, _ = launch(tmp_path, text.replace("EXIST_OK", "False"), *secured(tmp_path), expected=1)
    assert "File exists" in said and "is called for the plan" in said


AGAIN = """
def function(context):
    note("function")
    return [echo("ended")]


def generate_launch_description():
    process = ExecuteProcess(cmd=["true"], respawn=True, respawn_max_retries=2)
    return LaunchDescription([
        process, RegisterEventHandler(OnProcessExit(target_action=process, on_exit=[OpaqueFunction(function=function)]))
    ])
"""


def test_each_event_calls_its_function(tmp_path: Path) -> None:
    """Each of the three exits starts a process of its own, as in launch; the plan calls the function once more."""
    said, counts = launch(tmp_path, AGAIN, *secured(tmp_path))
    assert said.count("] ended") == 3 and counts["function"] == 4
