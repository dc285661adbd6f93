"""The text of a record: what is read, and what is said to be lost."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from enclave_addons.recording.record.lines import (
    EndpointMade,
    LineReader,
    LoadedComponent,
    NodeMade,
    RecordedRun,
    StartedProcess,
    line_text,
    read_lines,
)
from nodl.node_interface import EndpointKind


def line(what: str, n: int, **fields: Any) -> bytes:
    return json.dumps({"what": what, "pid": 7, "thread": 7, "at": 1, "n": n, **fields}).encode() + b"\n"


def complaints(text: bytes) -> list[str]:
    return [complaint.why for complaint in read_lines(text)[1]]


PUBLISHER = line(
    "publisher",
    2,
    node=1,
    name="chatter",
    fqn="/a/talker",
    final="/a/gossip",
    type="std_msgs/msg/String",
    qos=[1, 5, 1, 2],
    by="librclcpp.so",
    rc=0,
)
WHOLE = line("loaded", 1, parent=1, session=7, program="/bin/talker") + PUBLISHER + line("ended", 3)


def test_an_endpoint_is_read_with_both_of_its_names() -> None:
    lines, lost = read_lines(WHOLE)
    assert lost == []
    assert lines[1] == EndpointMade(
        EndpointKind.PUBLISHER,
        pid=7,
        thread=7,
        at=1,
        node=1,
        rc=0,
        written="chatter",
        fqn="/a/talker",
        final="/a/gossip",
        type="std_msgs/msg/String",
        by="librclcpp.so",
        qos=(1, 5, 1, 2),
    )


def test_a_whole_record_has_nothing_to_complain_of() -> None:
    assert complaints(WHOLE) == []


def test_threads_may_write_their_lines_in_another_order_than_they_number_them() -> None:
    head, ended = line("loaded", 1), line("ended", 3)
    assert complaints(head + ended + PUBLISHER) == []


def test_a_missing_number_is_told() -> None:
    assert complaints(line("loaded", 1) + line("ended", 4)) == [
        "2 of the lines of process 7 are missing: lines 2 to 3"
    ]


def test_a_program_that_becomes_another_numbers_its_lines_anew() -> None:
    assert complaints(WHOLE + WHOLE) == []


def test_a_cut_line_is_told_and_spoils_no_other() -> None:
    lines, lost = read_lines(PUBLISHER[:40] + b"\n" + line("loaded", 1) + PUBLISHER)
    assert [type(each).__name__ for each in lines] == ["Loaded", "EndpointMade"]
    assert len(lost) == 1 and lost[0].why.startswith("a line cannot be read: ")


def test_a_last_line_without_its_end_is_told() -> None:
    assert complaints(WHOLE + b'{"what":"publ')[0].startswith("a line was cut off: ")


def test_a_text_that_was_too_long_is_told() -> None:
    assert complaints(line("loaded", 1, cut=True)) == [
        "line 1 of process 7 has a text that was too long and is cut"
    ]


@pytest.mark.parametrize(
    "text",
    [
        b"[]\n",
        b"1\n",
        b'{"what": []}\n',
        b'{"pid": 1}\n',
        b"\xff\xfe\n",
        b'{"what":"node","pid":"x"}\n',
        b"{" * 9999,
    ],
)
def test_what_is_not_a_line_is_a_complaint_and_not_an_error(text: bytes) -> None:
    lines, lost = read_lines(text)
    assert lines == [] and len(lost) == 1


def test_kinds_of_lines_that_a_newer_recorder_writes_are_passed_over() -> None:
    assert read_lines(line("telepathy", 1)) == ([], [])


@given(st.integers(1, 60))
def test_a_record_may_come_in_any_portions(size: int) -> None:
    reader = LineReader()
    lines = [each for at in range(0, len(WHOLE), size) for each in reader.feed(WHOLE[at : at + size])]
    assert (lines, reader.complaints) == read_lines(WHOLE)


@given(st.binary(max_size=200))
def test_no_bytes_make_the_reader_fail(text: bytes) -> None:
    read_lines(text)


@pytest.mark.parametrize(
    "said",
    [
        RecordedRun("r1", "/x.launch.xml", "jazzy", "network namespace", "2026-11-21", secured=True),
        StartedProcess(
            9, "talker-1", "demo", "talker", "node", "/talker", "/", "x:3", ("a",), ("b:=c",), {"p": ("q", 1)}
        ),
        LoadedComponent("/box", "demo", "demo::T", "t", "/n", "x:4", ("b:=c",), {"p": True}),
    ],
)
def test_what_the_supervisor_says_is_read_as_it_was_said(
    said: RecordedRun | StartedProcess | LoadedComponent,
) -> None:
    assert read_lines(line_text(said)) == ([said], [])


def test_a_node_that_was_refused_has_the_texts_of_the_refusal() -> None:
    (made,), _ = read_lines(line("node", 1, node=1, name="x", namespace="", rc=1, error=["first", "last"]))
    assert isinstance(made, NodeMade) and made.error == ("first", "last")
