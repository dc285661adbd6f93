"""A plan for review says what is missing from it, whichever way it is printed."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.programs import COMPILED, install_package

from .conftest import SecureLaunch

Write = Callable[..., Path]


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    """A package ``robot`` with a Python node ``hello`` and a compiled ``engine``, both without a manifest."""
    hello = (
        "#!/usr/bin/env python3\nimport rclpy\nfrom std_msgs.msg import String\n\nrclpy.init()\n"
        "node = rclpy.create_node('hello')\nnode.create_publisher(String, 'greeting', 1)\nrclpy.spin(node)\n"
    )
    install_package(tmp_path / "install", "robot", {"hello": hello, "engine": COMPILED})
    return tmp_path / "install"


def test_the_tree_tells_what_was_inferred(secure_launch: SecureLaunch, write: Write, workspace: Path) -> None:
    file = write('<node pkg="robot" exec="hello"/><node pkg="demo_nodes" exec="talker"/>')
    tree = secure_launch("--dry-run", "--prefix", workspace, file).stdout
    hello, talker = (
        line for line in tree.splitlines() if "robot/hello" in line or "demo_nodes/talker" in line
    )
    assert "inferred from its source" in hello and "inferred" not in talker
    assert "publish: /chatter /greeting" in tree


def test_a_refusal_of_several_nodes_says_once_what_to_do(
    secure_launch: SecureLaunch, write: Write, workspace: Path, tmp_path: Path
) -> None:
    one, other = '<node pkg="robot" exec="engine"/>', '<node pkg="robot" exec="engine" name="second"/>'
    refused = secure_launch(
        "--secure", "--keystore", tmp_path / "ks", "--prefix", workspace, write(one + other)
    )
    assert refused.returncode == 1 and refused.stderr.count("no NoDL manifest for robot/engine") == 1
    assert "(the same for " in refused.stderr and "test.launch.xml:2)" in refused.stderr
    assert refused.stderr.count("--learn") == 1 and "\ntry: let it run once with --learn" in refused.stderr
    alone = secure_launch("--secure", "--keystore", tmp_path / "ks", "--prefix", workspace, write(one))
    assert "the same for" not in alone.stderr and "\ntry: let it run once with --learn" in alone.stderr


@pytest.mark.parametrize("way", [("--format", "policy"), ("--dump-params",)])
def test_what_is_not_known_is_told_beside_every_other_output(
    way: tuple[str, ...], secure_launch: SecureLaunch, write: Write, workspace: Path
) -> None:
    file = write('<node pkg="demo_nodes" exec="talker"/><node pkg="robot" exec="engine"/>')
    run = secure_launch("--dry-run", *way, "--prefix", workspace, file)
    assert run.returncode == 0
    assert "no NoDL manifest for robot/engine" in run.stderr
    assert "robot/engine" not in run.stdout


def test_an_explanation_tells_that_more_is_to_be_read(
    secure_launch: SecureLaunch, write: Write, workspace: Path
) -> None:
    file = write('<node pkg="demo_nodes" exec="talker"/><node pkg="robot" exec="engine"/>')
    run = secure_launch("--explain", "/talker", "--prefix", workspace, file)
    assert "publish /chatter" in run.stdout
    assert run.stderr == "secure-launch: warning: problems: 1, warnings: 0; --dry-run shows them\n"


def test_a_policy_of_nothing_known_is_an_error(
    secure_launch: SecureLaunch, write: Write, workspace: Path
) -> None:
    run = secure_launch(
        "--dry-run", "--format", "policy", "--prefix", workspace, write('<node pkg="robot" exec="engine"/>')
    )
    assert (run.returncode, run.stdout) == (1, "")
    assert "no NoDL manifest for robot/engine" in run.stderr and "there is no policy to print" in run.stderr


def test_an_attribute_that_its_own_arguments_overrule_is_told(
    secure_launch: SecureLaunch, write: Write
) -> None:
    file = write('<node pkg="demo_nodes" exec="talker" ros_args="--enclave /mine" enclave="other"/>')
    tree = secure_launch("--dry-run", file).stdout
    assert "enclave /mine" in tree and "enclave attribute 'other' is not used" in tree


def test_a_target_that_forgets_the_pushed_namespace_is_told(
    secure_launch: SecureLaunch, write: Write
) -> None:
    file = write(
        '<push_ros_namespace namespace="robot"/>'
        '<node_container pkg="demo_nodes" exec="component_container" name="box" namespace=""/>'
        '<load_composable_node target="box">'
        '<composable_node pkg="demo_nodes" plugin="demo_nodes::Talker" name="talker"/></load_composable_node>'
    )
    tree = secure_launch("--dry-run", file).stdout
    assert (
        "container 'box'" in tree
        and "this launch file starts /robot/box: a target needs its full name" in tree
    )


def test_a_prefix_that_is_not_there_is_named(secure_launch: SecureLaunch) -> None:
    run = secure_launch(
        "--dry-run", "--prefix", "/no/such/prefix", "demo_nodes", "talker_listener.launch.xml"
    )
    assert run.returncode == 2
    assert "--prefix /no/such/prefix: no such directory" in run.stderr


@pytest.mark.parametrize("content", ["container.launch.xml", "a program that is not there"])
def test_no_keys_are_made_for_a_launch_that_cannot_run(
    content: str, secure_launch: SecureLaunch, write: Write, tmp_path: Path
) -> None:
    """Loading components needs rclpy; these tests run without ROS."""
    if importlib.util.find_spec("rclpy") is not None:
        pytest.skip("ROS is sourced")
    target = (
        ["demo_nodes", content]
        if content.endswith(".xml")
        else [write('<executable cmd="no-such-program"/>')]
    )
    run = secure_launch("--secure", "--keystore", tmp_path / "ks", *target)
    assert run.returncode == 1
    assert "rclpy is not importable here" in run.stderr or "no-such-program" in run.stderr
    assert not (tmp_path / "ks").exists()
