"""A manifest may be part of the truth only: held against the source, it is said what it lacks."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_launch import LaunchPlan
from enclave_launch.diagnostics import Code
from nodl.verb import main
from tests.addons.inference.cpp.test_in_a_launch import install, may, plan
from tests.addons.inference.cpp.workspace import in_class, package, write

pytest.importorskip("tree_sitter_cpp", reason="the extra cpp is not installed")

SOURCE = in_class(
    'auto t = declare_parameter<std::string>("input", "scan");'
    "create_subscription<sensor_msgs::msg::LaserScan>(t, 1, cb);"
    'create_publisher<std_msgs::msg::String>("~/out", 1);'
)
MANIFEST = """
<interface version="1">
  <node name="n" executable="node">
    <topic name="scan" type="sensor_msgs/msg/LaserScan" role="subscription"/>
    {more}
  </node>
</interface>
"""
OUT = '<topic name="~/out" type="std_msgs/msg/String" role="publisher"/>'


def compared(tmp_path: Path, more: str | None, source: str = SOURCE) -> int:
    folder = package(tmp_path / "src/demo", {"src/main.cpp": source})
    prefix = tmp_path / "install"
    write(prefix / "share/ament_index/resource_index/packages/demo", "")
    if more is not None:
        write(prefix / "share/demo/demo.nodl.xml", MANIFEST.format(more=more))
    return main(["infer", "--compare", "--prefix", str(prefix), str(folder)])


def test_what_the_manifest_lacks_is_said_with_its_place(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert compared(tmp_path, "") == 1
    out = capsys.readouterr().out
    assert "demo/node: the manifest has 1 of 2 interfaces" in out
    assert "lacks publisher ~/out [std_msgs/msg/String]" in out
    assert "main.cpp:" in out
    assert "scan" not in out


def test_a_manifest_that_has_all_is_fine(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert compared(tmp_path, OUT) == 0
    assert "has 2 of 2" in capsys.readouterr().out


def test_what_the_source_leaves_open_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert compared(tmp_path, OUT, SOURCE.replace("auto t =", "acme::attach(this); auto t =")) == 0
    assert "open " in capsys.readouterr().out


def test_without_a_manifest_that_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert compared(tmp_path, None) == 1
    assert "demo/node: no manifest" in capsys.readouterr().out


LAUNCH = '<launch><node pkg="demo" exec="filter_node" name="n">{}</node></launch>'


def planned(tmp_path: Path, more: str, launch: str = LAUNCH.format(""), **options: object) -> LaunchPlan:
    """Of a launch in a workspace whose ``install`` has the manifest and whose ``src`` has the program."""
    package(tmp_path / "src/demo", {"src/main.cpp": SOURCE}, "add_executable(filter_node src/main.cpp)")
    install(tmp_path)
    manifest = MANIFEST.replace('executable="node"', 'executable="filter_node"').format(more=more)
    write(tmp_path / "install/share/demo/demo.nodl.xml", manifest)
    return plan(tmp_path, launch, **options)


def lacks(of: LaunchPlan) -> list[str]:
    return [str(each) for each in of.warnings if each.code is Code.MANIFEST_LACKS]


def test_a_launch_tells_what_an_installed_manifest_lacks(tmp_path: Path) -> None:
    of = planned(tmp_path, "")
    (told,) = lacks(of)
    assert "publish /n/out" in told
    assert "src/main.cpp:" in told
    assert "scan" not in told
    assert not may(of, "/n/out")  # the manifest decides
    assert not of.problems


def test_a_launch_is_silent_about_a_manifest_that_has_all(tmp_path: Path) -> None:
    assert not lacks(planned(tmp_path, OUT))


def test_a_manifest_that_the_user_names_is_taken_as_it_is(tmp_path: Path) -> None:
    named = tmp_path / "own.nodl.xml"
    write(named, MANIFEST.replace('executable="node"', 'executable="filter_node"').format(more=""))
    of = planned(tmp_path, OUT, launch=LAUNCH.format(""), manifests=(named,))
    assert not lacks(of)


def test_without_inference_nothing_is_compared(tmp_path: Path) -> None:
    assert not lacks(planned(tmp_path, "", infer=False))


def test_without_sources_in_reach_nothing_is_compared(tmp_path: Path) -> None:
    of = planned(tmp_path, "")
    assert lacks(of)
    (tmp_path / "src").rename(tmp_path / "elsewhere")
    assert not lacks(plan(tmp_path, LAUNCH.format("")))
    assert lacks(plan(tmp_path, LAUNCH.format(""), source_folders=(tmp_path / "elsewhere",)))


def test_a_program_that_starts_twice_is_told_once(tmp_path: Path) -> None:
    node = '<node pkg="demo" exec="filter_node" name="{}"/>'
    assert len(lacks(planned(tmp_path, "", f"<launch>{node.format('a')}{node.format('b')}</launch>"))) == 1
