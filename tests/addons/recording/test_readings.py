"""Names that begin with the node's own name or namespace: what the source may mean by them, and what decides."""

from __future__ import annotations

from collections.abc import Mapping

from enclave_addons.recording.record.learning import LearntEndpoint, learn_from
from enclave_addons.recording.record.lines import RecordedRun
from enclave_addons.recording.record.origins import Source
from enclave_addons.recording.record.requested import RequestedEndpoint, RequestedNode, StartedNode
from enclave_addons.recording.record.written import meant_name
from nodl.node_interface import ClientLibrary, EndpointKind
from nodl.remap import RemapRules

P = EndpointKind.PUBLISHER


def node(
    fqn: str, *written: str, own_namespace: str = "", parameters: Mapping[str, object] | None = None
) -> RequestedNode:
    namespace = fqn.rpartition("/")[0]
    finals = [each if each.startswith("/") else f"{namespace}/{each}" for each in written]
    names = [
        meant_name(P, each, final, fqn, RemapRules()).name
        for each, final in zip(written, finals, strict=True)
    ]
    made = zip(written, names, finals, strict=True)
    return RequestedNode(
        start=StartedNode("p", "x", parameters=parameters or {}),
        name="source_name",
        namespace=own_namespace,
        fqn=fqn,
        library=ClientLibrary.RCLPY,
        lifecycle=False,
        states=(),
        endpoints=tuple(RequestedEndpoint(P, each, name, final, "m/msg/A", 0) for each, name, final in made),
        known_start=True,
        started_as="node",
    )


def learnt(*nodes: RequestedNode) -> list[LearntEndpoint]:
    runs = [(RecordedRun(f"run{index}"), [each]) for index, each in enumerate(nodes)]
    (found,) = learn_from(runs).nodes
    return list(found.entries)


def readings(*nodes: RequestedNode) -> set[tuple[str, ...]]:
    return {(entry.name, *entry.readings) for entry in learnt(*nodes)}


def test_a_name_below_the_nodes_own_is_private() -> None:
    assert readings(node("/cam", "cam/image")) == {("~/image",)}


def test_a_name_below_the_nodes_own_that_a_parameter_also_has_may_be_either() -> None:
    (entry,) = learnt(node("/cam", "cam/image", parameters={"camera_name": "cam"}))
    assert (entry.name, entry.readings) == ("cam/image", ("~/image",))
    assert entry.origin.candidates == (Source("camera_name", suffix="/image"),)


def test_a_run_under_another_name_decides_what_is_private() -> None:
    first = node("/cam", "cam/image", parameters={"camera_name": "cam"})
    private = node("/eye", "eye/image", parameters={"camera_name": "cam"})
    assert readings(first, private) == {("~/image",)}
    followed = node("/eye", "left/image", parameters={"camera_name": "left"})
    (entry,) = learnt(first, followed)
    assert entry.origin.source == Source("camera_name", suffix="/image") and entry.origin.proven


def test_an_absolute_name_below_the_namespace_is_made_from_it_or_written_so() -> None:
    assert readings(node("/rig/n", "/rig/out")) == {("out", "/rig/out")}


def test_an_absolute_name_elsewhere_is_what_the_source_writes() -> None:
    assert readings(node("/rig/n", "/out")) == {("/out",)}
    assert readings(node("/rig/n", "/rig2/out")) == {("/rig2/out",)}


def test_a_run_in_another_namespace_decides_what_is_made_from_it() -> None:
    first = node("/rig/n", "/rig/out")
    assert readings(first, node("/lab/n", "/lab/out")) == {("out",)}
    assert readings(first, node("/lab/n", "/rig/out")) == {("/rig/out",)}


def test_the_namespace_of_the_source_itself_is_no_coincidence() -> None:
    assert readings(node("/rig/n", "/rig/out", own_namespace="/rig")) == {("/rig/out",)}


def test_an_absolute_name_that_is_a_parameters_value_is_that_value() -> None:
    (entry,) = learnt(node("/rig/n", "/rig/out", parameters={"topic": "/rig/out"}))
    assert entry.origin.source == Source("topic") and not entry.readings


def test_a_parameter_with_the_namespace_as_its_value_is_another_reading() -> None:
    (entry,) = learnt(node("/rig/n", "/rig/out", parameters={"robot": "rig"}))
    assert (entry.name, entry.readings) == ("/rig/out", ("out",))
    assert entry.origin.candidates == (Source("robot", suffix="/out", prefix="/"),)
