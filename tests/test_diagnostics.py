"""What a person is told is also a value that a program can ask."""

from __future__ import annotations

from enclave_common.source_location import SourceLocation
from enclave_launch.diagnostics import Code, Diagnostic
from enclave_launch.diagnostics.evaluation import parameter_file_missing


def test_a_diagnostic_reads_as_place_text_and_remedy() -> None:
    place = SourceLocation("a.launch.xml", 3, "node")
    told = Diagnostic(Code.NO_MANIFEST, "demo/talker", "nothing is known", place, "write a manifest")
    assert str(told) == "a.launch.xml:3: <node> nothing is known; write a manifest"
    assert str(Diagnostic(Code.LOG_LEVEL_MISSING, "log", "no level")) == "no level"


def test_codes_are_stable_words_each_with_one_meaning() -> None:
    assert str(Code.NO_MANIFEST) == f"{Code.NO_MANIFEST}" == "no-manifest"
    assert Code("no-manifest") is Code.NO_MANIFEST
    assert all(set(code.value) <= set("abcdefghijklmnopqrstuvwxyz-") for code in Code)
    assert len({code.meaning for code in Code}) == len(Code)


def test_a_place_is_read_as_it_is_written() -> None:
    for place in (SourceLocation("a:b.xml", 7), SourceLocation("a.xml"), SourceLocation("demo 1")):
        assert SourceLocation.read(str(place)) == place


def test_the_path_of_a_parameter_file_is_shown_and_a_whole_urdf_in_its_place_by_its_beginning() -> None:
    path = "/opt/" + "a" * 300 + "/parameters.yaml"
    assert path in parameter_file_missing(path).text
    urdf = "<robot>" + "<link/>" * 1000 + "</robot>"
    text = parameter_file_missing(urdf).text
    assert "<robot><link/>" in text and text.endswith(" ...") and len(text) < 600
    assert parameter_file_missing(urdf).subject == urdf
