"""Plugins in the user's own packages that make interfaces on the node which loads them, or nodes, or nothing."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from enclave_launch import LaunchPlan, ResolveOptions, resolve
from tests.addons.inference.cpp.workspace import HEAD, package

pytest.importorskip("tree_sitter_cpp", reason="the extra cpp is not installed")

CMAKE = """
add_library(own SHARED src/own.cpp)
pluginlib_export_plugin_description_file(host plugins.xml)
"""
PLUGINS = '<library path="own"><class name="own/It" type="own::It" base_class_type="{base}"/></library>'
HARDWARE = (
    HEAD
    + """
#include <hardware_interface/system_interface.hpp>
namespace own {{
class It : public hardware_interface::SystemInterface {{
public:
  CallbackReturn on_init(const hardware_interface::HardwareInfo & info) override {{
    if (hardware_interface::SystemInterface::on_init(info) != CallbackReturn::SUCCESS) {{
      return CallbackReturn::ERROR;
    }}
    {body}
    return CallbackReturn::SUCCESS;
  }}
private:
  rclcpp::Node::SharedPtr node_;
  rclcpp::Publisher<std_msgs::msg::Float64>::SharedPtr pub_;
}};
}}
PLUGINLIB_EXPORT_CLASS(own::It, hardware_interface::SystemInterface)
"""
)
CONTROLLER = (
    HEAD
    + """
#include <nav2_core/controller.hpp>
namespace own {{
class It : public nav2_core::Controller {{
public:
  void configure(
    const rclcpp_lifecycle::LifecycleNode::WeakPtr & parent, std::string name, std::shared_ptr<tf2_ros::Buffer> tf,
    std::shared_ptr<nav2_costmap_2d::Costmap2DROS> costmap) override {{
    auto node = parent.lock();
    node_ = parent;
    {body}
  }}
  void activate() override {{
    alive_ = node_.lock()->create_publisher<std_msgs::msg::Bool>("alive", 1);
  }}
private:
  rclcpp_lifecycle::LifecycleNode::WeakPtr node_;
  rclcpp_lifecycle::LifecyclePublisher<nav_msgs::msg::Path>::SharedPtr pub_;
  rclcpp_lifecycle::LifecyclePublisher<std_msgs::msg::Bool>::SharedPtr alive_;
}};
}}
PLUGINLIB_EXPORT_CLASS(own::It, nav2_core::Controller)
"""
)
LAYER = (
    HEAD
    + """
#include <nav2_costmap_2d/layer.hpp>
namespace own {{
class It : public nav2_costmap_2d::Layer {{
public:
  void onInitialize() override {{
    auto node = node_.lock();
    {body}
  }}
private:
  rclcpp::Subscription<std_msgs::msg::Float64>::SharedPtr sub_;
}};
}}
PLUGINLIB_EXPORT_CLASS(own::It, nav2_costmap_2d::Layer)
"""
)
ARM = """
<launch><node pkg="controller_manager" exec="ros2_control_node">
  <param name="robot_description" value="&lt;robot name='r'&gt;&lt;ros2_control name='arm' type='system'&gt;
    &lt;hardware&gt;&lt;plugin&gt;{name}&lt;/plugin&gt;&lt;/hardware&gt;&lt;/ros2_control&gt;&lt;/robot&gt;"/>
  <param from="{file}"/>
</node></launch>
"""
DRIVE = '<launch><node pkg="nav2_controller" exec="controller_server"><param from="{file}"/></node></launch>'
OF_ARM = "own_node: {ros__parameters: {topic: effort}}\narm: {ros__parameters: {topic: load}}\n"
OF_DRIVE = """
controller_server:
  ros__parameters: {controller_plugins: [Own], Own: {plugin: NAME, topic: seen, loud: true}}
local_costmap: {local_costmap: {ros__parameters: {plugins: []}}}
"""
OF_COSTMAP = "local_costmap: {local_costmap: {ros__parameters: {plugins: [mine], mine: {plugin: NAME}}}}\n"
Planned = Callable[..., LaunchPlan]


@pytest.fixture
def planned(tmp_path: Path) -> Planned:
    """Plan a launch of a host of the plugin ``own/It``, whose method has ``body``, or of one of another ``name``."""

    def plan(
        source: str,
        base: str,
        launch: str,
        parameters: str,
        body: str,
        name: str = "own/It",
        cmake: str = CMAKE,
    ) -> LaunchPlan:
        files = {"src/own.cpp": source.format(body=body), "plugins.xml": PLUGINS.format(base=base)}
        package(tmp_path / "src/own", files, cmake)
        file = tmp_path / "parameters.yaml"
        file.write_text(parameters.replace("NAME", name))
        written = tmp_path / "demo.launch.xml"
        written.write_text(launch.format(file=file, name=name))
        folders = (tmp_path / "src",)
        options = ResolveOptions(source_folders=folders, allow_missing_packages=True, distro="jazzy")
        return resolve(str(written), options=options)

    return plan


def names(plan: LaunchPlan) -> set[str]:
    return {rule.expression for rules in plan.derived.reasons.values() for rule in rules}


OF_A_FIELD_BUS = '\n#include "field_bus.hpp"\nauto bus = std::make_shared<FieldBus>();'


@pytest.fixture
def hardware(planned: Planned) -> Callable[..., LaunchPlan]:
    def plan(body: str, name: str = "own/It", cmake: str = CMAKE) -> LaunchPlan:
        return planned(HARDWARE, "hardware_interface::SystemInterface", ARM, OF_ARM, body, name, cmake)

    return plan


def test_a_hardware_component_that_makes_nothing_is_known(hardware: Planned) -> None:
    plan = hardware("")
    assert not plan.problems
    assert [node.fqn for node in plan.nodes] == ["/controller_manager", "/arm"]


def test_a_hardware_component_brings_the_node_that_it_makes(hardware: Planned) -> None:
    plan = hardware(
        'node_ = rclcpp::Node::make_shared("own_node");'
        'auto topic = node_->declare_parameter<std::string>("topic", "command");'
        "pub_ = node_->create_publisher<std_msgs::msg::Float64>(topic, 1);"
    )
    assert not plan.problems
    assert "/own_node" in [node.fqn for node in plan.nodes]
    assert "/effort" in names(plan) and "/command" not in names(plan)


def test_a_hardware_component_makes_interfaces_on_the_node_that_it_is_given(hardware: Planned) -> None:
    plan = hardware(
        'auto topic = get_node()->declare_parameter<std::string>("topic", "command");'
        'pub_ = get_node()->create_publisher<std_msgs::msg::Float64>("~/" + topic, 1);'
    )
    assert not plan.problems
    assert "/arm/load" in names(plan)
    assert names(plan).isdisjoint({"/arm/command", "/controller_manager/load", "/arm/effort"})


def test_a_hardware_component_without_sources_is_a_gap(hardware: Planned) -> None:
    (problem,) = hardware("", "own/Other").problems
    assert "'own/Other' needs is not known" in str(problem)


@pytest.fixture
def nav2(planned: Planned) -> Callable[..., LaunchPlan]:
    def plan(body: str, name: str = "own/It") -> LaunchPlan:
        return planned(CONTROLLER, "nav2_core::Controller", DRIVE, OF_DRIVE, body, name)

    return plan


def test_a_plugin_of_nav2_makes_interfaces_on_the_node_that_it_was_given_before(nav2: Planned) -> None:
    plan = nav2("")
    assert not plan.problems
    assert "/alive" in names(plan) and "/seen" not in names(plan)


def test_a_plugin_of_nav2_makes_interfaces_on_its_host_under_the_parameters_of_the_launch(
    nav2: Planned,
) -> None:
    plan = nav2(
        'node->declare_parameter(name + ".topic", "plan_seen");'
        'node->declare_parameter(name + ".loud", false);'
        'auto topic = node->get_parameter(name + ".topic").as_string();'
        'if (node->get_parameter(name + ".loud").as_bool()) {'
        '  node->create_service<std_srvs::srv::Empty>(name + "/hush", [](auto, auto) {});'
        "}"
        "pub_ = node->create_publisher<nav_msgs::msg::Path>(topic, 1);"
    )
    assert not plan.problems
    assert {"/seen", "/Own/hush"} <= names(plan)
    assert "/plan_seen" not in names(plan)
    assert "/host" not in [node.fqn for node in plan.nodes]


def test_a_plugin_of_nav2_without_sources_is_a_gap(nav2: Planned) -> None:
    (problem,) = nav2("", "own/Other").problems
    assert "own/Other, which no document describes" in str(problem)


@pytest.mark.parametrize(
    ("topic", "allowed"),
    [('"/ranges"', True), ('name_ + "/ranges"', True), ('joinWithParentNamespace("ranges")', False)],
)
def test_a_layer_makes_interfaces_on_the_node_of_its_costmap(
    planned: Planned, topic: str, allowed: bool
) -> None:
    body = f"sub_ = node->create_subscription<std_msgs::msg::Float64>({topic}, 1, [](const auto &) {{}});"
    plan = planned(LAYER, "nav2_costmap_2d::Layer", DRIVE, OF_COSTMAP, body)
    if not allowed:
        assert any("the name of what it would subscribe is not known" in str(each) for each in plan.problems)
        return
    assert not plan.problems
    assert {"/ranges", "/local_costmap/mine/ranges"} & names(plan)


def test_an_installed_header_of_nav2_changes_nothing(
    planned: Planned, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    header = tmp_path / "install/include/nav2_costmap_2d/nav2_costmap_2d/layer.hpp"
    header.parent.mkdir(parents=True)
    header.write_text(
        "namespace nav2_costmap_2d { class Layer { public: Layer();\n"
        "  void initialize(LayeredCostmap *, std::string, const nav2::LifecycleNode::WeakPtr &);\n"
        "  virtual void onInitialize() {}\n"
        "protected: nav2::LifecycleNode::WeakPtr node_; std::string name_; }; }\n"
    )
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "install"))
    body = 'sub_ = node->create_subscription<std_msgs::msg::Float64>("/ranges", 1, [](const auto &) {});'
    plan = planned(LAYER, "nav2_costmap_2d::Layer", DRIVE, OF_COSTMAP, body)
    assert not plan.problems
    assert "/ranges" in names(plan)


PANEL = (
    HEAD
    + """
#include <rviz_common/panel.hpp>
namespace own {{
class It : public rviz_common::Panel {{
  Q_OBJECT
public:
  void onInitialize() override {{
    node_ = getDisplayContext()->getRosNodeAbstraction().lock()->get_raw_node();
    stop_ = node_->create_client<std_srvs::srv::Trigger>("stop");
    {body}
  }}
private:
  rclcpp::Node::SharedPtr node_;
  rclcpp::Client<std_srvs::srv::Trigger>::SharedPtr stop_;
}};
}}
PLUGINLIB_EXPORT_CLASS(own::It, rviz_common::Panel)
"""
)
RVIZ = '<launch><node pkg="rviz2" exec="rviz2" name="rviz" args="-d {file}"/></launch>'


def test_a_panel_of_rviz_makes_interfaces_on_the_node_of_rviz(planned: Planned) -> None:
    plan = planned(PANEL, "rviz_common::Panel", RVIZ, "Panels: [{Class: NAME, Name: Own}]\n", "")
    assert not plan.problems
    assert "/stop" in names(plan)


def test_a_panel_of_rviz_that_hands_the_node_on_is_a_gap(planned: Planned) -> None:
    body = "acme::watch(node_);"
    plan = planned(PANEL, "rviz_common::Panel", RVIZ, "Panels: [{Class: NAME, Name: Own}]\n", body)
    assert any("the node is handed to acme::watch()" in str(each) for each in plan.problems)
