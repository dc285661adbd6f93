"""Every process, component and enclave is shown, also where nobody knows what it does."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.programs import COMPILED, install_package

from .conftest import SecureLaunch

Write = Callable[..., Path]


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    """A package ``robot`` with a compiled ``engine`` of which nothing is known."""
    prefix = tmp_path / "install"
    install_package(prefix, "robot", {"engine": COMPILED})
    install_package(prefix, "rclcpp_components", {"component_container": COMPILED})
    return prefix


@pytest.fixture
def look(secure_launch: SecureLaunch, write: Write, robot: Path) -> Callable[..., str]:
    def run(text: str, *words: str) -> str:
        done = secure_launch("--dry-run", "--prefix", robot, *words, write(text))
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


ENGINE = '<node pkg="robot" exec="engine" {}/>'
TALKER = '<node pkg="demo_nodes" exec="talker"/>'
COMPONENTS = """<node_container pkg="rclcpp_components" exec="component_container" name="box" namespace="">
<composable_node pkg="robot" plugin="robot::Wheel" name="wheel"/></node_container>"""


def enclaves(text: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(text)["enclaves"]
    return found


def test_a_robot_of_compiled_nodes_is_no_empty_tree(look: Callable[..., str]) -> None:
    tree = look(ENGINE.format('name="left" namespace="/wheels" enclave="wheels"'))
    assert "enclave /wheels" in tree and "[engine-1] robot/engine as /wheels/left" in tree
    assert "permissions unknown of engine-1" in tree
    found = enclaves(
        look(ENGINE.format('name="left" namespace="/wheels" enclave="wheels"'), "--format", "json")
    )
    assert list(found) == ["/wheels"] and found["/wheels"]["permissions_unknown"] == ["engine-1"]


def test_a_known_neighbour_does_not_hide_it(look: Callable[..., str]) -> None:
    tree = look(ENGINE.format("") + TALKER)
    assert "publish: /chatter" in tree and "permissions unknown of engine-1" in tree
    assert "talker-2" not in tree.split("permissions unknown of")[1].splitlines()[0]
    found = enclaves(look(ENGINE.format("") + TALKER, "--format", "json"))
    assert found["/"]["permissions_unknown"] == ["engine-1"] and "/chatter" in found["/"]["publish"]
    assert enclaves(look(TALKER, "--format", "json"))["/"]["permissions_unknown"] == []


def test_a_placeholder_for_a_namespace_does_not_reach_a_reader(look: Callable[..., str]) -> None:
    tree = look(ENGINE.format('name="left"'))
    assert "as /left" in tree and "<node_namespace_unspecified>" not in tree


def test_explain_speaks_of_what_it_does_not_know(look: Callable[..., str]) -> None:
    text = ENGINE.format("") + TALKER
    assert "engine-1: permissions unknown: no NoDL manifest for robot/engine" in look(text, "--explain", "/")
    one = look(text, "--explain", "engine-1")
    assert "process engine-1 in enclave / " in one and "permissions unknown" in one
    two = look(text, "--explain", "talker-2")
    assert "publish /chatter" in two and "engine" not in two
    assert look(text, "--explain", "[talker-2]") == two


@pytest.mark.parametrize("name", ["/left", "left", "/wheels/right", "engine-1"])
def test_each_name_that_the_tree_prints_is_one_to_explain(look: Callable[..., str], name: str) -> None:
    text = ENGINE.format('name="left"') + ENGINE.format('name="right" namespace="wheels"')
    assert "permissions unknown: no NoDL manifest" in look(text, "--explain", name)


def test_unknown_components_are_marked(look: Callable[..., str]) -> None:
    tree = look(COMPONENTS)
    assert "component robot robot::Wheel as /wheel  (permissions unknown)" in tree
    found = enclaves(look(COMPONENTS, "--format", "json"))
    assert found["/"]["permissions_unknown"] == ["/wheel"]


def test_a_policy_has_no_room_for_what_is_unknown(look: Callable[..., str]) -> None:
    policy = look(ENGINE.format('enclave="/engine"') + TALKER, "--format", "policy")
    assert "/engine" not in policy and 'path="/"' in policy


MISSING = {
    "an executable that is not built": '<node pkg="robot" exec="unbuilt"/>',
    "a package without any executable": '<node pkg="bare" exec="thing"/>',
    "a launch file that is not installed": '<include file="$(find-pkg-share robot)/launch/more.launch.xml"/>',
    "a parameter file": '<node pkg="robot" exec="engine"><param from="$(find-pkg-share robot)/p.yaml" '
    'allow_substs="true"/></node>',
    "parameters for all": '<set_parameters_from_file filename="$(find-pkg-share robot)/p.yaml"/>'
    + ENGINE.format(""),
    "parameters of a component": COMPONENTS.replace(
        'name="wheel"/>', 'name="wheel"><param from="$(find-pkg-share robot)/p.yaml"/></composable_node>'
    ),
}


@pytest.mark.parametrize("case", MISSING)
def test_an_unbuilt_tree_can_be_looked_at(
    case: str, look: Callable[..., str], secure_launch: SecureLaunch, write: Write, robot: Path
) -> None:
    (robot / "share/ament_index/resource_index/packages/bare").touch()
    tree = look(MISSING[case] + TALKER, "--allow-missing-packages")
    assert "demo_nodes/talker" in tree and "warning: " in tree
    strict = secure_launch("--dry-run", "--prefix", robot, write(MISSING[case] + TALKER))
    assert strict.returncode == 1 or "warning: " in strict.stdout
