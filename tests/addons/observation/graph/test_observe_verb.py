"""``secure-nodl observe`` beside programs that somebody else started."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from keystore import read_policy
from nodl.document import read_document
from tests.addons.observation.graph.conftest import Start
from tests.addons.observation.graph.nodes import LOOPBACK, Implementation, service, topic

ROOT = Path(__file__).parents[4]


def observe(domain: int, *words: str, status: int = 0) -> subprocess.CompletedProcess[str]:
    import os

    environment = {**os.environ, **LOOPBACK, "ROS_DOMAIN_ID": str(domain)}
    ran = subprocess.run(
        [sys.executable, "-m", "nodl.verb", "observe", *words],
        env=environment, cwd=ROOT, capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    assert ran.returncode == status, ran.stderr
    return ran


@pytest.mark.dds
def test_a_running_system_becomes_a_graph_a_policy_and_manifests(
    dds: Implementation, start: Start, domain_id: int, tmp_path: Path
) -> None:
    start(dds).tell(
        "node /r1/talker", *topic("/r1/chatter", writes=True), *service("/reset", serves=True), "list"
    )
    plan = tmp_path / "plan.json"
    process = {
        "package": "demo", "executable": "talker", "fqn": "/r1/talker", "namespace": "/r1", "parameters": {},
        "cmd": [*dds.command, str(domain_id), "/", "16"],
    }  # fmt: skip
    plan.write_text(json.dumps({"processes": [process], "components": []}))
    kept = tmp_path / "run.json"
    # Longer than the period after which Fast DDS repeats an endpoint's announcement that was lost, 3 s.
    seen = observe(domain_id, "--settle", "8", "--save", str(kept), "--launch", str(plan))
    assert "/r1/talker\n" in seen.stdout and "publisher /r1/chatter [std_msgs/msg/String]" in seen.stdout
    policy = tmp_path / "policy.xml"
    policy.write_text(observe(domain_id, str(kept), "--merge-only", "--format", "policy").stdout)
    (enclave,) = read_policy(policy).policy.enclaves
    assert enclave.path == "/r1/talker"
    rules = {(rule.operation.value, rule.expression) for rule in enclave.profiles[0].rules}
    assert rules == {("publish", "/r1/chatter"), ("reply", "/reset")}
    told = observe(domain_id, str(kept), "--merge-only", "-o", str(tmp_path / "manifests"))
    (written,) = (tmp_path / "manifests").iterdir()
    assert str(written) in told.stdout and "chatter: or /r1/chatter" in told.stderr
    (described,) = read_document(written)
    interface = described.interface
    assert interface.name == "talker" and interface.executable == "talker"
    assert {str(each.name) for each in interface.endpoints} == {"chatter", "/reset"}


@pytest.mark.dds
def test_where_nothing_runs_the_status_and_the_message_say_so(
    cyclone: Implementation, domain_id: int
) -> None:
    ran = observe(domain_id, "--for", "1s", status=1)
    assert "no node was seen; if nodes run in this domain" in ran.stderr
    assert "ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST" in ran.stderr


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--merge-only"], "needs observations to merge"),
        (["--for", "soon"], "is not a time such as 20s"),
        (["--domain-id", "233"], "invalid domain value"),
    ],
)
def test_wrong_usage_has_status_2(words: list[str], says: str) -> None:
    assert says in observe(1, *words, status=2).stderr


def test_a_file_that_is_no_observation_is_named(tmp_path: Path) -> None:
    bad = tmp_path / "bad.json"
    bad.write_text("{}")
    ran = observe(1, str(bad), "--merge-only", status=1)
    assert (
        f"{bad} is not what secure-nodl observe --save wrote" in ran.stderr and "Traceback" not in ran.stderr
    )
