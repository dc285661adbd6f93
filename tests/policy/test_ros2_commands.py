"""Commands of ``ros2`` that a launch file runs as processes."""

from __future__ import annotations

from pathlib import Path
from xml.sax.saxutils import quoteattr

import pytest

from enclave_launch import ResolveOptions, resolve
from enclave_launch.diagnostics import Code
from enclave_launch.plan import LaunchPlan
from enclave_launch.policy.derivation import allowed_names
from enclave_launch.ros_rules.ros2_command import instead_of, participant_commands
from enclave_launch.security_environment import SecuritySettings, secured_command, secured_environment
from nodl.ament_index import INDEX_FOLDER


@pytest.mark.parametrize(
    ("words", "shell", "found"),
    [
        (["ros2", "topic", "pub", "/go", "std_msgs/msg/Empty"], False, "topic"),
        (["/opt/ros/jazzy/bin/ros2", "run", "bot", "talker"], False, "run"),
        (["ros2 service call /reset std_srvs/srv/Empty"], True, "service"),
        (["sleep 5; ros2 lifecycle set /n configure"], True, "lifecycle"),
        (["bash", "-c", "sleep 1 && exec ros2 param set /n p 1"], False, "param"),
        (["ros2", "bag", "record", "-a"], False, "bag"),
        (["ros2", "bag", "info", "x"], False, None),
        (["ros2", "pkg", "prefix", "bot"], False, None),
        (["ros2"], False, None),
        (["ros2", "--help"], False, None),
        (["echo", "ros2", "topic", "list"], False, None),
        (["echo ros2 topic list"], True, None),
        (["echo 'unclosed"], True, None),
    ],
)
def test_which_commands_make_a_participant(words: list[str], shell: bool, found: str | None) -> None:
    command = participant_commands(words, shell=shell)
    assert (command[0][1] if command else None) == found


def test_each_gets_its_remedy() -> None:
    assert '<node pkg="bot" exec="talker"/>' in instead_of(("ros2", "run", "bot", "talker"))
    assert "<include" in instead_of(("ros2", "launch", "bot", "x.launch.py"))
    assert "policy file" in instead_of(("ros2", "topic", "pub", "/go"))
    assert "instead of -a" in instead_of(("ros2", "bag", "record", "-a"))


PACKAGE = """
<node name="talker" executable="talker"><topic name="chatter" type="std_msgs/msg/String" role="publisher"/></node>
"""


def _plan(tmp_path: Path, cmd: str, attributes: str = "") -> LaunchPlan:
    share = tmp_path / "share" / "bot"
    share.mkdir(parents=True, exist_ok=True)
    (share / "bot.nodl.xml").write_text(f'<interface version="1">{PACKAGE}</interface>')
    for kind, text in (("packages", ""), ("nodl_desc", "share/bot/bot.nodl.xml")):
        (tmp_path / INDEX_FOLDER / kind).mkdir(parents=True, exist_ok=True)
        (tmp_path / INDEX_FOLDER / kind / "bot").write_text(text)
    (tmp_path / "lib" / "bot").mkdir(parents=True, exist_ok=True)
    (tmp_path / "lib" / "bot" / "talker").touch(0o755)
    file = tmp_path / "x.launch.xml"
    file.write_text(f"<launch><executable cmd={quoteattr(cmd)} {attributes}/></launch>")
    return resolve(file, options=ResolveOptions(distro="jazzy", prefixes=(tmp_path,)))


def _allowed(plan: LaunchPlan, enclave: str = "/") -> dict[str, list[str]]:
    (policy,) = (each for each in plan.derived.policy.enclaves if each.path == enclave)
    built_in = plan.derived.built_in_names(enclave)
    return {
        kind: own
        for kind, names in allowed_names(policy).items()
        if (own := [name for name in names if (kind, name) not in built_in])
    }


@pytest.mark.parametrize(
    ("cmd", "allowed"),
    [
        ("ros2 topic pub --once -r 5 /go std_msgs/Empty {}", {"publish": ["/go"]}),
        ("ros2 topic echo scan --field ranges", {"subscribe": ["/scan"]}),
        ("ros2 service call /reset std_srvs/srv/Empty", {"call_services": ["/reset"]}),
        ("ros2 action send_goal --feedback /dock nav2_msgs/action/Dock {}", {"call_actions": ["/dock"]}),
        ("ros2 lifecycle set /cam configure",
         {"call_services": ["/cam/change_state", "/cam/get_available_transitions"]}),
        ("ros2 lifecycle get cam", {"call_services": ["/cam/get_state"]}),
        ("ros2 control load_controller arm", {"call_services": ["/controller_manager/load_controller"]}),
        ("ros2 control load_controller --set-state active -c /left/cm arm",
         {"call_services": [f"/left/cm/{verb}_controller" for verb in ("configure", "load", "switch")]}),
        ("bash -c 'source /opt/x.sh && exec ros2 service call /reset std_srvs/srv/Empty'",
         {"call_services": ["/reset"]}),
        ("ros2 run bot talker --ros-args -r chatter:=/news -r __ns:=/left", {"publish": ["/news"]}),
    ],
)  # fmt: skip
def test_a_command_may_do_what_its_words_say(tmp_path: Path, cmd: str, allowed: dict[str, list[str]]) -> None:
    plan = _plan(tmp_path, cmd)
    assert _allowed(plan) == allowed
    assert not plan.problems


def test_parameters_are_set_by_a_client_of_that_node_alone(tmp_path: Path) -> None:
    allowed = _allowed(_plan(tmp_path, "ros2 param set /cam rate 5"))
    assert {name.rpartition("/")[0] for name in allowed["call_services"]} == {"/cam"}
    assert "/cam/set_parameters" in allowed["call_services"]


def test_a_command_runs_in_its_enclave_by_the_variable_of_rcl(tmp_path: Path) -> None:
    (process,) = _plan(tmp_path, "ros2 run bot talker").processes
    assert process.program == "bot/talker"
    assert process.fqn == "<node_namespace_unspecified>/talker"
    settings = SecuritySettings("/ks")
    assert secured_environment(process, settings)["ROS_SECURITY_ENCLAVE_OVERRIDE"] == "/"
    assert secured_command(process, settings) == ("ros2", "run", "bot", "talker")


def test_an_enclave_of_the_launch_file_stays(tmp_path: Path) -> None:
    plan = _plan(tmp_path, "ros2 topic pub /go std_msgs/msg/Empty", 'enclave="/tool"')
    assert _allowed(plan, "/tool") == {"publish": ["/go"]}


def test_a_recording_of_named_topics_subscribes_to_these(tmp_path: Path) -> None:
    plan = _plan(tmp_path, "ros2 bag record -o out /scan /tf")
    assert _allowed(plan)["subscribe"] == ["/scan", "/tf"]


@pytest.mark.parametrize(
    ("cmd", "remedy"),
    [
        ("ros2 bag record -a", "name the topics instead of -a"),
        ("ros2 bag record /scan --regex /cam.*", "--policy"),
        ("ros2 bag play old", "--policy"),
        ("ros2 launch bot x.launch.py", "include that launch file"),
        ("ros2 topic pub $(env NAME a$b) std_msgs/msg/Empty", "--policy"),
        ("ros2 topic pub /go Empty", "--policy"),
        ("bash -c 'ros2 topic pub /a std_msgs/msg/Empty; ros2 topic pub /b std_msgs/msg/Empty'", "--policy"),
    ],
)
def test_one_whose_words_do_not_say_it_stops_a_secured_start(tmp_path: Path, cmd: str, remedy: str) -> None:
    (problem,) = _plan(tmp_path, cmd).problems
    assert problem.code is Code.COMMAND_NEEDS_ENCLAVE
    assert remedy in problem.remedy


@pytest.mark.parametrize("cmd", ["echo ros2 topic pub /go std_msgs/msg/Empty", "ros2 pkg list"])
def test_what_makes_no_participant_gets_no_enclave(tmp_path: Path, cmd: str) -> None:
    plan = _plan(tmp_path, cmd)
    assert plan.processes[0].enclave is None
    assert not plan.problems


def test_the_program_of_ros2_run_must_be_known_as_any_node(tmp_path: Path) -> None:
    (problem,) = _plan(tmp_path, "ros2 run nowhere talker").problems
    assert problem.code is Code.NO_MANIFEST
    assert "nowhere/talker" in problem.text
