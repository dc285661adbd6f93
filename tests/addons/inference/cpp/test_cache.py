"""Answers of earlier runs are taken where nothing that they were made from has changed, and only there."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple

import pytest

from enclave_addons.inference import InferredSystem, infer_paths
from tests.addons.inference.cpp.workspace import HEAD, names, package, write

pytest.importorskip("tree_sitter_cpp", reason="the extra cpp is not installed")

from enclave_addons.inference.answers import cpp, python
from enclave_addons.inference.answers.codec import decoded, encoded, keep_variant, variants
from enclave_addons.inference.answers.folder import CacheFolder

NODE = (
    HEAD
    + '#include "names.hpp"\n'
    + 'struct N : rclcpp::Node { N() : Node("n") { create_publisher<std_msgs::msg::String>(TOPIC, 1); } };\n'
    + "int main() { N n; }\n"
)


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    (tmp_path / "src").mkdir()
    package(
        tmp_path / "src" / "demo",
        {"src/main.cpp": NODE, "include/names.hpp": '#define TOPIC "a"\n'},
        cmake="include_directories(include other)\nadd_executable(node src/main.cpp)",
    )
    return tmp_path / "src"


def asked(workspace: Path) -> InferredSystem:
    return infer_paths([workspace])


def test_a_second_run_gives_the_same_without_following_the_program(workspace: Path, runs: list[str]) -> None:
    first = asked(workspace)
    again = asked(workspace)
    assert (again.nodes, again.gaps) == (first.nodes, first.gaps)
    assert names(again) == ["a"]
    assert runs == ["main.cpp"]


def test_an_edit_of_a_header_counts_for_the_programs_that_include_it_alone(
    workspace: Path, runs: list[str]
) -> None:
    package(workspace / "other", {"src/other.cpp": NODE.replace('#include "names.hpp"', '#define TOPIC "b"')})
    asked(workspace)
    runs.clear()
    write(workspace / "demo" / "include" / "names.hpp", '#define TOPIC "changed"\n')
    assert names(asked(workspace)) == ["b", "changed"]
    assert runs == ["main.cpp"]


def test_an_edit_of_the_source_counts(workspace: Path) -> None:
    asked(workspace)
    write(workspace / "demo" / "src" / "main.cpp", NODE.replace("TOPIC", '"edited"'))
    assert names(asked(workspace)) == ["edited"]


@pytest.mark.parametrize("kept", [cpp.VARIANTS, python.VARIANTS])
def test_each_robot_of_a_fleet_has_its_answer_in_the_next_run(kept: int, own_cache: Path) -> None:
    """They start one program each under its own parameters; were fewer kept, each run would lose them all in turn."""
    folder = CacheFolder()
    for robot in range(20):
        keep_variant(folder, "program", (f"robot_{robot}",), kept)
    assert {name for (name,) in variants(folder, "program")} == {f"robot_{robot}" for robot in range(20)}


def test_a_header_that_appears_before_the_one_that_was_found_counts(workspace: Path) -> None:
    asked(workspace)
    write(workspace / "demo" / "src" / "names.hpp", '#define TOPIC "nearer"\n')
    assert names(asked(workspace)) == ["nearer"]


def test_a_source_in_no_package_is_kept_too_and_its_headers_count(tmp_path: Path, runs: list[str]) -> None:
    write(tmp_path / "loose.cpp", NODE)
    write(tmp_path / "names.hpp", '#define TOPIC "a"\n')
    assert names(asked(tmp_path / "loose.cpp")) == ["a"] == names(asked(tmp_path / "loose.cpp"))
    assert runs == ["loose.cpp"]
    write(tmp_path / "names.hpp", '#define TOPIC "b"\n')
    assert names(asked(tmp_path / "loose.cpp")) == ["b"]


def test_what_the_build_says_counts(workspace: Path) -> None:
    asked(workspace)
    cmake = workspace / "demo" / "CMakeLists.txt"
    cmake.write_text(cmake.read_text() + "add_executable(second src/main.cpp)\n")
    assert {node.executable for node in asked(workspace).nodes} == {"node", "second"}


@pytest.mark.parametrize("damage", [b"", b"{}", b"\n\n", b"x" * 100])
def test_a_damaged_entry_is_as_none(workspace: Path, own_cache: Path, damage: bytes) -> None:
    asked(workspace)
    entries = [each for each in own_cache.rglob("*") if each.is_file()]
    assert entries
    for each in entries:
        each.write_bytes(damage)
    assert names(asked(workspace)) == ["a"]


@pytest.mark.parametrize("mode", [0o770, 0o707])
def test_a_folder_that_others_may_write_to_is_not_used(
    workspace: Path, own_cache: Path, runs: list[str], mode: int
) -> None:
    asked(workspace)
    (own_cache / "enclave-launch" / "inferred").chmod(mode)
    asked(workspace)
    assert runs == ["main.cpp", "main.cpp"]


def test_an_entry_that_others_may_write_to_is_not_believed(tmp_path: Path) -> None:
    folder = CacheFolder(str(tmp_path / "kept" / "inferred"))
    folder.write("key", b"content")
    assert folder.read("key") == b"content"
    (tmp_path / "kept" / "inferred" / "key").chmod(0o666)
    assert folder.read("key") is None


def test_an_entry_that_is_a_link_is_not_followed(tmp_path: Path) -> None:
    folder = CacheFolder(str(tmp_path / "kept" / "inferred"))
    folder.write("key", b"content")
    os.symlink(tmp_path / "kept" / "inferred" / "key", tmp_path / "kept" / "inferred" / "link")
    assert folder.read("link") is None


def test_without_a_place_to_keep_them_answers_are_made_each_time(
    workspace: Path, monkeypatch: pytest.MonkeyPatch, runs: list[str]
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", "/dev/null")
    assert names(asked(workspace)) == ["a"] == names(asked(workspace))
    assert runs == ["main.cpp", "main.cpp"]


def test_answers_are_read_back_as_they_were_written(workspace: Path) -> None:
    nodes = asked(workspace).nodes
    assert decoded(encoded(nodes)) == nodes


def test_a_record_that_is_not_on_the_list_is_not_kept_as_a_plain_tuple() -> None:
    class Stranger(NamedTuple):
        word: str

    assert decoded(encoded(("word",))) == ("word",)
    with pytest.raises(TypeError, match="Stranger is not kept"):
        encoded(Stranger("word"))


@pytest.mark.parametrize(
    "written", [{"record": "Popen", "fields": ["ls"]}, {"record": "Gap"}, {"enum": "Certainty", "value": "x"}]
)
def test_what_is_not_an_answer_of_ours_is_refused(written: object) -> None:
    with pytest.raises(ValueError):
        decoded(written)


def test_many_programs_in_parallel_give_what_they_give_one_after_the_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = {f"src/n{i}.cpp": NODE.replace("TOPIC", f'"t{i}"') for i in range(5)}
    cmake = "".join(f"add_executable(n{i} src/n{i}.cpp)\n" for i in range(5))
    folder = package(tmp_path / "demo", {**files, "include/names.hpp": ""}, cmake)
    monkeypatch.setenv("XDG_CACHE_HOME", "/dev/null")
    monkeypatch.setattr("enclave_addons.inference.cpp.parallel._processors", lambda: 1)
    alone = infer_paths([folder])
    monkeypatch.setattr("enclave_addons.inference.cpp.parallel._processors", lambda: 2)
    monkeypatch.setattr("enclave_addons.inference.cpp.parallel._may_fork", lambda: True)
    assert infer_paths([folder]).nodes == alone.nodes
    assert names(alone) == ["t0", "t1", "t2", "t3", "t4"]
