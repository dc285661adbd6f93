"""Python programs of packages that are not built yet: found by setup.py, setup.cfg and CMake in the sources."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_addons.inference.executable import InferredExecutable, infer_executable
from enclave_addons.inference.reach import SourcesInReach

NODE = """
import rclpy
from rclpy.node import Node
from std_msgs.msg import String
{imports}

class Base(Node):
    def __init__(self):
        super().__init__('base')
        self.create_publisher(String, {topic}, 1)

def main():
    rclpy.init()
    rclpy.spin(Base())
"""


def write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


def package(folder: Path, setup: str = "", cmake: str = "") -> Path:
    """Write a package named as its folder, with a module of that name and the given build files."""
    write(folder / "package.xml", f"<package><name>{folder.name}</name><version>1.0.0</version></package>")
    if setup:
        write(folder / "setup.py", setup)
    if cmake:
        write(folder / "CMakeLists.txt", f"project({folder.name})\n{cmake}\n")
    write(folder / folder.name / "__init__.py", "")
    return folder


def setup_py(entry: str, start: str = "") -> str:
    return f"from setuptools import setup\n{start}\nsetup(entry_points={{'console_scripts': [{entry}]}})\n"


def inferred(source: Path, executable: str = "base") -> InferredExecutable:
    return infer_executable("robot", executable, prefixes=[], sources=SourcesInReach([], [str(source)]))


def names(answer: InferredExecutable) -> list[str]:
    return sorted(str(each.name) for node in answer.interfaces for each in node.endpoints)


@pytest.mark.parametrize(
    "entry, start",
    [
        ("'base = robot.base:main'", ""),
        ("f'base = {package_name}.base:main'", "package_name = 'robot'"),
        ("'base = ' + package_name + '.base:main'", "package_name = 'robot'"),
    ],
)
def test_an_entry_point_is_followed_into_the_sources(tmp_path: Path, entry: str, start: str) -> None:
    robot = package(tmp_path / "robot", setup_py(entry, start))
    write(robot / "robot/base.py", NODE.format(imports="", topic="'odom'"))
    assert names(inferred(tmp_path)) == ["odom"]
    other = inferred(tmp_path, "arm")
    assert not other and other.not_made
    assert other.why == f"setup.py in {robot} makes no executable 'arm'; it makes base", (
        "whatever is installed"
    )


def test_a_byte_order_mark_hides_no_entry_point(tmp_path: Path) -> None:
    robot = package(tmp_path / "robot", "\ufeff" + setup_py("'base = robot.base:main'"))
    write(robot / "robot/base.py", "\ufeff" + NODE.format(imports="", topic="'odom'"))
    assert names(inferred(tmp_path)) == ["odom"]


def test_the_first_line_of_a_module_does_not_decide(tmp_path: Path) -> None:
    robot = package(tmp_path / "robot", setup_py("'base = robot.base:main'"))
    write(robot / "robot/base.py", "#!/user/bin/env3\n" + NODE.format(imports="", topic="'odom'"))
    assert names(inferred(tmp_path)) == ["odom"]


def test_an_entry_point_of_setup_cfg_counts_too(tmp_path: Path) -> None:
    robot = package(tmp_path / "robot", "from setuptools import setup\nsetup()\n")
    write(robot / "setup.cfg", "[options.entry_points]\nconsole_scripts =\n    base = robot.base:main\n")
    write(robot / "robot/base.py", NODE.format(imports="", topic="'odom'"))
    assert names(inferred(tmp_path)) == ["odom"]


def test_modules_below_src_are_found(tmp_path: Path) -> None:
    robot = package(tmp_path / "robot", setup_py("'base = bot.base:main'"))
    write(robot / "src/bot/__init__.py", "")
    write(robot / "src/bot/base.py", NODE.format(imports="", topic="'odom'"))
    assert names(inferred(tmp_path)) == ["odom"]


def test_a_module_of_another_package_is_read(tmp_path: Path) -> None:
    robot = package(tmp_path / "robot", setup_py("'base = robot.base:main'"))
    write(robot / "robot/base.py", NODE.format(imports="from tools.names import ODOM", topic="ODOM"))
    tools = package(tmp_path / "tools", setup_py(""))
    write(tools / "tools/names.py", "ODOM = 'wheel/odom'\n")
    assert names(inferred(tmp_path)) == ["wheel/odom"]
    (tools / "package.xml").unlink()  # no package any more: its modules are not in reach
    assert names(inferred(tmp_path)) == ["?"]


def test_an_entry_point_without_its_module_is_not_known(tmp_path: Path) -> None:
    package(tmp_path / "robot", setup_py("'base = robot.base:main'"))
    answer = inferred(tmp_path)
    assert not answer and "the module robot.base of entry point base was not found" in answer.why


@pytest.mark.parametrize(
    "cmake, executable",
    [
        ("install(PROGRAMS scripts/base.py DESTINATION lib/${PROJECT_NAME})", "base.py"),
        ("install(PROGRAMS scripts/base.py DESTINATION lib/${PROJECT_NAME} RENAME base)", "base"),
        ("install(DIRECTORY scripts/ DESTINATION lib/${PROJECT_NAME} USE_SOURCE_PERMISSIONS)", "base.py"),
        ("file(GLOB all scripts/*.py)\ninstall(PROGRAMS ${all} DESTINATION lib/${PROJECT_NAME})", "base.py"),
    ],
)
def test_a_script_that_cmake_installs_is_found(tmp_path: Path, cmake: str, executable: str) -> None:
    robot = package(tmp_path / "robot", cmake=cmake)
    write(robot / "scripts/base.py", NODE.format(imports="", topic="'odom'") + "main()\n")
    assert names(inferred(tmp_path, executable)) == ["odom"]
    assert not inferred(tmp_path, "other.py")


def test_a_script_that_is_installed_elsewhere_is_no_executable(tmp_path: Path) -> None:
    robot = package(tmp_path / "robot", cmake="install(PROGRAMS scripts/base.py DESTINATION share/robot)")
    write(robot / "scripts/base.py", NODE.format(imports="", topic="'odom'") + "main()\n")
    answer = inferred(tmp_path, "base.py")
    assert not answer and "CMakeLists.txt in" in answer.why


def test_what_is_installed_comes_before_the_sources(tmp_path: Path) -> None:
    robot = package(tmp_path / "src/robot", setup_py("'base = robot.base:main'"))
    write(robot / "robot/base.py", NODE.format(imports="", topic="'new'"))
    prefix = tmp_path / "install"
    write(prefix / "share/ament_index/resource_index/packages/robot", "")
    installed = prefix / "lib/robot/base"
    write(installed, "#!/usr/bin/env python3\n" + NODE.format(imports="", topic="'old'") + "main()\n")
    installed.chmod(0o755)
    sources = SourcesInReach([str(prefix)], [])
    assert names(infer_executable("robot", "base", prefixes=[str(prefix)], sources=sources)) == ["old"]
    installed.unlink()
    assert names(infer_executable("robot", "base", prefixes=[str(prefix)], sources=sources)) == ["new"]


def test_the_modules_of_the_package_itself_are_those_of_its_sources(tmp_path: Path) -> None:
    robot = package(tmp_path / "src/robot", setup_py("'base = robot.base:main'"))
    write(robot / "robot/base.py", NODE.format(imports="from robot.names import ODOM", topic="ODOM"))
    write(robot / "robot/names.py", "ODOM = 'new'\n")
    prefix = tmp_path / "install"
    site = prefix / "lib/python3.11/site-packages/robot"
    write(site / "__init__.py", "")
    write(site / "names.py", "ODOM = 'of the last build'\n")
    sources = SourcesInReach([str(prefix)], [])
    assert names(infer_executable("robot", "base", prefixes=[str(prefix)], sources=sources)) == ["new"]
