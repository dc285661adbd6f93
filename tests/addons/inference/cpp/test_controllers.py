"""Controllers of ros2_control in the user's own packages: nodes of the controller manager that loads them."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_launch import LaunchPlan, ResolveOptions, resolve
from tests.addons.inference.cpp.workspace import HEAD, package

pytest.importorskip("tree_sitter_cpp", reason="the extra cpp is not installed")

CONTROLLER = (
    HEAD
    + """
#include <controller_interface/controller_interface.hpp>
#include <pluginlib/class_list_macros.hpp>
namespace ctl {
class Relay : public controller_interface::ControllerInterface {
public:
  controller_interface::CallbackReturn on_init() override {
    topic_ = auto_declare<std::string>("topic", "reference");
    joints_ = auto_declare<std::vector<std::string>>("joints", {});
    return controller_interface::CallbackReturn::SUCCESS;
  }
  controller_interface::CallbackReturn on_configure(const rclcpp_lifecycle::State &) override {
    if (joints_.empty()) { return controller_interface::CallbackReturn::ERROR; }
    sub_ = get_node()->create_subscription<std_msgs::msg::Float64>("~/" + topic_, 1, [](const auto &) {});
    for (const auto & joint : joints_) {
      pubs_.push_back(get_node()->create_publisher<std_msgs::msg::Float64>(joint + "/effort", 1));
    }
    return controller_interface::CallbackReturn::SUCCESS;
  }
private:
  std::string topic_;
  std::vector<std::string> joints_;
  rclcpp::Subscription<std_msgs::msg::Float64>::SharedPtr sub_;
  std::vector<rclcpp::Publisher<std_msgs::msg::Float64>::SharedPtr> pubs_;
};
}
PLUGINLIB_EXPORT_CLASS(ctl::Relay, controller_interface::ControllerInterface)
"""
)
PLUGINS = (
    '<library path="ctl"><class name="ctl/Relay" type="ctl::Relay" '
    'base_class_type="controller_interface::ControllerInterface"/></library>'
)
CMAKE = """
add_library(ctl SHARED src/relay.cpp)
pluginlib_export_plugin_description_file(controller_interface plugins.xml)
"""
LAUNCH = """
<launch>
  <node pkg="controller_manager" exec="ros2_control_node">
    <param name="robot_description" value="&lt;robot name='r'/&gt;"/>
    <param from="{file}"/>
  </node>
  <node pkg="controller_manager" exec="spawner" args="left"/>
</launch>
"""


def planned(folder: Path, kind: str) -> LaunchPlan:
    package(folder / "src/ctl", {"src/relay.cpp": CONTROLLER, "plugins.xml": PLUGINS}, CMAKE)
    parameters = folder / "controllers.yaml"
    parameters.write_text(
        f"controller_manager: {{ros__parameters: {{left: {{type: {kind}}}}}}}\n"
        "left: {ros__parameters: {topic: target, joints: [a, b]}}\n"
    )
    launch = folder / "demo.launch.xml"
    launch.write_text(LAUNCH.format(file=parameters))
    options = ResolveOptions(source_folders=(folder / "src",), allow_missing_packages=True, distro="jazzy")
    return resolve(str(launch), options=options)


def test_a_controller_is_followed_with_what_launch_gives_it(tmp_path: Path) -> None:
    plan = planned(tmp_path, "ctl/Relay")
    assert not plan.problems
    assert "/left" in [node.fqn for node in plan.nodes]
    names = {rule.expression for rules in plan.derived.reasons.values() for rule in rules}
    assert {"/left/target", "/a/effort", "/b/effort", "/left/get_parameters"} <= names
    assert "/left/reference" not in names


def test_a_controller_whose_sources_nobody_has_is_a_gap(tmp_path: Path) -> None:
    plan = planned(tmp_path, "ctl/Other")
    assert any("ctl/Other, which no document describes" in str(each) for each in plan.problems)
    assert "/left" not in [node.fqn for node in plan.nodes]
