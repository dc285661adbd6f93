"""What known libraries make where their sources are not in reach, each as its own source says."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_addons.inference import infer_paths
from enclave_addons.inference.report.v2_report import to_v2
from enclave_addons.library import Library, LibraryDocuments
from enclave_addons.library.apply import applied
from nodl.dependence import Situation
from tests.addons.inference.cpp.workspace import HEAD, endpoints, gaps, in_class, infer, names, package

pytest.importorskip("tree_sitter_cpp", reason="the extra cpp is not installed")

CLOUDS = '#include "point_cloud_transport/point_cloud_transport.hpp"\n'
BOND = {("publisher", "bond"), ("subscription", "bond")}


def nav2(body: str) -> str:
    head = HEAD + "#include <nav2_ros_common/lifecycle_node.hpp>\n"
    return head + (
        'class Demo : public nav2::LifecycleNode { public: Demo() : nav2::LifecycleNode("n") { auto self = '
        f"shared_from_this(); {body} }} }};\nint main() {{ auto d = std::make_shared<Demo>(); }}\n"
    )


OF_NAV2 = {
    "an action server by the node": (
        'create_action_server<nav2_msgs::action::Wait>("wait", cb);', {("action_server", "wait")},
    ),
    "a factory": (
        'nav2::interfaces::create_subscription<std_msgs::msg::String>(self, "in", cb);', {("subscription", "in")},
    ),
    "a twist publisher": ('nav2_util::TwistPublisher p(self, "cmd_vel", 1);', {("publisher", "cmd_vel")}),
    "a twist subscriber": (
        'nav2_util::TwistSubscriber s(self, "cmd_vel", 1, a, b);', {("subscription", "cmd_vel")},
    ),
    "an odometry smoother": (
        'nav2_util::OdomSmoother o(self, 0.3, "wheels");', {("subscription", "wheels")},
    ),
    "an odometry smoother with its default": ("nav2_util::OdomSmoother o(self);", {("subscription", "odom")}),
    "clients of a lifecycle": (
        'nav2_util::LifecycleServiceClient c("amcl", self);',
        {("service_client", "amcl/change_state"), ("service_client", "amcl/get_state")},
    ),
}  # fmt: skip


@pytest.mark.parametrize(("body", "expected"), OF_NAV2.values(), ids=OF_NAV2)
def test_of_nav2(body: str, expected: set[tuple[str, str]], tmp_path: Path) -> None:
    system = infer(tmp_path, nav2(body))
    assert not gaps(system)
    assert endpoints(system) == expected | BOND


def test_the_events_of_a_service_follow_its_parameter(tmp_path: Path) -> None:
    system = infer(tmp_path, nav2('nav2::ServiceServer<std_srvs::srv::Empty> s("go", self, cb);'))
    events = [e.name for n in system.nodes for e in n.endpoints if "_service_event" in str(e.name)]
    assert [name.fill_each({}) for name in events] == [(), ()]
    shown = [
        each.text for name in events for each in name.fill_each({"service_introspection_mode": "contents"})
    ]
    assert shown == ["go/_service_event"]


def test_a_class_of_nav2_that_nobody_read_is_a_gap(tmp_path: Path) -> None:
    assert gaps(infer(tmp_path, nav2("nav2_util::Unheard u(self);")))


def test_the_service_of_a_camera_is_that_of_either_distribution(tmp_path: Path) -> None:
    system = infer(tmp_path, in_class('camera_info_manager::CameraInfoManager m(this, "left");'))
    assert {name for _, name in endpoints(system)} == {"set_camera_info", "~/set_camera_info"}
    (node,) = system.nodes
    described = {
        distro: {
            str(each.name)
            for each in applied(
                node, Situation(distro, "n", "/"), LibraryDocuments(Library())
            ).interface.endpoints
        }
        for distro in ("humble", "iron", "rolling")
    }
    private = {"~/set_camera_info"}
    assert described == {"humble": {"set_camera_info"}, "iron": private, "rolling": private}
    (document,) = to_v2(system.nodes).values()
    assert '"set_camera_info": {name: "set_camera_info", until: humble}' in document


def test_a_service_of_the_programs_own_under_the_name_of_a_camera_is_told(tmp_path: Path) -> None:
    own = 'create_service<std_srvs::srv::Empty>("set_camera_info", cb); '
    system = infer(tmp_path, in_class(own + 'camera_info_manager::CameraInfoManager m(this, "left");'))
    assert any("made in more than one way" in gap for gap in gaps(system))


def test_the_service_of_a_camera_with_a_namespace(tmp_path: Path) -> None:
    system = infer(tmp_path, in_class('camera_info_manager::CameraInfoManager m(this, "left", "", "ns");'))
    assert {name for _, name in endpoints(system)} == {"ns/set_camera_info"}


@pytest.mark.parametrize(
    "body",
    [
        "point_cloud_transport::PointCloudTransport t(shared_from_this());",
        'auto p = point_cloud_transport::create_publisher(shared_from_this(), "out");',
        'auto s = point_cloud_transport::create_subscription(shared_from_this(), "in", cb, "raw");',
    ],
)
def test_transports_of_point_clouds_are_told(body: str, tmp_path: Path) -> None:
    assert gaps(infer(tmp_path, in_class(body, before=CLOUDS)))


def moveit(body: str) -> str:
    head = HEAD + "#include <moveit/move_group_interface/move_group_interface.hpp>\n"
    return head + f'int main() {{ auto node = std::make_shared<rclcpp::Node>("mover"); {body} }}\n'


def test_a_move_group_interface_asks_move_group_and_waits_for_the_robot(tmp_path: Path) -> None:
    body = 'moveit::planning_interface::MoveGroupInterface arm(node, "arm"); '
    system = infer(tmp_path, moveit(body))
    made = endpoints(system)
    assert {("action_client", "move_action"), ("subscription", "robot_description_semantic")} <= made
    assert ("subscription", "joint_states") not in made
    assert {node.name for node in system.nodes} >= {
        "mover_ssp_robot_description",
        "transform_listener_impl_*",
    }
    system = infer(tmp_path, moveit(body + "auto pose = arm.getCurrentPose();"))
    assert ("subscription", "joint_states") in endpoints(system)


def test_a_move_group_interface_with_options_leaves_its_namespace_open(tmp_path: Path) -> None:
    body = "moveit::planning_interface::MoveGroupInterface arm(node, options);"
    assert any("namespace of this MoveGroupInterface" in gap for gap in gaps(infer(tmp_path, moveit(body))))


def test_an_interface_to_the_planning_scene_is_a_gap(tmp_path: Path) -> None:
    system = infer(tmp_path, moveit('moveit::planning_interface::PlanningSceneInterface scene("/arm");'))
    assert any("PlanningSceneInterface" in why for why in gaps(system))


def test_parameters_of_nav2_need_no_look_at_its_source(tmp_path: Path) -> None:
    """But for a function of that name in another namespace, which is followed."""
    before = (
        "namespace nav2 { template <class T, class N> T declare_or_get_parameter(N n, std::string name, T value)"
        "{ return n->has_parameter(name) ? n->get_parameter(name).template get_value<T>() : other(n, name); } }\n"
        "namespace own { template <class T, class N> T declare_or_get_parameter(N n, std::string name, T value)"
        '{ return "own_" + name; } }\n'
    )
    body = (
        'create_publisher<std_msgs::msg::String>(nav2::declare_or_get_parameter(this, "map", std::string("m")), 1);'
        'create_publisher<std_msgs::msg::String>(own::declare_or_get_parameter(this, "odom", std::string("o")), 1);'
    )
    system = infer(tmp_path, in_class(body, before=before))
    assert endpoints(system) == {("publisher", "param:map"), ("publisher", "own_odom")}
    assert not gaps(system)
    assert {"map", "strict_param_loading"} <= set(system.nodes[0].parameters)


def test_nodes_of_a_package_of_tests_that_nobody_makes_are_not_listed(tmp_path: Path) -> None:
    source = HEAD + (
        'class Demo : public rclcpp::Node { public: Demo() : Node("n") '
        '{ create_publisher<std_msgs::msg::String>("t", 1); } };\n'
    )
    for name, made in (("demo_tests", set()), ("demo_nodes", {("publisher", "t")})):
        folder = package(tmp_path / name, {"include/demo.hpp": source})
        assert endpoints(infer_paths([folder])) == made


AUTOWARE = {
    "autoware_utils_logging::LoggerLevelConfigure l(this);": {("service_server", "~/config_logger")},
    'autoware_utils_diagnostics::DiagnosticsInterface d(this, "x");': {("publisher", "/diagnostics")},
    "autoware_utils::ProcessingTimePublisher p(this);": {("publisher", "~/debug/processing_time_ms")},
    'autoware_utils_debug::ProcessingTimePublisher p(this, "~/ms");': {("publisher", "~/ms")},
    'autoware_utils_rclcpp::InterProcessPollingSubscriber<nav_msgs::msg::Odometry> s(this, "odom");': {
        ("subscription", "odom")
    },
    'autoware_utils_debug::TimeKeeper k; autoware_utils_debug::ScopedTimeTrack t("x", k);': set(),
    "lanelet::ConstLanelets lanes(3);": set(),
}


@pytest.mark.parametrize(("body", "expected"), AUTOWARE.items())
def test_of_autoware_utils(body: str, expected: set[tuple[str, str]], tmp_path: Path) -> None:
    before = "#include <autoware_utils_debug/time_keeper.hpp>\n#include <lanelet2_core/Forward.h>\n"
    system = infer(tmp_path, in_class(body, before=before))
    assert (endpoints(system), gaps(system)) == (expected, [])


@pytest.mark.parametrize("library", ["gz", "gazebo"])
def test_nodes_of_gazebo_make_no_interfaces_of_ros_and_their_callbacks_run(
    library: str, tmp_path: Path
) -> None:
    members = f"""
    {library}::transport::NodePtr gazebo{{new {library}::transport::Node()}};
    void on(int) {{ create_publisher<std_msgs::msg::String>("made_by_callback", 1); }}
    """
    body = 'gazebo->Init(); gazebo->Subscribe("~/contacts", &Demo::on, this);'
    system = infer(tmp_path, in_class(body, members))
    assert (names(system), gaps(system)) == (["made_by_callback"], [])
