"""What the positional words of ``secure-launch`` mean: as ``ros2 launch`` takes them."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_launch import UsageError
from enclave_launch.verb.target import LaunchTarget, find_target, parse_arguments
from tests.programs import install_package


@pytest.fixture
def prefix(tmp_path: Path) -> Path:
    share = install_package(tmp_path, "demo")
    for place in ("launch/one.launch.xml", "launch/twice.launch.xml", "other/deep/twice.launch.xml"):
        file = share / place
        file.parent.mkdir(parents=True, exist_ok=True)
        file.touch()
    return tmp_path


def test_a_package_and_a_file_anywhere_below_its_share_directory(prefix: Path) -> None:
    target = find_target(["demo", "one.launch.xml", "a:=1"], [str(prefix)])
    assert target == LaunchTarget(str(prefix / "share/demo/launch/one.launch.xml"), (("a", "1"),))


def test_a_path_followed_by_arguments(prefix: Path) -> None:
    file = str(prefix / "share/demo/launch/one.launch.xml")
    assert find_target([file, "a:=1", "b:=x:=y"], []) == LaunchTarget(file, (("a", "1"), ("b", "x:=y")))


REFUSED = {
    "nothing at all": ([], "PACKAGE LAUNCH_FILE"),
    "a path that does not exist": (["nosuch.launch.xml"], "'nosuch.launch.xml' does not exist"),
    "the same, with an argument": (["nosuch.launch.xml", "a:=b"], "does not exist"),
    "an unknown package": (
        ["nosuch_package", "x.launch.xml"],
        "'nosuch_package' not found, searched: {prefix}",
    ),
    "a file the package does not have": (["demo", "nosuch.launch.xml"], "nosuch.launch.xml"),
    "several files of that name": (
        ["demo", "twice.launch.xml"],
        "{prefix}/share/demo/other/deep/twice.launch.xml",
    ),
    "an argument without a value": (["demo", "one.launch.xml", "a:="], "malformed launch argument 'a:='"),
    "an argument that is none": (["demo", "one.launch.xml", "a=1"], "malformed launch argument 'a=1'"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_bad_words_are_refused_with_differences(case: str, prefix: Path) -> None:
    words, message = REFUSED[case]
    with pytest.raises(UsageError) as refused:
        find_target(words, [str(prefix)])
    assert message.format(prefix=prefix) in str(refused.value)


def test_the_last_value_of_a_repeated_argument_counts() -> None:
    assert parse_arguments(["a:=1", "b:=2", "a:=3"]) == (("a", "3"), ("b", "2"))
