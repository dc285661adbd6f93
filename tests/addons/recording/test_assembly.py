"""Whose line it is: processes behind shells, components of containers, nodes that share a name."""

from __future__ import annotations

from typing import Any

import yaml

from enclave_addons.recording.record.assembly import Record
from enclave_addons.recording.record.learning import learn
from enclave_addons.recording.record.lines import (
    EndpointMade,
    Initialised,
    Line,
    Loaded,
    LoadedComponent,
    NodeMade,
    RecordedRun,
    StartedProcess,
)
from enclave_addons.recording.record.manifest import manifest_text
from enclave_addons.recording.record.requested import RequestedNode, all_requested
from nodl.node_interface import EndpointKind

CPP = "librclcpp.so"
CONTAINER = StartedProcess(10, "box-1", "rclcpp_components", "component_container", "container", "/box")


def loaded(pid: int, parent: int, session: int) -> Loaded:
    return Loaded(pid, 0, parent, session, "/bin/x")


def node(pid: int, number: int, name: str, fqn: str) -> NodeMade:
    return NodeMade(pid, pid, number, number, 0, name, "", fqn, CPP)


def publisher(pid: int, number: int, name: str, fqn: str) -> EndpointMade:
    final = f"{fqn.rpartition('/')[0]}/{name}"
    return EndpointMade(
        EndpointKind.PUBLISHER, pid, pid, number, number, 0, name, fqn, final, "std_msgs/msg/String", CPP
    )


def nodes(*lines: Line) -> list[RequestedNode]:
    return all_requested(Record([RecordedRun("r"), *lines]).attributed())


def test_a_node_behind_a_shell_belongs_to_the_process_of_the_launch() -> None:
    started = StartedProcess(10, "talker-1", "demo", "talker")
    (asked,) = nodes(
        started, loaded(10, 1, 10), loaded(11, 10, 10), Initialised(11, 0, 0), node(11, 1, "t", "/t")
    )
    assert (asked.start.program, asked.process) == ("demo/talker", "talker-1")


def test_a_node_in_a_session_of_its_own_is_found_by_its_parents() -> None:
    started = StartedProcess(10, "talker-1", "demo", "talker")
    (asked,) = nodes(
        started, loaded(10, 1, 10), loaded(11, 10, 10), loaded(12, 11, 12), node(12, 1, "t", "/t")
    )
    assert asked.process == "talker-1"


def test_what_started_it_may_be_told_after_its_first_lines() -> None:
    (asked,) = nodes(
        loaded(10, 1, 10), node(10, 1, "t", "/t"), StartedProcess(10, "late-1", "demo", "talker")
    )
    assert asked.start.program == "demo/talker"


def test_a_process_of_which_nothing_is_heard_is_named() -> None:
    record = Record(
        [
            StartedProcess(10, "silent-1", "demo", "x"),
            StartedProcess(11, "b-2", "demo", "y"),
            loaded(11, 1, 11),
        ]
    )
    assert [started.process for started in record.silent()] == ["silent-1"]


def test_components_of_a_container_are_told_apart_by_their_final_names() -> None:
    found = nodes(
        CONTAINER,
        loaded(10, 1, 10),
        LoadedComponent("/box", "demo", "demo::Talker", "front", "/a"),
        LoadedComponent("box", "demo", "demo::Listener"),
        node(10, 1, "ComponentManager", "/box"),
        node(10, 2, "talker", "/a/front"),
        node(10, 3, "listener", "/listener"),
    )
    assert [(each.start.plugin, each.fqn) for each in found] == [
        ("", "/box"),
        ("demo::Talker", "/a/front"),
        ("demo::Listener", "/listener"),
    ]


def test_two_components_of_one_name_are_told_apart_by_their_order() -> None:
    found = nodes(
        CONTAINER,
        loaded(10, 1, 10),
        LoadedComponent("/box", "demo", "demo::One", "same"),
        LoadedComponent("/box", "demo", "demo::Two", "same"),
        node(10, 1, "ComponentManager", "/box"),
        node(10, 2, "one", "/same"),
        node(10, 3, "two", "/same"),
    )
    assert [each.start.plugin for each in found] == ["", "demo::One", "demo::Two"]


def test_a_helper_node_of_a_component_belongs_to_it() -> None:
    """Costmaps, clients, the node of a TransformListener: made inside the block of the component."""
    found = nodes(
        CONTAINER,
        loaded(10, 1, 10),
        LoadedComponent("/box", "nav", "nav::Planner", "planner"),
        node(10, 1, "ComponentManager", "/box"),
        node(10, 2, "planner", "/planner"),
        node(10, 3, "costmap", "/costmap/costmap"),
    )
    assert [each.start.plugin for each in found] == ["", "nav::Planner", "nav::Planner"]


def test_a_component_that_somebody_else_loads_is_that_of_the_same_plugin_or_nobodys() -> None:
    """The record of a container in which ``ros2 component load`` was called while it ran."""
    found = nodes(
        CONTAINER,
        loaded(10, 1, 10),
        LoadedComponent("/box", "demo", "demo::Talker"),
        LoadedComponent("/box", "demo", "demo::Listener"),
        node(10, 1, "ComponentManager", "/box"),
        node(10, 2, "talker", "/talker"),
        node(10, 3, "listener", "/listener"),
        node(10, 4, "talker", "/again"),
        node(10, 5, "stranger", "/stranger")._replace(at=60_000_000_000),
    )
    assert [(each.start.plugin, each.fqn) for each in found[3:]] == [
        ("demo::Talker", "/again"),
        ("", "/stranger"),
    ]


def test_what_a_launch_did_not_load_and_executables_are_not_learnt() -> None:
    lines = (
        CONTAINER,
        loaded(10, 1, 10),
        node(10, 1, "ComponentManager", "/box"),
        node(10, 2, "stranger", "/stranger"),
        StartedProcess(11, "python3-2", "", "python3", "executable"),
        loaded(11, 1, 11),
        node(11, 1, "script", "/script"),
    )
    learnt = learn([Record([RecordedRun("r"), *lines])])
    assert [each.key.node for each in learnt.nodes if each.key.node != "ComponentManager"] == []
    assert any("/stranger" in text for text in learnt.unforeseeable)


def test_the_node_of_a_transform_listener_marks_the_node_that_made_it() -> None:
    lines = (
        RecordedRun("r"),
        StartedProcess(10, "a-1", "demo", "a"),
        loaded(10, 1, 10),
        node(10, 1, "a", "/a"),
        publisher(10, 1, "p", "/a"),
        node(10, 2, "_", "/transform_listener_impl_5581a2b3c4d0"),
    )
    learnt = learn([Record(lines)])
    assert [(each.key.node, each.tf_listener) for each in learnt.nodes] == [("a", True)]
    assert learnt.unforeseeable == ()


def test_other_nodes_with_addresses_in_their_names_are_reported() -> None:
    lines = (
        StartedProcess(10, "a-1", "demo", "a"),
        loaded(10, 1, 10),
        node(10, 1, "_", "/helper_5581a2b3c4d0"),
    )
    assert learn([Record([RecordedRun("r"), *lines])]).unforeseeable == ("helper_* of demo/a",)


def test_a_word_of_letters_is_no_address() -> None:
    lines = (
        StartedProcess(10, "a-1", "demo", "a"),
        loaded(10, 1, 10),
        node(10, 1, "the_facade", "/the_facade"),
    )
    (learnt,) = learn([Record([RecordedRun("r"), *lines])]).nodes
    assert (learnt.key.node, learnt.random_name) == ("the_facade", False)


def test_quality_that_all_runs_have_is_learnt_and_what_differs_is_left_open() -> None:
    def record(run: str, *qos: int) -> Record:
        made = publisher(10, 1, "chatter", "/t")._replace(qos=qos)
        return Record(
            [
                RecordedRun(run),
                StartedProcess(10, "t-1", "demo", "t"),
                loaded(10, 1, 10),
                node(10, 1, "t", "/t"),
                made,
            ]
        )

    def learnt(*records: Record) -> Any:
        (found,) = learn(list(records)).nodes
        return yaml.safe_load(manifest_text(found))["publishers"][0]["qos"]

    first = record("a", 1, 5, 2, 2)
    same = {"history": "KEEP_LAST", "depth": 5, "reliability": "BEST_EFFORT", "durability": "VOLATILE"}
    assert learnt(first, record("b", 1, 5, 2, 2)) == same
    assert learnt(first, record("b", 1, 5, 1, 2)) == {**same, "reliability": "SYSTEM_DEFAULT"}
    assert set(learnt(first, record("b")).values()) == {"SYSTEM_DEFAULT"}, "one run that does not tell"
