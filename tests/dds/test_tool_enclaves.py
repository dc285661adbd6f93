"""Enclaves of tools on real DDS: what a tool needs on its target can be made, its neighbour cannot.

The endpoints are written down by hand, as ``ros2`` commands were seen to make them; the table under test is not asked.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

import pytest

import keystore
from keystore.formats.domains import Domains
from keystore.formats.policy import EnclavePolicy, Operation, Profile
from keystore.steps.tool_enclaves import create_tool_enclave
from nodl.graph.cyclone import CycloneObserver, ObserverError
from nodl.graph.model import Graph
from tests.dds.our_keystore import PARAMETER_SERVICES, allow, provision
from tests.dds.probe import Participant, Probe
from tests.graph.conftest import Start
from tests.graph.conftest import start as start
from tests.graph.nodes import LOOPBACK, Implementation, topic, wait_for

pytestmark = pytest.mark.dds

DISCOVERY = ("ros_discovery_info",)
ME = f"_ros2cli_{os.getpid()}"


def client(service: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """What is published and subscribed."""
    return (f"rq{service}Request",), (f"rr{service}Reply",)


def clients(node: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    both = [client(f"{node}/{service}") for service in PARAMETER_SERVICES]
    return tuple(p for publish, _ in both for p in publish), tuple(
        s for _, subscribe in both for s in subscribe
    )


# Every command of ros2cli, whatever it does.
CLI_PUBLISHES = ("rt/rosout", "rt/parameter_events", f"rr/{ME}/get_type_descriptionReply", *DISCOVERY)
CLI_SUBSCRIBES = (f"rq/{ME}/get_type_descriptionRequest", *DISCOVERY)

# tool, target, may publish, may subscribe, may not publish, may not subscribe
CASES = {
    "list": ((), (), (), ("rt/chatter",), ("rt/chatter",)),
    "echo": (("/chatter",), (), ("rt/chatter",), ("rt/chatter",), ("rt/other", "rt/chatter/more", "rt/")),
    "pub": (("/chatter",), ("rt/chatter",), (), ("rt/other",), ("rt/chatter",)),
    "param": (("/front/talker",), *clients("/front/talker"), clients("/talker")[0], clients("/front/other")[1]),
    "call": (("/reset",), *client("/reset"), *client("/stop")),
}  # fmt: skip


@pytest.fixture
def root(tmp_path: Path, domain_id: int) -> Path:
    """With one node of the robot: the keystore is in use."""
    policy = EnclavePolicy(
        "/talker", (Profile("/", "talker", allow(Operation.PUBLISH, "/rosout", "/chatter")),)
    )
    provision(tmp_path / "ks", domain_id, [policy])
    return tmp_path / "ks"


@pytest.mark.parametrize("tool", CASES)
def test_a_tool_can_make_what_it_needs_on_its_target_and_nothing_beside(
    dds: Probe, root: Path, domain_id: int, tool: str
) -> None:
    targets, publish, subscribe, not_publish, not_subscribe = CASES[tool]
    made = create_tool_enclave(root, tool, targets)
    attempts = Participant(
        "tool",
        root / "enclaves" / made.enclave[1:],
        (*CLI_PUBLISHES, *publish, *not_publish),
        (*CLI_SUBSCRIBES, *subscribe, *not_subscribe),
    )
    answers = dds.try_endpoints(domain_id, [attempts])
    assert answers.participants == {"tool": True}, answers.log
    allowed = {(verb, name) for (_, verb, name), allowed in answers.endpoints.items() if allowed}
    assert allowed == {
        *(("publish", name) for name in (*CLI_PUBLISHES, *publish)),
        *(("subscribe", name) for name in (*CLI_SUBSCRIBES, *subscribe)),
    }


def test_an_observer_may_read_discovery_and_not_even_publish_it(
    dds: Probe, root: Path, domain_id: int
) -> None:
    made = create_tool_enclave(root, "observe")
    attempts = Participant(
        "tool", root / "enclaves" / made.enclave[1:], (*DISCOVERY, "rt/rosout"), (*DISCOVERY, "rt/chatter")
    )
    answers = dds.try_endpoints(domain_id, [attempts])
    allowed = {(verb, name) for (_, verb, name), allowed in answers.endpoints.items() if allowed}
    assert allowed == {("subscribe", "ros_discovery_info")}, answers.log


def observed(root: Path, enclave: str, domain_id: int, expected: set[str]) -> Graph:
    observer = CycloneObserver(domain_id, LOOPBACK, root / "enclaves" / enclave[1:])
    try:
        return wait_for(
            observer, lambda graph: {node.fqn for node in graph.nodes if node.interfaces} == expected
        )
    finally:
        observer.close()


def test_an_observers_enclave_shows_the_whole_graph_of_a_secured_system_and_a_foreign_one_nothing(
    cyclone: Probe, start: Start, root: Path, tmp_path: Path, domain_id: int
) -> None:
    from tests.dds.conftest import HERE

    nodes = Implementation("Cyclone DDS", (sys.executable, str(HERE.parent / "graph" / "cyclone_nodes.py")))
    directory = root / "enclaves" / "talker"
    program = start(nodes, str(directory), enclave="/talker")
    program.tell("node /talker", *topic("/chatter", writes=True), "list")
    made = create_tool_enclave(root, "observe")
    graph = observed(root, made.enclave, domain_id, {"/talker"})
    (process,) = graph.processes
    assert [(i.kind.value, i.name) for i in process.interfaces] == [("publisher", "/chatter")]
    assert process.participant.claims_security and process.participant.enclave == "/talker"
    from keystore.steps.tool_enclaves import enclaves_by_guid

    assert enclaves_by_guid(root)[process.participant.subject_hash] == "/talker"
    other = tmp_path / "other"
    keystore.create_keystore(other, keystore.CreateOptions(domains=Domains.single(domain_id)))
    foreign = create_tool_enclave(other, "observe")
    observer = CycloneObserver(domain_id, LOOPBACK, other / "enclaves" / foreign.enclave[1:])
    try:
        graph = wait_for(observer, lambda graph: len(graph.processes) == 1)
        for _ in range(20):  # the participant is known: time for the rest to come, if it came
            observer.look()
            time.sleep(0.1)
        (process,) = observer.graph().processes
        assert not process.listed and next(process.endpoints, None) is None
    finally:
        observer.close()


def test_a_tools_enclave_that_was_taken_back_is_gone_and_its_certificate_on_the_crl(
    cyclone: Probe, root: Path, domain_id: int
) -> None:
    made = create_tool_enclave(root, "observe")
    report = keystore.remove(root, [made.enclave])
    assert report.revoked == 1
    with pytest.raises(ObserverError, match="not the directory of an enclave"):
        CycloneObserver(domain_id, LOOPBACK, root / "enclaves" / made.enclave[1:])
