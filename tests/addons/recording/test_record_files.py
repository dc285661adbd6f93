"""A recorded process writes about itself and what it starts, about nobody else."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from enclave_addons.recording.record_files import RecordFiles

ANOTHER, FORGER = 100, 200


def line(pid: int, what: str = "publisher", at: int = 1) -> bytes:
    return json.dumps({"what": what, "pid": pid, "at": at, "n": 1}).encode() + b"\n"


@pytest.fixture
def files(tmp_path: Path) -> RecordFiles:
    made = RecordFiles(tmp_path)
    for process, pid in (("talker-1", ANOTHER), ("forger-2", FORGER)):
        made.path_of(process)
        made.started(process, pid)
    return made


def write(files: RecordFiles, process: str, *lines: bytes) -> None:
    with files.path_of(process).open("ab") as file:
        file.write(b"".join(lines))


def test_a_process_writes_about_itself_and_about_what_it_starts(files: RecordFiles) -> None:
    own = [line(FORGER), line(201, "loaded", 2), line(201, at=3)]
    write(files, "forger-2", *own)
    assert files.new_lines() == b"".join(own)
    assert files.reports == []


def test_lines_about_another_process_are_refused_and_reported_once(files: RecordFiles) -> None:
    write(files, "forger-2", line(ANOTHER), line(ANOTHER, "loaded"), line(ANOTHER))
    assert files.new_lines() == b""
    assert files.reports == [
        "forger-2 wrote lines about process 100 of talker-1 into its record; they are not used"
    ]


def test_lines_about_what_another_process_started_are_refused(files: RecordFiles) -> None:
    write(files, "talker-1", line(101, "loaded"))
    assert files.new_lines() == line(101, "loaded")
    write(files, "forger-2", line(101))
    assert files.new_lines() == b""
    assert "about process 101 of talker-1" in files.reports[0]


@pytest.mark.parametrize("what", ["run", "process", "component"])
def test_what_only_the_launcher_knows_is_refused_from_a_process(files: RecordFiles, what: str) -> None:
    write(files, "forger-2", line(FORGER, what))
    assert files.new_lines() == b""
    assert "about the launcher" in files.reports[0]


def test_a_process_that_was_described_by_another_before_it_started_is_reported(files: RecordFiles) -> None:
    write(files, "forger-2", line(300, "loaded"))
    files.new_lines()
    files.path_of("late-3")
    files.started("late-3", 300)
    assert "forger-2 wrote lines about process 300 of late-3" in files.reports[0]


def test_lines_of_several_files_come_in_the_order_in_which_they_were_written(files: RecordFiles) -> None:
    write(files, "forger-2", line(FORGER, at=2), line(FORGER, at=4))
    write(files, "talker-1", line(ANOTHER, at=1), line(ANOTHER, at=3))
    assert [json.loads(each)["at"] for each in files.new_lines().splitlines()] == [1, 2, 3, 4]


def test_a_line_is_handed_out_when_it_is_whole(files: RecordFiles) -> None:
    whole = line(FORGER)
    write(files, "forger-2", whole[:10])
    assert files.new_lines() == b"" and files.unfinished() == whole[:10] + b"\n"
    write(files, "forger-2", whole[10:])
    assert files.new_lines() == whole and files.unfinished() == b""


@pytest.mark.parametrize(
    "claim", [{"pid": 101}, {"pid": 777, "parent": ANOTHER}, {"pid": 777, "session": ANOTHER}]
)
def test_a_program_that_claims_to_be_of_another_process_is_refused_and_reported(
    files: RecordFiles, claim: dict[str, int]
) -> None:
    write(files, "talker-1", line(101, "loaded"))
    files.new_lines()
    write(files, "forger-2", json.dumps({"what": "loaded", "at": 2, **claim}).encode() + b"\n")
    assert files.new_lines() == b""
    assert "forger-2 wrote lines about process 10" in files.reports[0] and "of talker-1" in files.reports[0]


def test_a_session_that_was_named_before_its_process_started_is_reported(files: RecordFiles) -> None:
    write(files, "forger-2", json.dumps({"what": "loaded", "pid": 777, "session": 300}).encode() + b"\n")
    files.new_lines()
    files.started("late-3", 300)
    assert "forger-2 wrote lines about process 300 of late-3" in files.reports[0]
