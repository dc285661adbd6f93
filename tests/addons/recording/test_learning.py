"""Learning on real rclpy: one launch teaches, another one of the same programs is planned as it really is."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from enclave_addons.recording.record.assembly import Record, read_record
from enclave_addons.recording.record.requested import all_requested
from enclave_launch import LaunchPlan, ResolveOptions, resolve
from enclave_launch.diagnostics import Code
from enclave_launch.policy.derivation import LIST_NAMES
from nodl.document import read_document
from nodl.name_template import NameTemplate, ParameterPart
from nodl.verb import main as secure_nodl
from tests.addons.recording.conftest import ROOT, prefix_of_rclpy, rclpy_python
from tests.programs import install_package, python_program

WORKSPACE = ROOT / "fixtures" / "rclpy_ws"
LAUNCH_FILES = WORKSPACE / "share" / "rclpy_nodes" / "launch"
RELEASES = ("jazzy", "kilted")

Graph = dict[str, dict[str, set[str]]]


class Learnt(NamedTuple):
    release: str
    folder: Path
    output: str


def environment(release: str, folder: Path, **more: str) -> dict[str, str]:
    """Real rclpy on loopback."""
    return {
        **os.environ,
        "RCLPY_PYTHON": str(rclpy_python(release)),
        "AMENT_PREFIX_PATH": str(prefix_of_rclpy(release, folder / "rcl")),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_LOG_DIR": str(folder / "log"),
        "ROS_DISTRO": release,
        **more,
    }


def secure_launch(*arguments: str, variables: dict[str, str]) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "enclave_launch", "--prefix", str(WORKSPACE), *arguments]
    return subprocess.run(
        command, env=variables, cwd=ROOT, capture_output=True, text=True, check=False, timeout=120
    )


@pytest.fixture(scope="session", params=RELEASES)
def learnt(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Learnt:
    release: str = request.param
    folder = tmp_path_factory.mktemp(release)
    into = folder / "learnt"
    ran = secure_launch(
        *("--learn", str(into), "--learn-for", "3s", "--learn-isolation", "local"),
        *("rclpy_nodes", "learn.launch.xml"),
        variables=environment(release, folder),
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr
    return Learnt(release, into, ran.stdout + ran.stderr)


def record_of(learnt: Learnt) -> Record:
    (file,) = (learnt.folder / "records").glob("*.record")
    return read_record(file.read_bytes())


def test_a_learning_run_says_what_it_is(learnt: Learnt) -> None:
    assert "unsecured" in learnt.output
    assert "isolated by: discovery on this machine only, in a DDS domain of its own" in learnt.output
    assert "device files are not isolated" in learnt.output


def test_nothing_of_the_record_is_lost(learnt: Learnt) -> None:
    record = record_of(learnt)
    assert record.complaints == []
    assert record.silent() == []
    assert len(all_requested(record.attributed())) == 12


def template(learnt: Learnt, file: str, place: int = 0) -> NameTemplate:
    (node,) = read_document(learnt.folder / file)
    return node.interface.endpoints[place].name


def test_manifests_hold_names_as_sources_write_them(learnt: Learnt) -> None:
    (node,) = read_document(learnt.folder / "rclpy_nodes__services.nodl.yaml")
    assert node.interface.package == "rclpy_nodes"
    assert [str(endpoint.name) for endpoint in node.interface.endpoints] == [
        "set",
        "~/reload",
        "/inner/gather",
    ]


def test_names_from_parameters_and_arguments_say_so(learnt: Learnt) -> None:
    assert template(learnt, "rclpy_nodes__listener.nodl.yaml", 1).parts == (ParameterPart("input_topic"),)
    assert template(learnt, "rclpy_nodes__lister.nodl.yaml").parts == (
        ParameterPart("source_list", None, "each"),
    )
    assert template(learnt, "rclpy_nodes__mux.nodl.yaml", 1).parts == (ParameterPart("inputs.*.topic"),)
    relay = [template(learnt, "rclpy_nodes__relay.nodl.yaml", place).parts for place in range(3)]
    assert relay == [(ParameterPart("<2>"),), (ParameterPart("echo_topic", "echo"),), (ParameterPart("<1>"),)]


def test_a_parameter_that_only_the_program_knows_is_known_with_its_default(learnt: Learnt) -> None:
    (node,) = read_document(learnt.folder / "rclpy_nodes__talker.nodl.yaml")
    names = [endpoint.name.parts for endpoint in node.interface.endpoints]
    assert (ParameterPart("mood_topic", "mood"),) in names and ("chatter",) in names


def test_a_second_run_proves_a_parameter_that_only_the_program_knows(tmp_path: Path) -> None:
    file = tmp_path / "one.launch.xml"
    for inside in ("", '<param name="input_topic" value="murmur"/>'):
        file.write_text(f'<launch><node pkg="rclpy_nodes" exec="listener">{inside}</node></launch>')
        ran = secure_launch(
            *(
                "--learn",
                str(tmp_path / "learnt"),
                "--learn-for",
                "2s",
                "--learn-isolation",
                "local",
                str(file),
            ),
            variables=environment("jazzy", tmp_path),
        )
        assert ran.returncode == 0, ran.stdout + ran.stderr
    text = (tmp_path / "learnt" / "rclpy_nodes__listener.nodl.yaml").read_text()
    assert "parameter: input_topic\n      default: chatter\n      proof: another value was followed" in text


def test_a_lifecycle_node_that_was_active_is_complete(learnt: Learnt) -> None:
    text = (learnt.folder / "rclpy_nodes__lifecycle.nodl.yaml").read_text()
    (node,) = read_document(learnt.folder / "rclpy_nodes__lifecycle.nodl.yaml")
    assert node.interface.lifecycle and "incomplete" not in text
    assert [str(endpoint.name) for endpoint in node.interface.endpoints] == ["configured", "activated"]


def test_the_records_bear_out_the_manifests(learnt: Learnt, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["check-record", str(learnt.folder), "--nodl", str(learnt.folder), "--judge", "manifest"]
    status = secure_nodl(arguments)
    output = capsys.readouterr().out
    assert status == 0, output
    assert output.count("as recorded") == 12
    assert not any(word in output for word in ("missing:", "never seen:", "wrong:"))


def test_a_manifest_that_lacks_a_name_fails_against_the_record(
    learnt: Learnt, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for file in learnt.folder.glob("*.nodl.yaml"):
        text = file.read_text().replace("name: chatter\n", "name: gibberish\n")
        (tmp_path / file.name).write_text(text)
    assert (
        secure_nodl(["check-record", str(learnt.folder), "--nodl", str(tmp_path), "--judge", "manifest"]) == 1
    )
    output = capsys.readouterr().out
    assert "missing: /speaker: publisher /gossip (written 'chatter', std_msgs/msg/String)" in output
    assert "never seen: /speaker: publisher /gibberish" in output


def resolved(launch_file: str, release: str, folder: Path) -> LaunchPlan:
    prefixes = (WORKSPACE, prefix_of_rclpy(release, folder.parent / "rcl"))
    options = ResolveOptions(prefixes=prefixes, manifests=(folder,), distro=release, infer=False)
    plan = resolve(LAUNCH_FILES / launch_file, options=options)
    assert plan.problems == ()
    return plan


def graph_of(plan: LaunchPlan) -> Graph:
    graph: Graph = {}
    for enclave in plan.derived.policy.enclaves:
        for profile in enclave.profiles:
            node = graph.setdefault(f"{profile.ns.rstrip('/')}/{profile.node}", {})
            for rule in profile.rules:
                node.setdefault(LIST_NAMES[rule.operation], set()).add(rule.expression)
    return graph


@pytest.fixture
def other_launch(learnt: Learnt, tmp_path: Path, domain_id: int) -> Iterator[dict[str, str]]:
    """Another launch file than the one that was learnt, while it runs; its environment."""
    variables = environment(learnt.release, tmp_path, ROS_DOMAIN_ID=str(domain_id))
    command = [sys.executable, "-m", "enclave_launch", "--prefix", str(WORKSPACE)]
    launch = subprocess.Popen(
        [*command, "rclpy_nodes", "other.launch.xml"],
        env=variables,
        cwd=ROOT,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        yield variables
    finally:
        launch.send_signal(signal.SIGINT)
        launch.wait(30)


@pytest.fixture
def live_graph(learnt: Learnt, other_launch: dict[str, str]) -> Graph:
    look = [str(rclpy_python(learnt.release)), str(Path(__file__).parent / "live_graph.py"), "12"]
    seen = subprocess.run(look, env=other_launch, capture_output=True, text=True, check=True, timeout=180)
    return {
        node: {kind: {row[0] for row in rows} for kind, rows in kinds.items() if rows}
        for node, kinds in json.loads(seen.stdout.splitlines()[-1]).items()
    }


def test_after_one_run_another_launch_has_all_it_needs_and_what_is_beyond_is_told(
    learnt: Learnt, live_graph: Graph
) -> None:
    """A name that had a parameter's value may be fixed as well: both readings are granted."""
    plan = resolved("other.launch.xml", learnt.release, learnt.folder)
    graph = graph_of(plan)
    assert sorted(graph) == sorted(live_graph)
    told = " ".join(each.text for each in plan.warnings if each.code is Code.RECORD_UNDECIDED)
    for node, kinds in live_graph.items():
        for kind, names in kinds.items():
            assert names <= graph[node][kind], node
            for beyond in graph[node][kind] - names:
                assert beyond.rpartition("/")[2] in told, (node, beyond)


@pytest.mark.dds
def test_another_launch_runs_as_planned(learnt: Learnt, other_launch: dict[str, str]) -> None:
    """With namespaces of the user's own ROS arguments, and with the events of an introspected service."""
    command = [sys.executable, "-m", "enclave_addons.review.verb", "drift", "--prefix", str(WORKSPACE)]
    ran = subprocess.run(
        [*command, "--nodl", str(learnt.folder), "--for", "60s", "rclpy_nodes", "other.launch.xml"],
        env=other_launch, cwd=ROOT, capture_output=True, text=True, timeout=180,
    )  # fmt: skip
    assert (ran.returncode, ran.stdout.partition(";")[0]) == (0, "as planned"), ran.stdout


LAZY = """import rclpy
from rclpy.node import Node
from std_msgs.msg import String


class Lazy(Node):
    def __init__(self):
        super().__init__("lazy")
        self.output = self.create_publisher(String, "scan", 1)
        self.input = None
        self.create_timer(0.05, self.look)

    def look(self):
        if self.input is None and self.output.get_subscription_count():
            self.input = self.create_subscription(String, "cloud_in", self.output.publish, 1)


rclpy.init()
rclpy.spin(Lazy())
"""


def test_what_was_never_seen_and_the_source_makes_is_told_when_learning_ends(tmp_path: Path) -> None:
    """A subscription that exists only while somebody reads the node's output."""
    program = python_program(LAZY, rclpy_python("jazzy"))
    install_package(tmp_path / "ws", "lazy_nodes", {"lazy": program})
    launch_file = tmp_path / "lazy.launch.xml"
    launch_file.write_text('<launch><node pkg="lazy_nodes" exec="lazy"/></launch>')
    ran = secure_launch(
        *("--prefix", str(tmp_path / "ws"), "--learn", str(tmp_path / "learnt"), "--learn-for", "2s"),
        *("--learn-isolation", "local", str(launch_file)),
        variables=environment("jazzy", tmp_path),
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert "node lazy: never seen: subscription /cloud_in (its source makes it" in ran.stderr, ran.stderr
    assert "publisher /scan (" not in ran.stderr
    assert "--also unseen" in ran.stderr
