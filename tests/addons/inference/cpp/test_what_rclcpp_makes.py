"""What rclcpp and well-known libraries make when they are asked: each construct beside one that makes nothing."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.addons.inference.cpp.workspace import HEAD, endpoints, gaps, in_class, infer, node, package, write

pytest.importorskip("tree_sitter_cpp", reason="the extra cpp is not installed")

TF = {("subscription", "/tf"), ("subscription", "/tf_static")}
ROWS = {
    "a transform listener on the node": (
        in_class("", "tf2_ros::Buffer b_{get_clock()}; tf2_ros::TransformListener l_{b_, this};"),
        TF,
    ),
    "a transform broadcaster": (
        in_class("", "tf2_ros::TransformBroadcaster b_{*this};"),
        {("publisher", "/tf")},
    ),
    "a static broadcaster": (
        in_class(
            "b_ = std::make_shared<tf2_ros::StaticTransformBroadcaster>(this);",
            "std::shared_ptr<tf2_ros::StaticTransformBroadcaster> b_;",
        ),
        {("publisher", "/tf_static")},
    ),
    "a buffer alone": (in_class("", "tf2_ros::Buffer b_{get_clock()};"), set()),
    "a buffer that serves frames": (
        in_class("", "tf2_ros::Buffer b_{get_clock(), tf2::durationFromSec(1.0), shared_from_this()};"),
        {("service_server", "tf2_frames")},
    ),
    "a filter's subscriber": (
        in_class("", 'message_filters::Subscriber<sensor_msgs::msg::Image> s_{this, "image"};'),
        {("subscription", "image")},
    ),
    "a filter's subscriber that subscribes later": (
        in_class('s_.subscribe(this, "image");', "message_filters::Subscriber<sensor_msgs::msg::Image> s_;"),
        {("subscription", "image")},
    ),
    "a filter's subscriber that a callback of the options starts": (
        in_class(
            "rclcpp::PublisherOptions o; o.event_callbacks.matched_callback = [this](auto &) { "
            's_.subscribe(this, "image"); }; '
            'create_publisher<sensor_msgs::msg::Image>("out", 1, o);',
            "message_filters::Subscriber<sensor_msgs::msg::Image> s_;",
        ),
        {("subscription", "image"), ("publisher", "out")},
    ),
    "a filter's subscriber that never subscribes": (
        in_class("", "message_filters::Subscriber<sensor_msgs::msg::Image> s_;"),
        set(),
    ),
    "diagnostics": (in_class("", "diagnostic_updater::Updater u_{this};"), {("publisher", "/diagnostics")}),
    "a bond": (
        in_class("", 'bond::Bond b_{"bond", "id", shared_from_this()};'),
        {("publisher", "bond"), ("subscription", "bond")},
    ),
    "an action server": (
        in_class(
            'rclcpp_action::create_server<example_interfaces::action::Fibonacci>(this, "fib", a, b, c);'
        ),
        {("action_server", "fib")},
    ),
    "an action client with interfaces": (
        in_class(
            "rclcpp_action::create_client<example_interfaces::action::Fibonacci>(get_node_base_interface(), "
            'get_node_graph_interface(), get_node_logging_interface(), get_node_waitables_interface(), "fib");'
        ),
        {("action_client", "fib")},
    ),
    "a generic publisher": (
        in_class('create_generic_publisher("a", "std_msgs/msg/String", 1);'),
        {("publisher", "a")},
    ),
    "a client of another node's parameters": (
        in_class(
            'c_ = std::make_shared<rclcpp::SyncParametersClient>(this, "other");',
            "rclcpp::SyncParametersClient::SharedPtr c_;",
        ),
        {
            ("service_client", f"other/{name}")
            for name in (
                "describe_parameters",
                "get_parameter_types",
                "get_parameters",
                "list_parameters",
                "set_parameters",
                "set_parameters_atomically",
            )
        },
    ),
    "service introspection": (
        in_class(
            's_ = create_service<std_srvs::srv::Empty>("s", cb); s_->configure_introspection(get_clock(), 1, state);',
            "rclcpp::Service<std_srvs::srv::Empty>::SharedPtr s_;",
        ),
        {("service_server", "s"), ("publisher", "s/_service_event")},
    ),
    "topic statistics of a subscription": (
        in_class(
            "rclcpp::SubscriptionOptions o; o.topic_stats_options.state = rclcpp::TopicStatisticsState::Enable; "
            'create_subscription<std_msgs::msg::String>("in", 1, cb, o);'
        ),
        {("subscription", "in"), ("publisher", "/statistics")},
    ),
    "topic statistics on a topic that is written out": (
        in_class(
            "auto o = rclcpp::SubscriptionOptions(); "
            "o.topic_stats_options.state = rclcpp::TopicStatisticsState::Enable; "
            'o.topic_stats_options.publish_topic = "/my/statistics"; '
            'create_subscription<std_msgs::msg::String>("in", 1, cb, o);'
        ),
        {("subscription", "in"), ("publisher", "/my/statistics")},
    ),
    "topic statistics that are switched off": (
        in_class(
            "rclcpp::SubscriptionOptions o; o.topic_stats_options.state = rclcpp::TopicStatisticsState::Disable; "
            'o.topic_stats_options.publish_topic = "/never"; '
            'create_subscription<std_msgs::msg::String>("in", 1, cb, o);'
        ),
        {("subscription", "in")},
    ),
    "topic statistics of all subscriptions of a node": (
        HEAD + "int main(int argc, char ** argv) { rclcpp::init(argc, argv); "
        'auto n = std::make_shared<rclcpp::Node>("n", rclcpp::NodeOptions().enable_topic_statistics(true)); '
        'n->create_subscription<std_msgs::msg::String>("in", 1, cb); }',
        {("subscription", "in"), ("publisher", "/statistics")},
    ),
    "its own name": (
        in_class('create_publisher<std_msgs::msg::String>(std::string(get_name()) + "/a", 1);'),
        {("publisher", "{node}/a")},
    ),
}


@pytest.mark.parametrize(("source", "expected"), ROWS.values(), ids=ROWS.keys())
def test_a_row(source: str, expected: set[tuple[str, str]], tmp_path: Path) -> None:
    system = infer(tmp_path, source)
    assert endpoints(system) == expected
    assert gaps(system) == []


def test_a_listener_without_a_node_makes_one(tmp_path: Path) -> None:
    system = infer(
        tmp_path, in_class("", "tf2_ros::Buffer b_{get_clock()}; tf2_ros::TransformListener l_{b_};")
    )
    helper = node(system, "transform_listener_impl_*")
    assert {str(e.name) for e in helper.endpoints} == {"/tf", "/tf_static"}
    assert node(system, "n").endpoints == ()
    assert (helper.parameter_services, node(system, "n").parameter_services) == (False, True)


@pytest.mark.parametrize(
    ("options", "has_them"),
    [
        ("rclcpp::NodeOptions()", True),
        (".start_parameter_services(false)", True),
        (".start_parameter_services(false).start_parameter_event_publisher(false)", False),
        (".start_parameter_services(argc > 1).start_parameter_event_publisher(false)", True),
    ],
)
def test_a_node_has_parameter_services_unless_both_options_switch_them_off(
    tmp_path: Path, options: str, has_them: bool
) -> None:
    given = options if options.startswith("rclcpp") else f"rclcpp::NodeOptions(){options}"
    main = f'int main(int argc, char ** argv) {{ auto n = std::make_shared<rclcpp::Node>("n", {given}); }}'
    assert node(infer(tmp_path, "#include <rclcpp/rclcpp.hpp>\n" + main), "n").parameter_services is has_them


def test_an_image_publisher_has_its_transports(tmp_path: Path) -> None:
    found = endpoints(
        infer(tmp_path, in_class('image_transport::create_camera_publisher(this, "cam/image");'))
    )
    assert {
        ("publisher", "cam/image"),
        ("publisher", "cam/image/compressed"),
        ("publisher", "cam/camera_info"),
    } <= found


NAMES = {
    "a constant in a header's namespace": ("create_publisher<M>(names::kTopic, 1);", "a"),
    "a macro": ("create_publisher<M>(TOPIC, 1);", "a"),
    "a static member": ("create_publisher<M>(kMember, 1);", "a"),
    "joined texts": ('create_publisher<M>(std::string("x/") + names::kTopic, 1);', "x/a"),
    "a stream": ('std::stringstream s; s << "x" << 3; create_publisher<M>(s.str(), 1);', "x3"),
    "a number": ('create_publisher<M>("x" + std::to_string(2), 1);', "x2"),
    "a format": ('create_publisher<M>(std::format("{}/x{}", "a", 3), 1);', "?"),
    "a format that is not known": ("create_publisher<M>(fmt::format(get_name(), 1), 1);", "?"),
    "a parameter": ('create_publisher<M>(declare_parameter<std::string>("p", "a"), 1);', "param:p"),
    "a parameter without default": (
        'create_publisher<M>(declare_parameter<std::string>("p"), 1);',
        "param:p",
    ),
    "an output argument": (
        'std::string t; declare_parameter("p", "a"); get_parameter("p", t); create_publisher<M>(t, 1);',
        "param:p",
    ),
    "a parameter or a value": (
        'std::string t; get_parameter_or<std::string>("p", t, "a"); create_publisher<M>(t + "/x", 1);',
        "param:p/x",
    ),
    "a conversion": (
        'declare_parameter("p", "a"); create_publisher<M>(get_parameter("p").as_string(), 1);',
        "param:p",
    ),
}


@pytest.mark.parametrize(("body", "expected"), NAMES.values(), ids=NAMES.keys())
def test_a_name(body: str, expected: str, tmp_path: Path) -> None:
    before = (
        'namespace names { static constexpr std::string_view kTopic = "a"; }\n#define TOPIC "a"\n'
        "enum class K { A, B };\nusing M = std_msgs::msg::String;\n"
    )
    system = infer(tmp_path, in_class(body, 'static constexpr const char * kMember = "a";', before))
    assert endpoints(system) == {("publisher", expected)}


def test_loops_over_lists_make_each_interface(tmp_path: Path) -> None:
    body = 'for (const auto & t : {"x", "y"}) { create_publisher<std_msgs::msg::String>(t, 1); }'
    body += (
        'for (int i = 0; i < 2; ++i) { create_publisher<std_msgs::msg::String>("n" + std::to_string(i), 1); }'
    )
    assert {name for _, name in endpoints(infer(tmp_path, in_class(body)))} == {"x", "y", "n0", "n1"}


def test_remap_rules_in_the_options_belong_to_the_node(tmp_path: Path) -> None:
    source = HEAD + (
        'int main() { auto n = std::make_shared<rclcpp::Node>("n", rclcpp::NodeOptions().arguments('
        '{"--ros-args", "-r", "a:=b"})); n->create_publisher<std_msgs::msg::String>("a", 1); }'
    )
    system = infer(tmp_path, source)
    assert system.nodes[0].own_rules == ("a:=b",)
    assert gaps(system) == []


__all__ = ["node"]


OWN = (
    HEAD
    + 'struct N : rclcpp::Node {{ N() : Node("n") {{}} }};\nint main(int argc, char ** argv) {{ {0} N n; }}\n'
)


def test_arguments_that_the_program_makes_for_init_are_rules_of_its_nodes_and_those_of_launch_are_not(
    tmp_path: Path,
) -> None:
    made = 'const char * a[] = {"prog", "--ros-args", "-r", "a:=b"}; rclcpp::init(4, a);'
    (found,) = infer(tmp_path, OWN.format(made)).nodes
    assert (found.own_rules, found.global_arguments) == (("a:=b",), False)


def test_arguments_of_main_are_those_of_launch(tmp_path: Path) -> None:
    (found,) = infer(tmp_path, OWN.format("rclcpp::init(argc, argv);")).nodes
    assert (found.own_rules, found.global_arguments) == ((), True)


def test_without_arguments_the_launch_is_not_heard(tmp_path: Path) -> None:
    (found,) = infer(tmp_path, OWN.format("rclcpp::init(0, nullptr);")).nodes
    assert found.global_arguments is False


def test_arguments_that_are_not_known_are_a_gap(tmp_path: Path) -> None:
    assert any("rclcpp::init" in why for why in gaps(infer(tmp_path, OWN.format("rclcpp::init(2, made());"))))


RELEASE = """
#include <rclcpp/version.h>
struct N : rclcpp::Node { N() : Node("n") {
#if RCLCPP_VERSION_GTE(28, 0, 0)
  create_publisher<std_msgs::msg::String>("new", 1);
#else
  create_publisher<std_msgs::msg::String>("old", 1);
#endif
} };
int main() { N n; }
"""


@pytest.mark.parametrize(("major", "name"), [(16, "old"), (28, "new")])
def test_the_release_that_is_installed_decides_what_is_compiled(
    tmp_path: Path, major: int, name: str
) -> None:
    from enclave_addons.inference.cpp.system import infer_sources

    numbers = zip(("MAJOR", "MINOR", "PATCH"), (major, 0, 1), strict=True)
    text = "".join(f"#define RCLCPP_VERSION_{part} ({number})\n" for part, number in numbers)
    write(tmp_path / "ros/include/rclcpp/rclcpp/version.h", text)
    folder = package(tmp_path / "demo", {"src/main.cpp": HEAD + RELEASE})
    (found,) = infer_sources([str(folder / "src/main.cpp")], [str(tmp_path / "ros")]).nodes
    assert [str(endpoint.name) for endpoint in found.endpoints] == [name]
