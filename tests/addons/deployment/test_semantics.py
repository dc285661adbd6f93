"""What an engine cannot express is named and refused, unless somebody accepts that it is left out."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_addons.review.verb import main
from tests.addons.deployment.kit import DEMO_WS, TALK, export, launch_file, provisioned

ENGINES = ("systemd", "compose", "kubernetes")

TIMER = TALK.replace(
    "</launch>", '<timer period="2"><node pkg="demo_nodes" exec="talker" name="late"/></timer></launch>'
)
PYTHON = """
from launch import LaunchDescription
from launch.actions import EmitEvent, LogInfo, RegisterEventHandler, Shutdown
from launch.event_handlers import OnProcessExit, OnShutdown
from launch.events import Shutdown as ShutdownEvent
from launch_ros.actions import Node

def generate_launch_description():
    speaker = Node(package="demo_nodes", executable="talker", name="speaker", respawn=RESPAWN)
    return LaunchDescription([speaker, HANDLER])
"""
FUNCTION = "RegisterEventHandler(OnProcessExit(target_action=speaker, on_exit=lambda event, context: None))"
LOGGING = 'RegisterEventHandler(OnShutdown(on_shutdown=[LogInfo(msg="bye")]))'
ENDING = (
    "RegisterEventHandler(OnProcessExit(target_action=speaker, on_exit=[EmitEvent(event=ShutdownEvent())]))"
)


def python(handler: str, respawn: str = "False") -> str:
    return PYTHON.replace("HANDLER", handler).replace("RESPAWN", respawn)


CASES = {
    "a timer": (TIMER, "robot.launch.xml", "is started by an event (timer 2"),
    "a Python function": (python(FUNCTION), "robot.launch.py", "OnProcessExit talker-1, a Python function"),
    "what happens at the end": (python(LOGGING), "robot.launch.py", "OnShutdown"),
}  # fmt: skip


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("case", CASES)
def test_what_cannot_be_expressed_is_named_with_its_place_and_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], engine: str, case: str
) -> None:
    text, name, told = CASES[case]
    launch = launch_file(tmp_path, text, name)
    ks = provisioned(launch, tmp_path / "ks")
    assert export(engine, launch, ks, tmp_path / "out") == 1
    error = capsys.readouterr().err
    assert f"{engine} cannot express this part of the launch" in error
    assert told in error and f"{launch}:" in error
    assert not (tmp_path / "out").exists()
    assert export(engine, launch, ks, tmp_path / "out", "--accept-unexpressed") == 0
    assert "warning: left out" in capsys.readouterr().err
    written = "".join(path.read_text() for path in (tmp_path / "out").rglob("*") if path.is_file())
    assert "not expressed here: " in written, "and whoever reads the files knows it, too"
    assert "__node:=late" not in written


def test_on_exit_shutdown_is_what_systemd_can_say_and_the_others_cannot(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    launch = launch_file(tmp_path, TALK.replace('name="ear"', 'name="ear" on_exit="shutdown"'))
    ks = provisioned(launch, tmp_path / "ks")
    assert export("systemd", launch, ks, tmp_path / "out") == 0
    target = (tmp_path / "out/ros-robot.target").read_text()
    assert "BindsTo=ros-robot-ear.service\nAfter=ros-robot-ear.service\n" in target
    assert "Wants=ros-robot-front-speaker.service" in target
    for engine in ("compose", "kubernetes"):
        assert export(engine, launch, ks, tmp_path / engine) == 1
        assert "the end of listener-2 ends the launch" in capsys.readouterr().err


@pytest.mark.parametrize(("respawn", "status"), [("False", 0), ("True", 1)])
def test_the_same_as_an_event_handler_unless_the_process_is_started_again(
    tmp_path: Path, respawn: str, status: int
) -> None:
    launch = launch_file(tmp_path, python(ENDING, respawn), "robot.launch.py")
    assert export("systemd", launch, provisioned(launch, tmp_path / "ks"), tmp_path / "out") == status


def test_components_have_nobody_who_loads_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The launcher does it, with a node of its own, which an engine does not have."""
    launch = launch_file(tmp_path, (DEMO_CONTAINER).read_text(), "robot.launch.xml")
    assert export("systemd", launch, provisioned(launch, tmp_path / "ks"), tmp_path / "out") == 1
    assert "by the launcher" in capsys.readouterr().err


def test_components_that_are_left_out_are_named_on_the_terminal_and_in_what_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    launch = launch_file(tmp_path, (DEMO_CONTAINER).read_text(), "robot.launch.xml")
    out = tmp_path / "out"
    assert export("systemd", launch, provisioned(launch, tmp_path / "ks"), out, "--accept-unexpressed") == 0
    said, written = capsys.readouterr().err, "".join(file.read_text() for file in out.glob("*.target"))
    for component in ("/robot1/talker", "/robot1/inner/listener"):
        assert f"component {component} is loaded into /robot1/container by the launcher" in said
        assert f"component {component} is loaded into" in written


DEMO_CONTAINER = Path(__file__).parents[3] / "fixtures/demo_ws/share/demo_nodes/launch/container.launch.xml"


def test_a_plan_with_problems_is_not_exported(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    launch = launch_file(tmp_path)
    ks = provisioned(launch, tmp_path / "ks")
    launch.write_text(TALK.replace("</launch>", '<node pkg="nowhere" exec="x"/></launch>'))
    assert export("systemd", launch, ks, tmp_path / "out", "--allow-missing-packages") == 1
    assert "nothing was written" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_an_enclave_that_is_not_provisioned_is_not_exported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    launch = launch_file(tmp_path)
    ks = provisioned(launch, tmp_path / "ks")
    launch.write_text(TALK.replace('name="ear"', 'name="other"'))
    assert export("systemd", launch, ks, tmp_path / "out") == 1
    assert "has no enclave /other; it has /ear, /front/speaker" in capsys.readouterr().err


@pytest.mark.parametrize("engine", ENGINES)
def test_devices_and_real_time_are_said_to_the_engines_that_know_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], engine: str
) -> None:
    launch = launch_file(tmp_path, TALK, "robot.launch.xml")
    ks = provisioned(launch, tmp_path / "ks")
    hosts = tmp_path / "hosts.yaml"
    hosts.write_text(
        "version: 1\nneeds:\n  - {nodes: [/front/*], devices: [/dev/video0], groups: [video], realtime: true}\n"
    )
    words = (engine, launch, ks, tmp_path / "out")
    status = export(*words, "--hosts", str(hosts))
    error = capsys.readouterr().err
    if engine == "kubernetes":
        assert status == 1 and "needs /dev/video0, real-time scheduling, which the cluster has to" in error
        assert export(*words, "--hosts", str(hosts), "--accept-unexpressed") == 0
    else:
        assert (status, error) == (0, "")
        hosts.write_text(hosts.read_text().replace("groups: [video], ", ""))
        assert export(*words, "--hosts", str(hosts)) == 0
        assert "name the group of the device" in capsys.readouterr().err


@pytest.mark.parametrize("engine", ENGINES)
def test_processes_on_zenoh_are_refused_since_nothing_would_lead_them_to_a_router(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], engine: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    launch = launch_file(tmp_path, TALK, "robot.launch.xml")
    ks = provisioned(launch, tmp_path / "ks")
    assert export(engine, launch, ks, tmp_path / "dds") == 0
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_zenoh_cpp")
    assert export(engine, launch, ks, tmp_path / "out", "--accept-unexpressed") == 1
    assert "on Zenoh (rmw_zenoh_cpp): without a router" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_keystore_of_another_enclave_scope_is_named_as_that(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    launch = launch_file(tmp_path)
    keystore = provisioned(launch, tmp_path / "ks")  # an enclave for each node
    words = ("--format", "systemd", "--keystore", str(keystore), "-o", str(tmp_path / "out"))
    assert main(["export", *words, "--prefix", str(DEMO_WS), "--enclave-scope", "launch", str(launch)]) == 1
    told = capsys.readouterr().err
    assert "has no enclave /; it has /ear, /front/speaker" in told and "--enclave-scope" in told
