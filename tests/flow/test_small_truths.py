"""What the plan says is what happens: the small differences that a comparison with real launch found."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from enclave_launch import LaunchFileError, LaunchPlan, ManifestError, ResolveOptions, provision, resolve
from enclave_launch.diagnostics import Code
from enclave_launch.report.explained import explain
from enclave_launch.verb.secure_launch import main

from .conftest import DEMO

Plan = Callable[..., LaunchPlan]


@pytest.fixture
def plan(tmp_path: Path) -> Plan:
    """``plan(text, name=text)``: the content of ``<launch>`` of the main file and of others beside it."""

    def make(text: str, **others: str) -> LaunchPlan:
        for name, content in {"main": text, **others}.items():
            whole = content if content.startswith("<!DOCTYPE") else f"<launch>\n{content}\n</launch>"
            (tmp_path / f"{name}.launch.xml").write_text(whole)
        return resolve(tmp_path / "main.launch.xml", options=ResolveOptions(prefixes=(DEMO,)))

    return make


def started(found: LaunchPlan) -> list[str]:
    return [" ".join(process.process.cmd) for process in found.processes]


TALKER = '<node pkg="demo_nodes" exec="talker">{}</node>'


def test_of_two_equal_rules_the_first_is_named_as_rcl_applies_it(plan: Plan) -> None:
    rules = '\n<remap from="chatter" to="x"/>\n<remap from="chatter" to="x"/>'
    explained = explain(plan(TALKER.format(rules)).derived, "/x")
    assert any("main.launch.xml:3" in line for line in explained)
    assert not any("main.launch.xml:4" in line for line in explained)


COUNTERS = {
    "an argument": (
        '<arg name="n" default="2"/><executable cmd="echo a$(var n)"/><include file="$(dirname)/other.launch.xml" '
        'if="$(eval \'$(var n) &gt; 0\')"><arg name="n" value="$(eval \'$(var n) - 1\')"/></include>',
        '<arg name="n" default="9"/><executable cmd="echo b$(var n)"/><include file="$(dirname)/main.launch.xml" '
        'if="$(eval \'$(var n) &gt; 0\')"><arg name="n" value="$(eval \'$(var n) - 1\')"/></include>',
        ["echo a2", "echo b1", "echo a0"],
    ),
    "a variable": (
        '<executable cmd="echo a$(env N 0)"/><include file="$(dirname)/other.launch.xml" '
        "if=\"$(eval '$(env N 0) &lt; 2')\"/>",
        '<set_env name="N" value="$(eval \'$(env N 0) + 1\')"/><include file="$(dirname)/main.launch.xml"/>',
        ["echo a0", "echo a1", "echo a2"],
    ),
}


@pytest.mark.parametrize("case", COUNTERS)
def test_files_that_include_each_other_may_count_to_an_end(case: str, plan: Plan) -> None:
    main, other, expected = COUNTERS[case]
    assert started(plan(main, other=other)) == expected


def test_files_that_include_each_other_for_ever_are_refused(plan: Plan) -> None:
    with pytest.raises(LaunchFileError, match="without end"):
        plan(
            '<include file="$(dirname)/other.launch.xml"/>',
            other='<include file="$(dirname)/main.launch.xml"/>',
        )


@pytest.mark.parametrize("output", ["screen", "log", "both", "own_log", "full"])
def test_outputs_that_launch_knows(output: str, plan: Plan) -> None:
    assert started(plan(f'<executable cmd="true" output="{output}"/>')) == ["true"]


def test_an_output_that_launch_does_not_know_is_refused_in_its_words(plan: Plan) -> None:
    with pytest.raises(LaunchFileError, match="loud is not a valid standard output config"):
        plan('<executable cmd="true" output="loud"/>')
    assert started(plan('<executable cmd="true" output="loud" if="false"/>')) == []


def test_an_entity_made_of_others_is_text(plan: Plan) -> None:
    text = '<!DOCTYPE launch [<!ENTITY a "one"><!ENTITY b "&a; two">]><launch><executable cmd="echo &b;"/></launch>'
    assert started(plan(text)) == ["echo one two"]


def test_an_enclave_too_deep_for_dds_stops_a_secured_start_only(plan: Plan, tmp_path: Path) -> None:
    node = '<node pkg="demo_nodes" exec="talker" enclave="{}"/>'
    deep = plan(node.format("/a" * 20))
    (problem,) = deep.problems
    assert problem.code is Code.ENCLAVE_TOO_DEEP and started(deep)
    with pytest.raises(ManifestError, match="20 segments"):
        provision(deep, tmp_path / "ks")
    assert not plan(node.format("/a" * 19)).problems
    with pytest.raises(LaunchFileError):  # what rcl itself refuses is an error of the file
        plan(node.format("/a b"))


def test_an_executable_in_an_enclave_that_permits_nothing_is_told(plan: Plan) -> None:
    (warning,) = plan('<executable cmd="true" enclave="/tool"/>').warnings
    assert warning.code is Code.ENCLAVE_UNGRANTED and "/tool, the enclave of true-1" in warning.text
    shared = plan(TALKER.format("") + '<executable cmd="true" enclave="/"/>')
    assert not shared.warnings


@pytest.mark.parametrize(
    "rules", ["{('chatter', 'x')}", "{'chatter': 'x'}.items()", "iter([('chatter', 'x')])"]
)
def test_remaps_of_a_python_file_may_come_in_any_collection(rules: str, tmp_path: Path) -> None:
    (tmp_path / "a.launch.py").write_text(
        "from launch import LaunchDescription\nfrom launch_ros.actions import Node\n"
        "def generate_launch_description():\n    return LaunchDescription([Node(package='demo_nodes', "
        f"executable='talker', remappings={rules})])\n"
    )
    found = resolve(tmp_path / "a.launch.py", options=ResolveOptions(prefixes=(DEMO,)))
    (enclave,) = found.derived.policy.enclaves
    assert "/x" in {rule.expression for profile in enclave.profiles for rule in profile.rules}


def test_what_a_launch_file_prints_does_not_get_into_the_plan(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """turtlebot3_bringup's launch files print the name of their URDF."""
    file = tmp_path / "printing.launch.py"
    file.write_text(
        "from launch import LaunchDescription\n"
        "def generate_launch_description():\n    print('urdf_file_name')\n    return LaunchDescription([])\n"
    )
    assert main([str(file), "--dry-run", "--format", "json"]) == 0
    said = capsys.readouterr()
    assert json.loads(said.out) and "urdf_file_name" in said.err
