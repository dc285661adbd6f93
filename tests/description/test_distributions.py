"""Names and behaviour that come with a release."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_launch.description.install import public_module
from enclave_launch.evaluation.evaluate import EvaluationError, evaluate
from enclave_launch.host.current import active_host
from enclave_launch.host.plan_host import PlanHost


@pytest.mark.parametrize(
    ("module", "name", "absent", "present"),
    [
        ("actions", "ForEach", "jazzy", "kilted"),
        ("actions", "DeclareBooleanLaunchArgument", "kilted", "lyrical"),
        ("substitutions", "EqualsSubstitution", "humble", "jazzy"),
        ("substitutions", "PathSubstitution", "humble", "rolling"),
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
    assert run(tmp_path, text, "kilted") == ["1 12"]
    with pytest.raises(EvaluationError, match="Unexpected nested tag"):
        run(tmp_path, text, "jazzy")


def test_dirname_ends_with_the_include_in_newer_releases(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "inner.launch.xml").write_text("<launch/>")
    text = '<include file="$(dirname)/sub/inner.launch.xml"/><executable cmd="$(dirname)"/>'
    assert run(tmp_path, text, "rolling") == [str(tmp_path / "sub")]
    assert run(tmp_path, text, "lyrical") == [str(tmp_path)]


def test_joins(tmp_path: Path) -> None:
    text = '<executable cmd="$(string-join . a b) $(path-join /x y)"/><log_info message="m"/>'
    assert run(tmp_path, text, "lyrical") == ["a.b /x/y"]


def test_any_and_all_take_arguments_in_later_releases(tmp_path: Path) -> None:
    text = '<executable cmd="$(any false true) $(all true false)"/>'
    assert run(tmp_path, text, "kilted") == ["true false"]
    with pytest.raises(EvaluationError, match="unexpected keyword argument 'args'"):
        run(tmp_path, text, "rolling")
