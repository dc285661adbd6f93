"""What programs made on real DDS is the graph that is observed: Cyclone DDS, Fast DDS, both sizes of identifiers."""

from __future__ import annotations

import pytest

from enclave_addons.observation.graph.cyclone import CycloneObserver
from enclave_addons.observation.graph.json_form import graph_document, graph_from_document
from enclave_addons.observation.graph.model import Attribution, Graph, GraphProcess
from nodl.node_interface import EndpointKind as Kind
from tests.addons.observation.graph.conftest import Start
from tests.addons.observation.graph.nodes import Implementation, action, service, topic, wait_for

pytestmark = pytest.mark.dds

Rows = set[tuple[str, str, str, str]]


def rows(process: GraphProcess) -> Rows:
    """(node, kind, name, type) of everything complete."""
    return {
        (node.fqn, each.kind.value, each.name, each.type)
        for node in process.nodes
        for each in node.interfaces
        if each.complete
    }


def of(graph: Graph, guid: str) -> GraphProcess | None:
    return next((each for each in graph.processes if each.participant.guid == guid), None)


TWO_NODES = [
    "node /front/alpha",
    *topic("/chatter", writes=True, quality="best_effort"),
    *service("/front/reset", serves=True),
    *action("/front/count", serves=True),
    "node /beta",
    *topic("/chatter", writes=False),
    *service("/front/reset", serves=False),
    *action("/front/count", serves=False),
]
THEIR_ROWS: Rows = {
    ("/front/alpha", "publisher", "/chatter", "std_msgs/msg/String"),
    ("/front/alpha", "service_server", "/front/reset", "std_srvs/srv/Trigger"),
    ("/front/alpha", "action_server", "/front/count", "example_interfaces/action/Fibonacci"),
    ("/beta", "subscription", "/chatter", "std_msgs/msg/String"),
    ("/beta", "service_client", "/front/reset", "std_srvs/srv/Trigger"),
    ("/beta", "action_client", "/front/count", "example_interfaces/action/Fibonacci"),
}


@pytest.mark.parametrize("gid_size", [16, 24])
def test_the_graph_is_what_two_nodes_of_one_process_made(
    dds: Implementation, start: Start, observer: CycloneObserver, gid_size: int
) -> None:
    program = start(dds, gid_size=gid_size, enclave="/robot").tell(*TWO_NODES, "list")
    graph = wait_for(
        observer, lambda graph: bool((it := of(graph, program.guid)) and rows(it) == THEIR_ROWS and it.listed)
    )
    process = of(graph, program.guid)
    assert process is not None and rows(process) == THEIR_ROWS
    assert (process.unowned, process.foreign, process.gid_size) == ((), (), gid_size)
    assert (process.participant.enclave, process.participant.pid) == ("/robot", program.pid)
    assert not process.participant.claims_security
    assert {each.by for each in process.interfaces} == {Attribution.LIST}
    assert graph_from_document(graph_document(graph)) == graph
    (quality,) = [each.endpoints[0].quality for each in process.interfaces if each.kind is Kind.PUBLISHER]
    own_history = ("KEEP_LAST", 7) if dds.name == "Cyclone DDS" else ("", 0)
    assert (quality.reliability, quality.history, quality.depth) == ("BEST_EFFORT", *own_history)


def test_both_sizes_and_both_implementations_at_once_keep_apart(
    cyclone: Implementation, fastdds: Implementation, start: Start, observer: CycloneObserver
) -> None:
    """Two launches of the same nodes, by releases on either side of Iron."""
    nodes = ["node /talker", *topic("/chatter", writes=True), "list"]
    programs = [
        start(implementation, gid_size=size).tell(*nodes)
        for implementation in (cyclone, fastdds)
        for size in (16, 24)
    ]
    wanted = {program.guid: ["/talker"] for program in programs}

    def found(graph: Graph) -> dict[str, list[str]]:
        return {
            each.participant.guid: [node.fqn for node in each.nodes if node.interfaces]
            for each in graph.processes
        }

    assert found(wait_for(observer, lambda graph: found(graph) == wanted)) == wanted


def test_late_endpoints_come_and_ended_ones_go_but_a_run_remembers_them(
    dds: Implementation, start: Start, observer: CycloneObserver
) -> None:
    program = start(dds).tell("node /n", *topic("/first", writes=True), "list")
    client = {("/n", "service_client", "/call", "std_srvs/srv/Trigger")}
    first = {("/n", "publisher", "/first", "std_msgs/msg/String")}

    def there(graph: Graph) -> bool:
        return of(graph, program.guid) is not None

    def seen(graph: Graph) -> Rows:
        it = of(graph, program.guid)
        return rows(it) if it else set()

    assert seen(wait_for(observer, lambda graph: seen(graph) == first)) == first
    program.tell(*service("/call", serves=False), "list")
    assert seen(wait_for(observer, lambda graph: seen(graph) == first | client)) == first | client
    program.tell("remove writer rq/callRequest", "remove reader rr/callReply", "list")
    assert seen(wait_for(observer, lambda graph: seen(graph) == first)) == first
    assert seen(observer.graph(past=True)) == first | client, "whose it was is remembered"
    program.end()
    assert not there(wait_for(observer, lambda graph: not there(graph)))
    assert seen(observer.graph(past=True)) == first | client


def test_a_client_that_came_and_left_between_two_looks_was_there(
    dds: Implementation, start: Start, observer: CycloneObserver
) -> None:
    program = start(dds).tell("node /n", *topic("/first", writes=True), "list")
    first = {("/n", "publisher", "/first", "std_msgs/msg/String")}

    def seen(graph: Graph) -> Rows:
        it = of(graph, program.guid)
        return rows(it) if it else set()

    assert seen(wait_for(observer, lambda graph: seen(graph) == first)) == first
    program.tell(*service("/call", serves=False), "list", "remove writer rq/callRequest")
    program.tell("remove reader rr/callReply", "list", *topic("/last", writes=True), "list")
    short = {("/n", "service_client", "/call", "std_srvs/srv/Trigger")}
    last = {("/n", "publisher", "/last", "std_msgs/msg/String")}
    wait_for(observer, lambda graph: seen(graph) == first | last)
    assert seen(observer.graph()) == first | last
    assert seen(observer.graph(past=True)) == first | short | last


def test_half_a_service_is_told_as_half_open_until_its_other_half_comes(
    dds: Implementation, start: Start, observer: CycloneObserver
) -> None:
    request, reply = service("/reset", serves=True)
    program = start(dds).tell("node /n", request, "list")

    def missing(graph: Graph) -> list[tuple[str, ...]]:
        process = of(graph, program.guid)
        return [each.missing for each in process.interfaces] if process else []

    graph = wait_for(observer, lambda graph: missing(graph) == [("reply",)])
    assert missing(graph) == [("reply",)] and graph.half_open
    program.tell(reply, "list")
    graph = wait_for(observer, lambda graph: missing(graph) == [()])
    assert missing(graph) == [()] and not graph.half_open


def test_without_a_list_parameter_services_tell_the_node_and_what_is_not_ros_is_foreign(
    dds: Implementation, start: Start, observer: CycloneObserver
) -> None:
    parameters = service(
        "/a/n/get_parameters", serves=True, type_name="rcl_interfaces::srv::dds_::GetParameters"
    )
    program = start(dds, gid_size=0).tell(
        *parameters, *topic("/x", writes=True), "writer HelloWorld HelloWorld"
    )

    def complete(graph: Graph) -> bool:
        it = of(graph, program.guid)
        return it is not None and len(rows(it)) == 2 and len(it.foreign) == 1

    found = of(wait_for(observer, complete), program.guid)
    assert found is not None
    assert {node for node, *_ in rows(found)} == {"/a/n"}
    assert {each.by for each in found.interfaces} == {Attribution.PARAMETER_SERVICES}
    assert [each.topic for each in found.foreign] == ["HelloWorld"] and not found.listed


def test_a_list_about_somebody_else_is_not_believed() -> None:
    """In an unsecured domain anybody may write one."""
    from enclave_addons.observation.graph.discovery_info import ListedNode, ParticipantList
    from enclave_addons.observation.graph.model import GraphState, SeenEndpoint, SeenParticipant

    honest, liar = "0110" + "a" * 20 + "000001c1", "0110" + "b" * 20 + "000001c1"
    state = GraphState()
    state.participant(SeenParticipant(honest))
    writer = f"{honest[:24]}00000103"
    state.endpoint(SeenEndpoint(writer, honest, True, "rt/x", "a::msg::dds_::C_"))
    lie = ParticipantList(honest, (ListedNode("/innocent", (), (writer,)),), 16)
    state.listed(lie, liar)
    assert [node.fqn for node in state.graph().nodes] == [] and len(state.forged) == 1
    state.listed(lie._replace(nodes=(ListedNode("/it", (), (writer,)),)), honest)
    assert [node.fqn for node in state.graph().nodes] == ["/it"]
