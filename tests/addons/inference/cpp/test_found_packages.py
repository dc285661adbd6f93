"""Packages are found below the folders of a workspace as colcon finds them."""

from __future__ import annotations

from pathlib import Path

from enclave_addons.inference.cpp.reading.project import find_packages
from enclave_addons.inference.cpp.system import workspace_of


def package(folder: Path, name: str) -> Path:
    folder.mkdir(parents=True)
    (folder / "package.xml").write_text(f"<package><name>{name}</name></package>", encoding="utf-8")
    return folder


def test_links_below_a_workspace_are_followed_and_circles_end(tmp_path: Path) -> None:
    inside = package(tmp_path / "src/inside", "inside")
    package(tmp_path / "elsewhere/linked", "linked")
    (tmp_path / "src/repository").symlink_to(tmp_path / "elsewhere")
    (tmp_path / "elsewhere/back").symlink_to(tmp_path / "src")
    found = find_packages([str(tmp_path / "src")])
    assert {name: each.folder for name, each in found.items()} == {
        "inside": str(inside),
        "linked": str(tmp_path / "src/repository/linked"),
    }


def test_folders_that_colcon_ignores_are_left_out(tmp_path: Path) -> None:
    package(tmp_path / "src/used", "used")
    package(tmp_path / "src/ignored/unused", "unused")
    (tmp_path / "src/ignored/COLCON_IGNORE").touch()
    assert set(find_packages([str(tmp_path / "src")])) == {"used"}


def test_what_lies_beside_a_repository_is_not_its_workspace_but_what_lies_beside_it_in_src_is(
    tmp_path: Path,
) -> None:
    alone = package(tmp_path / "clones/alone", "alone")
    package(tmp_path / "clones/other", "other")
    (alone / ".git").mkdir()
    assert set(workspace_of([str(alone / "node.cpp")]).packages) == {"alone"}
    inside = package(tmp_path / "ws/src/inside", "inside")
    package(tmp_path / "ws/src/beside", "beside")
    (inside / ".git").mkdir()
    assert set(workspace_of([str(inside / "node.cpp")]).packages) == {"inside", "beside"}
