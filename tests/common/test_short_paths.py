"""Paths get short; names that only look like paths stay whole."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_common.terminal import short_paths


@pytest.fixture
def folder(tmp_path: Path) -> str:
    (tmp_path / "launch").mkdir()
    (tmp_path / "launch" / "a.launch.xml").write_text("")
    return str(tmp_path)


def test_files_below_the_folder_lose_it(folder: str) -> None:
    text = f"{folder}/launch/a.launch.xml:3: <node> at {folder}/launch/a.launch.xml"
    assert short_paths(text, folder) == "launch/a.launch.xml:3: <node> at launch/a.launch.xml"
    assert short_paths(text, f"{folder}/") == short_paths(text, folder)


@pytest.mark.parametrize("name", ["cmd_vel", "launch", "launch/b.launch.xml"])
def test_a_ros_name_that_begins_like_the_folder_stays(folder: str, name: str) -> None:
    text = f"publish: {folder}/{name}"
    assert short_paths(text, folder) == text


def test_nothing_is_lost_at_the_root(folder: str) -> None:
    text = f"publish: /chatter {folder}/launch/a.launch.xml"
    assert short_paths(text, "/") == text == short_paths(text, "")


def test_a_path_inside_of_another_stays(folder: str) -> None:
    text = f"/other{folder}/launch/a.launch.xml"
    assert short_paths(text, folder) == text
