"""The flow as a library: the custom launcher of ``fixtures/``, and each of the three calls by itself."""

from __future__ import annotations

import asyncio
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from enclave_launch import (
    ManifestError,
    ProvisionError,
    ResolveOptions,
    UsageError,
    provision,
    resolve,
    run_async,
)
from enclave_launch.secured import PlanProvider

DEMO = Path(__file__).parents[2] / "fixtures" / "demo_ws"
TALKER_LISTENER = DEMO / "share" / "demo_nodes" / "launch" / "talker_listener.launch.xml"
OPTIONS = ResolveOptions(prefixes=(DEMO,))


@pytest.fixture(autouse=True)
def own_log_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / "log"))


@pytest.mark.parametrize("arguments", [{"count": "2"}, [("count", 2)], ["count:=2"], [["count", "2"]]])
def test_arguments_that_are_no_pairs_of_texts_are_wrong_usage(arguments: Any) -> None:
    with pytest.raises(UsageError, match=r"^launch arguments are pairs of texts, as in \[\('count', '2'\)\]"):
        resolve(TALKER_LISTENER, arguments, options=OPTIONS)
    assert resolve(TALKER_LISTENER, [("count", "2")], options=OPTIONS).processes


@pytest.mark.dds
def test_the_custom_launcher_of_twenty_lines_runs_a_secured_talker_and_listener(tmp_path: Path) -> None:
    pytest.importorskip("cyclonedds") if os.environ.get("CI") != "true" else None
    launcher = DEMO.parent / "custom_launcher.py"
    command = [sys.executable, str(launcher), str(TALKER_LISTENER), f"{tmp_path}/ks", "--prefix", str(DEMO)]
    run = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False, cwd=tmp_path)
    assert run.returncode == 0, run.stdout + run.stderr
    assert "talker-1 runs in /" in run.stdout
    assert "I heard: [Hello World: " in run.stdout
    code = launcher.read_text().split("import argparse")[1]
    assert len([line for line in code.splitlines() if line.strip()]) <= 20


def test_resolving_decides_everything_and_touches_nothing(tmp_path: Path) -> None:
    before = dict(os.environ), set(sys.modules) & {"launch", "launch_ros"}
    plan = resolve(TALKER_LISTENER, [("count", "3")], options=OPTIONS)
    assert [process.fqn for process in plan.processes] == [
        "<node_namespace_unspecified>/talker",
        "<node_namespace_unspecified>/listener",
    ]
    assert [node.fqn for node in plan.nodes] == ["/talker", "/listener"]
    assert (dict(os.environ), set(sys.modules) & {"launch", "launch_ros"}) == before
    assert list(tmp_path.iterdir()) == []


def test_provisioning_twice_changes_nothing(tmp_path: Path) -> None:
    plan = resolve(TALKER_LISTENER, options=OPTIONS)
    assert provision(plan, tmp_path / "ks").report.changed
    files = {path: path.stat().st_mtime_ns for path in (tmp_path / "ks").rglob("*")}
    assert not provision(plan, tmp_path / "ks").report.changed
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "ks").rglob("*")} == files


def test_a_node_taken_out_of_the_launch_file_takes_exactly_its_permissions_with_it(tmp_path: Path) -> None:
    file = tmp_path / "robot.launch.xml"
    file.write_text(
        '<launch><node pkg="demo_nodes" exec="talker"/>\n<node pkg="demo_nodes" exec="listener"/></launch>'
    )

    def topics() -> set[str]:
        text = (tmp_path / "ks" / "enclaves" / "permissions.xml").read_text()
        return {piece.split("</topic>")[0] for piece in text.split("<topic>")[1:]}

    provision(resolve(file, options=OPTIONS), tmp_path / "ks")
    with_listener = topics()
    file.write_text('<launch><node pkg="demo_nodes" exec="talker"/></launch>')
    provision(resolve(file, options=OPTIONS), tmp_path / "ks")
    assert {name for name in with_listener - topics() if "listener" not in name} == set()
    assert not any("listener" in name for name in topics())
    assert "rt/chatter" in topics() and "rr/talker/get_parametersReply" in topics()


def test_two_launch_files_on_one_keystore_both_keep_what_they_need(tmp_path: Path) -> None:
    files = []
    for name in ("talker", "listener"):
        files.append(tmp_path / f"{name}.launch.xml")
        files[-1].write_text(f'<launch><node pkg="demo_nodes" exec="{name}"/></launch>')
    first = provision(resolve(files[0], options=OPTIONS), tmp_path / "ks")
    provision(resolve(files[1], options=OPTIONS), tmp_path / "ks")
    text = (tmp_path / "ks" / "enclaves" / "permissions.xml").read_text()
    assert "rr/talker/get_parametersReply" in text and "rr/listener/get_parametersReply" in text
    process = first.plan.processes[0].process
    assert PlanProvider(first).ensure(process), "the one that runs starts its next process"


def test_a_plan_with_problems_is_not_provisioned(tmp_path: Path) -> None:
    file = tmp_path / "unnamed.launch.xml"
    file.write_text('<launch><node exec="/bin/true" name="mystery"/></launch>')
    plan = resolve(file, options=OPTIONS)
    assert "no NoDL manifest" in plan.problems[0].text
    with pytest.raises(ManifestError, match="nothing was started or written"):
        provision(plan, tmp_path / "ks")
    assert not (tmp_path / "ks").exists()


def test_errors_of_the_keystore_are_errors_of_the_flow(tmp_path: Path) -> None:
    (tmp_path / "ks").mkdir()
    (tmp_path / "ks" / "file").touch()
    with pytest.raises(ProvisionError, match="not a keystore"):
        provision(resolve(TALKER_LISTENER, options=OPTIONS), tmp_path / "ks")


def echo_file(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "echo.launch.xml"
    path.write_text(f"<launch>{text}</launch>")
    return path


EchoVariables = Callable[[str], dict[str, str]]


@pytest.fixture
def variables_of_a_secured_process(tmp_path: Path) -> EchoVariables:
    """Run an executable with the given attributes secured, and give the ROS_SECURITY variables it had."""

    def run(attributes: str) -> dict[str, str]:
        file = echo_file(tmp_path, f"<executable cmd=\"sh -c 'env > {tmp_path}/env'\" {attributes}/>")
        launch = provision(resolve(file), tmp_path / "ks")
        assert asyncio.run(run_async(launch)) == 0
        lines = (line.partition("=") for line in (tmp_path / "env").read_text().splitlines())
        return {name: value for name, _, value in lines if name.startswith("ROS_SECURITY")}

    return run


def test_an_executable_gets_its_enclave_through_the_override(
    variables_of_a_secured_process: EchoVariables, tmp_path: Path
) -> None:
    assert variables_of_a_secured_process('enclave="/files"') == {
        "ROS_SECURITY_ENABLE": "true",
        "ROS_SECURITY_KEYSTORE": str(tmp_path / "ks"),
        "ROS_SECURITY_STRATEGY": "Enforce",
        "ROS_SECURITY_ENCLAVE_OVERRIDE": "/files",
    }
    assert (tmp_path / "ks" / "enclaves" / "files" / "permissions.p7s").exists()


def test_an_executable_without_enclave_is_still_told_that_security_is_on(
    variables_of_a_secured_process: EchoVariables,
) -> None:
    variables = variables_of_a_secured_process("")
    assert variables["ROS_SECURITY_STRATEGY"] == "Enforce"
    assert "ROS_SECURITY_ENCLAVE_OVERRIDE" not in variables


TAMPERINGS = {
    "another signature": ("permissions.p7s", lambda data: data.replace(b"MII", b"MIJ", 1)),
    "other permissions, unsigned": (
        "permissions.p7s",
        lambda data: data.replace(b"rt/chatter", b"rt/chatteR"),
    ),
    "the reviewed copy": ("permissions.xml", lambda data: data.replace(b"rt/chatter", b"rt/chatteR")),
    "no permissions at all": ("permissions.p7s", None),
    "another key": ("key.pem", lambda data: b""),
}


@pytest.mark.parametrize("case", TAMPERINGS)
def test_an_enclave_changed_after_provisioning_starts_nothing(case: str, tmp_path: Path) -> None:
    name, change = TAMPERINGS[case]
    launch = provision(resolve(TALKER_LISTENER, [("seconds", "2")], options=OPTIONS), tmp_path / "ks")
    file = tmp_path / "ks" / "enclaves" / name
    if change is None:
        file.unlink()
    else:
        changed = change(file.read_bytes())
        assert changed != file.read_bytes()
        file.write_bytes(changed)
    assert asyncio.run(run_async(launch)) == 1
    text = "".join(path.read_text() for path in (tmp_path / "log").rglob("launch.log"))
    if case != "another signature":  # which a cheap look does not see: DDS refuses that process
        assert "is no longer what was provisioned for this launch" in text
        assert "process started" not in text


@pytest.mark.parametrize("prefixes", [str(DEMO), DEMO, [str(DEMO)], (DEMO,), iter([DEMO])])
def test_one_prefix_is_one_prefix_however_it_is_given(prefixes: Any) -> None:
    assert ResolveOptions(prefixes=prefixes).prefixes == (DEMO,)


def test_a_plan_reads_as_one_would_say_it() -> None:
    plan = resolve(DEMO / "share/demo_nodes/launch/talker_listener.launch.xml", options=OPTIONS)
    talker, listener = plan.processes
    assert (talker.name, talker.process.package, talker.process.executable) == (
        "talker",
        "demo_nodes",
        "talker",
    )
    assert talker.enclave is not None and talker.enclave.path == "/"
    assert talker.location.line == 5 and listener.process.parameters["count"] == 5
