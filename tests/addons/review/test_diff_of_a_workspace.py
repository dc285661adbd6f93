"""``diff REVISION:`` in an ordinary colcon workspace: three packages in src/, an isolated install out of date."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest

from enclave_addons.review.verb import main
from tests.programs import PYTHON

LAUNCH = """<launch>
  <node pkg="robot_cpp" exec="driver" name="driver"/>
  <node pkg="robot_py" exec="teleop" name="teleop">
    <param from="$(find-pkg-share robot_bringup)/config/teleop.yaml"/>
  </node>
</launch>
"""
SECOND = '  <node pkg="robot_py" exec="teleop" name="second"/>\n</launch>'
PARAMETERS = "teleop:\n  ros__parameters:\n    topic: cmd_vel\n"
DRIVER = """#include <rclcpp/rclcpp.hpp>
#include <std_msgs/msg/bool.hpp>
class Driver : public rclcpp::Node {
 public:
  Driver() : Node("driver") {
    odometry_ = create_publisher<std_msgs::msg::Bool>("odometry", 10);
  }
 private:
  rclcpp::Publisher<std_msgs::msg::Bool>::SharedPtr odometry_, estop_;
};
int main(int argc, char ** argv) {
  rclcpp::init(argc, argv);
  rclcpp::spin(std::make_shared<Driver>());
}
"""
ESTOP = '    estop_ = create_publisher<std_msgs::msg::Bool>("/base/estop", 10);\n  }\n private:'
TELEOP = """import rclpy
from rclpy.node import Node
from std_msgs.msg import Bool


class Teleop(Node):
    def __init__(self):
        super().__init__("teleop")
        self.declare_parameter("topic", "cmd_vel")
        self.create_publisher(Bool, self.get_parameter("topic").value, 10)


def main():
    rclpy.init()
    rclpy.spin(Teleop())
"""
SETUP = """from glob import glob
from setuptools import find_packages, setup
package_name = "robot_py"
setup(
    name=package_name,
    packages=find_packages(),
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/" + package_name]),
        ("share/" + package_name, ["package.xml"]),
        ("share/" + package_name + "/launch", glob("launch/*.launch.py")),
    ],
    entry_points={"console_scripts": ["teleop = robot_py.teleop:main"]},
)
"""
CMAKE = """cmake_minimum_required(VERSION 3.8)
project(robot_cpp)
find_package(ament_cmake REQUIRED)
find_package(rclcpp REQUIRED)
add_executable(driver src/driver.cpp)
ament_target_dependencies(driver rclcpp std_msgs)
install(TARGETS driver DESTINATION lib/${PROJECT_NAME})
ament_package()
"""
BRINGUP = """project(robot_bringup)
install(DIRECTORY launch config DESTINATION share/${PROJECT_NAME})
ament_package()
"""


def write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


def git(folder: Path, *words: str) -> None:
    identity = ("-c", "user.name=t", "-c", "user.email=t@example.org", "-c", "init.defaultBranch=main")
    subprocess.run(["git", *identity, *words], cwd=folder, check=True, capture_output=True)


def package_xml(name: str, kind: str) -> str:
    export = f"<export><build_type>{kind}</build_type></export>"
    return f"<package format='3'><name>{name}</name><version>1.0.0</version>{export}</package>"


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """``ws/src/robot`` is a git repository; ``ws/install`` has its packages, each in a prefix of its own."""
    repository = tmp_path / "ws" / "src" / "robot"
    for name, kind in (
        ("robot_cpp", "ament_cmake"),
        ("robot_py", "ament_python"),
        ("robot_bringup", "ament_cmake"),
    ):
        write(repository / name / "package.xml", package_xml(name, kind))
    write(repository / "robot_cpp" / "CMakeLists.txt", CMAKE)
    write(repository / "robot_cpp" / "src" / "driver.cpp", DRIVER)
    write(repository / "robot_py" / "setup.py", SETUP)
    write(repository / "robot_py" / "resource" / "robot_py", "")
    write(repository / "robot_py" / "robot_py" / "__init__.py", "")
    write(repository / "robot_py" / "robot_py" / "teleop.py", TELEOP)
    write(repository / "robot_bringup" / "CMakeLists.txt", BRINGUP)
    write(repository / "robot_bringup" / "launch" / "robot.launch.xml", LAUNCH)
    write(repository / "robot_bringup" / "config" / "teleop.yaml", PARAMETERS)
    git(repository, "init", "-q")
    git(repository, "add", "-A")
    git(repository, "commit", "-q", "-m", "first")
    install = tmp_path / "ws" / "install" / "robot_bringup"
    write(install / "share" / "ament_index" / "resource_index" / "packages" / "robot_bringup", "")
    write(install / "share" / "robot_bringup" / "launch" / "robot.launch.xml", LAUNCH)
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(install))
    monkeypatch.chdir(repository)
    return repository


def change(file: Path, before: str, after: str) -> None:
    text = file.read_text()
    assert before in text
    file.write_text(text.replace(before, after))


def in_code(repository: Path) -> None:
    change(repository / "robot_cpp" / "src" / "driver.cpp", "  }\n private:", ESTOP)


def in_the_launch_file(repository: Path) -> None:
    change(repository / "robot_bringup" / "launch" / "robot.launch.xml", "</launch>", SECOND)


def in_a_parameter_file(repository: Path) -> None:
    change(repository / "robot_bringup" / "config" / "teleop.yaml", "cmd_vel", "/arm/cmd_vel")


NAMED = ["robot_bringup", "robot.launch.xml"]
IN_SOURCES = ["robot_bringup/launch/robot.launch.xml"]
INSTALLED = ["../../install/robot_bringup/share/robot_bringup/launch/robot.launch.xml"]


@pytest.mark.parametrize("words", [NAMED, IN_SOURCES, INSTALLED], ids=["by name", "in src", "in install"])
@pytest.mark.parametrize(
    ("edit", "line"),
    [
        (in_code, "+   publish /base/estop"),
        (in_the_launch_file, "+ node /second"),
        (in_a_parameter_file, "+   publish /arm/cmd_vel"),
    ],
)
def test_a_right_that_a_branch_adds_is_found(
    workspace: Path, capsys: pytest.CaptureFixture[str], edit: object, line: str, words: list[str]
) -> None:
    assert main(["diff", "main:", *words]) == 0
    assert capsys.readouterr().out == "no enclave, node, permission or flow differs\n"
    edit(workspace)  # type: ignore[operator]
    assert main(["diff", "main:", *words]) == 1
    assert line in capsys.readouterr().out.splitlines()
    status = subprocess.run(["git", "status", "--porcelain"], cwd=workspace, capture_output=True, text=True)
    assert status.stdout.count("\n") == 1, "nothing but the edit is left in the work tree"


def test_a_workspace_that_is_called_from_elsewhere(
    workspace: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    in_code(workspace)
    assert main(["diff", "main:", *NAMED]) == 1
    assert "/base/estop" in capsys.readouterr().out


def test_what_git_does_not_have_is_named_as_not_compared(
    workspace: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    prefix = tmp_path / "opt"
    write(prefix / "share" / "ament_index" / "resource_index" / "packages" / "vendor", "")
    write(prefix / "lib" / "vendor" / "camera", "#!/bin/sh\n")
    (prefix / "lib" / "vendor" / "camera").chmod(0o755)
    change(
        workspace / "robot_bringup" / "launch" / "robot.launch.xml",
        "</launch>", '<node pkg="vendor" exec="camera" name="camera"/></launch>',
    )  # fmt: skip
    main(["diff", "main:", "--prefix", str(prefix), *NAMED, "--format", "json"])
    assert json.loads(capsys.readouterr().out)["as_installed"] == ["vendor"]


def test_a_package_without_sources_in_a_repository_is_refused(
    workspace: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    prefix = tmp_path / "opt"
    write(prefix / "share" / "ament_index" / "resource_index" / "packages" / "vendor", "")
    write(prefix / "share" / "vendor" / "launch" / "camera.launch.xml", "<launch/>")
    assert main(["diff", "main:", "--prefix", str(prefix), "vendor", "camera.launch.xml"]) == 2
    assert "no sources of package 'vendor'" in capsys.readouterr().err


def test_the_build_type_decides_what_installs_a_package(
    workspace: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A ``CMakeLists.txt`` that lies beside ``setup.py`` builds nothing of a Python package."""
    write(workspace / "robot_py" / "CMakeLists.txt", "install(DIRECTORY launch DESTINATION share/robot_py)\n")
    git(workspace, "add", "-A")
    assert main(["diff", "main:", *NAMED]) == 0
    change(workspace / "robot_py" / "package.xml", "ament_python", "ament_cmake")
    assert main(["diff", "main:", *NAMED]) == 1
    assert "robot_py/lib/robot_py' does not exist" in capsys.readouterr().err


def test_a_setup_py_that_fails_names_the_way_out(workspace: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(workspace / "robot_py" / "setup.py", "raise SystemExit('needs a compiler')\n")
    git(workspace, "commit", "-q", "-am", "broken")
    assert main(["diff", "main:", *NAMED]) == 2
    told = capsys.readouterr().err
    assert "setup.py cannot be read" in told and "--build" in told and "Traceback" not in told


def test_a_build_of_the_revision_is_compared_with_what_is_installed(
    workspace: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As colcon would: the command runs in a copy of the revision and leaves ``install/`` there."""
    build = workspace.parent.parent / "build.py"
    write(
        build,
        "import shutil, pathlib\n"
        "share = pathlib.Path('install/robot_bringup/share')\n"
        "(share / 'ament_index/resource_index/packages').mkdir(parents=True)\n"
        "(share / 'ament_index/resource_index/packages/robot_bringup').touch()\n"
        "(share / 'robot_bringup/launch').mkdir(parents=True)\n"
        "(share / 'robot_bringup/launch/robot.launch.xml').write_text('<launch/>')\n",
    )
    command = f"{PYTHON} {build}"
    status = main(["diff", "main:", "--build", command, "--allow-missing-packages", *NAMED])
    out = capsys.readouterr().out
    assert status == 1 and "+ node /driver" in out
    assert not (workspace / "install").exists()
    assert main(["diff", "main:", "--build", "false", *NAMED]) == 2
    assert "--build 'false' failed" in capsys.readouterr().err
    assert main(["diff", "plan.json", "--build", "true", *NAMED]) == 2


def test_a_program_whose_interfaces_nobody_knows_is_named_as_not_compared(
    workspace: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["diff", "main:", "--missing-nodl", "library", *NAMED]) == 0
    out = capsys.readouterr().out
    assert "Not compared, interfaces not completely known: " in out and "robot_cpp/driver" in out
