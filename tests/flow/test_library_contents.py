"""Nodes of the library that ships with us, in launch files as users write them: granted beside what is not."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_launch import LaunchPlan
from enclave_launch.policy.derivation import allowed_names

from .conftest import Launch, allowed


def problems(plan: LaunchPlan) -> str:
    return " ".join(map(str, plan.problems))


NAV2 = '<node pkg="nav2_{0}" exec="{0}_server" name="{0}_server"><param from="{1}"/></node>'


def test_a_planner_server_has_its_costmap_layers_and_planners(launch: Launch, tmp_path: Path) -> None:
    file = tmp_path / "nav2.yaml"
    file.write_text("""
planner_server: {ros__parameters: {planner_plugins: [Fine], Fine: {plugin: nav2_smac_planner::SmacPlannerHybrid}}}
global_costmap:
  global_costmap:
    ros__parameters:
      plugins: [static_layer, obstacles]
      static_layer: {plugin: nav2_costmap_2d::StaticLayer}
      obstacles:
        plugin: nav2_costmap_2d::ObstacleLayer
        observation_sources: front rear
        front: {topic: /front/scan}
        rear: {topic: points, data_type: PointCloud2}
""")
    plan = launch(NAV2.format("planner", file))
    assert not plan.problems
    assert {"/map", "/front/scan", "/global_costmap/points"} <= set(allowed(plan, "subscribe"))
    assert "/unsmoothed_plan" in allowed(plan, "publish")
    assert "/global_costmap/obstacles" in allowed(plan, "publish")
    assert not {"/scan", "/global_costmap/voxel_grid", "/expansions"} & {
        *allowed(plan, "publish"),
        *allowed(plan, "subscribe"),
    }
    assert "/transform_listener_impl_*/get_type_description" in {
        name for e in plan.derived.policy.enclaves for name in allowed_names(e)["serve_services"]
    }
    assert not any("transform_listener" in n and "parameters" in n for n in allowed(plan, "serve_services"))


INFO_SERVER = (
    '<node pkg="nav2_map_server" exec="costmap_filter_info_server" name="info" namespace="{0}">'
    '<param name="filter_info_topic" value="told"/><param name="mask_topic" value="{1}"/></node>'
)


def test_the_mask_of_a_costmap_filter_is_what_the_launchs_own_server_tells(
    launch: Launch, tmp_path: Path
) -> None:
    file = tmp_path / "nav2.yaml"
    file.write_text("""
global_costmap:
  global_costmap:
    ros__parameters:
      filters: [keepout]
      keepout: {plugin: nav2_costmap_2d::KeepoutFilter, filter_info_topic: /robot/told}
""")
    planner = NAV2.format("planner", file)
    plan = launch(planner + INFO_SERVER.format("robot", "mask"))
    assert not plan.problems
    assert {"/robot/told", "/global_costmap/mask"} <= set(allowed(plan, "subscribe"))
    elsewhere = launch(planner + INFO_SERVER.format("other", "mask"))
    assert "no costmap_filter_info_server of this launch tells the mask on /robot/told" in problems(elsewhere)
    assert "/global_costmap/mask" not in allowed(elsewhere, "subscribe")


def test_servo_is_another_program_in_humble(launch: Launch) -> None:
    node = '<node pkg="moveit_servo" exec="{}" name="servo"><param name="moveit_servo.joint_topic" value="/js"/></node>'
    old = launch(node.format("servo_node_main"), distro="humble")
    assert "/servo/start_servo" in allowed(old, "serve_services") and "/js" in allowed(old, "subscribe")
    new = launch(node.format("servo_node"))
    assert "/servo/start_servo" not in allowed(new, "serve_services")
    assert "/servo/switch_command_type" in allowed(new, "serve_services")


def test_a_planner_that_nobody_describes_stops_a_secure_start(launch: Launch, tmp_path: Path) -> None:
    file = tmp_path / "nav2.yaml"
    file.write_text(
        "planner_server: {ros__parameters: {planner_plugins: [Mine], Mine: {plugin: my::Planner}}}"
    )
    assert "plugin 'Mine' is of class my::Planner, which no document describes" in problems(
        launch(NAV2.format("planner", file))
    )


TREE = '<root><BehaviorTree><Sequence><Spin server_name="{}"/>{}</Sequence></BehaviorTree></root>'


def test_a_behavior_tree_says_what_bt_navigator_calls(launch: Launch, tmp_path: Path) -> None:
    tree = tmp_path / "tree.xml"
    node = (
        '<node pkg="nav2_bt_navigator" exec="bt_navigator" name="bt_navigator">'
        f'<param name="navigators" value="[navigate_to_pose]"/>'
        f'<param name="default_nav_to_pose_bt_xml" value="{tree}"/></node>'
    )
    tree.write_text(TREE.format("turn", ""))
    plan = launch(node)
    assert allowed(plan, "call_actions") == ["/navigate_to_pose", "/turn"] and not plan.problems
    tree.write_text(TREE.format("turn", "<MyNode/>"))
    assert "node 'MyNode' of the behavior tree uses is not known" in problems(launch(node))
    tree.write_text(TREE.format("turn", "<GoalUpdater/>"))
    assert "/goal_update" in allowed(launch(node), "subscribe")
    assert "/goals_update" in allowed(launch(node, distro="kilted"), "subscribe")
    node = node.replace("</node>", '<param name="goal_updater_topic" value="/person"/></node>')
    plan = launch(node)
    assert "/person" in allowed(plan, "subscribe") and not plan.problems
    assert not {"/goal_update", "/goals_update"} & set(allowed(plan, "subscribe"))
    tree.write_text("<root>\n</tree>")
    assert f"the behavior tree cannot be read: {tree}:2: not well-formed XML: mismatched tag" in problems(
        launch(node)
    )


def test_a_tree_of_nav2s_own_is_known_where_nav2_is_not_installed(launch: Launch) -> None:
    node = (
        '<node pkg="nav2_bt_navigator" exec="bt_navigator" name="bt_navigator">'
        '<param name="navigators" value="[navigate_to_pose]"/>'
        '<param name="default_nav_to_pose_bt_xml" value="/nowhere/{}"/></node>'
    )
    own = "share/nav2_bt_navigator/behavior_trees/{}.xml"
    plan = launch(node.format(own.format("navigate_w_replanning_time")))
    assert not plan.problems
    assert allowed(plan, "call_actions") == ["/compute_path_to_pose", "/follow_path", "/navigate_to_pose"]
    assert {"/controller_selector", "/planner_selector"} <= set(allowed(plan, "subscribe"))
    plan = launch(node.format(own.format("navigate_w_replanning_time")), distro="humble")
    assert "/controller_selector" not in allowed(plan, "subscribe")
    for other in (own.format("mine"), "my_trees/navigate_w_replanning_time.xml"):
        assert "the behavior tree cannot be read" in problems(launch(node.format(other)))


LUA = """include "map_builder.lua"
include "trajectory_builder.lua"
options = {{
  map_builder = MAP_BUILDER,  -- num_laser_scans = 5
  use_odometry = true, use_nav_sat = false, use_landmarks = false,
  num_laser_scans = 2, num_multi_echo_laser_scans = 0, num_point_clouds = 1,
}}
MAP_BUILDER.use_trajectory_builder_2d = true
{}
return options
"""


def test_cartographer_subscribes_the_sensors_of_its_configuration(launch: Launch, tmp_path: Path) -> None:
    node = (
        '<node pkg="cartographer_ros" exec="cartographer_node" name="cartographer_node" '
        f'args="-configuration_directory {tmp_path} -configuration_basename robot.lua"/>'
    )
    file = tmp_path / "robot.lua"

    def sensors() -> list[str]:
        plan = launch(node)
        assert not plan.problems
        every = {"/scan", "/scan_1", "/scan_2", "/scan_3", "/echoes", "/points2", "/imu", "/odom", "/fix"}
        return sorted(every & set(allowed(plan, "subscribe")))

    file.write_text(LUA.format(""))
    assert sensors() == ["/imu", "/odom", "/points2", "/scan_1", "/scan_2"]
    assert "/tracked_pose" not in allowed(launch(node), "publish")
    file.write_text(LUA.format("TRAJECTORY_BUILDER_2D.use_imu_data = false\noptions.num_laser_scans = 1"))
    assert sensors() == ["/odom", "/points2", "/scan"]
    (tmp_path / "base.lua").write_text(LUA.format("options.publish_tracked_pose = true"))
    file.write_text('include "base.lua"\noptions.use_odometry = false\nreturn options')
    assert sensors() == ["/imu", "/points2", "/scan_1", "/scan_2"]
    assert "/tracked_pose" in allowed(launch(node), "publish")


@pytest.mark.parametrize(
    ("written", "why"),
    [
        (LUA.format("if true then options.num_laser_scans = 1 end"), "it computes its values"),
        (LUA.format("options.num_laser_scans = lasers"), "num_laser_scans is 'lasers', which is computed"),
        ("return options", "it does not say num_laser_scans"),
        ('include "mine.lua"', "mine.lua cannot be read"),
        ('include "robot.lua"', "include each other without end"),
    ],
)
def test_sensors_of_cartographer_that_lua_computes_are_a_gap(
    launch: Launch, tmp_path: Path, written: str, why: str
) -> None:
    (tmp_path / "robot.lua").write_text(written)
    arguments = f"-configuration_directory {tmp_path} -configuration_basename robot.lua"
    node = f'<node pkg="cartographer_ros" exec="cartographer_node" name="c" args="{arguments}"/>'
    assert why in problems(launch(node))


RSLIDAR = """
common: {{msg_source: {source}, send_packet_ros: {packets}, send_point_cloud_ros: true}}
lidar:
  - driver: {{lidar_type: RS16}}
    ros: {{ros_send_point_cloud_topic: /front/points, ros_recv_packet_topic: /front/packets}}
  - driver: {{lidar_type: RS16}}
    ros: {{ros_send_packet_topic: rear_packets, ros_send_imu_data_topic: /imu}}
"""
RSLIDAR_NODE = (
    '<node pkg="rslidar_sdk" exec="rslidar_sdk_node" namespace="lidar">'
    '<param name="config_path" value="{}"/></node>'
)


def test_rslidar_sdk_has_the_topics_of_its_file(launch: Launch, tmp_path: Path) -> None:
    file = tmp_path / "lidars.yaml"
    file.write_text(RSLIDAR.format(source=1, packets="false"))
    plan = launch(RSLIDAR_NODE.format(file))
    assert not plan.problems
    assert allowed(plan, "publish") == ["/front/points", "/lidar/rslidar_points"]
    assert allowed(plan, "subscribe") == []
    assert {"/lidar/rslidar_points_destination_0", "/lidar/rslidar_points_destination_1"} <= {
        node.fqn for node in plan.nodes
    }
    file.write_text(RSLIDAR.format(source=2, packets="true"))
    plan = launch(RSLIDAR_NODE.format(file))
    assert allowed(plan, "publish") == [
        *("/front/points", "/lidar/rear_packets", "/lidar/rslidar_packets", "/lidar/rslidar_points"),
    ]
    assert allowed(plan, "subscribe") == ["/front/packets", "/lidar/rslidar_packets"]


@pytest.mark.parametrize(
    ("written", "why"),
    [
        (RSLIDAR.format(source=7, packets="false"), "msg_source '7' is none of rslidar_sdk"),
        (RSLIDAR.format(source=1, packets="perhaps"), "send_packet_ros is neither true nor false"),
        ("lidar: []", "a mapping 'common' and a list 'lidar'"),
        (None, "there is no such file"),
    ],
)
def test_a_file_that_rslidar_sdk_cannot_use_is_a_gap(
    launch: Launch, tmp_path: Path, written: str | None, why: str
) -> None:
    file = tmp_path / "lidars.yaml"
    if written is not None:
        file.write_text(written)
    assert why in problems(launch(RSLIDAR_NODE.format(file)))


TWIST_MUX = '<node pkg="twist_mux" exec="twist_mux" name="twist_mux"><param from="{}"/></node>'


def test_twist_mux_subscribes_the_topics_of_its_file(launch: Launch, tmp_path: Path) -> None:
    file = tmp_path / "mux.yaml"
    file.write_text(
        "twist_mux: {ros__parameters: {topics: {joy: {topic: joy_vel}, nav: {topic: /nav}}, locks: {e: {topic: stop}}}}"
    )
    assert allowed(launch(TWIST_MUX.format(file)), "subscribe") == ["/joy_vel", "/nav", "/stop"]


RVIZ = """
Panels: [{{Class: rviz_common/Displays}}]
Visualization Manager:
  Displays:
    - {{Class: rviz_default_plugins/LaserScan, Enabled: false, Topic: {{Value: /scan}}}}
    - Class: rviz_common/Group
      Displays: [{{Class: rviz_default_plugins/Map, Topic: {{Value: /map}}, Update Topic: {{Value: /map_updates}}}}]
    - {{Class: rviz_default_plugins/Grid}}
    {more}
  Tools: [{{Class: rviz_default_plugins/SetGoal, Topic: {{Value: /goal}}}}]
"""


def test_rviz_gets_what_its_displays_and_tools_name(launch: Launch, tmp_path: Path) -> None:
    file = tmp_path / "view.rviz"
    node = f'<node pkg="rviz2" exec="rviz2" name="rviz2" args="-d {file}"/>'
    file.write_text(RVIZ.format(more=""))
    plan = launch(node)
    assert allowed(plan, "subscribe") == ["/map", "/map_updates", "/scan", "/tf", "/tf_static"]
    assert allowed(plan, "publish") == ["/goal"] and not plan.problems
    file.write_text(RVIZ.format(more="- {Class: my_rviz/Display}"))
    assert "display of class 'my_rviz/Display' needs is not known" in problems(launch(node))


def test_rviz_is_given_a_file_that_the_launch_file_writes(launch: Launch, tmp_path: Path) -> None:
    """Nav2's launch of RViz replaces the namespace in a file; a dry run writes none, and it is not rviz's default."""
    (tmp_path / "view.rviz").write_text(RVIZ.format(more="").replace("/map", "<robot>/map"))
    (tmp_path / "rviz.launch.py").write_text(
        "from launch import LaunchDescription\nfrom launch_ros.actions import Node\n"
        "from nav2_common.launch import ReplaceString\n\ndef generate_launch_description():\n"
        f"    view = ReplaceString('{tmp_path}/view.rviz', {{'<robot>': '/r1'}})\n"
        "    return LaunchDescription([Node(package='rviz2', executable='rviz2', arguments=['-d', view])])\n"
    )
    plan = launch(f'<include file="{tmp_path}/rviz.launch.py"/>')
    assert {"/r1/map", "/r1/map_updates", "/scan"} <= set(allowed(plan, "subscribe"))
    assert allowed(plan, "publish") == ["/goal"] and not plan.problems


def test_rviz_without_a_file_has_that_of_the_user_else_its_own_default(
    launch: Launch, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    default = ["/clicked_point", "/goal_pose", "/initialpose"]
    without = '<node pkg="rviz2" exec="rviz2"/>'
    not_there = '<node pkg="rviz2" exec="rviz2" args="-d /missing-file.rviz"/>'
    assert allowed(launch(without), "publish") == allowed(launch(not_there), "publish") == default
    of_user = tmp_path / ".rviz2" / "default.rviz"
    of_user.parent.mkdir()
    of_user.write_text(RVIZ.format(more=""))
    assert allowed(launch(without), "publish") == ["/goal"]
    assert allowed(launch(not_there), "publish") == default
    warning = "the file /missing-file.rviz does not exist: rviz2 loads its default configuration"
    assert warning in " ".join(each.text for each in launch(not_there).warnings)
    assert "rviz2 takes" not in " ".join(each.text for each in launch(without).warnings)
    of_missing_package = (
        '<node pkg="rviz2" exec="rviz2" args="-d /missing/my_robot/share/my_robot/view.rviz"/>'
    )
    assert "there is no such file" in problems(launch(of_missing_package))


def test_a_display_without_a_class_is_none_and_that_is_said(launch: Launch, tmp_path: Path) -> None:
    file = tmp_path / "view.rviz"
    file.write_text(RVIZ.format(more="- {Type: rviz_default_plugins/Path, Topic: /path}"))
    plan = launch(f'<node pkg="rviz2" exec="rviz2" args="-d {file}"/>')
    assert "/path" not in allowed(plan, "subscribe") and not plan.problems
    told = f"{file}:9: rviz2 loads nothing for a display without Class"
    assert told in " ".join(each.text for each in plan.warnings)


def test_displays_and_panels_of_other_packages_are_described_by_documents(
    launch: Launch, tmp_path: Path
) -> None:
    file = tmp_path / "view.rviz"
    node = f'<node pkg="rviz2" exec="rviz2" args="-d {file}"/>'
    file.write_text(
        RVIZ.format(
            more="- {Class: moveit_rviz_plugin/Trajectory, Trajectory Topic: /arm/path}\n    - Class: rviz/Grid"
        )
    )
    plan = launch(node)
    assert "/arm/path" in allowed(plan, "subscribe") and not plan.problems
    file.write_text(
        "Panels:\n  - Class: nav2_rviz_plugins/Navigation 2\n    Class: nav2_rviz_plugins/Selector\n"
    )
    plan = launch(node)
    assert "/planner_selector" in allowed(plan, "publish") and not plan.problems
    assert "/navigate_to_pose" not in allowed(plan, "call_actions"), (
        "rviz takes the last of a key given twice"
    )


def test_a_display_of_moveit_with_a_robot_from_elsewhere_is_not_known(launch: Launch, tmp_path: Path) -> None:
    file = tmp_path / "view.rviz"
    node = f'<node pkg="rviz2" exec="rviz2" args="-d {file}"/>'
    display = (
        "- {{Class: moveit_rviz_plugin/MotionPlanning, Robot Description: {}, Move Group Namespace: {}}}"
    )
    file.write_text(RVIZ.format(more=display.format("robot_description", "''")))
    plan = launch(node)
    assert "/move_action" in allowed(plan, "call_actions") and not plan.problems
    file.write_text(RVIZ.format(more=display.format("other", "''")))
    assert "another parameter than robot_description" in problems(launch(node))
    file.write_text(RVIZ.format(more=display.format("robot_description", "/arm")))
    assert "move_group in a namespace" in problems(launch(node))


def test_a_gazebo_bridge_bridges_its_arguments_and_its_file(launch: Launch, tmp_path: Path) -> None:
    file = tmp_path / "bridge.yaml"
    file.write_text(
        "- {ros_topic_name: odom, gz_topic_name: /model/odom, ros_type_name: nav_msgs/msg/Odometry, "
        "gz_type_name: gz.msgs.Odometry, direction: GZ_TO_ROS}\n"
    )
    node = (
        '<node pkg="ros_gz_bridge" exec="parameter_bridge" name="b" args="{}">'
        '<param name="config_file" value="{}"/></node>'
    )
    words = "/clock@rosgraph_msgs/msg/Clock[gz.msgs.Clock /cmd_vel@geometry_msgs/msg/Twist]gz.msgs.Twist"
    plan = launch(node.format(words, file))
    assert allowed(plan, "publish") == ["/clock", "/odom"]
    assert allowed(plan, "subscribe") == ["/cmd_vel"]
    file.write_text("- {ros_topic_name: odom, direction: SIDEWAYS}\n")
    assert "'SIDEWAYS' is not a direction of a bridge" in problems(launch(node.format(words, file)))


@pytest.mark.parametrize(
    ("pkg", "exe"), [("rosbridge_server", "rosbridge_websocket"), ("foxglove_bridge",) * 2]
)
def test_bridges_for_any_topic_are_a_gap_until_a_policy_answers(launch: Launch, pkg: str, exe: str) -> None:
    assert "say with --policy what it may" in problems(launch(f'<node pkg="{pkg}" exec="{exe}" name="b"/>'))


def test_relay_takes_its_topics_from_the_command_line(launch: Launch) -> None:
    node = '<node pkg="topic_tools" exec="relay" name="r" args="{}"/>'
    plan = launch(node.format("/in"))
    assert (allowed(plan, "subscribe"), allowed(plan, "publish")) == (["/in"], ["/in_relay"])
    assert allowed(launch(node.format("/in out")), "publish") == ["/out"]


def test_republish_uses_the_transports_it_is_told(launch: Launch) -> None:
    node = (
        '<node pkg="image_transport" exec="republish" name="r"><param name="in_transport" value="compressed"/>'
        '<param name="out_transport" value="raw"/></node>'
    )
    plan = launch(node)
    assert (allowed(plan, "subscribe"), allowed(plan, "publish")) == (["/in/compressed"], ["/out"])


def test_republish_publishes_in_the_one_transport_that_it_is_told(launch: Launch) -> None:
    node = '<node pkg="image_transport" exec="republish" name="r" {}</node>'
    told = node.format('><param name="out_transport" value="compressed"/>')
    assert allowed(launch(told), "publish") == ["/out/compressed"]
    arguments = launch(node.format('args="compressed raw">'), distro="humble")
    assert allowed(arguments, "subscribe") == ["/in/compressed"]
    assert allowed(arguments, "publish") == ["/out"]


CONTROL = """
<node pkg="robot_state_publisher" exec="robot_state_publisher"><param name="robot_description" value="{urdf}"/></node>
<node pkg="controller_manager" exec="ros2_control_node"><param from="{file}"/></node>
<node pkg="controller_manager" exec="spawner" args="arm {words}"/>
"""
URDF = "&lt;robot name='r'&gt;&lt;ros2_control name='Left Arm'/&gt;&lt;/robot&gt;"


def test_a_controller_manager_gets_what_its_spawners_load(launch: Launch, tmp_path: Path) -> None:
    file, own = tmp_path / "cm.yaml", tmp_path / "arm.yaml"
    file.write_text("controller_manager: {ros__parameters: {update_rate: 100}}")
    own.write_text("arm: {ros__parameters: {type: joint_trajectory_controller/JointTrajectoryController}}")
    urdf = URDF.replace("Left Arm", "Left")
    plan = launch(CONTROL.format(urdf=urdf, file=file, words=f"--param-file {own}"))
    assert not plan.problems
    assert "/arm/follow_joint_trajectory" in allowed(plan, "serve_actions")
    assert "/controller_manager/set_parameters" in allowed(plan, "call_services")
    assert "/left" in [node.fqn for node in plan.nodes]
    plan = launch(CONTROL.format(urdf=urdf, file=file, words=""))
    assert "the class of plugin 'arm' is not known" in problems(plan)
    assert "/controller_manager/set_parameters" not in allowed(plan, "call_services")
    plan = launch(CONTROL.format(urdf="output of xacro, which is not installed", file=file, words=""))
    assert ": 'output of xacro, which is not installed'" in problems(plan), "the text says what is missing"
    (place,) = {each.location.file for each in plan.problems if each.location and "xacro" in each.text}
    assert place.endswith(".launch.xml"), "a user has nothing to correct in a document that comes with us"


HARDWARE = (
    "&lt;robot name='r'&gt;&lt;ros2_control name='Arm'&gt;&lt;hardware&gt;&lt;plugin&gt;{plugin}&lt;/plugin&gt;"
    "&lt;/hardware&gt;&lt;transmission&gt;&lt;plugin&gt;a/Gear&lt;/plugin&gt;&lt;/transmission&gt;"
    "&lt;/ros2_control&gt;&lt;/robot&gt;"
)


@pytest.mark.parametrize("distro", ["humble", "jazzy"])
def test_hardware_that_nobody_describes_is_a_gap(launch: Launch, tmp_path: Path, distro: str) -> None:
    file = tmp_path / "cm.yaml"
    file.write_text(
        "controller_manager: {ros__parameters: {arm: {type: joint_state_broadcaster/JointStateBroadcaster}}}"
    )
    text = CONTROL.format(urdf=HARDWARE, file=file, words="")
    plan = launch(text.format(plugin="mock_components/GenericSystem"), distro=distro)
    assert not plan.problems
    assert ("/arm" in [node.fqn for node in plan.nodes]) and ("Gear" not in problems(plan))
    assert "hardware component 'Arm' of class 'own/Hw' needs is not known" in problems(
        launch(text.format(plugin="own/Hw"), distro=distro)
    )


def test_an_ekf_subscribes_its_inputs_and_publishes_tf_in_its_namespace_too(launch: Launch) -> None:
    node = (
        '<node pkg="robot_localization" exec="ekf_node" name="ekf" namespace="r1">'
        '<param name="odom0" value="wheel/odom"/><param name="imu0" value="/imu"/>'
        '<remap from="odometry/filtered" to="odom"/><remap from="/tf" to="tf"/></node>'
    )
    plan = launch(node)
    assert {"/r1/wheel/odom", "/imu", "/r1/tf"} <= set(allowed(plan, "subscribe"))
    assert {"/r1/odom", "/r1/tf"} <= set(allowed(plan, "publish"))
    assert "/r1/cmd_vel" not in allowed(plan, "subscribe")


def test_slam_toolbox_is_a_lifecycle_node_since_jazzy_only(launch: Launch) -> None:
    node = '<node pkg="slam_toolbox" exec="async_slam_toolbox_node" name="slam_toolbox"/>'
    (old,) = (e for e in launch(node, distro="humble").derived.policy.enclaves)
    (new,) = (e for e in launch(node, distro="jazzy").derived.policy.enclaves)
    assert "/slam_toolbox/change_state" not in allowed_names(old)["serve_services"]
    assert "/slam_toolbox/change_state" in allowed_names(new)["serve_services"]


def test_the_service_of_a_calibration_is_private_since_iron(launch: Launch) -> None:
    node = '<node pkg="usb_cam" exec="usb_cam_node_exe" name="front" namespace="cameras"/>'
    assert allowed(launch(node), "serve_services") == [
        "/cameras/front/set_camera_info",
        "/cameras/set_capture",
    ]
    assert "/cameras/front/get_parameters" in allowed(launch(node), "call_services")
    assert allowed(launch(node, distro="humble"), "serve_services") == [
        "/cameras/set_camera_info",
        "/cameras/set_capture",
    ]


MOVE_GROUP = """
move_group:
  ros__parameters:
    planning_pipelines: [ompl]
    ompl: {planning_plugins: [PLANNER], response_adapters: [default_planning_response_adapters/ValidateSolution]}
    capabilities: pilz_industrial_motion_planner/MoveGroupSequenceAction
    disable_capabilities: move_group/ClearOctomapService
    moveit_controller_manager: moveit_simple_controller_manager/MoveItSimpleControllerManager
    moveit_simple_controller_manager:
      controller_names: [arm, hand]
      arm: {type: FollowJointTrajectory, action_ns: follow_joint_trajectory}
      hand: {type: GripperCommand, action_ns: ''}
"""


def test_move_group_has_its_capabilities_pipelines_and_controllers(launch: Launch, tmp_path: Path) -> None:
    file = tmp_path / "move_group.yaml"
    node = f'<node pkg="moveit_ros_move_group" exec="move_group"><param from="{file}"/></node>'
    file.write_text(MOVE_GROUP.replace("PLANNER", "ompl_interface/OMPLPlanner"))
    plan = launch(node)
    assert not plan.problems
    assert allowed(plan, "call_actions") == ["/arm/follow_joint_trajectory", "/hand"]
    assert {"/move_action", "/sequence_move_group"} <= set(allowed(plan, "serve_actions"))
    assert "/get_planning_scene" in allowed(plan, "serve_services")
    assert "/clear_octomap" not in allowed(plan, "serve_services")
    assert {"/display_contacts", "/pipeline_state"} <= set(allowed(plan, "publish"))
    file.write_text(MOVE_GROUP.replace("PLANNER", "my/Planner"))
    assert "plugin 'my/Planner' is of class my/Planner, which no document describes" in problems(launch(node))


def test_a_node_name_of_launch_renames_the_further_nodes_that_take_it(launch: Launch) -> None:
    node = '<node pkg="moveit_ros_move_group" exec="move_group" {}/>'
    assert "/moveit_simple_controller_manager" in [each.fqn for each in launch(node.format("")).nodes]
    named = [each.fqn for each in launch(node.format('name="arm"')).nodes]
    assert "/moveit_simple_controller_manager" not in named and "/arm_private_*" in named


REALSENSE = (
    '<node pkg="realsense2_camera" exec="realsense2_camera_node" name="d435" namespace="front">{}</node>'
)


def test_a_depth_camera_publishes_the_streams_that_are_switched_on(launch: Launch) -> None:
    plain = allowed(launch(REALSENSE.format("")), "publish")
    assert {"/front/d435/color/image_raw", "/front/d435/depth/image_rect_raw", "/tf_static"} <= set(plain)
    assert not {"/tf", "/front/d435/infra1/image_rect_raw", "/front/d435/depth/color/points"} & set(plain)
    more = REALSENSE.format(
        '<param name="enable_infra1" value="true"/><param name="pointcloud.enable" value="true"/>'
    )
    added = set(allowed(launch(more), "publish")) - set(plain)
    assert {"/front/d435/infra1/image_rect_raw", "/front/d435/depth/color/points"} <= added


def test_rtabmap_subscribes_what_its_switches_say(launch: Launch) -> None:
    node = (
        '<node pkg="rtabmap_slam" exec="rtabmap" name="rtabmap"><param name="subscribe_depth" value="false"/>'
        '<param name="subscribe_rgb" value="false"/><param name="subscribe_scan" value="true"/>'
        '<remap from="scan" to="/lidar"/></node>'
    )
    subscribed = allowed(launch(node), "subscribe")
    assert {"/lidar", "/odom"} <= set(subscribed)
    assert not {"/depth/image", "/rgb/image", "/scan_cloud", "/rgbd_image"} & set(subscribed)


@pytest.mark.parametrize(
    ("pkg", "exe"),
    [
        ("micro_ros_agent", "micro_ros_agent"),
        ("depthai_ros_driver", "camera_node"),
        ("rmf_traffic_ros2", "rmf_traffic_schedule"),
    ],
)
def test_what_only_devices_or_others_decide_is_a_gap(launch: Launch, pkg: str, exe: str) -> None:
    assert "say with --policy" in problems(launch(f'<node pkg="{pkg}" exec="{exe}" name="n"/>'))
