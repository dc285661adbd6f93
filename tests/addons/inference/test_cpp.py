"""rclcpp sources: names, types, executables and components; what is not known is said."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_addons.inference import InferredSystem, infer_paths
from nodl.node_interface import NodeInterface

pytest.importorskip("tree_sitter_cpp", reason="the extra cpp is not installed")

SOURCE = """
#define MACRO "macro_topic"
namespace demo {
static constexpr char kTopic[] = "constant";
class Talker : public rclcpp::Node {
public:
  using Fib = example_interfaces::action::Fibonacci;
  explicit Talker(const rclcpp::NodeOptions & options) : Node("talker", "ns", options), tf_(this) {
    declare_parameter<std::string>("topic", "chatter");
    auto topic = get_parameter("topic").as_string();
    a_ = create_publisher<std_msgs::msg::String>(topic + "/x", 10);
    b_ = this->create_publisher<std_msgs::msg::String>(kTopic, 10);
    c_ = create_subscription<std_msgs::msg::String>(MACRO, 10, std::bind(&Talker::on, this, _1));
    d_ = rclcpp_action::create_server<Fib>(this, "fib", a, b, c);
    e_ = create_client<std_srvs::srv::Empty>(name_);
    f_ = create_publisher<std_msgs::msg::String>(computed(), 10);
    helper_ = elsewhere::helper(this);
  }
private:
  tf2_ros::TransformBroadcaster tf_;
  std::string name_ = "member";
};
class Base : public rclcpp::Node {
public:
  explicit Base(const std::string & name) : rclcpp::Node(name) {
    create_publisher<std_msgs::msg::String>("base", 1);
  }
};
class Derived : public Base { public: Derived() : Base("derived") {} };
}
RCLCPP_COMPONENTS_REGISTER_NODE(demo::Talker)
"""
MAIN = """
#include "talker.hpp"
int main() {
  auto node = rclcpp::Node::make_shared("plain");
  auto client = node->create_client<std_srvs::srv::Empty>("/service");
  auto derived = std::make_shared<demo::Derived>();
}
"""
CMAKE = """
project(demo)
add_library(talker SHARED src/talker.cpp)
rclcpp_components_register_node(talker PLUGIN "demo::Talker" EXECUTABLE talker_node)
set(SOURCES src/main.cpp)
add_executable(main_node ${SOURCES})
"""


@pytest.fixture
def system(tmp_path: Path) -> InferredSystem:
    (tmp_path / "src").mkdir()
    (tmp_path / "package.xml").write_text("<package><name>demo</name></package>", encoding="utf-8")
    (tmp_path / "CMakeLists.txt").write_text(CMAKE, encoding="utf-8")
    (tmp_path / "src/talker.hpp").write_text(SOURCE.partition("RCLCPP_COMPONENTS")[0], encoding="utf-8")
    registration = '#include "talker.hpp"\nRCLCPP_COMPONENTS_REGISTER_NODE(demo::Talker)\n'
    (tmp_path / "src/talker.cpp").write_text(registration, encoding="utf-8")
    (tmp_path / "src/main.cpp").write_text(MAIN, encoding="utf-8")
    return infer_paths([tmp_path])


def node(system: InferredSystem, name: str) -> NodeInterface:
    (found,) = (each for each in system.nodes if each.name == name)
    return found


def test_names_and_types(system: InferredSystem) -> None:
    talker = node(system, "talker")
    assert talker.namespace == "/ns"
    assert {(e.kind.value, str(e.name), e.type) for e in talker.endpoints} == {
        ("publisher", "param:topic/x", "std_msgs/msg/String"),
        ("publisher", "constant", "std_msgs/msg/String"),
        ("publisher", "?", "std_msgs/msg/String"),
        ("publisher", "/tf", "tf2_msgs/msg/TFMessage"),
        ("subscription", "macro_topic", "std_msgs/msg/String"),
        ("action_server", "fib", "example_interfaces/action/Fibonacci"),
        ("service_client", "member", "std_srvs/srv/Empty"),
    }
    assert [gap.why for gap in talker.gaps] == [
        "the node is handed to elsewhere::helper(), which may make interfaces on it"
    ]


def test_executables_and_components(system: InferredSystem) -> None:
    assert (node(system, "talker").plugin, node(system, "talker").executable) == (
        "demo::Talker",
        "talker_node",
    )
    assert node(system, "plain").executable == "main_node"
    assert node(system, "derived").executable == "main_node"


def test_constructor_arguments_of_derived_classes(system: InferredSystem) -> None:
    assert [str(e.name) for e in node(system, "derived").endpoints] == ["base"]
    assert not any(each.name is None for each in system.nodes)


def test_a_local_node(system: InferredSystem) -> None:
    assert [str(e.name) for e in node(system, "plain").endpoints] == ["/service"]
