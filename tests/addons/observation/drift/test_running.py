"""Drift of real launches on real DDS: what is put beside them is found, by ``--watch`` and by ``secure-plan drift``."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import keystore
from keystore import Domains, create_tool_enclave
from tests.addons.observation.drift.planned import DEMO_WS, ROOT
from tests.addons.observation.graph.conftest import Start
from tests.addons.observation.graph.conftest import cyclone as cyclone
from tests.addons.observation.graph.conftest import domain_id as domain_id
from tests.addons.observation.graph.conftest import fastdds as fastdds
from tests.addons.observation.graph.conftest import start as start
from tests.addons.observation.graph.nodes import LONGEST_SECONDS, LOOPBACK, Implementation, topic

pytestmark = pytest.mark.dds

FOR_EVER = ("count:=0", "seconds:=0")
LAUNCH = ("demo_nodes", "talker_listener.launch.xml")


@pytest.fixture
def environment(domain_id: int) -> dict[str, str]:
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', os.defpath)}"
    return {**os.environ, **LOOPBACK, "ROS_DOMAIN_ID": str(domain_id), "PATH": path}


class Launch:
    """A launch with ``--watch``, and what that tells."""

    def __init__(self, environment: dict[str, str], folder: Path, *options: str) -> None:
        self._report, self.shown = folder / "drift.jsonl", folder / "shown"
        command = [
            sys.executable, "-m", "enclave_launch", "-n", "--prefix", str(DEMO_WS), *options, "--watch",
            "--watch-report", str(self._report), *LAUNCH, *FOR_EVER,
        ]  # fmt: skip
        with self.shown.open("wb") as shown:
            self.process = subprocess.Popen(
                command, env=environment, cwd=ROOT, stdout=shown, stderr=subprocess.STDOUT
            )

    @property
    def told(self) -> list[dict[str, Any]]:
        return (
            [json.loads(line) for line in self._report.read_text().splitlines()]
            if self._report.exists()
            else []
        )

    def wait_for(self, text: str) -> None:
        self._wait(lambda: text in self.shown.read_text(errors="replace"), text)

    def wait_until_told(self, kind: str, event: str = "new") -> dict[str, Any]:
        def found() -> list[dict[str, Any]]:
            return [each for each in self.told if (each["kind"], each["event"]) == (kind, event)]

        self._wait(lambda: bool(found()), f"{event} {kind}")
        return found()[0]

    def _wait(self, done: Any, what: str) -> None:
        end = time.monotonic() + LONGEST_SECONDS
        while not done():
            shown = self.shown.read_text(errors="replace")
            assert self.process.poll() is None and time.monotonic() < end, f"no {what}: {self.told}\n{shown}"
            time.sleep(0.1)

    def end(self) -> int:
        self.process.send_signal(2)
        return self.process.wait(60)


@contextlib.contextmanager
def launched(environment: dict[str, str], folder: Path, *options: str) -> Iterator[Launch]:
    launch = Launch(environment, folder, *options)
    try:
        launch.wait_for("I heard")
        yield launch
    finally:
        if launch.process.poll() is None:
            launch.end()


def test_an_intruder_beside_a_launch_is_told_with_its_process_and_when_it_has_gone(
    fastdds: Implementation, start: Start, environment: dict[str, str], tmp_path: Path
) -> None:
    with launched(environment, tmp_path) as launch:
        assert launch.told == []
        intruder = start(fastdds).tell("node /intruder", *topic("/chatter", writes=False), "list")
        told = launch.wait_until_told("unplanned-node")
        assert (told["subject"], told["level"]) == ("/intruder", "alarm") and str(intruder.pid) in told["who"]
        intruder.end()
        launch.wait_until_told("unplanned-node", "over")
        assert launch.end() == 1, "there was an alarm"
        # On a busy machine the participant may be seen before it says which node it is.
        assert {each["kind"] for each in launch.told} <= {"unplanned-node", "unplanned-process"}
        assert "drift: alarm: unplanned-node: /intruder is not planned" in launch.shown.read_text()


def test_each_intruder_beside_a_secured_launch_is_told(
    cyclone: Implementation, start: Start, environment: dict[str, str], tmp_path: Path, domain_id: int
) -> None:
    root, other = tmp_path / "ks", tmp_path / "other"
    with launched(environment, tmp_path, "--secure", "--keystore", str(root)) as launch:
        assert launch.told == []
        nodes = ["node /intruder", *topic("/chatter", writes=False), "list"]
        start(cyclone).tell(*nodes)
        launch.wait_until_told("not-secured")
        keystore.create_keystore(other, keystore.CreateOptions(domains=Domains.single(domain_id)))
        keystore.create_enclave(other, "/foreign", allow_all=True)
        start(cyclone, str(other / "enclaves" / "foreign"), enclave="/").tell(*nodes)
        launch.wait_until_told("other-ca")
        start(cyclone, str(root / "enclaves"), enclave="/").tell(
            *nodes
        )  # the talker's own key and permissions
        told = launch.wait_until_told("enclave-of-another")
        assert told["subject"] == "/intruder" and told["enclave"] == "/"
        double = start(cyclone, str(root / "enclaves"), enclave="/").tell("node /talker", "list")
        told = launch.wait_until_told("stranger")  # right in enclave and name: only its process gives it away
        assert f"process {double.pid} " in told["who"]
        # On a busy machine a participant may be seen before it says which node it is.
        assert {each["kind"] for each in launch.told} - {"unplanned-process"} == {
            "not-secured", "other-ca", "enclave-of-another", "stranger",
        }  # fmt: skip


def drift(environment: dict[str, str], *words: str) -> tuple[int, dict[str, Any]]:
    ran = subprocess.run(
        [sys.executable, "-m", "enclave_addons.review.verb", "drift", "--prefix", str(DEMO_WS),
         *LAUNCH, *FOR_EVER, "--format", "json", *words],
        env=environment, cwd=ROOT, capture_output=True, text=True, timeout=150,
    )  # fmt: skip
    assert "Traceback" not in ran.stderr, ran.stderr
    return ran.returncode, json.loads(ran.stdout) if ran.stdout else {"error": ran.stderr}


def test_a_running_system_is_held_against_the_plan_from_outside(
    cyclone: Implementation, start: Start, environment: dict[str, str], tmp_path: Path
) -> None:
    root = tmp_path / "ks"
    with launched(environment, tmp_path, "--secure", "--keystore", str(root)) as launch:
        enclave = create_tool_enclave(root, "observe").enclave
        security = ("--keystore", str(root), "--enclave", enclave)
        status, document = drift(environment, "--settle", "2", *security)
        alarms = [each for each in document["findings"] if each["level"] == "alarm"]
        assert (status, document["drift"], alarms) == (0, False, []), launch.shown.read_text()
        assert document["nodes"] == ["/listener", "/talker"]
        start(cyclone).tell("node /intruder", *topic("/chatter", writes=False), "list")
        status, document = drift(environment, "--settle", "2", "--for", "4", *security)
        assert status == 1 and {
            each["kind"] for each in document["findings"] if each["level"] == "alarm"
        } == {"not-secured"}


def test_a_launch_on_loopback_is_found_by_who_looks_at_the_network_card(
    cyclone: Implementation, environment: dict[str, str], tmp_path: Path
) -> None:
    """As a new user does: the demo's nodes talk on loopback, drift is called without any variable."""
    elsewhere = {name: text for name, text in environment.items() if name not in LOOPBACK}
    with launched(environment, tmp_path):
        status, document = drift(elsewhere, "--settle", "2", "--for", "8")
    assert {each["level"] for each in document["findings"]} <= {"note"}
    assert (status, document["drift"], document["complete"]) == (0, False, True)
    assert document["nodes"] == ["/listener", "/talker"]


def test_what_is_not_seen_is_neither_as_planned_nor_missing_and_what_cannot_be_observed_has_a_status_of_its_own(
    cyclone: Implementation, environment: dict[str, str], tmp_path: Path
) -> None:
    status, document = drift(environment, "--settle", "0.5", "--for", "1")
    assert (status, document["drift"], document["complete"]) == (4, False, False)
    assert [each["kind"] for each in document["findings"]] == ["out-of-sight"]
    keystore.create_keystore(tmp_path / "ks")
    status, document = drift(environment, "--keystore", str(tmp_path / "ks"), "--enclave", "/tools/observe")
    assert status == 3 and "is not the directory of an enclave" in document["error"]
    assert drift(environment, "--enclave", "/tools/observe")[0] == 2


@pytest.mark.parametrize(
    "words", [["--watch-report", "x"], ["--watch-accept", "/x"], ["--watch", "--dry-run"]]
)
def test_options_of_watch_that_would_have_no_effect_are_refused(words: list[str]) -> None:
    ran = subprocess.run(
        [sys.executable, "-m", "enclave_launch", "--prefix", str(DEMO_WS), *words, *LAUNCH],
        cwd=ROOT, capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert ran.returncode == 2 and "--watch" in ran.stderr
