"""Every call of rclpy and its companions that makes an endpoint, with positional and keyword arguments."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from enclave_addons.inference import InferredSystem
from nodl.node_interface import NodeInterface

Infer = Callable[..., InferredSystem]

HEAD = """
import rclpy
from rclpy.node import Node
from rclpy.action import ActionClient, ActionServer
from std_msgs.msg import String
from std_srvs.srv import Empty
from nav2_msgs.action import NavigateToPose
import tf2_ros, message_filters, diagnostic_updater
rclpy.init()
node = rclpy.create_node('n')
"""

CALLS = {
    "node.create_publisher(String, 't', 10)": [("publisher", "t", "std_msgs/msg/String")],
    "node.create_publisher(msg_type=String, topic='t', qos_profile=10)": [
        ("publisher", "t", "std_msgs/msg/String")
    ],
    "node.create_subscription(String, 't', print, 10)": [("subscription", "t", "std_msgs/msg/String")],
    "node.set_parameters([rclpy.Parameter('use_sim_time', value=True)])": [
        ("subscription", "/clock", "rosgraph_msgs/msg/Clock")
    ],
    "node.set_parameters([rclpy.Parameter('use_sim_time', value=False)])": [],
    "node.create_service(Empty, 's', print)": [("service_server", "s", "std_srvs/srv/Empty")],
    "node.create_client(Empty, 's')": [("service_client", "s", "std_srvs/srv/Empty")],
    "ActionServer(node, NavigateToPose, 'a', print)": [
        ("action_server", "a", "nav2_msgs/action/NavigateToPose")
    ],
    "ActionClient(node, action_type=NavigateToPose, action_name='a')": [
        ("action_client", "a", "nav2_msgs/action/NavigateToPose")
    ],
    "tf2_ros.TransformBroadcaster(node)": [("publisher", "/tf", "tf2_msgs/msg/TFMessage")],
    "tf2_ros.StaticTransformBroadcaster(node)": [("publisher", "/tf_static", "tf2_msgs/msg/TFMessage")],
    "tf2_ros.TransformListener(tf2_ros.Buffer(), node)": [
        ("subscription", "/tf", "tf2_msgs/msg/TFMessage"),
        ("subscription", "/tf_static", "tf2_msgs/msg/TFMessage"),
    ],
    "tf2_ros.TransformListener(tf2_ros.Buffer(), node, static_only=True)": [
        ("subscription", "/tf_static", "tf2_msgs/msg/TFMessage"),
    ],
    "message_filters.Subscriber(node, String, 't')": [("subscription", "t", "std_msgs/msg/String")],
    "diagnostic_updater.Updater(node)": [
        ("publisher", "/diagnostics", "diagnostic_msgs/msg/DiagnosticArray")
    ],
    "from rclpy.wait_for_message import wait_for_message\nwait_for_message(String, node, 't')": [
        ("subscription", "t", "std_msgs/msg/String")
    ],
    "node.destroy_publisher(node.create_publisher(String, 't', 1))": [
        ("publisher", "t", "std_msgs/msg/String")
    ],
    "from rosidl_runtime_py.utilities import get_message\n"
    "node.create_publisher(get_message('std_msgs/msg/String'), 't', 1)": [("publisher", "t", "")],
}


def endpoints(node: NodeInterface) -> list[tuple[str, str, str]]:
    return sorted((e.kind.value, str(e.name), e.type) for e in node.endpoints)


@pytest.mark.parametrize("call", CALLS)
def test_calls_that_make_endpoints(call: str, infer: Infer) -> None:
    system = infer(HEAD + call + "\n")
    assert endpoints(system.nodes[0]) == CALLS[call]
    assert not system.gaps
    assert not system.nodes[0].gaps


DEFAULT: dict[str, str | int] = {"history": "KEEP_LAST", "reliability": "RELIABLE", "durability": "VOLATILE"}
SENSOR_DATA: dict[str, str | int] = {**DEFAULT, "depth": 5, "reliability": "BEST_EFFORT"}
QUALITIES: dict[str, dict[str, str | int]] = {
    "node.create_publisher(String, 't', 7)": {**DEFAULT, "depth": 7},
    "d = 3\nnode.create_subscription(String, 't', print, d)": {**DEFAULT, "depth": 3},
    "node.create_publisher(String, 't', qos_profile=qos_profile_sensor_data)": SENSOR_DATA,
    "node.create_subscription(String, 't', print, rclpy.qos.QoSPresetProfiles.SENSOR_DATA.value)": SENSOR_DATA,
    # The neighbours, of which nothing is certain:
    "node.create_publisher(String, 't', qos_profile_system_default)": {},
    "node.create_publisher(String, 't', QoSProfile(depth=7))": {},
    "node.create_publisher(String, 't', int(input()))": {},
    "node.create_publisher(String, 't', 7 if input() else 8)": {},
    "node.create_publisher(String, 't', 7 if input() else qos_profile_sensor_data)": {},
    "node.create_publisher(String, 't', 7, qos_overriding_options=QoSOverridingOptions.with_default_policies())": {},
    "node.create_publisher(String, 't', *([7] if input() else [8]))": {},
    "node.create_publisher(String, 't', True)": {},
    "node.create_publisher(String, 't', 0)": {},
    "node.create_service(Empty, 't', print)": {},
}


@pytest.mark.parametrize("call", QUALITIES)
def test_quality_of_service_is_known_where_it_is_certain(call: str, infer: Infer) -> None:
    imports = (
        "from rclpy.qos import QoSProfile, qos_profile_sensor_data, qos_profile_system_default\n"
        "from rclpy.qos_overriding_options import QoSOverridingOptions\n"
    )
    (endpoint,) = infer(HEAD + imports + call + "\n").nodes[0].endpoints
    assert dict(endpoint.qos) == QUALITIES[call]


def test_of_two_outcomes_with_their_own_quality_both_are_told(infer: Infer) -> None:
    """So that whoever compares takes either."""
    system = infer(
        HEAD
        + """
node.declare_parameter('fast', False)
if node.get_parameter('fast').value:
    node.create_publisher(String, 't', 1)
else:
    node.create_publisher(String, 't', 50)
"""
    )
    assert {dict(e.qos)["depth"] for e in system.nodes[0].endpoints} == {1, 50}


def test_each_node_has_its_own(infer: Infer) -> None:
    """Two objects of one class, told apart by where they are made."""
    system = infer(
        """
        import rclpy
        from rclpy.node import Node
        from std_msgs.msg import String
        class Robot(Node):
            def __init__(self, name):
                super().__init__(name, namespace='fleet')
                self.create_publisher(String, f'{name}/pose', 1)
        rclpy.init()
        executor = rclpy.executors.MultiThreadedExecutor()
        for i in range(2):
            executor.add_node(Robot(f'r{i}'))
        executor.spin()
        """
    )
    found = {(n.namespace, n.name, str(n.endpoints[0].name)) for n in system.nodes}
    assert found == {("/fleet", "r0", "r0/pose"), ("/fleet", "r1", "r1/pose")}


def test_the_same_class_in_unknown_number(infer: Infer) -> None:
    """A loop of unknown length still names what is known."""
    system = infer(
        """
        import rclpy, sys
        from std_msgs.msg import String
        for arg in sys.argv:
            node = rclpy.create_node('n')
            node.create_publisher(String, 'all/' + arg, 1)
        """
    )
    (node,) = system.nodes
    assert node.name == "n"
    assert [(str(e.name), e.certainty.value) for e in node.endpoints] == [("all/?", "pattern")]


def test_lifecycle_node_and_its_transitions(infer: Infer) -> None:
    system = infer(
        """
        import rclpy
        from rclpy.lifecycle import LifecycleNode
        from std_msgs.msg import String
        class L(LifecycleNode):
            def __init__(self):
                super().__init__('l')
            def on_configure(self, state):
                self.pub = self.create_lifecycle_publisher(String, 'late', 1)
        rclpy.spin(L())
        """
    )
    (node,) = system.nodes
    assert node.lifecycle
    assert endpoints(node) == [("publisher", "late", "std_msgs/msg/String")]


PARAMETERS = {
    "self.declare_parameter('t', 'd'); n = self.get_parameter('t').value": "param:t",
    "n = self.declare_parameter('t', 'd').value": "param:t",
    "self.declare_parameter('t', 'd'); n = self.get_parameter('t').get_parameter_value().string_value": "param:t",
    "self.declare_parameters('', [('t', 'd')]); n = self.get_parameter('t').value": "param:t",
    "self.declare_parameters('p', [('t', 'd')]); n = self.get_parameter('p.t').value": "param:p.t",
    "self.declare_parameter('t', 'd'); n = self.get_parameter_or('t', Parameter('t', value='e')).value": "param:t",
}


@pytest.mark.parametrize("body", PARAMETERS)
def test_names_from_parameters(body: str, infer: Infer) -> None:
    system = infer(
        f"""
        import rclpy
        from rclpy.node import Node
        from rclpy.parameter import Parameter
        from std_msgs.msg import String
        class N(Node):
            def __init__(self):
                super().__init__('n')
                {body}
                self.create_publisher(String, n + '/x', 1)
        rclpy.spin(N())
        """
    )
    (endpoint,) = system.nodes[0].endpoints
    name = PARAMETERS[body].removeprefix("param:")
    assert str(endpoint.name) == PARAMETERS[body] + "/x"
    assert endpoint.certainty.value == "from default"
    assert endpoint.name.fill({}).text == "d/x"
    assert endpoint.name.fill({name: "given"}).text == "given/x"


READ_LATER = {
    "a timer": ("Node", "self.create_timer(1, self.make)", "make(self)"),
    "a transition": ("LifecycleNode", "pass", "on_configure(self, state)"),
}


@pytest.mark.parametrize("case", READ_LATER)
def test_a_parameter_that_is_read_in_a_callback_is_as_well_known(case: str, infer: Infer) -> None:
    base, register, callback = READ_LATER[case]
    system = infer(
        f"""
        import rclpy
        from rclpy.node import Node
        from rclpy.lifecycle import LifecycleNode
        from std_msgs.msg import String
        class N({base}):
            def __init__(self):
                super().__init__('n')
                self.declare_parameter('frame', 'base')
                {register}
            def {callback}:
                frame = self.get_parameter('frame').value
                self.pub = self.create_publisher(String, f'{{frame}}/range', 1)
        rclpy.spin(N())
        """
    )
    (endpoint,) = system.nodes[0].endpoints
    assert str(endpoint.name) == "param:frame/range"
    assert not system.gaps


def test_the_elements_of_a_list_parameter_are_open_until_a_launch_says(infer: Infer) -> None:
    system = infer(
        """
        import rclpy
        from std_msgs.msg import String
        node = rclpy.create_node('n')
        node.declare_parameter('robots', ['a', 'b'])
        for robot in node.get_parameter('robots').value:
            node.create_publisher(String, f'{robot.strip("/")}/cmd', 1)
        """
    )
    assert [str(endpoint.name) for endpoint in system.nodes[0].endpoints] == ["?/cmd"]


@pytest.mark.parametrize(
    ("init", "given", "gaps"),
    [
        ("", "cli_args=['--ros-args', '-r', 'a:=/b']", 0),
        ("", "cli_args=['--ros-args', '-p', 'a:=b']", 1),
        ("", "cli_args=sys.argv[1:]", 1),
        ("args=['--ros-args', '-r', '__ns:=/m']", "", 0),
        ("args=['--ros-args', '--log-level', 'debug']", "", 0),
        ("args=['--ros-args', '-r', '__ns:=/m']", "use_global_arguments=False", 0),
    ],
)
def test_parameters_in_code_are_a_gap_and_rules_are_not(
    init: str, given: str, gaps: int, infer: Infer
) -> None:
    system = infer(f"import rclpy, sys\nrclpy.init({init})\nrclpy.create_node('n', {given})\n")
    (node,) = system.nodes
    assert [gap.why for gap in node.gaps] == [
        "remap rules or parameters given in code are not followed"
    ] * gaps


def test_what_is_unknown_is_said(infer: Infer) -> None:
    system = infer(
        """
        import rclpy
        from rclpy.node import Node
        from elsewhere import Helper, Base
        class N(Node):
            def __init__(self):
                super().__init__('n')
                Helper(self)
        class M(Base):
            def __init__(self):
                super().__init__('m')
                self.create_publisher(object, 'x', 1)
        N()
        M()
        """
    )
    whys = [gap.why for node in system.nodes for gap in node.gaps]
    assert any("handed to elsewhere.Helper" in why for why in whys)
    assert any("elsewhere.Base" in why for why in whys)


def test_code_made_at_run_time_is_a_gap(infer: Infer) -> None:
    system = infer("import rclpy\nnode = rclpy.create_node('n')\nexec(open('x').read())\n")
    assert any("eval, exec" in gap.why for gap in system.gaps)


def test_a_file_that_does_not_parse_is_a_gap(infer: Infer) -> None:
    system = infer("print 'python 2'\n")
    assert [gap.source.line for gap in system.gaps] == [1]


NAVIGATOR = """
from nav2_simple_commander.robot_navigator import BasicNavigator
{definition}
navigator = {call}
navigator.waitUntilNav2Active(localizer="slam")
"""


@pytest.mark.parametrize(
    ("definition", "call", "node"),
    [
        ("", "BasicNavigator()", "basic_navigator"),
        ("", "BasicNavigator('mine', namespace='robot1')", "mine"),
        (
            "class Mine(BasicNavigator):\n    def __init__(self):\n        super().__init__('sub')",
            "Mine()",
            "sub",
        ),
        ("class Mine(BasicNavigator):\n    pass", "Mine()", "basic_navigator"),
    ],
)
def test_a_node_that_a_library_brings_along(
    definition: str, call: str, node: str, infer: Callable[..., InferredSystem]
) -> None:
    (found,) = infer(NAVIGATOR.format(definition=definition, call=call)).nodes
    names = {str(endpoint.name) for endpoint in found.endpoints}
    assert found.name == node
    assert {"navigate_to_pose", "amcl_pose", "bt_navigator/get_state", "slam/get_state"} <= names
    assert found.namespace == ("/robot1" if "namespace" in call else "/")


def test_lifecycle_managers_found_at_run_time_are_unknown(names: Callable[..., list[str]]) -> None:
    text = "from nav2_simple_commander.robot_navigator import BasicNavigator\nBasicNavigator().lifecycleStartup()\n"
    assert "?" in names(text)


def test_interactive_markers_lie_below_the_namespace_of_their_server(
    node_body: Callable[..., list[str]],
) -> None:
    server = "interactive_markers.InteractiveMarkerServer(self, self.declare_parameter('ns', 'm').value)"
    found = node_body(server, before="import interactive_markers")
    assert found == ["param:ns/feedback", "param:ns/get_interactive_markers", "param:ns/update"]
