"""``package.xml`` is read as XML, as colcon reads it."""

from __future__ import annotations

from pathlib import Path

import pytest

from nodl.package_xml import PackageXml, read_package_xml

WHOLE = """<?xml version="1.0"?>
<!-- <name>old</name> <depend>gone</depend> -->
<package format="3">
  <name>robot</name>
  <version compatibility="1.0.0">1.2.3</version>
  <description>R&amp;D, of <name>people</name></description>
  <depend>rclcpp</depend>
  <exec_depend condition="$ROS_VERSION == 2"> std_msgs </exec_depend>
  <test_depend>ament_lint</test_depend>
  <!-- <depend>commented_out</depend> -->
  <export><build_type>ament_cmake</build_type><nav2_core plugin="${prefix}/plugins.xml" /></export>
</package>
"""


def test_each_part_is_read_and_comments_are_not(tmp_path: Path) -> None:
    (tmp_path / "package.xml").write_text(WHOLE)
    assert read_package_xml(tmp_path) == PackageXml(
        "robot",
        "1.2.3",
        frozenset({"ament_cmake"}),
        frozenset({"rclcpp", "std_msgs", "ament_lint"}),
        ("${prefix}/plugins.xml",),
    )


@pytest.mark.parametrize(
    "text", [None, "", "<package><name>robot</name>", "<package><name>R&D</name></package>"]
)
def test_a_file_that_is_not_there_or_no_xml_says_nothing(tmp_path: Path, text: str | None) -> None:
    if text is not None:
        (tmp_path / "package.xml").write_text(text)
    assert read_package_xml(tmp_path) == PackageXml()


@pytest.mark.parametrize(("version", "known"), [("2.0", "2.0"), ("@VERSION@", "")])
def test_a_version_is_numbers_with_dots(tmp_path: Path, version: str, known: str) -> None:
    (tmp_path / "package.xml").write_text(f"<package><version>{version}</version></package>")
    assert read_package_xml(tmp_path).version == known


def test_a_package_for_two_releases_of_ros_has_the_build_types_of_both(tmp_path: Path) -> None:
    kinds = {"1": "catkin", "2": "ament_python"}
    lines = (
        f'<build_type condition="$ROS_VERSION == {ros}">{kind}</build_type>' for ros, kind in kinds.items()
    )
    (tmp_path / "package.xml").write_text(f"<package><export>{''.join(lines)}</export></package>")
    assert read_package_xml(tmp_path).build_types == {"catkin", "ament_python"}
