"""What a program hands to libraries, and what libraries make by themselves."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from enclave_addons.inference import InferredSystem
from enclave_addons.inference.models.rclpy import may_make_nodes

Infer = Callable[..., InferredSystem]

_OWN_NODE = """
    import rclpy
    from std_msgs.msg import String
    {imports}
    rclpy.init()
    node = rclpy.create_node('n')
    node.create_publisher(String, 'mine', 10)
    {body}
    rclpy.spin(node)
    """


@pytest.mark.parametrize(
    ("imports", "body"),
    [
        (
            "from turtlebot4_navigation.turtlebot4_navigator import TurtleBot4Navigator",
            "TurtleBot4Navigator()",
        ),
        ("from moveit.planning import MoveItPy", "MoveItPy(node_name='m')"),
        ("import rosbag2_py", "rosbag2_py.Recorder()"),
        ("from launch_testing_ros import WaitForTopics", "WaitForTopics([])"),
        ("import my_robot_ros", "my_robot_ros.start()"),
    ],
)
def test_what_a_ros_package_makes_that_cannot_be_read_is_a_gap(imports: str, body: str, infer: Infer) -> None:
    (gap,) = infer(_OWN_NODE.format(imports=imports, body=body)).gaps
    assert "is of a ROS package that is not analysed" in gap.why


def test_all_calls_of_ros_1_are_one_gap(infer: Infer) -> None:
    (gap,) = infer(_OWN_NODE.format(imports="import rospy", body="rospy.init_node('m'); rospy.Rate(1)")).gaps
    assert gap.why == "this program calls rospy of ROS 1, which is not analysed"


@pytest.mark.parametrize(
    ("imports", "body"),
    [
        ("import rosbag2_py", "rosbag2_py.SequentialReader()"),
        ("from ultralytics import YOLO", "YOLO('m.pt')"),
        ("import tf_transformations", "tf_transformations.euler_from_quaternion([0, 0, 0, 1])"),
        ("import tf2_kdl", "tf2_kdl.PyKDL.Vector(1, 0, 0)"),
        ("from tf2_sensor_msgs.tf2_sensor_msgs import do_transform_cloud", "do_transform_cloud(None, None)"),
        ("from geometry_msgs.msg import Twist", "Twist()"),
    ],
)
def test_what_makes_no_node_is_none(imports: str, body: str, infer: Infer) -> None:
    assert not infer(_OWN_NODE.format(imports=imports, body=body)).gaps


@pytest.mark.parametrize(("library", "made"), [("pinocchio", False), ("pynput", False), ("acme", True)])
def test_a_library_that_package_xml_names_is_of_ros_unless_it_is_known_not_to_be(
    library: str, made: bool
) -> None:
    assert may_make_nodes(f"{library}.Model", frozenset({library})) is made
    assert not may_make_nodes(f"{library}.Model", frozenset())


_WRITER = """class Writer:
        def write(self, text):
            node.create_client(String, 'late')
    """
