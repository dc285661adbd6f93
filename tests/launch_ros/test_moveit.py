"""Launch files that import ``moveit_configs_utils`` and ``launch_param_builder``, on a machine where neither is
installed."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from enclave_launch.evaluation.evaluate import EvaluationError, evaluate
from enclave_launch.host.plan_host import PlanHost
from enclave_launch.process import Evaluation
from nodl.ament_index import INDEX_FOLDER

Launch = Callable[..., Evaluation]

FILES = {
    "config/arm.urdf": '<robot name="arm"><link name="base"/></robot>',
    "config/arm.srdf": '<?xml version="1.0"?>\n<robot name="arm">\n  <!-- fixed -->\n'
    '  <virtual_joint child_link="base" parent_frame="world" name="v" type="fixed"/>\n</robot>\n',
    "config/kinematics.yaml": "hand: {kinematics_solver: kdl}\n",
    "config/joint_limits.yaml": "joint_limits: {j1: {max_velocity: 2.5}}\n",
    "config/moveit_controllers.yaml": "moveit_simple_controller_manager:\n  controller_names: [arm_controller]\n",
    "config/pilz_cartesian_limits.yaml": "cartesian_limits: {max_trans_vel: 1.0}\n",
    "config/ros2_controllers.yaml": "controller_manager: {ros__parameters: {update_rate: 100}}\n",
}
HEAD = """
from launch import LaunchDescription
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from moveit_configs_utils import MoveItConfigsBuilder
from moveit_configs_utils.launches import *

def generate_launch_description():
"""


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    share = tmp_path / "share" / "arm_moveit_config"
    for name, text in FILES.items():
        (share / name).parent.mkdir(parents=True, exist_ok=True)
        (share / name).write_text(text)
    (tmp_path / INDEX_FOLDER / "packages").mkdir(parents=True)
    (tmp_path / INDEX_FOLDER / "packages" / "arm_moveit_config").touch()
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    monkeypatch.setenv("PATH", "/nowhere")
    yield share
    for name in [
        name for name in sys.modules if name.startswith(("moveit_configs", "launch_param", "xacro"))
    ]:
        del sys.modules[name]


@pytest.fixture
def launch(package: Path, tmp_path: Path) -> Launch:
    def run(body: str, *, distro: str = "jazzy", head: str = HEAD, **arguments: str) -> Evaluation:
        file = tmp_path / "main.launch.py"
        file.write_text(head + "".join(f"    {line}\n" for line in body.splitlines()))
        host = PlanHost(distro=distro, allow_missing_packages=True)
        return evaluate(file, list(arguments.items()), host=host)

    return run


MOVE_GROUP = "return generate_move_group_launch(MoveItConfigsBuilder('arm').to_moveit_configs())"


def test_move_group_has_the_parameters_of_the_package_and_those_of_moveit(launch: Launch) -> None:
    (process,) = launch(MOVE_GROUP).processes
    found = process.parameters
    assert process.program == "moveit_ros_move_group/move_group"
    assert str(found["robot_description"]).endswith('<robot name="arm"><link name="base"/></robot>')
    assert found["robot_description_kinematics.hand.kinematics_solver"] == "kdl"
    assert found["robot_description_planning.joint_limits.j1.max_velocity"] == 2.5
    assert found["robot_description_planning.cartesian_limits.max_trans_vel"] == 1.0
    assert found["moveit_simple_controller_manager.controller_names"] == ("arm_controller",)
    assert found["moveit_manage_controllers"] is True
    assert found["default_planning_pipeline"] == "ompl"
    assert found["planning_pipelines"] == ("chomp", "ompl", "pilz_industrial_motion_planner", "stomp")
    assert found["ompl.planner_configs.RRT.goal_bias"] == 0.05
    assert found["capabilities"] == ""
    assert found["publish_planning_scene"] is True


def test_an_argument_changes_what_it_stands_for(launch: Launch) -> None:
    (process,) = launch(MOVE_GROUP, publish_monitored_planning_scene="false", capabilities="a b").processes
    assert process.parameters["publish_planning_scene"] is False
    assert process.parameters["capabilities"] == "a b"
    (in_gdb,) = launch(MOVE_GROUP, debug="true").processes
    assert in_gdb.prefix[:2] == ("gdb", "-x")


@pytest.mark.parametrize(
    ("distro", "plugin", "pipelines"),
    [("humble", ("ompl.planning_plugin", "ompl_interface/OMPLPlanner"), 3),
     ("kilted", ("ompl.planning_plugins", ("ompl_interface/OMPLPlanner",)), 4)],
)  # fmt: skip
def test_the_distribution_decides_about_moveits_own_pipelines(
    launch: Launch, distro: str, plugin: tuple[str, object], pipelines: int
) -> None:
    found = launch(MOVE_GROUP, distro=distro).processes[0].parameters
    assert found[plugin[0]] == plugin[1]
    named = found["planning_pipelines"]
    assert isinstance(named, tuple) and len(named) == pipelines


def test_files_that_are_named_replace_the_usual_ones(launch: Launch, package: Path) -> None:
    (package / "other.yaml").write_text("elbow: {timeout: 0.1}")
    body = """configs = (MoveItConfigsBuilder('arm')
 .robot_description_kinematics('other.yaml')
 .planning_pipelines(pipelines=['chomp'])
 .trajectory_execution(moveit_manage_controllers=False)
 .to_moveit_configs())
return LaunchDescription([Node(package='pk', executable='e', parameters=[configs.to_dict()])])"""
    found = launch(body).processes[0].parameters
    assert found["robot_description_kinematics.elbow.timeout"] == 0.1
    assert "robot_description_kinematics.hand.kinematics_solver" not in found
    assert found["planning_pipelines"] == ("chomp",)
    assert found["moveit_manage_controllers"] is False
    assert not [
        name for name in found if name.startswith(("ompl", "pilz", "robot_description_planning.cart"))
    ]


def test_mappings_of_substitutions_are_performed_when_the_node_is(launch: Launch, package: Path) -> None:
    body = """from launch.actions import DeclareLaunchArgument
configs = MoveItConfigsBuilder('arm').robot_description('config/arm.urdf', mappings={'a': LaunchConfiguration('a')})
node = Node(package='pk', executable='e', parameters=[configs.to_moveit_configs().robot_description])
return LaunchDescription([DeclareLaunchArgument('a', default_value='b'), node])"""
    text = launch(body).processes[0].parameters["robot_description"]
    assert isinstance(text, str)
    assert text.endswith('<robot name="arm"><link name="base"/></robot>')


def test_each_virtual_joint_has_a_publisher_and_each_controller_a_spawner(launch: Launch) -> None:
    body = "configs = MoveItConfigsBuilder('arm').to_moveit_configs()\nreturn generate_{}_launch(configs)"
    (joint,) = launch(body.format("static_virtual_joint_tfs")).processes
    assert joint.name == "static_transform_publisher0"
    assert joint.cmd[1:5] == ("--frame-id", "world", "--child-frame-id", "base")
    spawners = launch(body.format("spawn_controllers")).processes
    assert [process.cmd[1] for process in spawners] == ["arm_controller", "joint_state_broadcaster"]


def test_the_demo_includes_the_launch_files_of_the_package(launch: Launch, package: Path) -> None:
    (package / "launch").mkdir()
    for name in ("rsp", "move_group", "moveit_rviz", "spawn_controllers"):
        body = f"return generate_{name}_launch(MoveItConfigsBuilder('arm').to_moveit_configs())"
        (package / "launch" / f"{name}.launch.py").write_text(f"{HEAD}    {body}\n")
    demo = "return generate_demo_launch(MoveItConfigsBuilder('arm').to_moveit_configs())"
    started = [process.executable for process in launch(demo, use_rviz="false").processes]
    assert started == ["robot_state_publisher", "move_group", "ros2_control_node", "spawner", "spawner"]
    humble = launch(demo, distro="humble").processes
    control = next(process for process in humble if process.executable == "ros2_control_node")
    assert "robot_description" in control.parameters
    assert not control.remaps


@pytest.mark.parametrize(
    ("absent", "message"),
    [("kinematics.yaml", "kinematics.yaml doesn't exist"), ("arm.srdf", "arm.srdf doesn't exist")],
)
def test_a_file_that_is_missing_is_an_error_but_for_the_urdf(
    launch: Launch, package: Path, absent: str, message: str
) -> None:
    (package / "config" / "arm.urdf").unlink()
    assert "robot_description" not in launch(MOVE_GROUP).processes[0].parameters
    (package / "config" / absent).unlink()
    with pytest.raises(EvaluationError, match=message):
        launch(MOVE_GROUP)


def test_one_of_several_controller_files_must_have_a_usual_name(launch: Launch, package: Path) -> None:
    (package / "config" / "left_controllers.yaml").write_text("a: 1")
    launch(MOVE_GROUP)
    (package / "config" / "moveit_controllers.yaml").unlink()
    with pytest.raises(EvaluationError, match="Unable to guess which parameter file to load"):
        launch(MOVE_GROUP)


def test_a_parameter_builder_collects_parameters(launch: Launch, package: Path) -> None:
    head = """
from launch import LaunchDescription
from launch_param_builder import ParameterBuilder, get_path, load_yaml
from launch_ros.actions import Node

def generate_launch_description():
"""
    body = """values = (ParameterBuilder('arm_moveit_config')
 .yaml('config/kinematics.yaml')
 .yaml('config/joint_limits.yaml', 'limits')
 .parameter('rate', 5)
 .file_parameter('text', 'config/kinematics.yaml')
 .path_parameter('path', 'config/arm.srdf')
 .xacro_parameter('model', 'config/arm.urdf')
 .to_dict())
return LaunchDescription([Node(package='pk', executable='e', parameters=[values])])"""
    found = launch(body, head=head).processes[0].parameters
    assert found["hand.kinematics_solver"] == "kdl"
    assert found["limits.joint_limits.j1.max_velocity"] == 2.5
    assert (found["rate"], found["text"]) == (5, FILES["config/kinematics.yaml"])
    assert found["path"] == str(package / "config/arm.srdf")
    with pytest.raises(EvaluationError, match=r"main\.launch\.py:8: .*none\.yaml doesn't exist"):
        launch("\nParameterBuilder('arm_moveit_config').yaml('none.yaml')", head=head)
