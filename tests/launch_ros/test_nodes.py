"""Nodes as values: kinds, remap rules with their places, packages that are not installed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from enclave_common.source_location import SourceLocation
from enclave_launch import LaunchFileError
from enclave_launch.policy.running_node import node_of_component, node_of_process
from enclave_launch.process import Evaluation, ResolvedProcess
from nodl.ament_index import PackageNotFoundError
from nodl.node_interface import NodeInterface
from nodl.remap import NodeNames

Evaluate = Callable[..., Evaluation]


def test_kinds_and_programs(launched: Evaluate) -> None:
    text = """
    <node pkg="pk" exec="e" name="n" namespace="ns"/>
    <node_container pkg="rc" exec="cc" name="c" namespace=""/>
    <executable cmd="/bin/ls -l"/>
    <node exec="own_program"/>"""
    found = [(p.kind, p.package, p.executable, p.name, p.namespace, p.fqn) for p in launched(text).processes]
    unknown = ("<node_name_unspecified>", "<node_namespace_unspecified>")
    assert found == [
        ("node", "pk", "e", "n", "/ns", "/ns/n"),
        ("container", "rc", "cc", "c", "/", "/c"),
        ("executable", None, "/bin/ls", None, None, None),
        ("node", None, "own_program", *unknown, f"{unknown[1]}/{unknown[0]}"),
    ]


def test_remap_rules_know_their_place(launched: Evaluate) -> None:
    text = """<set_remap from="a" to="b"/>
    <node pkg="pk" exec="e" args="--ros-args -r user:=first">
      <remap from="c" to="d"/>
      <remap from="e" to="f"/>
    </node>
    <load_composable_node target="c">
      <composable_node pkg="pk" plugin="P" name="n"><remap from="g" to="h"/></composable_node>
    </load_composable_node>"""
    result = launched(text)
    rules = [(r.source, r.target, r.location and r.location.line) for r in result.processes[0].remaps]
    assert rules == [("a", "b", 2), ("c", "d", 4), ("e", "f", 5)]
    component = result.components[0]
    assert [(r.source, r.location and r.location.line) for r in component.remaps] == [("a", 2), ("g", 8)]
    assert (component.location.line, component.location.element) == (8, "composable_node")


NODE = NodeInterface("pk", "e", None, "n", None, (), SourceLocation("pk.nodl.xml", 1))


def origins(process: ResolvedProcess) -> list[tuple[str, str]]:
    """The rules that the node obeys, each with the line of its origin."""
    node = node_of_process(process, NODE, "/n", "node")
    return [(rule.text, rule.origin.partition(" ")[0].rpartition(":")[2]) for rule in node.rules.process]


@pytest.mark.parametrize("started_by", ["", 'launch-prefix="nice -n 3"'])
def test_each_rule_of_a_command_line_tells_where_it_was_written(launched: Evaluate, started_by: str) -> None:
    text = f"""<set_remap from="a" to="b"/>
    <node pkg="pk" exec="e" name="n" {started_by} args="x:=y --ros-args -r c:=d --">
      <remap from="c" to="d"/>
      <remap from="a" to="b"/>
    </node>"""
    (process,) = launched(text).processes
    of_args_and_name = [("x:=y", "3"), ("c:=d", "3"), ("__node:=n", "3")]
    assert origins(process) == [*of_args_and_name, ("a:=b", "2"), ("c:=d", "4"), ("a:=b", "5")]


def test_of_equal_rules_the_place_of_the_first_is_told(launched: Evaluate) -> None:
    text = """<set_remap from="a" to="b"/>
    <node pkg="pk" exec="e" name="n"><remap from="a" to="b"/></node>
    <load_composable_node target="c">
      <composable_node pkg="pk" plugin="P" name="n"><remap from="a" to="b"/></composable_node>
    </load_composable_node>"""
    result = launched(text)
    alone = node_of_process(result.processes[0], NODE, "/n", "node")
    loaded = node_of_component(result.components[0], None, NODE, "/n")
    for node in (alone, loaded):
        (rule,) = NodeNames("n", "/", node.rules).topic("a").rules
        assert ":2" in rule.origin and rule.text == "a:=b"


def test_remaps_are_launchs_own_rules_as_written_whoever_wins(launched: Evaluate) -> None:
    text = """<node pkg="pk" exec="e" name="n" args="--ros-args -r __node:=z">
      <remap from="__node" to="x"/><remap from="a" to="b"/>
    </node>"""
    (process,) = launched(text).processes
    assert [(rule.source, rule.target) for rule in process.remaps] == [("__node", "x"), ("a", "b")]


def test_a_prefix_is_not_taken_for_the_program(launched: Evaluate) -> None:
    (process,) = launched(
        '<node pkg="pk" exec="e" launch-prefix="nice -n 3" ros_args="--enclave /x -r a:=b"/>'
    ).processes
    assert process.cmd[:3] == ("nice", "-n", "3")
    assert (process.executable, process.enclave.argument) == ("e", "/x")
    assert process.remaps == ()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            '<node pkg="nowhere_to_be_found" exec="e"/>',
            "package 'nowhere_to_be_found' not found, searching: ['",
        ),
        ('<node pkg="pk" exec="nothing"/>', "executable 'nothing' not found on the libexec directory"),
        (
            '<executable cmd="$(find-pkg-share nowhere_to_be_found)"/>',
            "package 'nowhere_to_be_found' not found",
        ),
    ],
)
def test_what_is_not_installed_is_an_error_with_its_place(launched: Evaluate, text: str, words: str) -> None:
    with pytest.raises(LaunchFileError) as caught:
        launched(f'<executable cmd="before"/>\n{text}')
    assert words in str(caught.value)
    assert caught.value.location is not None
    assert caught.value.location.line == 3


def test_the_error_is_the_one_that_callers_know(launched: Evaluate) -> None:
    with pytest.raises(LaunchFileError) as caught:
        launched('<node pkg="nowhere_to_be_found" exec="e"/>')
    assert isinstance(caught.value.cause, PackageNotFoundError)
    assert isinstance(caught.value.cause, KeyError)


def test_missing_packages_can_be_allowed(launched: Evaluate) -> None:
    text = """
    <node pkg="gone_pkg" exec="e" name="n"/><node pkg="gone_pkg" exec="f"/>
    <executable cmd="$(find-pkg-share other_gone_pkg)/x"/><node pkg="pk" exec="e"/>"""
    result = launched(text, allow_missing_packages=True)
    assert [process.cmd[0] for process in result.processes][:3] == [
        "/missing/gone_pkg/lib/gone_pkg/e",
        "/missing/gone_pkg/lib/gone_pkg/f",
        "/missing/other_gone_pkg/share/other_gone_pkg/x",
    ]
    assert [warning.text for warning in result.warnings if "gone_pkg" in warning.subject] == [
        "package 'gone_pkg' is not installed; using /missing/gone_pkg in its place",
        "package 'other_gone_pkg' is not installed; using /missing/other_gone_pkg in its place",
    ]


def test_an_installed_package_still_needs_its_program(launched: Evaluate) -> None:
    with pytest.raises(LaunchFileError, match="executable 'nothing' not found"):
        launched('<node pkg="pk" exec="nothing"/>')
    looked = launched('<node pkg="pk" exec="nothing"/>', allow_missing_packages=True)
    assert looked.processes[0].cmd[0] == "/missing/pk/lib/pk/nothing"
    assert [warning.subject for warning in looked.warnings] == ["pk/nothing"]


def test_ten_nodes_of_one_name_are_warned_about(launched: Evaluate) -> None:
    found = launched('<node pkg="pk" exec="e" name="n" namespace="/"/>' * 3)
    warnings = [str(warning) for warning in found.warnings]
    assert [warning.split(":")[0] for warning in warnings] == ["e-2", "e-3"]
    assert "at least 3 nodes with the name /n" in warnings[1]


def test_the_environment_is_left_alone(
    launched: Evaluate, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import os

    monkeypatch.setenv("ROS_LOG_DIR", "/logs")
    launched('<set_ros_log_dir new_log_dir="x"/><set_env name="NEW" value="1"/><node pkg="pk" exec="e"/>')
    assert os.environ["ROS_LOG_DIR"] == "/logs"
    assert "NEW" not in os.environ
