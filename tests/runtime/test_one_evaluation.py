"""A launch file is evaluated once: what it makes, asks and computes is made, asked and computed once, secured too."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

DEMO = Path(__file__).parents[2] / "fixtures" / "demo_ws"

HEAD = """
import os
import random
from launch import Action, LaunchDescription, Substitution
from launch.actions import *
from launch.event_handlers import OnProcessExit
from launch.substitutions import *
from launch_ros.actions import Node, SetParameter, SetRemap

HERE = os.path.dirname(os.path.abspath(__file__))


def make(name):
    os.mkdir(os.path.join(HERE, name))  # fails the second time
    return name


def echo(*words):
    return ExecuteProcess(cmd=["echo", *words], output="screen")
"""

PROGRAM = "#!/bin/sh\nexec cat\n"


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    """The demo packages with a talker that starts anywhere and says what it was started with."""
    workspace = tmp_path / "ws"
    subprocess.run(["cp", "-r", str(DEMO), str(workspace)], check=True)
    talker = workspace / "lib" / "demo_nodes" / "talker"
    talker.unlink()
    talker.write_text('#!/bin/sh\necho talker got "$@"\n')
    talker.chmod(0o755)
    return workspace


def launch(workspace: Path, text: str, *options: str, expected: int = 0) -> tuple[str, str]:
    """Run ``text`` as a Python launch file; what was said on standard output and error."""
    file = workspace.parent / "test.launch.py"
    file.write_text(HEAD + text)
    environment = {**os.environ, "ROS_LOG_DIR": str(workspace.parent / "log"), "HOME": str(workspace.parent)}
    command = [sys.executable, "-m", "enclave_launch", "--prefix", str(workspace), *options, str(file)]
    run = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60, check=False)
    assert run.returncode == expected, run.stdout + run.stderr
    return run.stdout, run.stderr


def secured(workspace: Path) -> tuple[str, ...]:
    return "--secure", "--keystore", str(workspace.parent / "ks")


EVERYTHING = """
make("by_the_module")
print("said by the module")


class Mine(Substitution):
    def perform(self, context):
        return make("by_a_substitution")


class MyAction(Action):
    def execute(self, context):
        make("by_an_action")
        return [echo("from", "my", "action")]


def function(context):
    make("by_a_function")
    print("said by the function")
    context.launch_configurations["made"] = "in the function"
    os.environ["MADE"] = "by the function"
    name = f"node_{random.randrange(10**9)}"
    return [Node(package="demo_nodes", executable="talker", name=name, output="screen",
                 remappings=[("chatter", f"topic_{random.randrange(10**9)}")])]


def generate_launch_description():
    make("by_the_description")
    first = echo(Mine(), Command(["mkdir -v ", os.path.join(HERE, "by_a_command")]))
    return LaunchDescription([
        first,
        MyAction(),
        OpaqueFunction(function=function),
        echo("configuration", LaunchConfiguration("made"), "variable", EnvironmentVariable("MADE")),
        RegisterEventHandler(OnProcessExit(target_action=first, on_exit=[echo("after", "the", "first")])),
        TimerAction(period=0.1, actions=[echo("later")]),
    ])
"""


@pytest.mark.parametrize("with_security", [False, True], ids=["plain", "secured"])
def test_what_a_launch_file_does_it_does_once(workspace: Path, with_security: bool) -> None:
    said, _ = launch(workspace, EVERYTHING, *(secured(workspace) if with_security else ()))
    assert said.count("said by the module") == said.count("said by the function") == 1
    assert "by_a_substitution mkdir: created directory" in said
    assert "configuration in the function variable by the function" in said
    for words in ("from my action", "after the first", "later", "talker got --ros-args"):
        assert words in said, said


def test_a_name_at_random_is_the_one_that_was_signed(workspace: Path) -> None:
    text = """
def generate_launch_description():
    name = f"node_{random.randrange(10**9)}"
    return LaunchDescription([
        Node(package="demo_nodes", executable="talker", name=name, namespace=AnonName("space"), output="screen"),
        Node(package="demo_nodes", executable="talker",
             name=[PythonExpression(["'n%d' % __import__('random').randrange(10**9)"])]),
    ])
"""
    said, _ = launch(workspace, text, *secured(workspace))
    assert said.count("has finished cleanly") == 2


LOGGING = """
import launch


def function(context):
    launch.logging.get_logger("mine").warning("said by a function")
    LogInfo(msg="logged by a function").execute(context)


def generate_launch_description():
    launch.logging.get_logger().error("said by the description")
    return LaunchDescription([OpaqueFunction(function=function), LogInfo(msg="logged by an action"), echo("x")])
"""


@pytest.mark.parametrize("with_security", [False, True], ids=["plain", "secured"])
def test_what_is_logged_is_in_the_log_of_the_launch_once(workspace: Path, with_security: bool) -> None:
    said, told = launch(workspace, LOGGING, *(secured(workspace) if with_security else ()))
    for words in (
        "said by a function",
        "logged by a function",
        "said by the description",
        "logged by an action",
    ):
        assert said.count(words) == 1, said
        assert words not in told


def test_scopes_and_global_rules_of_functions_hold_at_the_start_too(workspace: Path) -> None:
    text = """
def inside(context):
    SetRemap("chatter", "news").execute(context)
    SetParameter("p", 1).execute(context)
    return None


def generate_launch_description():
    talker = lambda name: Node(package="demo_nodes", executable="talker", name=name, output="screen")
    return LaunchDescription([
        SetRemap("a", "b"), SetParameter("q", 2),
        GroupAction([OpaqueFunction(function=inside), talker("in")]),
        talker("out"),
    ])
"""
    said, _ = launch(workspace, text, *secured(workspace))
    inner = next(line for line in said.splitlines() if "__node:=in" in line and "got" in line)
    assert "a:=b" in inner and "chatter:=news" in inner and "p:=1" in inner


def test_what_a_function_starts_itself_is_started(workspace: Path) -> None:
    text = """
def function(context):
    echo("started", "by", "hand").execute(context)


def generate_launch_description():
    return LaunchDescription([OpaqueFunction(function=function), TimerAction(period=0.5, actions=[])])
"""
    said, _ = launch(workspace, text, *secured(workspace))
    assert said.count("] started by hand") == 1


def test_an_included_python_file_runs_as_often_as_in_launch(workspace: Path) -> None:
    """Once to look at its arguments, once to include it: launch does so, and a secured start adds nothing."""
    (workspace.parent / "inner.launch.py").write_text(
        HEAD
        + """
print("said by the included file")


def generate_launch_description():
    word = DeclareLaunchArgument("word", default_value="none")
    return LaunchDescription([word, echo("got", LaunchConfiguration("word"))])
"""
    )
    text = """
def generate_launch_description():
    include = IncludeLaunchDescription(os.path.join(HERE, "inner.launch.py"), launch_arguments=[("word", "a word")])
    return LaunchDescription([include])
"""
    plain, _ = launch(workspace, text)
    with_security, _ = launch(workspace, text, *secured(workspace))
    counts = [said.count("said by the included file") for said in (plain, with_security)]
    assert counts == [2, 2]
    assert "got a word" in plain and "got a word" in with_security


def test_an_error_of_a_plain_launch_has_its_place_and_its_next_step(workspace: Path) -> None:
    text = """
def generate_launch_description():
    return LaunchDescription([Node(package="nowhere", executable="x")])
"""
    said, told = launch(workspace, text, expected=1)
    assert "test.launch.py:" in said + told
    assert "package 'nowhere' not found" in said + told


def test_a_second_run_of_the_same_plan_evaluates_anew(workspace: Path) -> None:
    """The first run used up what was noted; names at random are the same all the same."""
    launch_file = workspace.parent / "x.launch.xml"
    launch_file.write_text(
        '<launch><node pkg="demo_nodes" exec="talker" name="$(anon talker)" output="screen"/></launch>'
    )
    program = f"""
from pathlib import Path
from enclave_launch import ResolveOptions, provision, resolve, run
options = ResolveOptions(prefixes=(Path({str(workspace)!r}),))
launch = provision(resolve({str(launch_file)!r}, options=options), {str(workspace.parent / "ks")!r})
print([run(launch), run(launch)])
"""
    environment = {**os.environ, "ROS_LOG_DIR": str(workspace.parent / "log")}
    command = [sys.executable, "-c", program]
    run = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60, check=False)
    assert "[0, 0]" in run.stdout, run.stdout + run.stderr
