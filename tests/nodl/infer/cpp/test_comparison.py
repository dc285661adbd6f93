"""A manifest may be part of the truth only: held against the source, it is said what it lacks."""

from __future__ import annotations

from pathlib import Path

import pytest

from nodl.verb import main
from tests.nodl.infer.cpp.workspace import in_class, package, write

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
