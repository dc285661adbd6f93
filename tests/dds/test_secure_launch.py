"""``secure-launch --secure`` on the demo workspace, end to end: launch file in, secured talk out."""

from __future__ import annotations

import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.dds.demo import DEMO_WS, Node, environment

pytestmark = [pytest.mark.dds, pytest.mark.usefixtures("cyclone")]

LONGEST_SECONDS = 90.0


@dataclass(frozen=True)
class Launched:
    status: int
    output: str

    def lines_of(self, process: str) -> list[str]:
        """What ``process`` (a name without its number) printed, through the launcher."""
        return [line for line in self.output.splitlines() if re.match(rf"\[{process}-\d+\] ", line)]

    def heard(self, listener: str = "listener") -> list[str]:
        return [line for line in self.lines_of(listener) if "I heard: [" in line]


@dataclass(frozen=True)
class Launcher:
    """Runs ``secure-launch`` with the demo workspace, in a DDS domain of its own."""

    folder: Path
    domain: int

    @property
    def keystore(self) -> Path:
        return self.folder / "keystore"

    def __call__(self, *arguments: str) -> Launched:
        command = ["secure-launch", "--prefix", str(DEMO_WS), *arguments]
        env = {**environment(self.domain), "ROS_LOG_DIR": str(self.folder / "log")}
        result = subprocess.run(
            command,
            env=env,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=LONGEST_SECONDS,
        )
        return Launched(result.returncode, result.stdout)

    def secured(self, *arguments: str) -> Launched:
        return self("--secure", "--keystore", str(self.keystore), *arguments)


@pytest.fixture
def launch(tmp_path: Path, domain_id: int) -> Launcher:
    return Launcher(tmp_path, domain_id)


def enclaves(keystore: Path) -> set[str]:
    found = {path.parent.relative_to(keystore / "enclaves") for path in keystore.glob("enclaves/**/key.pem")}
    return {"/" + str(path).removeprefix(".") for path in found}


@pytest.mark.parametrize("language", ["xml", "yaml", "py"])
def test_talker_and_listener(launch: Launcher, language: str) -> None:
    launched = launch.secured("demo_nodes", f"talker_listener.launch.{language}", "count:=3")
    assert launched.status == 0, launched.output
    assert len(launched.heard()) >= 3, launched.output
    for name in ("talker", "listener"):
        assert any("is up, secured by enclave /" in line for line in launched.lines_of(name)), launched.output
    assert enclaves(launch.keystore) == {"/"}


@pytest.mark.parametrize(
    ("launch_file", "expected"),
    [
        ("talker_listener_namespace", {"/robot1"}),
        ("talker_listener_remap", {"/speaker", "/ear"}),
        ("shared_enclave", {"/shared"}),
    ],
)
def test_names_changed_by_launch(launch: Launcher, launch_file: str, expected: set[str]) -> None:
    """Pushed namespace, remapped nodes and topics, two nodes in one enclave."""
    launched = launch.secured("demo_nodes", f"{launch_file}.launch.xml", "count:=3")
    assert launched.status == 0, launched.output
    assert len(launched.heard()) >= 3, launched.output
    assert enclaves(launch.keystore) == expected


def test_services_and_actions(launch: Launcher) -> None:
    launched = launch.secured("demo_nodes", "services_actions.launch.xml")
    assert launched.status == 0, launched.output
    assert "Result: 2 + 3 = 5" in launched.output
    assert "Result: [0, 1, 1, 2, 3, 5, 8, 13]" in launched.output
    assert enclaves(launch.keystore) == {
        "/operator",
        "/robot1/adder",
        "/robot1/arm/counter",
        "/robot1/arm/planner",
    }


def test_the_intruder_is_refused_and_the_talk_goes_on(launch: Launcher) -> None:
    launched = launch.secured("demo_nodes", "talker_listener_intruder.launch.xml", "count:=10")
    assert launched.status == 0, launched.output
    assert any(
        "REFUSED: DDS refuses the publisher on rt/chatter" in line for line in launched.lines_of("intruder")
    )
    assert len(launched.heard()) >= 10
    assert "forged" not in launched.output


def test_without_secure_the_intruder_is_heard(launch: Launcher) -> None:
    """The control of the test above."""
    launched = launch("demo_nodes", "talker_listener_intruder.launch.xml", "count:=10")
    assert any("NOT REFUSED" in line for line in launched.lines_of("intruder")), launched.output
    assert any("forged by the intruder" in line for line in launched.heard()), launched.output
    assert launched.status != 0
    assert not launch.keystore.exists()


def test_the_same_listener_hears_nothing_without_its_enclave(launch: Launcher, domain_id: int) -> None:
    """It listens from outside while the launch talks to its own listener."""
    outsider = Node("listener", environment(domain_id), "-p", "seconds:=10")
    launched = launch.secured("demo_nodes", "talker_listener.launch.xml", "count:=5")
    outside = outsider.end()
    assert len(launched.heard()) >= 5, launched.output
    assert outside.says("NOT secured") and outside.says("heard 0 messages"), outside.output


TAMPER = """#!/bin/sh
# Between the last look of the launcher and the start of the process: one topic name changed.
sed -i 's|<topic>rt/rosout</topic>|<topic>rt/chatter</topic>|' \\
    "$ROS_SECURITY_KEYSTORE/enclaves/intruder/permissions.p7s"
exec "$@"
"""
TAMPERED_LAUNCH = """
<launch>
  <node pkg="demo_nodes" exec="talker" enclave="talker" output="screen">
    <param name="seconds" value="3"/>
  </node>
  <node pkg="demo_nodes" exec="intruder" enclave="intruder" output="screen" launch-prefix="{prefix}"/>
</launch>
"""


def test_tampered_permissions_are_refused_and_the_status_tells(launch: Launcher, tmp_path: Path) -> None:
    prefix = tmp_path / "tamper"
    prefix.write_text(TAMPER, encoding="utf-8")
    prefix.chmod(0o755)
    launch_file = tmp_path / "tampered.launch.xml"
    launch_file.write_text(TAMPERED_LAUNCH.format(prefix=prefix), encoding="utf-8")
    launched = launch.secured("--accept-prefix", prefix.name, str(launch_file))
    assert "<topic>rt/rosout</topic>" not in _permissions(launch), "the document was not tampered with"
    assert "DDS refuses the participant of enclave /intruder" in launched.output, launched.output
    assert launched.status != 0
    assert any("Publishing" in line for line in launched.lines_of("talker")), "the others go on"


def _permissions(launch: Launcher) -> str:
    return (launch.keystore / "enclaves/intruder/permissions.p7s").read_text(encoding="utf-8")


def test_a_second_launch_uses_what_the_first_made(launch: Launcher) -> None:
    """Nothing is rewritten; the nodes talk as before."""
    arguments = ("demo_nodes", "talker_listener.launch.xml", "count:=1")
    assert launch.secured(*arguments).status == 0
    before = {path: (path.stat().st_mtime_ns, path.read_bytes()) for path in _files(launch.keystore)}
    launched = launch.secured(*arguments)
    assert launched.status == 0 and launched.heard(), launched.output
    assert {path: (path.stat().st_mtime_ns, path.read_bytes()) for path in _files(launch.keystore)} == before


def _files(keystore: Path) -> list[Path]:
    return sorted(path for path in keystore.rglob("*") if path.is_file() and path.name != ".lock")
