"""A manifest is united with what stood there before: entries of other runs, and what a person wrote."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import yaml

from enclave_addons.recording.record.assembly import Record
from enclave_addons.recording.record.learning import learn
from enclave_addons.recording.record.lines import EndpointMade, Loaded, NodeMade, RecordedRun, StartedProcess
from enclave_addons.recording.record.manifest import manifest_text
from nodl.document import parse_document
from nodl.name_template import NameTemplate, ParameterPart
from nodl.node_interface import EndpointKind

BY, TYPE, QOS = "librclcpp.so", "std_msgs/msg/String", (1, 5, 1, 2)
FROM_PARAMETER = (ParameterPart("in_topic"),)


def record(run: str, name: str = "scan", qos: tuple[int, ...] = QOS, **parameters: object) -> Record:
    """One run of ``demo/t``, which publishes ``name``."""
    started = StartedProcess(10, "t-1", "demo", "t", parameters=parameters)
    loaded, node = Loaded(10, 0, 1, 10, "/lib/demo/t"), NodeMade(10, 10, 1, 1, 0, "t", "", "/t", BY)
    made = EndpointMade(EndpointKind.PUBLISHER, 10, 10, 1, 1, 0, name, "/t", f"/{name}", TYPE, BY, qos)
    return Record([RecordedRun(run), started, loaded, node, made])


def text(*records: Record, before: str = "") -> str:
    (node,) = learn(records).nodes
    return manifest_text(node, before)


def row(document: str) -> Mapping[str, Any]:
    (found,) = yaml.safe_load(document)["codegen"]["enclave_launch"]["endpoints"]
    assert isinstance(found, dict)
    return found


def readings(document: str) -> list[NameTemplate]:
    (node,) = parse_document(document.encode(), "t.nodl.yaml", package="demo")
    (endpoint,) = node.interface.endpoints
    return [endpoint.name, *endpoint.readings]


PROVEN = text(record("a", in_topic="scan"), record("b", "front", in_topic="front"))
"""What somebody else has measured: the name followed the parameter."""


def test_what_other_runs_have_proven_holds_after_a_run_here_that_decides_nothing() -> None:
    here = record("c", "front", in_topic="front")
    assert [each.parts for each in readings(text(here, before=PROVEN))] == [FROM_PARAMETER]
    assert [each.parts for each in readings(text(here))] == [FROM_PARAMETER, ("front",)], "alone both hold"
    assert row(text(here, before=PROVEN))["runs"] == ["a", "b", "c"]


def test_what_runs_here_prove_holds_against_others_that_decided_nothing() -> None:
    undecided = text(record("c", "front", in_topic="front"))
    here = record("a", "front", in_topic="front"), record("b", "scan", in_topic="scan")
    united = text(*here, before=undecided)
    assert [each.parts for each in readings(united)] == [FROM_PARAMETER]
    assert row(united)["runs"] == ["a", "b", "c"]


def test_sources_of_runs_that_decide_nothing_are_all_possible() -> None:
    before = text(record("a", in_topic="scan"))
    united = readings(text(record("b", other="scan"), before=before))
    assert {each.parts for each in united} == {("scan",), FROM_PARAMETER, (ParameterPart("other"),)}
    again = readings(text(record("a", in_topic="scan"), before=before))
    assert {each.parts for each in again} == {("scan",), FROM_PARAMETER}, "the run that stands there already"


def test_a_name_that_is_there_where_nothing_is_set_is_the_default_of_a_proven_parameter() -> None:
    (found,) = readings(text(record("c", "front"), before=PROVEN))
    assert found.parts == (ParameterPart("in_topic", "front"),)


def test_quality_that_differs_from_that_of_other_runs_is_left_open() -> None:
    united = text(record("c", qos=(1, 9, 2, 2)), before=text(record("a")))
    (publisher,) = yaml.safe_load(united)["publishers"]
    assert (
        publisher["qos"]["reliability"] == "SYSTEM_DEFAULT" and publisher["qos"]["durability"] == "VOLATILE"
    )


def test_a_row_without_runs_is_a_persons_and_stays() -> None:
    document = yaml.safe_load(text(record("a")))
    (mine,) = document["codegen"]["enclave_launch"]["endpoints"]
    mine["parameter"] = "by_hand"
    del mine["runs"]
    assert row(text(record("b"), before=yaml.safe_dump(document)))["parameter"] == "by_hand"
