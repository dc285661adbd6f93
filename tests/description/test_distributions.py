"""Names and behaviour that come with a release."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_launch.description.install import public_module
from enclave_launch.evaluation.evaluate import EvaluationError, evaluate
from enclave_launch.host.current import active_host
from enclave_launch.host.host import HostOptions
from enclave_launch.host.plan_host import PlanHost
from enclave_launch.ros_rules.distro import ALWAYS, Distro, Feature, release_of


@pytest.mark.parametrize(
    ("module", "name", "absent", "present"),
    [
        ("actions", "ForEach", "jazzy", "kilted"),
        ("actions", "ReplaceEnvironmentVariables", "kilted", "lyrical"),
        ("actions", "DeclareBooleanLaunchArgument", "kilted", "lyrical"),
        ("substitutions", "EqualsSubstitution", "humble@2025-05", "humble@2025-07"),
        ("substitutions", "PathSubstitution", "jazzy@2025-05", "jazzy@2025-07"),
    ],
)
def test_names_exist_where_the_release_has_them(module: str, name: str, absent: str, present: str) -> None:
    package = public_module(f"launch.{module}")
    with active_host(PlanHost(distro=absent)):
        assert name not in package.__all__
        with pytest.raises(AttributeError, match=name):
            getattr(package, name)
    with active_host(PlanHost(distro=present)):
        assert name in package.__all__
        assert getattr(package, name).__name__ == name


def run(tmp_path: Path, text: str, distro: str) -> list[str]:
    path = tmp_path / "main.launch.xml"
    path.write_text(f"<launch>{text}</launch>", encoding="utf-8")
    return [" ".join(process.cmd) for process in evaluate(path, host=PlanHost(distro=distro)).processes]


def test_for_each_and_for(tmp_path: Path) -> None:
    text = """
        <for_each values="{name: a, n: 1};{name: b}"><executable cmd="$(for-var name) $(for-var n none)"/></for_each>
        <for len="2" name="i"><executable cmd="round $(index i)"/></for>
    """
    assert run(tmp_path, text, "kilted") == ["a 1", "b none", "round 0", "round 1"]
    with pytest.raises(EvaluationError, match="Unrecognized entity of the type: for_each"):
        run(tmp_path, text, "jazzy")


def test_let_inside_include(tmp_path: Path) -> None:
    (tmp_path / "inner.launch.xml").write_text('<launch><executable cmd="$(var a) $(var b)"/></launch>')
    given = '<let name="b" value="$(var a)2"/><arg name="a" value="1"/>'
    text = f'<include file="$(dirname)/inner.launch.xml">{given}</include>'
    assert run(tmp_path, text, "jazzy") == ["1 12"]
    with pytest.raises(EvaluationError, match="Unexpected nested tag"):
        run(tmp_path, text, "jazzy@2025-08")


def test_dirname_ends_with_the_include_in_newer_releases(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "inner.launch.xml").write_text("<launch/>")
    text = '<include file="$(dirname)/sub/inner.launch.xml"/><executable cmd="$(dirname)"/>'
    assert run(tmp_path, text, "rolling@2025") == [str(tmp_path / "sub")]
    assert run(tmp_path, text, "lyrical") == [str(tmp_path)]


def test_joins(tmp_path: Path) -> None:
    text = '<executable cmd="$(string-join . a b) $(path-join /x y)"/><log_info message="m"/>'
    assert run(tmp_path, text, "lyrical") == ["a.b /x/y"]


def test_any_and_all_take_arguments_in_later_releases(tmp_path: Path) -> None:
    text = '<executable cmd="$(any false true) $(all true false)"/>'
    assert run(tmp_path, text, "kilted") == ["true false"]
    with pytest.raises(EvaluationError, match="unexpected keyword argument 'args'"):
        run(tmp_path, text, "rolling@2024")


def test_rep_env_replaces_the_whole_environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SHELL_HAS", "1")
    text = """<group><rep_env><env name="ONLY" value="$(env SHELL_HAS)"/></rep_env>
        <executable cmd="in $(env ONLY) $(env SHELL_HAS gone)"/></group>
        <executable cmd="after $(env ONLY gone) $(env SHELL_HAS)"/>"""
    assert run(tmp_path, text, "lyrical") == ["in 1 gone", "after gone 1"]
    with pytest.raises(EvaluationError, match="rep_env"):
        run(tmp_path, text, "kilted")


def test_a_timer_in_a_group_keeps_its_namespace(tmp_path: Path) -> None:
    path = tmp_path / "main.launch.xml"
    path.write_text(
        """<launch><group><push_ros_namespace namespace="grp"/>
        <timer period="1"><node pkg="pk" exec="e" name="late"/></timer></group></launch>"""
    )

    def name(distro: str) -> str | None:
        host = PlanHost(HostOptions(distro, allow_missing_packages=True))
        return evaluate(path, host=host).processes[0].fqn

    assert name("jazzy@2025-06-22") == name("humble") == "<node_namespace_unspecified>/late"
    assert name("jazzy") == name("rolling@2025-05") == "/grp/late"


@pytest.mark.parametrize(("distro", "joins"), [("jazzy@2025-10", False), ("jazzy@2025-11", True)])
def test_paths_below_the_launch_files_directory(tmp_path: Path, distro: str, joins: bool) -> None:
    path = tmp_path / "main.launch.py"
    path.write_text(
        """
from launch import LaunchDescription
from launch.actions import ExecuteProcess
from launch.substitutions import ThisLaunchFileDir

def generate_launch_description():
    return LaunchDescription([ExecuteProcess(cmd=[ThisLaunchFileDir() / "x"])])
"""
    )
    if joins:
        assert evaluate(path, host=PlanHost(distro=distro)).processes[0].cmd == (str(tmp_path / "x"),)
    else:
        with pytest.raises(EvaluationError, match="unsupported operand"):
            evaluate(path, host=PlanHost(distro=distro))


def test_the_page_has_the_table_of_versions() -> None:
    page = (Path(__file__).parents[2] / "docs" / "ros2.md").read_text(encoding="utf-8")
    for row in Feature:
        firsts = [_cell(row.first_in(distro)) for distro in Distro]
        assert f"| {' | '.join([row.what, row.package, *firsts, row.source])} |" in page
    for distro in Distro:
        known = ", ".join(" ".join(each) for each in release_of(distro).versions.items())
        assert f"{distro.value} {known}" in page


def _cell(first: tuple[int, ...] | None) -> str:
    if first is None:
        return "no"
    return "yes" if first == ALWAYS else ".".join(map(str, first))
