"""A node as it will run: which rules it obeys, where its name comes from, what follows for its helpers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from enclave_common.source_location import SourceLocation
from enclave_launch import LaunchFileError
from enclave_launch.evaluation.evaluate import evaluate
from enclave_launch.host.plan_host import PlanHost
from enclave_launch.policy import RunningNode
from enclave_launch.policy.running_node import UnknownNodeName, node_of_component, node_of_process
from enclave_launch.process import ResolvedComponent, ResolvedProcess
from nodl.node_interface import RANDOM_ENDING, Gap, NodeInterface

from .conftest import make_node

NODE = '<node pkg="pk" exec="talker" {}>{}</node>'
BOX = """<node_container pkg="rclcpp_components" exec="component_container" name="box" namespace="/cell"
    ros_args="-r image:=by_command_line">
  <composable_node pkg="pk" plugin="pk::Camera" {}>{}</composable_node></node_container>"""


def interface(original: str | None = "talker", **fields: Any) -> NodeInterface:
    return make_node("pub image", original="talker").interface._replace(name=original, **fields)


def launched(folder: Path, text: str) -> tuple[ResolvedProcess, tuple[ResolvedComponent, ...]]:
    file = folder / "test.launch.xml"
    file.write_text(f"<launch>{text}</launch>")
    found = evaluate(file, host=PlanHost(allow_missing_packages=True, distro="jazzy"))
    return found.processes[0], tuple(found.components)


def process_node(folder: Path, node: NodeInterface, attributes: str = "", children: str = "") -> RunningNode:
    return node_of_process(launched(folder, NODE.format(attributes, children))[0], node, "/", "node")


def component_node(
    folder: Path, node: NodeInterface, attributes: str = "", children: str = "", contained: bool = True
) -> RunningNode:
    box, (component,) = launched(folder, BOX.format(attributes, children))
    return node_of_component(component, box if contained else None, node, "/")


REMAP = '<remap from="image" to="picture"/>'
ARGUMENTS = 'name="eye" namespace="/left" ros_args="-p rate:=1"'


def names(node: RunningNode) -> list[str]:
    return [rule.replacement for rule in node.rules.names]


def test_a_node_that_listens_to_its_command_line_obeys_it(tmp_path: Path) -> None:
    node = process_node(tmp_path, interface(global_arguments=True), ARGUMENTS, REMAP)
    assert (node.fqn, names(node), node.parameters) == ("/left/eye", ["picture"], {"rate": 1})
    assert node.process_namespace == "/left"
    assert not node.interface.gaps


def test_a_section_of_a_parameter_file_that_names_the_node_is_its_own_also_where_launch_names_none(
    tmp_path: Path,
) -> None:
    """Of two nodes of one program each has the sections that match its final name, as rcl reads the file."""
    file = tmp_path / "parameters.yaml"
    file.write_text(
        "talker: {ros__parameters: {topic: mine}}\n/**: {ros__parameters: {rate: 2}}\n"
        "listener: {ros__parameters: {topic: other}}\n"
    )
    given = f'<param from="{file}"/>'
    node = process_node(tmp_path, interface(global_arguments=True), "", given)
    assert (node.fqn, node.parameters) == ("/talker", {"topic": "mine", "rate": 2})
    other = process_node(tmp_path, interface("listener", global_arguments=True), "", given)
    assert (other.fqn, other.parameters) == ("/listener", {"topic": "other", "rate": 2})
    moved = process_node(tmp_path, interface(global_arguments=True), 'namespace="/left"', given)
    assert (moved.fqn, moved.parameters) == ("/left/talker", {"rate": 2})
    renamed = process_node(tmp_path, interface(global_arguments=True), 'name="listener"', given)
    assert (renamed.fqn, renamed.parameters) == ("/listener", {"topic": "other", "rate": 2})


def test_a_node_without_use_global_arguments_obeys_its_own_rules_alone(tmp_path: Path) -> None:
    deaf = interface(global_arguments=False, own_rules=("image:=mine", "__ns:=/own"))
    node = process_node(tmp_path, deaf, ARGUMENTS, REMAP)
    assert (node.fqn, names(node), node.parameters) == ("/own/talker", ["mine"], {})


def test_its_own_rules_come_before_those_of_the_command_line(tmp_path: Path) -> None:
    own = interface(global_arguments=True, own_rules=("image:=mine", "__node:=me", "__ns:=/own"))
    node = process_node(tmp_path, own, ARGUMENTS, REMAP)
    assert (node.fqn, names(node)) == ("/own/me", ["mine", "picture"])


@pytest.mark.parametrize(
    ("attributes", "children", "open_question"),
    [
        ("", "", False),
        ("", REMAP, True),
        ('name="eye"', "", True),
        ("", '<param name="rate" value="1"/>', True),
        ("", '<param from="{folder}/talker.yaml"/>', True),
        ("", '<param from="{folder}/other.yaml"/>', False),
    ],
)
def test_whether_a_node_listens_is_asked_where_launch_gives_it_something(
    attributes: str, children: str, open_question: bool, tmp_path: Path
) -> None:
    for name in ("talker", "other"):
        (tmp_path / f"{name}.yaml").write_text(f"{name}: {{ros__parameters: {{rate: 1}}}}\n")
    children = children.format(folder=tmp_path)
    known = Gap(SourceLocation("talker.py", 3), "known before")
    node = process_node(tmp_path, interface(global_arguments=None, gaps=(known,)), attributes, children)
    assert node.interface.gaps[0] == known
    assert ["use_global_arguments" in gap.why for gap in node.interface.gaps[1:]] == [True] * open_question


def test_a_component_obeys_its_load_request_and_not_its_container(tmp_path: Path) -> None:
    node = component_node(tmp_path, interface(), 'name="eye" namespace="/left"', REMAP)
    assert (node.fqn, names(node), node.role) == ("/left/eye", ["picture"], "component")
    assert node.process_namespace == "/cell"


def test_a_component_in_a_container_that_is_not_here_has_no_namespace_of_a_process(tmp_path: Path) -> None:
    node = component_node(tmp_path, interface(), 'name="eye"', contained=False)
    assert (node.fqn, node.process_namespace) == ("/eye", "/")


def test_rules_forwarded_from_a_container_that_is_not_here_are_not_known(tmp_path: Path) -> None:
    forward = '<extra_arg name="forward_global_arguments" value="true"/>'
    node = component_node(tmp_path, interface(), 'name="eye"', REMAP + forward, contained=False)
    assert (node.fqn, names(node)) == ("/eye", ["picture"])


def test_a_component_without_a_name_keeps_the_one_of_its_class(tmp_path: Path) -> None:
    """As Python launch files may load it; an empty ``__node`` in its load request would be refused by rcl."""
    box, (component,) = launched(tmp_path, BOX.format('name="eye" namespace="/left"', ""))
    unnamed = component._replace(name="")
    assert node_of_component(unnamed, box, interface(), "/").fqn == "/left/talker"


def test_a_further_node_of_a_component_obeys_its_own_rules_and_the_container(tmp_path: Path) -> None:
    """One that the component makes itself, with options of its own: rcl gives it the process's arguments."""
    helper = interface(original="helper", own_rules=("__node:=helper",))
    node = component_node(tmp_path, helper, 'name="eye" namespace="/left"', REMAP)
    assert (node.fqn, names(node)) == ("/cell/helper", ["by_command_line"])


def test_a_further_node_without_options_obeys_the_container_and_not_the_load_request(tmp_path: Path) -> None:
    """rcl gives it the arguments of the process (ros2/rclcpp#3003), so that it gets the container's name, too."""
    helper = interface(original="helper", of_process=True)
    node = component_node(tmp_path, helper, 'name="eye" namespace="/left"', REMAP)
    assert (node.fqn, names(node)) == ("/cell/box", ["by_command_line"])
    deaf = component_node(tmp_path, helper._replace(global_arguments=False), 'name="eye"', REMAP)
    assert (deaf.fqn, names(deaf)) == ("/helper", [])
    loaded = component_node(tmp_path, helper, 'name="eye"', contained=False)
    assert [gap.why.split(",")[0] for gap in loaded.interface.gaps] == [
        "the node obeys the arguments of its container"
    ]


def test_forwarded_rules_come_after_those_of_the_load_request(tmp_path: Path) -> None:
    forward = '<extra_arg name="forward_global_arguments" value="true"/>'
    node = component_node(tmp_path, interface(), 'name="eye"', REMAP + forward)
    assert names(node) == ["picture", "by_command_line"]


@pytest.mark.parametrize(
    ("rules", "attributes", "fixed"),
    [
        ((), "", "talker"),
        ((), 'name="eye"', "eye"),
        (("__node:=helper" + RANDOM_ENDING,), "", "helper"),
    ],
)
def test_what_is_known_of_a_name_that_ends_at_random(
    rules: tuple[str, ...], attributes: str, fixed: str, tmp_path: Path
) -> None:
    random = interface(original=f"talker{RANDOM_ENDING}", own_rules=rules, global_arguments=True)
    node = process_node(tmp_path, random, attributes)
    assert node.fixed_name == fixed
    assert node.name.endswith(RANDOM_ENDING) is ("name=" not in attributes)


def test_a_name_that_nobody_gives_is_refused_and_one_that_launch_gives_is_taken(tmp_path: Path) -> None:
    with pytest.raises(UnknownNodeName, match=r"node demo/talker is not known"):
        process_node(tmp_path, interface(original=None))
    named = process_node(tmp_path, interface(original=None), 'name="eye"')
    assert (named.name, named.original_name) == ("eye", "eye")


def test_a_rule_at_which_rcl_refuses_to_start_is_told_where_it_is_written(tmp_path: Path) -> None:
    with pytest.raises(LaunchFileError) as refused:
        process_node(tmp_path, interface(), "", '\n<remap from="a__b" to="c"/>')
    assert f"{tmp_path}/test.launch.xml:2: invalid remap rule 'a__b:=c'" in str(refused.value)
    assert "rcl would refuse to start this process" in str(refused.value)
    with pytest.raises(LaunchFileError, match=r"test\.launch\.xml:1: .*invalid remap rule '__ns:=x'"):
        process_node(tmp_path, interface(), 'ros_args="-r __ns:=x"')
