"""An executable whose ``main`` only makes a component is not followed again; every other ``main`` is."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_addons.inference import InferredSystem, infer_paths
from nodl.node_interface import NodeInterface
from tests.addons.inference.cpp.workspace import package

pytest.importorskip("tree_sitter_cpp", reason="the extra cpp is not installed")


HEADER = """#pragma once
#include <rclcpp/rclcpp.hpp>
namespace demo {
class Talker : public rclcpp::Node {
public:
  explicit Talker(const rclcpp::NodeOptions & options = rclcpp::NodeOptions());
};
}
"""
SOURCE = """#include "talker.hpp"
demo::Talker::Talker(const rclcpp::NodeOptions & options) : Node("talker", options) {
  create_publisher<std_msgs::msg::String>("chatter", 1);
}
"""
MAIN = """#include "talker.hpp"
int main(int argc, char ** argv)
{
  rclcpp::init(argc, argv);  // as usual
  auto node = std::make_shared<demo::Talker>();
  rclcpp::spin(node->get_node_base_interface());
  rclcpp::shutdown();
  return 0;
}
"""
CMAKE = """include_directories(include)
add_library(talker_component src/talker.cpp)
rclcpp_components_register_nodes(talker_component "demo::Talker")
add_executable(talker src/main.cpp)
target_link_libraries(talker talker_component)
"""


def infer(folder: Path, main: str = MAIN, header: str = HEADER, source: str = SOURCE) -> InferredSystem:
    files = {"src/main.cpp": main, "src/talker.cpp": source, "include/talker.hpp": header}
    return infer_paths([package(folder / "demo", files, CMAKE)])


def executable(system: InferredSystem) -> NodeInterface:
    (found,) = (node for node in system.nodes if node.executable == "talker")
    return found


def listed(node: NodeInterface) -> list[str]:
    return [f"{each.kind.value} {each.name}" for each in node.endpoints]


@pytest.mark.parametrize(
    ("written", "instead"),
    [
        ("as it is", "as it is"),
        ("Talker>()", "Talker>(rclcpp::NodeOptions())"),
        (
            "  auto node = std::make_shared<demo::Talker>()",
            "  rclcpp::NodeOptions o; auto node = std::make_shared<demo::Talker>(o)",
        ),
        ("->get_node_base_interface()", ""),
        ("return 0;", "return EXIT_SUCCESS;"),
        ("  rclcpp::shutdown();\n  return 0;\n", ""),
    ],
)
def test_one_that_only_makes_the_component_is_what_the_component_is(
    tmp_path: Path, runs: list[str], written: str, instead: str
) -> None:
    system = infer(tmp_path, MAIN.replace(written, instead))
    (component,) = (node for node in system.nodes if node.plugin == "demo::Talker")
    assert runs == ["talker.cpp"]
    assert listed(component) == ["publisher chatter"]
    assert executable(system) == component._replace(executable="talker", plugin=None)


@pytest.mark.parametrize(
    ("written", "instead", "made"),
    [
        ("rclcpp::spin", 'node->create_publisher<std_msgs::msg::String>("more", 1);\n  rclcpp::spin', "publisher more"),
        ("Talker>()", "Talker>(more)", "publisher chatter"),
        ("rclcpp::init(argc, argv)", "rclcpp::init(0, nullptr)", "publisher chatter"),
        ("Talker>()", 'Talker>(rclcpp::NodeOptions().arguments({"-r", "chatter:=x"}))', "publisher chatter"),
        ("int main", 'auto other = std::make_shared<rclcpp::Node>("other");\nint main', "publisher chatter"),
    ],
)  # fmt: skip
def test_one_that_does_anything_else_is_a_program_of_its_own(
    tmp_path: Path, runs: list[str], written: str, instead: str, made: str
) -> None:
    system = infer(tmp_path, MAIN.replace(written, instead))
    assert sorted(runs) == ["main.cpp", "talker.cpp"]
    assert made in [each for node in system.nodes if node.executable == "talker" for each in listed(node)]


def test_one_that_calls_another_constructor_than_a_container_does_is_a_program_of_its_own(
    tmp_path: Path, runs: list[str]
) -> None:
    header = HEADER.replace(
        "  explicit Talker(const rclcpp::NodeOptions & options = rclcpp::NodeOptions());\n",
        '  Talker() : Talker("alone") {}\n'
        "  explicit Talker(const rclcpp::NodeOptions & options);\n"
        "  explicit Talker(const std::string & topic) : Node(topic) {\n"
        "    create_publisher<std_msgs::msg::String>(topic, 1);\n  }\n",
    )
    system = infer(tmp_path, header=header)
    assert sorted(runs) == ["main.cpp", "talker.cpp"]
    assert listed(executable(system)) == ["publisher alone"]


def test_an_edit_of_the_component_reaches_the_executable(tmp_path: Path) -> None:
    infer(tmp_path)
    assert listed(executable(infer(tmp_path, source=SOURCE.replace("chatter", "speech")))) == [
        "publisher speech"
    ]


def test_an_edit_of_main_alone_reaches_it_too(tmp_path: Path) -> None:
    infer(tmp_path)
    main = MAIN.replace(
        "rclcpp::spin", 'node->create_client<example_interfaces::srv::AddTwoInts>("add");\n  rclcpp::spin'
    )
    assert "service_client add" in listed(executable(infer(tmp_path, main)))
