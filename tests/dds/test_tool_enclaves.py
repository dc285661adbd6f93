"""Enclaves of tools on real DDS: what a tool needs on its target can be made, its neighbour cannot.

The endpoints are written down by hand, as the tools of jazzy were recorded making them; the table is not asked.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from typing import NamedTuple

import pytest

import keystore
from enclave_addons.observation.graph.cyclone import CycloneObserver, ObserverError
from enclave_addons.observation.graph.model import Graph
from keystore import Domains, EnclavePolicy, Operation, Profile, create_tool_enclave
from tests.addons.observation.graph.conftest import Start
from tests.addons.observation.graph.conftest import start as start
from tests.addons.observation.graph.nodes import LOOPBACK, Implementation, topic, wait_for
from tests.dds.our_keystore import PARAMETER_SERVICES, allow, provision
from tests.dds.probe import Participant, Probe

pytestmark = pytest.mark.dds

DISCOVERY = ("ros_discovery_info",)
ME = f"_ros2cli_{os.getpid()}"
LIFECYCLE = (
    "change_state", "get_state", "get_available_states", "get_available_transitions", "get_transition_graph",
)  # fmt: skip


def clients(prefix: str, services: tuple[str, ...]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """What is published and subscribed."""
    names = [f"{prefix}/{each}" for each in services]
    return tuple(f"rq{each}Request" for each in names), tuple(f"rr{each}Reply" for each in names)


def servers(*services: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    return tuple(f"rr{each}Reply" for each in services), tuple(f"rq{each}Request" for each in services)


class Has(NamedTuple):
    """What a node publishes and subscribes, in DDS's names."""

    publishes: tuple[str, ...]
    subscribes: tuple[str, ...]


def node(name: str, *services: str, publishes: tuple[str, ...] = (), subscribes: tuple[str, ...] = ()) -> Has:
    """With ``/rosout`` and its description, as every node has them since jazzy."""
    replies, requests = servers(*(f"/{name}/{each}" for each in ("get_type_description", *services)))
    return Has(("rt/rosout", *replies, *publishes, *DISCOVERY), (*requests, *subscribes, *DISCOVERY))


EVENTS = ("rt/parameter_events",)
CLI = node(ME, publishes=EVENTS)
CALLER = node("_ros2cli_requester_std_srvs_Empty", *PARAMETER_SERVICES, publishes=EVENTS)
GOAL_SENDER = node("_ros2cli_send_goal_demo_action_Fold", *PARAMETER_SERVICES, publishes=EVENTS)
RECORDER = node(
    "rosbag2_recorder", *PARAMETER_SERVICES, "is_paused", "pause", "resume", "split_bagfile", "snapshot",
    publishes=("rt/events/write_split",), subscribes=EVENTS,
)  # fmt: skip
PLAYER = node(
    "rosbag2_player", *PARAMETER_SERVICES, "burst", "get_rate", "is_paused", "pause", "play", "play_next",
    "resume", "seek", "set_rate", "stop", "toggle_paused",
    publishes=("rt/events/read_split", *EVENTS), subscribes=EVENTS,
)  # fmt: skip
LISTENER = servers("/transform_listener_impl_55b9c9ae84e0/get_type_description")
RVIZ = node(
    "rviz", *PARAMETER_SERVICES, "reset_time",
    publishes=(*EVENTS, *LISTENER[0]), subscribes=(*EVENTS, *LISTENER[1], "rt/tf", "rt/tf_static"),
)  # fmt: skip
RQT = node("rqt_gui_py_node_4711", *PARAMETER_SERVICES, publishes=EVENTS)
TELEOP = node("teleop_twist_keyboard", *PARAMETER_SERVICES, publishes=EVENTS)
PLOTJUGGLER = node("plotjuggler", *PARAMETER_SERVICES, publishes=EVENTS, subscribes=EVENTS)
ROSBRIDGE = node(
    "rosbridge_websocket", *PARAMETER_SERVICES, publishes=(*EVENTS, "rt/client_count", "rt/connected_clients")
)
RVIZ_TOOLS = ("rt/goal_pose", "rt/initialpose", "rt/clicked_point")
FOLD = "/fold/_action"
FOLDING = Has(
    tuple(f"rq{FOLD}/{each}Request" for each in ("send_goal", "cancel_goal", "get_result")),
    (
        *(f"rr{FOLD}/{each}Reply" for each in ("send_goal", "cancel_goal", "get_result")),
        *(f"rt{FOLD}/{each}" for each in ("feedback", "status")),
    ),
)

# tool: its targets, its node, what else it makes on its target, what beside it must be refused
CASES: dict[str, tuple[tuple[str, ...], Has, Has, Has]] = {
    "list": ((), CLI, Has((), ()), Has(("rt/chatter",), ("rt/chatter",))),
    "echo": (
        ("/chatter",), CLI, Has((), ("rt/chatter",)),
        Has(("rt/chatter",), ("rt/other", "rt/chatter/more", "rt/")),
    ),
    "pub": (("/chatter",), CLI, Has(("rt/chatter",), ()), Has(("rt/other",), ("rt/chatter",))),
    "param": (
        ("/front/talker",), CLI, Has(*clients("/front/talker", PARAMETER_SERVICES)),
        Has(clients("/talker", PARAMETER_SERVICES)[0], clients("/front/other", PARAMETER_SERVICES)[1]),
    ),
    "call": (("/reset",), CALLER, Has(*clients("", ("reset",))), Has(*clients("", ("stop",)))),
    "action": (
        ("/fold",), GOAL_SENDER, FOLDING,
        Has((f"rt{FOLD}/feedback", "rq/two/fold/_action/send_goalRequest"), ("rr/two/fold/_action/send_goalReply",)),
    ),
    "lifecycle": (
        ("/driver",), CLI, Has(*clients("/driver", LIFECYCLE)),
        Has(("rq/camera/change_stateRequest", "rr/driver/change_stateReply"), ("rq/driver/change_stateRequest",)),
    ),
    "component": (
        ("/box",), CLI, Has(*clients("/box/_container", ("load_node", "unload_node", "list_nodes"))),
        Has(("rq/box2/_container/load_nodeRequest",), ("rr/box2/_container/list_nodesReply",)),
    ),
    "record": (
        ("/chatter",), RECORDER, Has((), ("rt/chatter",)), Has(("rt/chatter", *EVENTS), ("rt/other",)),
    ),
    "rviz": (("/scan",), RVIZ, Has((), ("rt/scan",)), Has((*RVIZ_TOOLS, "rt/scan", "rt/tf"), ("rt/map",))),
    "rviz-control": (("/scan",), RVIZ, Has(RVIZ_TOOLS, ("rt/scan",)), Has(("rt/cmd_vel",), ("rt/map",))),
    "rqt-graph": ((), RQT, Has((), ()), Has(("rt/chatter",), ("rt/chatter",))),
    "teleop": (("/cmd_vel",), TELEOP, Has(("rt/cmd_vel",), ()), Has(("rt/other",), ("rt/cmd_vel",))),
    "plotjuggler": (("/scan",), PLOTJUGGLER, Has((), ("rt/scan",)), Has(("rt/scan",), ("rt/map",))),
    "rosbridge": (("/scan",), ROSBRIDGE, Has((), ("rt/scan",)), Has(("rt/scan",), ("rt/map",))),
    "play": (("/chatter",), PLAYER, Has(("rt/chatter",), ()), Has(("rt/other", "rt/clock"), ("rt/chatter",))),
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
    targets, own, on_target, beside = CASES[tool]
    made = create_tool_enclave(root, tool, targets)
    publishes, subscribes = own.publishes + on_target.publishes, own.subscribes + on_target.subscribes
    attempts = Participant(
        "tool",
        root / "enclaves" / made.enclave[1:],
        (*publishes, *beside.publishes),
        (*subscribes, *beside.subscribes),
    )
    answers = dds.try_endpoints(domain_id, [attempts])
    assert answers.participants == {"tool": True}, answers.log
    allowed = {(verb, name) for (_, verb, name), allowed in answers.endpoints.items() if allowed}
    assert allowed == {
        *(("publish", name) for name in publishes),
        *(("subscribe", name) for name in subscribes),
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

    nodes = Implementation(
        "Cyclone DDS",
        (sys.executable, str(HERE.parent / "addons" / "observation" / "graph" / "cyclone_nodes.py")),
    )
    directory = root / "enclaves" / "talker"
    program = start(nodes, str(directory), enclave="/talker")
    program.tell("node /talker", *topic("/chatter", writes=True), "list")
    made = create_tool_enclave(root, "observe")
    graph = observed(root, made.enclave, domain_id, {"/talker"})
    (process,) = graph.processes
    assert [(i.kind.value, i.name) for i in process.interfaces] == [("publisher", "/chatter")]
    assert process.participant.claims_security and process.participant.enclave == "/talker"
    assert process.participant.pid == program.pid, "which it does not say; its UDP port does"
    from keystore.steps.tool_enclaves import enclaves_by_guid

    assert enclaves_by_guid(root)[process.participant.subject_hash] == "/talker"
    other = tmp_path / "other"
    keystore.create_keystore(other, keystore.CreateOptions(domains=Domains.single(domain_id)))
    foreign = create_tool_enclave(other, "observe")
    observer = CycloneObserver(domain_id, LOOPBACK, other / "enclaves" / foreign.enclave[1:])
    try:
        graph = wait_for(observer, lambda graph: len(graph.processes) == 1)
        for _ in range(20):  # the participant is known: time for the rest to come, if it came
            observer.poll()
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
