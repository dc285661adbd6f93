"""From observed runs to manifests: several explanations stay several until a run decides."""

from __future__ import annotations

from types import MappingProxyType

import pytest

from enclave_addons.observation.graph.observation import Observed
from enclave_addons.observation.graph.sources import learn_observed
from enclave_addons.observation.graph.starts import start_for, start_of_command, starts_of_plan
from enclave_addons.recording.record.learning import LearntEndpoint, LearntNode
from enclave_addons.recording.record.lines import RecordedRun
from enclave_addons.recording.record.requested import StartedNode
from nodl.node_interface import EndpointKind as Kind
from tests.addons.observation.graph.made import Made, one_node
from tests.addons.observation.graph.nodes import action, service, topic


def observed(name: str, fqn: str, endpoints: list[str], *rules: str, **parameters: object) -> Observed:
    """A run of one node of ``demo/talker``."""
    start = StartedNode("demo", "talker", fqn=fqn, rule_texts=rules, parameters=MappingProxyType(parameters))
    return Observed(RecordedRun(name), one_node(fqn, *endpoints), starts=(start,))


def learnt(*runs: Observed) -> LearntNode:
    (node,) = learn_observed(runs).learnt.nodes
    return node


def entry(node: LearntNode, kind: Kind = Kind.PUBLISHER) -> LearntEndpoint:
    (found,) = [each for each in node.entries if each.kind is kind]
    return found


RELATIVE = observed("a", "/talker", topic("/chatter", writes=True))


def test_one_run_in_the_root_namespace_cannot_tell_relative_from_absolute() -> None:
    assert (entry(learnt(RELATIVE)).name, entry(learnt(RELATIVE)).spellings) == ("chatter", ("/chatter",))


def test_a_run_in_a_namespace_decides_for_the_relative_name() -> None:
    moved = observed("b", "/r1/talker", topic("/r1/chatter", writes=True), "__ns:=/r1")
    found = entry(learnt(RELATIVE, moved))
    assert (found.name, found.spellings, found.runs) == ("chatter", (), ("a", "b"))


def test_the_neighbour_whose_name_stayed_is_absolute() -> None:
    stayed = observed("b", "/r1/talker", topic("/chatter", writes=True), "__ns:=/r1")
    found = entry(learnt(RELATIVE, stayed))
    assert (found.name, found.spellings) == ("/chatter", ())


def test_a_name_that_moves_with_the_nodes_name_is_private() -> None:
    first = observed("a", "/talker", topic("/talker/state", writes=True))
    second = observed(
        "b", "/r1/speaker", topic("/r1/speaker/state", writes=True), "__ns:=/r1", "__node:=speaker"
    )
    assert (entry(learnt(first)).name, entry(learnt(first)).spellings) == (
        "~/state",
        ("talker/state", "/talker/state"),
    )
    node = learnt(first, second)
    assert (entry(node).name, entry(node).spellings, node.key.node) == ("~/state", (), "talker")


def test_of_two_joined_topics_both_stay_until_a_run_without_the_rule_shows_which() -> None:
    joined = observed("a", "/talker", topic("/in", writes=False), "left:=in", "right:=in")
    found = entry(learnt(joined), Kind.SUBSCRIPTION)
    assert found.name == "left" and "right" in found.spellings
    apart = observed("b", "/r1/talker", topic("/r1/right", writes=False), "__ns:=/r1")
    found = entry(learnt(joined, apart), Kind.SUBSCRIPTION)
    assert (found.name, found.spellings) == ("right", ())


def test_a_name_that_is_a_parameters_value_follows_the_parameter() -> None:
    first = observed("a", "/talker", topic("/front/scan", writes=False), scan_topic="/front/scan")
    second = observed("b", "/talker", topic("/rear/scan", writes=False), scan_topic="/rear/scan")
    found = entry(learnt(first, second), Kind.SUBSCRIPTION)
    assert found.origin.source is not None and found.origin.source.parameter == "scan_topic"
    assert found.origin.proven and found.spellings == ()


def test_what_only_some_runs_show_stays_with_the_runs_that_show_it() -> None:
    more = observed("b", "/talker", [*topic("/chatter", writes=True), *service("/reset", serves=True)])
    node = learnt(RELATIVE, more)
    assert entry(node).runs == ("a", "b")
    assert entry(node, Kind.SERVICE_SERVER).runs == ("b",)


def test_what_every_node_has_is_left_out_and_its_sort_is_told() -> None:
    log = "rcl_interfaces::msg::dds_::Log_"
    parameters = service(
        "/talker/get_parameters", serves=True, type_name="rcl_interfaces::srv::dds_::GetParameters"
    )
    state = service("/talker/change_state", serves=True, type_name="lifecycle_msgs::srv::dds_::ChangeState")
    endpoints = [
        *topic("/rosout", writes=True, type_name=log),
        *parameters,
        *state,
        *topic("/x", writes=True),
    ]
    node = learnt(observed("a", "/talker", endpoints))
    assert [each.name for each in node.entries] == ["x"] and node.lifecycle
    assert node.incomplete == ("a lifecycle node: whether it was active while it was observed is not known",)
    # of another type it is the program's own
    own = learnt(observed("a", "/talker", topic("/rosout", writes=True)))
    assert [each.name for each in own.entries] == ["rosout"]


def test_half_open_and_unexplained_things_are_told_and_in_no_manifest() -> None:
    request, _ = service("/reset", serves=True)
    found = learn_observed([observed("a", "/talker", [request, *action("/go", serves=True)])])
    assert [each.name for each in found.learnt.nodes[0].entries] == ["go"]
    assert found.left_out == ("/talker: service_server /reset is half open, without reply",)
    stranger = Observed(RecordedRun("b"), one_node("/stranger", *topic("/x", writes=True)))
    assert learn_observed([stranger]).learnt.nodes == ()
    assert "the program is not known" in learn_observed([stranger]).left_out[0]


def test_the_command_line_of_a_process_tells_program_rules_and_parameters() -> None:
    command = [
        "/usr/bin/python3", "/opt/ws/lib/demo/talker", "word", "--ros-args", "-r", "__ns:=/r1", "-p", "rate:=2",
        "--params-file", "/tmp/x", "-r", "chatter:=/news", "--", "more",
    ]  # fmt: skip
    start = start_of_command(command)
    assert start is not None
    assert (start.package, start.executable, start.arguments) == ("demo", "talker", ("word", "more"))
    assert start.rule_texts == ("__ns:=/r1", "chatter:=/news") and start.parameters == {"rate": "2"}
    assert start_of_command(["/usr/bin/rviz2", "-d", "x"]) is None
    made = Made()
    participant = made.participant(1, pid=7)
    made.listed(participant, made.node(participant, "/r1/talker", *topic("/news", writes=True)))
    run = Observed(RecordedRun("a"), made.graph(), {participant: tuple(command)})
    (node,) = learn_observed([run]).learnt.nodes
    assert node.program == "demo/talker" and node.entries[0].name == "chatter"


def test_a_launch_file_tells_how_a_node_was_started_also_where_it_gives_no_name() -> None:
    command = ["/opt/ws/lib/demo/talker", "--ros-args", "-r", "chatter:=/news"]
    plan = {
        "processes": [
            {
                "package": "demo", "executable": "talker", "fqn": "/<node_name_unspecified>", "namespace": "/",
                "cmd": command, "parameters": {},
            }
        ],
        "components": [
            {
                "package": "demo", "plugin": "demo::Listener", "fqn": "/r1/ear", "container": "/c",
                "remaps": [["chatter", "/news"]], "parameters": {},
            }
        ],
    }  # fmt: skip
    made = Made()
    participant = made.participant(1)
    made.listed(
        participant,
        made.node(participant, "/talker", *topic("/news", writes=True)),
        made.node(participant, "/r1/ear", *topic("/news", writes=False)),
    )
    run = Observed(RecordedRun("a"), made.graph(), starts=starts_of_plan(plan))
    found = {node.program: node.entries[0].name for node in learn_observed([run]).learnt.nodes}
    assert found == {"demo/talker": "chatter", "demo/demo::Listener": "chatter"}


@pytest.mark.parametrize(
    ("running", "found"),
    [
        (("python3", "/ws/lib/demo/one", "--ros-args", "--params-file", "/tmp/launch_params_x1"), True),
        (("python3", "/ws/lib/demo/one", "--ros-args", "--params-file", "relative"), False),
        (("python3", "/ws/lib/demo/two", "--ros-args", "--params-file", "/tmp/launch_params_x1"), False),
        (("python3", "/ws/lib/demo/one", "--ros-args"), False),
    ],
)
def test_a_parameter_file_that_launch_generates_has_any_path(running: tuple[str, ...], found: bool) -> None:
    planned = ("/ws/lib/demo/one", "--ros-args", "--params-file", "<params:1>")
    start = StartedNode("demo", "one", fqn="/one", command=planned)
    assert bool(start_for("/one", running, [start])) is found
