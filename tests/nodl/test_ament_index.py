"""The ament index on real folders: which prefix wins, what is refused, what the errors say."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from nodl import ament_index


def install(prefix: Path, package: str, *files: str) -> None:
    """A package as colcon installs it: marker, share folder, and empty files (executable below lib)."""
    marker = prefix / ament_index.INDEX_FOLDER / "packages" / package
    marker.parent.mkdir(parents=True, exist_ok=True)
    marker.touch()
    for name in files:
        path = prefix / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
        path.chmod(0o755 if name.startswith("lib/") else 0o644)


@pytest.fixture
def prefixes(tmp_path: Path) -> tuple[str, str]:
    overlay, underlay = tmp_path / "overlay", tmp_path / "underlay"
    install(underlay, "demo", "lib/demo/talker", "share/demo/launch/a.launch.xml")
    install(underlay, "base", "share/base/launch/b.launch.py", "share/base/test/b.launch.py")
    install(overlay, "demo", "lib/demo/talker", "share/demo/package.xml")
    return str(overlay), str(underlay)


def test_the_first_prefix_wins(prefixes: tuple[str, str]) -> None:
    assert ament_index.package_prefix("demo", prefixes) == prefixes[0]
    assert ament_index.package_prefix("demo", prefixes[::-1]) == prefixes[1]
    assert ament_index.package_share_directory("base", prefixes) == f"{prefixes[1]}/share/base"


def test_an_unknown_package_names_itself_and_the_searched_prefixes(prefixes: tuple[str, str]) -> None:
    with pytest.raises(KeyError) as caught:
        ament_index.package_prefix("nosuch", prefixes)
    assert str(caught.value) == f"package 'nosuch' not found, searching: {list(prefixes)}"
    assert isinstance(caught.value, ament_index.PackageNotFoundError)
    assert (caught.value.package, caught.value.prefixes) == ("nosuch", prefixes)


@pytest.mark.parametrize("name", ["", "a", "-a", "a/b", "a b", "ä1", "..", "a\n"])
def test_what_cannot_be_a_package_name(name: str, prefixes: tuple[str, str]) -> None:
    with pytest.raises(ValueError, match="is not a valid package name"):
        ament_index.package_prefix(name, prefixes)


def test_executables_are_found_below_lib(prefixes: tuple[str, str]) -> None:
    assert ament_index.executable_path("demo", "talker", prefixes) == f"{prefixes[0]}/lib/demo/talker"
    with pytest.raises(
        ament_index.ExecutableNotInstalledError, match="executable 'nosuch' not found on the lib"
    ):
        ament_index.executable_path("demo", "nosuch", prefixes)
    with pytest.raises(
        ament_index.ExecutableNotInstalledError, match=r"libexec directory '.*' does not exist"
    ):
        ament_index.executable_path("base", "talker", prefixes)


def test_a_file_that_may_not_be_executed_is_no_executable(prefixes: tuple[str, str]) -> None:
    Path(prefixes[0], "lib/demo/talker").chmod(0o644)
    with pytest.raises(ament_index.ExecutableNotInstalledError):
        ament_index.executable_path("demo", "talker", prefixes)


def test_launch_files_are_found_anywhere_below_share(prefixes: tuple[str, str]) -> None:
    found = ament_index.launch_file_path("demo", "a.launch.xml", prefixes[1:])
    assert found == f"{prefixes[1]}/share/demo/launch/a.launch.xml"
    with pytest.raises(FileNotFoundError, match=r"'c.launch.py' was not found in the share directory"):
        ament_index.launch_file_path("demo", "c.launch.py", prefixes)


def test_two_launch_files_of_one_name_are_listed(prefixes: tuple[str, str]) -> None:
    with pytest.raises(ament_index.MultipleLaunchFilesError) as caught:
        ament_index.launch_file_path("base", "b.launch.py", prefixes)
    assert caught.value.paths == (
        f"{prefixes[1]}/share/base/launch/b.launch.py",
        f"{prefixes[1]}/share/base/test/b.launch.py",
    )
    assert all(path in str(caught.value) for path in caught.value.paths)


def test_resources_of_all_prefixes_are_listed_once(prefixes: tuple[str, str]) -> None:
    Path(prefixes[0], ament_index.INDEX_FOLDER, "packages", ".hidden").touch()
    Path(prefixes[0], ament_index.INDEX_FOLDER, "packages", "folder").mkdir()
    assert ament_index.list_resources("packages", prefixes) == {"demo": prefixes[0], "base": prefixes[1]}
    assert ament_index.list_resources("nodl", prefixes) == {}
    assert ament_index.list_resource_types(prefixes) == {"packages"}


def test_resource_text(prefixes: tuple[str, str]) -> None:
    folder = Path(prefixes[1], ament_index.INDEX_FOLDER, "nodl")
    folder.mkdir()
    (folder / "demo__talker").write_text("share/demo/talker.nodl.yaml\n")
    found = ament_index.read_resource("nodl", "demo__talker", prefixes)
    assert found == ament_index.Resource("share/demo/talker.nodl.yaml\n", prefixes[1])
    with pytest.raises(LookupError, match="Could not find the resource 'x' of type 'nodl'"):
        ament_index.read_resource("nodl", "x", prefixes)


@pytest.mark.parametrize("name", ["../packages", "a/b", "a\\b", ""])
def test_names_never_leave_the_index(name: str, prefixes: tuple[str, str]) -> None:
    with pytest.raises(ament_index.InvalidResourceTypeNameError):
        ament_index.list_resources(name, prefixes)
    with pytest.raises(ament_index.InvalidResourceNameError):
        ament_index.find_resource("packages", name, prefixes)


def test_search_prefixes_puts_options_first_and_drops_what_is_not_there(tmp_path: Path) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    first.mkdir()
    second.mkdir()
    path = os.pathsep.join([str(second), str(tmp_path / "gone"), "", str(first)])
    found = ament_index.search_prefixes([str(first)], {"AMENT_PREFIX_PATH": path})
    assert found == (str(first), str(second))
    assert ament_index.search_prefixes((), {}) == ()
