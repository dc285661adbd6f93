"""``launches`` and ``launch_utils`` of ``moveit_configs_utils``: launch descriptions for a robot's MoveIt package.

They are used if the real package is not installed.
Source: what the package (https://github.com/moveit/moveit2, moveit_configs_utils) starts.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any
from xml.parsers import expat

from enclave_common.xml_tree import collect_elements
from enclave_launch.description.actions.arguments import DeclareLaunchArgument
from enclave_launch.description.actions.includes import IncludeLaunchDescription
from enclave_launch.description.actions.nodes import Node
from enclave_launch.description.conditions import IfCondition, UnlessCondition
from enclave_launch.description.launch_description import LaunchDescription
from enclave_launch.description.parameters.descriptions import ParameterValue
from enclave_launch.description.sources import PythonLaunchDescriptionSource
from enclave_launch.description.stand_ins.moveit_configs import MoveItConfigs
from enclave_launch.description.substitutions.variables import LaunchConfiguration
from enclave_launch.host.current import current_release
from enclave_launch.ros_rules.distro import Distro


class DeclareBooleanLaunchArg(DeclareLaunchArgument):
    """Declare an argument that is ``true`` or ``false``."""

    def __init__(
        self, name: str, *, default_value: object = False, description: str | None = None, **kwargs: Any
    ) -> None:
        choices = ["true", "false", "True", "False"]
        super().__init__(
            name, default_value=str(default_value), description=description, choices=choices, **kwargs
        )


def add_debuggable_node(
    ld: LaunchDescription,
    package: str,
    executable: str,
    condition_name: str = "debug",
    commands_file: str | None = None,
    extra_debug_args: list[str] | None = None,
    **kwargs: Any,
) -> None:
    """Add a node to ``ld`` twice: plain, and in gdb if the argument ``condition_name`` is true."""
    debug = LaunchConfiguration(condition_name)
    ld.add_action(Node(package=package, executable=executable, condition=UnlessCondition(debug), **kwargs))
    arguments = kwargs.pop("arguments", None)
    if arguments is not None and extra_debug_args:
        arguments = [*arguments, *extra_debug_args]
    commands = f"-x {commands_file} " if commands_file else ""
    ld.add_action(
        Node(
            package=package,
            executable=executable,
            condition=IfCondition(debug),
            prefix=[f"gdb {commands}--ex run --args"],
            arguments=arguments,
            **kwargs,
        )
    )


def generate_rsp_launch(moveit_config: MoveItConfigs) -> LaunchDescription:
    """Start robot_state_publisher."""
    rate = LaunchConfiguration("publish_frequency")
    return LaunchDescription(
        [
            DeclareLaunchArgument("publish_frequency", default_value="15.0"),
            Node(
                package="robot_state_publisher",
                executable="robot_state_publisher",
                respawn=True,
                output="screen",
                parameters=[moveit_config.robot_description, {"publish_frequency": rate}],
            ),
        ]
    )


def generate_moveit_rviz_launch(moveit_config: MoveItConfigs) -> LaunchDescription:
    """Start RViz with the parameters of MoveIt's panel."""
    ld = LaunchDescription([DeclareBooleanLaunchArg("debug", default_value=False)])
    file = str(_path(moveit_config) / "config/moveit.rviz")
    ld.add_action(DeclareLaunchArgument("rviz_config", default_value=file))
    add_debuggable_node(
        ld,
        package="rviz2",
        executable="rviz2",
        output="log",
        respawn=False,
        arguments=["-d", LaunchConfiguration("rviz_config")],
        parameters=[
            moveit_config.planning_pipelines,
            moveit_config.robot_description_kinematics,
            moveit_config.joint_limits,
        ],
    )
    return ld


def generate_setup_assistant_launch(moveit_config: MoveItConfigs) -> LaunchDescription:
    """Start MoveIt's setup assistant."""
    ld = LaunchDescription([DeclareBooleanLaunchArg("debug", default_value=False)])
    name = "moveit_setup_assistant"
    option = ["--config_pkg=", str(_path(moveit_config))]
    add_debuggable_node(ld, package=name, executable=name, arguments=[option])
    return ld


def generate_static_virtual_joint_tfs_launch(moveit_config: MoveItConfigs) -> LaunchDescription:
    """Start a static_transform_publisher for each virtual joint of the SRDF."""
    joints = [
        joint for text in moveit_config.robot_description_semantic.values() for joint in _virtual_joints(text)
    ]
    return LaunchDescription(
        [
            Node(
                package="tf2_ros",
                executable="static_transform_publisher",
                name=f"static_transform_publisher{number}",
                output="log",
                arguments=["--frame-id", parent, "--child-frame-id", child],
            )
            for number, (parent, child) in enumerate(joints)
        ]
    )


def _virtual_joints(srdf: str) -> list[tuple[str, str]]:
    """Return the parent frame and the child link of each virtual joint."""
    parser = expat.ParserCreate()
    document = collect_elements(parser, namespaces=False)
    parser.Parse(srdf, True)
    joints = [element.attrib for element in document[0] if element.tag == "virtual_joint"]
    return [(joint["parent_frame"], joint["child_link"]) for joint in joints]


def generate_spawn_controllers_launch(moveit_config: MoveItConfigs) -> LaunchDescription:
    """Start a spawner for each controller of MoveIt's manager, and one for the joint states."""
    manager = moveit_config.trajectory_execution.get("moveit_simple_controller_manager", {})
    return LaunchDescription(
        [
            Node(package="controller_manager", executable="spawner", arguments=[name], output="screen")
            for name in (*manager.get("controller_names", []), "joint_state_broadcaster")
        ]
    )


def generate_warehouse_db_launch(moveit_config: MoveItConfigs) -> LaunchDescription:
    """Start the database of MoveIt's warehouse."""
    folder = str(_path(moveit_config) / "default_warehouse_mongo_db")
    parameters = {
        "overwrite": False,
        "database_path": LaunchConfiguration("moveit_warehouse_database_path"),
        "warehouse_port": LaunchConfiguration("moveit_warehouse_port"),
        "warehouse_host": LaunchConfiguration("moveit_warehouse_host"),
        "warehouse_exec": "mongod",
        "warehouse_plugin": "warehouse_ros_mongo::MongoDatabaseConnection",
    }
    return LaunchDescription(
        [
            DeclareLaunchArgument("moveit_warehouse_database_path", default_value=folder),
            DeclareBooleanLaunchArg("reset", default_value=False),
            DeclareLaunchArgument("moveit_warehouse_port", default_value="33829"),
            DeclareLaunchArgument("moveit_warehouse_host", default_value="localhost"),
            Node(package="warehouse_ros_mongo", executable="mongo_wrapper_ros.py", parameters=[parameters]),
            Node(
                package="moveit_ros_warehouse",
                executable="moveit_init_demo_warehouse",
                output="screen",
                condition=IfCondition(LaunchConfiguration("reset")),
            ),
        ]
    )


def generate_move_group_launch(moveit_config: MoveItConfigs) -> LaunchDescription:
    """Start move_group with all parameters."""
    capabilities = moveit_config.move_group_capabilities
    ld = LaunchDescription(
        [
            DeclareBooleanLaunchArg("debug", default_value=False),
            DeclareBooleanLaunchArg("allow_trajectory_execution", default_value=True),
            DeclareBooleanLaunchArg("publish_monitored_planning_scene", default_value=True),
            *(
                DeclareLaunchArgument(name, default_value=capabilities[name])
                for name in ("capabilities", "disable_capabilities")
            ),
            DeclareBooleanLaunchArg("monitor_dynamics", default_value=False),
        ]
    )
    publishes = LaunchConfiguration("publish_monitored_planning_scene")
    configuration = {
        "publish_robot_description_semantic": True,
        "allow_trajectory_execution": LaunchConfiguration("allow_trajectory_execution"),
        **{  # as text, which may be empty
            name: ParameterValue(LaunchConfiguration(name), value_type=str)
            for name in ("capabilities", "disable_capabilities")
        },
        "publish_planning_scene": publishes,
        "publish_geometry_updates": publishes,
        "publish_state_updates": publishes,
        "publish_transforms_updates": publishes,
        "monitor_dynamics": False,
    }
    add_debuggable_node(
        ld,
        package="moveit_ros_move_group",
        executable="move_group",
        commands_file=str(_path(moveit_config) / "launch" / "gdb_settings.gdb"),
        output="screen",
        parameters=[moveit_config.to_dict(), configuration],
        extra_debug_args=["--debug"],
        additional_env={"DISPLAY": os.environ.get("DISPLAY", "")},
    )
    return ld


def generate_demo_launch(
    moveit_config: MoveItConfigs, launch_package_path: Path | None = None
) -> LaunchDescription:
    """Start all of it: the launch files of the package, and a driver that does as if.

    ``launch_package_path``: the folder with the launch files, by default that of the configuration.
    """
    package = _path(moveit_config)
    folder = (launch_package_path or package) / "launch"
    ld = LaunchDescription(
        [
            DeclareBooleanLaunchArg(
                "db",
                default_value=False,
                description="By default, we do not start a database (it can be large)",
            ),
            DeclareBooleanLaunchArg(
                "debug", default_value=False, description="By default, we are not in debug mode"
            ),
            DeclareBooleanLaunchArg("use_rviz", default_value=True),
        ]
    )
    if (folder / "static_virtual_joint_tfs.launch.py").exists():
        ld.add_action(_included(folder / "static_virtual_joint_tfs.launch.py"))
    ld.add_action(_included(folder / "rsp.launch.py"))
    ld.add_action(_included(folder / "move_group.launch.py"))
    ld.add_action(_included(folder / "moveit_rviz.launch.py", "use_rviz"))
    ld.add_action(_included(folder / "warehouse_db.launch.py", "db"))
    file = str(package / "config/ros2_controllers.yaml")
    topic = ("/controller_manager/robot_description", "/robot_description")
    is_humble = current_release().distro is Distro.HUMBLE
    ld.add_action(
        Node(
            package="controller_manager",
            executable="ros2_control_node",
            parameters=[moveit_config.robot_description, file] if is_humble else [file],
            remappings=[] if is_humble else [topic],
        )
    )
    ld.add_action(_included(folder / "spawn_controllers.launch.py"))
    return ld


def _included(file: Path, condition: str = "") -> IncludeLaunchDescription:
    holds = IfCondition(LaunchConfiguration(condition)) if condition else None
    return IncludeLaunchDescription(PythonLaunchDescriptionSource(str(file)), condition=holds)


def _path(moveit_config: MoveItConfigs) -> Path:
    return moveit_config.package_path or Path()
