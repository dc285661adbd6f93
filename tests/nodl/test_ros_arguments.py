"""What rcl finds on a command line (ros2/rcl ``arguments.c``)."""

from __future__ import annotations

import shlex

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nodl.ros_arguments import (
    ParameterFileArgument,
    ParameterRule,
    RosArguments,
    parse_ros_arguments,
    remap_arguments,
)


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("", RosArguments()),
        ("a b --ros-args", RosArguments()),
        ("--ros-args -r a:=b --remap c:=d", RosArguments(("a:=b", "c:=d"))),
        ("--ros-args -r a:=b -- -r c", RosArguments(("a:=b",))),
        ("--ros-args -- c:=d", RosArguments(("c:=d",))),
        ("--ros-args -r a:=b -- x --ros-args -r c:=d", RosArguments(("a:=b", "c:=d"))),
        ("--ros-args --ros-args -r a:=b", RosArguments(("a:=b",))),
        ("-r a b:=c", RosArguments(("b:=c",))),
        ("-r a:=b", RosArguments(("a:=b",))),
        ("--ros-args -e /x --enclave /y", RosArguments(enclave="/y")),
        ("--enclave /x", RosArguments()),
        ("--ros-args --enclave", RosArguments()),
        ("--ros-args --log-level -r -r a:=b", RosArguments(("a:=b",))),
        ("--ros-args --disable-rosout-logs -r a:=b", RosArguments(("a:=b",))),
        (
            "--ros-args -p a:=1 --params-file f.yaml --param n:b:=x:=y",
            RosArguments(
                parameters=(
                    ParameterRule("a", "1"),
                    ParameterFileArgument("f.yaml"),
                    ParameterRule("b", "x:=y", "n"),
                )
            ),
        ),
        ("--ros-args -p nothing", RosArguments()),
    ],
)
def test_reading(line: str, expected: RosArguments) -> None:
    assert parse_ros_arguments(shlex.split(line)) == expected


def test_each_rule_is_found_by_the_index_of_its_word() -> None:
    line = "x:=y --ros-args -r a:=b -p c:=1 --remap a:=b -- d:=e"
    assert remap_arguments(shlex.split(line)) == {0: "x:=y", 3: "a:=b", 7: "a:=b", 9: "d:=e"}


@given(st.lists(st.sampled_from(["--ros-args", "--", "-r", "-p", "-e", "--params-file", "a:=b", "x", ""])))
def test_any_words_are_read(words: list[str]) -> None:
    found = parse_ros_arguments(words)
    assert len(found.remaps) + len(found.parameters) <= len(words)
