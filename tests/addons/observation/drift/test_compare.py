"""A system that runs as planned has no findings; every change that is made to it is found, and only that."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import pytest

from enclave_addons.observation.drift.compare import Circumstances, Security, compare
from enclave_addons.observation.drift.expected import expected_in
from enclave_addons.observation.drift.finding import DriftFinding, FindingCertainty, Kind, Level
from enclave_addons.observation.graph.model import Graph
from enclave_addons.review.quality import Quality
from enclave_launch import DryRun
from tests.addons.observation.drift.planned import commands, plan, running
from tests.addons.observation.graph.made import Made
from tests.addons.observation.graph.nodes import topic

LAUNCHES = [
    ("demo_nodes", "talker_listener.launch.xml"),
    ("demo_nodes", "services_actions.launch.xml"),
    ("demo_nodes", "talker_listener_namespace.launch.xml"),
]
TALKER = plan(*LAUNCHES[0])


def found(document: Any, graph: Graph, **circumstances: Any) -> list[DriftFinding]:
    return compare(expected_in([DryRun(**document)], 0), graph, Circumstances(**circumstances))


def kinds(findings: list[DriftFinding]) -> list[tuple[Kind, str]]:
    return [(each.kind, each.subject) for each in findings]


@pytest.mark.parametrize("words", LAUNCHES)
def test_what_runs_as_planned_has_no_findings(words: tuple[str, ...]) -> None:
    document, made = plan(*words), Made()
    running(document, made)
    assert found(document, made.graph()) == []


@pytest.mark.parametrize("words", LAUNCHES)
def test_each_node_that_does_not_run_is_found(words: tuple[str, ...]) -> None:
    document = plan(*words)
    for node in document["nodes"]:
        made = Made()
        running(document, made, without=node["fqn"])
        assert kinds(found(document, made.graph())) == [(Kind.MISSING_NODE, node["fqn"])]


@pytest.mark.parametrize("words", LAUNCHES)
def test_each_endpoint_that_is_not_planned_is_found(words: tuple[str, ...]) -> None:
    """The other way round: the plan forgets one interface of one node after the other."""
    document = plan(*words)
    made = Made()
    running(document, made)
    graph = made.graph()
    for node in range(len(document["nodes"])):
        for interface in range(len(document["nodes"][node]["interfaces"])):
            less = copy.deepcopy(document)
            gone = less["nodes"][node]["interfaces"][interface]
            less["nodes"][node]["interfaces"] = [
                each
                for each in less["nodes"][node]["interfaces"]
                if (each["operation"], each["name"]) != (gone["operation"], gone["name"])
            ]
            (finding,) = found(less, graph)
            expected = (Kind.UNPLANNED_ENDPOINT, less["nodes"][node]["fqn"], gone["name"])
            assert (finding.kind, finding.subject, finding.name) == expected


@pytest.mark.parametrize("words", LAUNCHES)
def test_each_endpoint_that_a_manifest_states_and_no_node_has_is_found(words: tuple[str, ...]) -> None:
    document = plan(*words)
    for node in document["nodes"]:
        own = [each for each in node["interfaces"] if not each["built_in"]]
        for gone in own:
            less, made = copy.deepcopy(document), Made()
            for each in less["nodes"]:
                if each["fqn"] == node["fqn"]:
                    each["interfaces"].remove(gone)
            running(less, made)
            (finding,) = found(document, made.graph())
            assert (finding.kind, finding.subject, finding.name) == (
                Kind.MISSING_ENDPOINT, node["fqn"], gone["name"],
            )  # fmt: skip


def test_what_a_description_may_name_beyond_what_is_there_is_not_missed() -> None:
    """Interfaces that were inferred, recorded or from the library; and of lifecycle nodes."""
    inferred, made = copy.deepcopy(TALKER), Made()
    for process in inferred["processes"]:
        process["interfaces"] = "inferred"
    less = copy.deepcopy(TALKER)
    less["nodes"][0]["interfaces"] = [each for each in less["nodes"][0]["interfaces"] if each["built_in"]]
    running(less, made)
    assert found(inferred, made.graph()) == []
    assert [each.kind for each in found(TALKER, made.graph())] == [Kind.MISSING_ENDPOINT]


Inject = Callable[[Made, dict[str, str]], None]


def stranger(made: Made, _: dict[str, str]) -> None:
    guid = made.participant(90, pid=7)
    made.listed(guid, made.node(guid, "/intruder", *topic("/chatter", writes=False)))


def second_node(made: Made, there: dict[str, str]) -> None:
    guid = there["/talker"]
    made.state.listed(_with(made, guid, "/hidden", *topic("/exfiltrate", writes=True)), guid)


def _with(made: Made, guid: str, fqn: str, *commands: str) -> Any:
    listed = made.state._lists[guid]
    return listed._replace(nodes=(*listed.nodes, made.node(guid, fqn, *commands)))


def again(made: Made, _: dict[str, str]) -> None:
    document = copy.deepcopy(TALKER)
    document["nodes"] = [each for each in document["nodes"] if each["fqn"] == "/talker"]
    guid = made.participant(91, pid=8)
    lines = [line for each in document["nodes"][0]["interfaces"] for line in commands(each)]
    made.listed(guid, made.node(guid, "/talker", *lines))


def plain_dds(made: Made, _: dict[str, str]) -> None:
    guid = made.participant(92)
    made.node(guid, "", "writer HelloWorldTopic HelloWorld")


def other_type(made: Made, _: dict[str, str]) -> None:
    guid = made.participant(93)
    made.node(guid, "", "reader rt/chatter other::msg::dds_::Thing_")


def forged(made: Made, there: dict[str, str]) -> None:
    listed = made.state._lists[there["/talker"]]
    made.state.listed(listed, there["/listener"])


INJECTED: dict[str, tuple[Inject, set[Kind]]] = {
    "a node that is not planned": (stranger, {Kind.UNPLANNED_NODE}),
    "a further node in a planned process": (second_node, {Kind.UNPLANNED_NODE}),
    "a second node of a planned name": (again, {Kind.REPEATED_NODE}),
    "a program on plain DDS": (plain_dds, {Kind.UNPLANNED_PROCESS}),
    "a reader of another type": (other_type, {Kind.UNPLANNED_PROCESS, Kind.TYPES_DO_NOT_MEET}),
    "a list of somebody else's nodes": (forged, {Kind.FORGED_LIST}),
}


@pytest.mark.parametrize(("inject", "expected"), INJECTED.values(), ids=INJECTED.keys())
def test_what_is_put_into_a_running_system_is_found(inject: Inject, expected: set[Kind]) -> None:
    made = Made()
    there = running(TALKER, made)
    inject(made, there)
    findings = found(TALKER, made.graph(), forged=tuple(made.state.forged))
    assert {each.kind for each in findings} == expected
    assert all(each.level is Level.ALARM for each in findings)


def test_what_a_plan_does_not_know_is_not_compared() -> None:
    """A type that is only a placeholder is no type; beside a name that is not known others may be there."""
    document, made = copy.deepcopy(TALKER), Made()
    running(document, made)
    for node in document["nodes"]:
        for interface in node["interfaces"]:
            interface["type"] = "" if interface["name"] == "/chatter" else interface["type"]
    assert not found(document, made.graph())
    (talker,) = (node for node in document["nodes"] if node["fqn"] == "/talker")
    talker["interfaces"] = [each for each in talker["interfaces"] if each["name"] != "/chatter"]
    (alarm,) = found(document, made.graph())
    assert (alarm.kind, alarm.level) == (Kind.UNPLANNED_ENDPOINT, Level.ALARM)
    gap = {"severity": "warning", "code": "interface-unknown", "subject": "/talker", "file": None, "line": 0}
    gap |= {"text": "", "remedy": ""}
    (note,) = found({**document, "diagnostics": [gap]}, made.graph())
    assert (note.kind, note.level) == (Kind.UNPLANNED_ENDPOINT, Level.NOTE)


def test_another_type_than_planned_is_found() -> None:
    changed, made = copy.deepcopy(TALKER), Made()
    for node in changed["nodes"]:
        for interface in node["interfaces"]:
            if interface["name"] == "/chatter":
                interface["type"] = "std_msgs/msg/Header"
    running(changed, made)
    assert set(kinds(found(TALKER, made.graph()))) == {
        (Kind.TYPE_DIFFERS, "/listener"),
        (Kind.TYPE_DIFFERS, "/talker"),
    }


def with_quality(made: Made, number: int, fqn: str, quality: Quality) -> None:
    """The node of the plan, all of its endpoints with one quality."""
    guid = made.participant(number)
    (planned,) = [each for each in TALKER["nodes"] if each["fqn"] == fqn]
    lines = [line for each in planned["interfaces"] for line in commands(each)]
    made.listed(guid, made.node(guid, fqn, *lines, quality=quality))


AS_ROS = Quality(history="KEEP_LAST", depth=10)
STATED = {
    "history": "KEEP_LAST",
    "depth": 10,
    "reliability": "RELIABLE",
    "durability": "VOLATILE",
    "deadline_ns": 0,
}
OTHER_QUALITIES = {
    "depth is 1, planned is 10": AS_ROS._replace(depth=1),
    "history is KEEP_ALL, planned is KEEP_LAST": AS_ROS._replace(history="KEEP_ALL", depth=0),
    "reliability is BEST_EFFORT, planned is RELIABLE": AS_ROS._replace(reliability="BEST_EFFORT"),
    "durability is TRANSIENT_LOCAL, planned is VOLATILE": AS_ROS._replace(durability="TRANSIENT_LOCAL"),
    "deadline is 0.5 s, planned is none": AS_ROS._replace(deadline=500_000_000),
}


def quality_told(planned: dict[str, Any], seen: Quality) -> list[str]:
    document, made = copy.deepcopy(TALKER), Made()
    for node in document["nodes"]:
        for each in node["interfaces"]:
            if each["name"] == "/chatter":
                each["qos"] = planned
    for number, fqn in enumerate(("/talker", "/listener"), 1):
        with_quality(made, number, fqn, seen)
    return [each.text for each in found(document, made.graph()) if each.kind is Kind.QOS_DIFFERS]


@pytest.mark.parametrize(("why", "seen"), OTHER_QUALITIES.items(), ids=OTHER_QUALITIES.keys())
def test_quality_that_is_another_than_planned_is_found(why: str, seen: Quality) -> None:
    assert quality_told(STATED, seen) == [
        f"/talker: publish /chatter: {why}",
        f"/listener: subscribe /chatter: {why}",
    ]


def test_quality_as_planned_or_that_the_plan_or_discovery_leaves_open_is_not_told() -> None:
    assert quality_told(STATED, AS_ROS) == []
    assert quality_told({}, Quality(reliability="BEST_EFFORT", depth=3, history="KEEP_LAST")) == []
    assert quality_told(STATED, Quality()) == [], "Fast DDS does not announce its history"
    assert quality_told({"lifespan_ns": 5}, AS_ROS) == [], "nor does anybody a lifespan that we read"


def test_two_ends_whose_quality_does_not_meet_are_found_and_those_that_meet_are_not() -> None:
    def graph(offered: Quality, requested: Quality) -> Graph:
        made = Made()
        for number, (fqn, writes, quality) in enumerate(
            (("/talker", True, offered), ("/listener", False, requested)), 1
        ):
            guid = made.participant(number)
            made.listed(guid, made.node(guid, fqn, *topic("/chatter", writes=writes), quality=quality))
        return made.graph()

    def told(offered: Quality, requested: Quality) -> list[str]:
        findings = found(TALKER, graph(offered, requested))
        return [each.text for each in findings if each.kind is Kind.QOS_DOES_NOT_MEET]

    best_effort, latched = Quality(reliability="BEST_EFFORT"), Quality(durability="TRANSIENT_LOCAL")
    assert told(Quality(), best_effort) == [] and told(latched, Quality()) == []
    assert told(best_effort, Quality()) == [
        "rt/chatter: /talker and /listener do not meet: reliability: BEST_EFFORT is offered, RELIABLE requested"
    ]
    assert len(told(Quality(), latched)) == 1
    assert told(Quality(deadline=2_000_000_000), Quality(deadline=1_000_000_000)) == [
        "rt/chatter: /talker and /listener do not meet: deadline: 2 s is offered, 1 s requested"
    ]
    assert told(Quality(deadline=1), Quality(deadline=1)) == []
    assert len(told(Quality(ownership="EXCLUSIVE"), Quality())) == 1


def test_what_is_accepted_is_no_finding_and_a_participant_without_endpoints_of_its_own_is_a_note() -> None:
    made = Made()
    running(TALKER, made)
    guid = made.participant(90)
    made.listed(guid, made.node(guid, "/_ros2cli_7", *topic("/chatter", writes=False)))
    observer = made.participant(91)
    made.node(observer, "", "reader ros_discovery_info rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_")
    assert {each.kind for each in found(TALKER, made.graph())} == {
        Kind.UNPLANNED_NODE,
        Kind.UNPLANNED_PROCESS,
    }
    (note,) = found(TALKER, made.graph(), accepted=("/_ros2cli*",))
    assert (note.kind, note.level) == (Kind.UNPLANNED_PROCESS, Level.NOTE)


def test_an_unknown_participant_of_which_nothing_is_seen_is_an_alarm() -> None:
    made = Made()
    running(TALKER, made)
    made.participant(91)
    (finding,) = found(TALKER, made.graph())
    assert (finding.kind, finding.level) == (Kind.UNPLANNED_PROCESS, Level.ALARM)
    assert "sees none of its endpoints" in finding.text


def test_what_the_observer_cannot_see_is_neither_missing_nor_as_planned() -> None:
    made = Made()
    (empty,) = found(TALKER, made.graph())
    assert (empty.kind, empty.level) == (Kind.OUT_OF_SIGHT, Level.CANNOT_TELL)
    assert "no participant was discovered" in empty.text
    assert "ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST" in empty.remedy
    made.participant(1)
    findings = found(TALKER, made.graph())
    assert [each.level for each in findings if each.kind is Kind.OUT_OF_SIGHT] == [Level.CANNOT_TELL]
    assert Kind.MISSING_NODE not in {each.kind for each in findings}


@pytest.mark.parametrize(("authenticated", "remedy"), [(False, "--enclave"), (True, "not trusted")])
def test_an_observer_without_an_enclave_that_is_trusted_cannot_tell_about_a_secured_system(
    authenticated: bool, remedy: str
) -> None:
    made = Made()
    made.participant(1, prefix=f"{HASH:012x}")
    (finding,) = found(TALKER, made.graph(), security=SECURITY._replace(authenticated=authenticated))
    assert finding.kind is Kind.OUT_OF_SIGHT and remedy in finding.remedy


def test_a_planned_node_in_a_process_that_the_launch_did_not_start_is_found() -> None:
    made = Made()
    running(TALKER, made)
    (finding,) = found(TALKER, made.graph(), strangers=frozenset({1002}))
    assert finding.kind is Kind.STRANGER and "process 1002" in finding.who


def test_a_nameless_participant_is_told_at_once_where_its_process_is_known_not_to_be_of_the_launch() -> None:
    made = Made()
    running(TALKER, made)
    guid = made.participant(92, pid=7)
    made.node(guid, "", "writer HelloWorldTopic HelloWorld")
    (waits,) = found(TALKER, made.graph())
    (at_once,) = found(TALKER, made.graph(), strangers=frozenset({7}))
    assert (waits.certainty, at_once.certainty) == (FindingCertainty.WHEN_SETTLED, FindingCertainty.FACT)


def test_nodes_without_names_and_executables_are_not_taken_for_intruders() -> None:
    document, made = copy.deepcopy(TALKER), Made()
    document["nodes"] = []
    for process in document["processes"]:
        process["fqn"] = process["fqn"].replace("talker", "<node_name_unspecified>")
    guid = made.participant(1)
    made.listed(guid, made.node(guid, "/whatever"))
    assert [each.kind for each in found(document, made.graph())] == [Kind.MISSING_NODE]
    elsewhere = made.participant(2)
    made.listed(elsewhere, made.node(elsewhere, "/other/whatever"))
    assert {each.kind for each in found(document, made.graph())} == {Kind.MISSING_NODE, Kind.UNPLANNED_NODE}


def test_processes_of_another_domain_are_not_missed() -> None:
    document = copy.deepcopy(TALKER)
    for process in document["processes"]:
        process["domain_id"] = 7
        process["enclave"] = "/elsewhere"
    for node in document["nodes"]:
        node["enclave"] = "/elsewhere"
    assert found(document, Graph()) == []


# secured

ENCLAVE = TALKER["nodes"][0]["enclave"]
HASH, OTHER_HASH = 0x8000_0000_0001, 0x8000_0000_0002
SECURITY = Security({HASH: ENCLAVE, OTHER_HASH: "/other"})


def secured(made: Made, number: int, node: str, hash_: int = HASH) -> str:
    guid = made.participant(number, prefix=f"{hash_:012x}", enclave=ENCLAVE)
    (planned,) = [each for each in TALKER["nodes"] if each["fqn"] == node]
    made.listed(guid, made.node(guid, node, *(c for each in planned["interfaces"] for c in commands(each))))
    return guid


def as_planned() -> Made:
    made = Made()
    secured(made, 1, "/talker")
    secured(made, 2, "/listener")
    return made


def test_secured_and_as_planned_there_is_nothing_to_tell() -> None:
    assert found(TALKER, as_planned().graph(), security=SECURITY) == []


def unsecured_participant(made: Made) -> None:
    made.participant(80, enclave=ENCLAVE)


def foreign_certificate(made: Made) -> None:
    made.participant(81, prefix="ffff00000000", enclave=ENCLAVE)


def same_subject_of_another_ca(made: Made) -> None:
    made.participant(82, prefix=f"{HASH:012x}", enclave=ENCLAVE)


def stolen_key(made: Made) -> None:
    guid = made.participant(83, prefix=f"{HASH:012x}")
    made.listed(guid, made.node(guid, "/mine", *topic("/chatter", writes=True)))


def node_in_another_enclave(made: Made) -> None:
    guid = made.participant(84, prefix=f"{OTHER_HASH:012x}")
    made.listed(guid, made.node(guid, "/talker2"))


SECURED: dict[str, tuple[Callable[[Made], None], Kind]] = {
    "a participant without security": (unsecured_participant, Kind.NOT_SECURED),
    "a certificate that this keystore does not have": (foreign_certificate, Kind.OTHER_CA),
    "the subject of an enclave, by another CA": (same_subject_of_another_ca, Kind.NOT_AUTHENTICATED),
    "an enclave of the plan used by a node that is not in it": (stolen_key, Kind.ENCLAVE_OF_ANOTHER),
    "an enclave of the keystore that is not in the plan": (node_in_another_enclave, Kind.UNPLANNED_NODE),
}


@pytest.mark.parametrize(("inject", "expected"), SECURED.values(), ids=SECURED.keys())
def test_each_intruder_in_a_secured_system_is_found(inject: Callable[[Made], None], expected: Kind) -> None:
    made = as_planned()
    inject(made)
    (finding,) = found(TALKER, made.graph(), security=SECURITY)
    assert (finding.kind, finding.level) == (expected, Level.ALARM)


def test_a_planned_node_in_an_enclave_that_is_not_its_own_is_found() -> None:
    made = Made()
    secured(made, 1, "/talker", OTHER_HASH)
    secured(made, 2, "/listener")
    (finding,) = found(TALKER, made.graph(), security=SECURITY)
    assert finding.kind is Kind.ENCLAVE_OF_ANOTHER and "/talker runs in enclave /other" in finding.text


def test_without_an_enclave_of_its_own_the_observer_judges_participants_only() -> None:
    made = Made()
    made.participant(1, prefix=f"{HASH:012x}")
    unsecured_participant(made)
    findings = found(TALKER, made.graph(), security=SECURITY._replace(authenticated=False))
    assert {each.kind for each in findings} >= {Kind.NOT_SECURED}
    assert Kind.MISSING_NODE not in {each.kind for each in findings}
    assert Kind.NOT_AUTHENTICATED not in {each.kind for each in findings}


def test_an_enclave_that_is_made_while_somebody_watches_is_not_of_another_ca() -> None:
    made = Made()
    secured(made, 1, "/talker")
    made.participant(9, prefix=f"{HASH + 7:012x}")
    before = [each.kind for each in found(TALKER, made.graph(), security=SECURITY)]
    assert Kind.OTHER_CA in before
    expected, graph = expected_in([DryRun(**TALKER)], 0), made.graph()
    now = {**SECURITY.enclaves, HASH + 7: "/tools/observe"}
    after = compare(expected, graph, Circumstances(SECURITY), lambda: now)
    assert Kind.OTHER_CA not in {each.kind for each in after}
    still = compare(expected, graph, Circumstances(SECURITY), lambda: {**SECURITY.enclaves})
    assert Kind.OTHER_CA in {each.kind for each in still}
