"""What a launch file says about enclaves: attributes, scopes, the user's own ``--enclave``.

The rules are those of the design article "ROS 2 Security Enclaves"; which path follows from them is tested
with ``enclave_launch.enclave``.
"""

from __future__ import annotations

from collections.abc import Callable

import pytest

from enclave_launch.process import EnclaveRequest, Evaluation

Evaluate = Callable[..., Evaluation]


def requests(launched: Evaluate, text: str, **options: object) -> list[tuple[str | None, str | None]]:
    """``(attribute, scope)`` of each process."""
    return [(p.enclave.attribute, p.enclave.scope) for p in launched(text, **options).processes]


NODE = '<node pkg="pk" exec="e"{}/>'
PLAIN = NODE.format("")


@pytest.mark.parametrize(
    ("case", "text", "expected"),
    [
        ("nothing said", PLAIN, [(None, None)]),
        ("an attribute", NODE.format(' enclave="a"'), [("a", None)]),
        ("an absolute one", NODE.format(' enclave="/a/b"'), [("/a/b", None)]),
        (
            "a substitution",
            '<arg name="x" default="1"/>' + NODE.format(' enclave="r$(var x)"'),
            [("r1", None)],
        ),
        ("an executable", '<executable cmd="ls" enclave="a"/>', [("a", None)]),
        (
            "the pushed namespace is the scope",
            '<push_ros_namespace namespace="ns"/>' + PLAIN,
            [(None, "/ns")],
        ),
        ("a node's own namespace is not", NODE.format(' namespace="ns"'), [(None, None)]),
        (
            "pushed namespaces nest",
            '<push_ros_namespace namespace="a"/><push_ros_namespace namespace="b"/>' + PLAIN,
            [(None, "/a/b")],
        ),
        (
            "a namespace with an enclave of its own",
            '<push_ros_namespace namespace="foo" enclave="bar"/>' + PLAIN,
            [(None, "/bar")],
        ),
        (
            "its enclave is below the scope so far",
            '<push_ros_namespace namespace="a"/><push_ros_namespace namespace="foo" enclave="bar"/>' + PLAIN,
            [(None, "/a/bar")],
        ),
        (
            "once set, a plain namespace joins the scope",
            '<push_ros_namespace namespace="a" enclave="x"/><push_ros_namespace namespace="b"/>' + PLAIN,
            [(None, "/x/b")],
        ),
        (
            "... an absolute one replaces it",
            '<push_ros_namespace namespace="a" enclave="x"/><push_ros_namespace namespace="/b"/>' + PLAIN,
            [(None, "/b")],
        ),
        ("an enclave alone", '<push_ros_enclave enclave="bar"/>' + PLAIN, [(None, "/bar")]),
        ("the other spelling", '<push-ros-enclave enclave="bar"/>' + PLAIN, [(None, "/bar")]),
        (
            "... below the namespace",
            '<push_ros_namespace namespace="a"/><push_ros_enclave enclave="bar"/>' + PLAIN,
            [(None, "/a/bar")],
        ),
        (
            "... nested",
            '<push_ros_enclave enclave="a"/><push_ros_enclave enclave="b"/>' + PLAIN,
            [(None, "/a/b")],
        ),
        (
            "... reset by an absolute value",
            '<push_ros_namespace namespace="a"/><push_ros_enclave enclave="/"/>' + PLAIN,
            [(None, "/")],
        ),
        (
            "a group scopes it",
            f'<group><push_ros_enclave enclave="in"/>{PLAIN}</group>{PLAIN}',
            [(None, "/in"), (None, None)],
        ),
        (
            "forwarding=false clears it",
            f'<push_ros_enclave enclave="out"/><group forwarding="false">{PLAIN}</group>{PLAIN}',
            [(None, None), (None, "/out")],
        ),
        (
            "both sides of a group",
            f'<push_ros_enclave enclave="out"/><group><push_ros_enclave enclave="in"/>{PLAIN}</group>{PLAIN}',
            [(None, "/out/in"), (None, "/out")],
        ),
    ],
    ids=lambda value: value if isinstance(value, str) and "<" not in value else "",
)
def test_requests(
    launched: Evaluate, case: str, text: str, expected: list[tuple[str | None, str | None]]
) -> None:
    assert requests(launched, text) == expected


def test_an_enclave_does_not_change_the_namespace(launched: Evaluate) -> None:
    result = launched(
        '<push_ros_namespace namespace="foo" enclave="bar"/><push_ros_enclave enclave="baz"/>' + PLAIN
    )
    (process,) = result.processes
    assert (process.namespace, process.enclave.scope) == ("/foo", "/bar/baz")
    assert "--enclave" not in process.cmd


def test_includes_see_the_scope(launched: Evaluate, tmp_path: object) -> None:
    from pathlib import Path

    Path(str(tmp_path), "in.launch.xml").write_text(f"<launch>{PLAIN}</launch>")
    text = '<push_ros_enclave enclave="out"/><include file="$(dirname)/in.launch.xml"/>'
    assert requests(launched, text) == [(None, "/out")]


def test_in_python(launched: Evaluate) -> None:
    text = """
from launch import LaunchDescription
from launch.actions import ExecuteProcess, GroupAction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import ComposableNodeContainer, LifecycleNode, Node, PushRosEnclave, PushRosNamespace

def generate_launch_description():
    return LaunchDescription([
        GroupAction([PushRosNamespace("foo", enclave="bar"), Node(package="pk", executable="e", enclave="n")]),
        PushRosEnclave(["e", LaunchConfiguration("x", default="1")]),
        LifecycleNode(package="pk", executable="e", name="n", namespace="", enclave="/abs"),
        ComposableNodeContainer(package="rc", executable="cc", name="c", namespace="", enclave="c"),
        ExecuteProcess(cmd=["ls"], enclave="x"),
    ])
"""
    assert requests(launched, text, syntax="py") == [
        ("n", "/bar"),
        ("/abs", "/e1"),
        ("c", "/e1"),
        ("x", "/e1"),
    ]


def test_in_yaml(launched: Evaluate) -> None:
    text = """
launch:
- push_ros_namespace: {namespace: foo, enclave: bar}
- push_ros_enclave: {enclave: baz}
- node: {pkg: pk, exec: e, enclave: n}
- node_container: {pkg: rc, exec: cc, name: c, namespace: "", enclave: c}
"""
    assert requests(launched, text, syntax="yaml") == [("n", "/bar/baz"), ("c", "/bar/baz")]


def test_the_users_own_enclave_is_the_last_one_given(launched: Evaluate) -> None:
    result = launched(
        '<node pkg="pk" exec="e" args="--ros-args -e /a --" ros_args="--enclave /b" enclave="c"/>'
    )
    assert result.processes[0].enclave == EnclaveRequest("c", None, "/b")


def test_an_enclave_outside_of_the_ros_arguments_is_none(launched: Evaluate) -> None:
    result = launched('<node pkg="pk" exec="e" args="--enclave /a"/>')
    assert result.processes[0].enclave.argument is None


def test_the_namespace_given_on_the_command_line_is_a_scope_too(launched: Evaluate) -> None:
    assert launched(PLAIN, "ros_namespace:=cli").processes[0].enclave.scope == "/cli"
