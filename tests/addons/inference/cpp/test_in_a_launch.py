"""From the sources of a colcon workspace to signed permissions: no manifest, nothing built, nothing executed."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from enclave_launch import LaunchPlan, ResolveOptions, provision, resolve
from tests.addons.inference.cpp.workspace import HEAD, package, write

pytest.importorskip("tree_sitter_cpp", reason="the extra cpp is not installed")

FILTER = (
    HEAD
    + """
#include <rclcpp_components/register_node_macro.hpp>
namespace demo {
class Filter : public rclcpp::Node {
public:
  explicit Filter(const rclcpp::NodeOptions & options) : Node("filter", options) {
    auto input = declare_parameter<std::string>("input", "scan");
    sub_ = create_subscription<sensor_msgs::msg::LaserScan>(input, 10, [](const auto &) {});
    pub_ = create_publisher<sensor_msgs::msg::LaserScan>(input + "_filtered", 10);
    for (const auto & name : declare_parameter<std::vector<std::string>>("monitors", {"front"})) {
      create_publisher<std_msgs::msg::Bool>("~/" + name + "/ok", 1);
    }
  }
};
}
RCLCPP_COMPONENTS_REGISTER_NODE(demo::Filter)
"""
)
CMAKE = """
add_library(filter SHARED src/filter.cpp)
rclcpp_components_register_node(filter PLUGIN "demo::Filter" EXECUTABLE filter_node)
"""
LAUNCH = """
<launch>
  <push-ros-namespace namespace="rover"/>
  <node pkg="demo" exec="filter_node" name="front">
    <param name="input" value="lidar"/>
    <param name="monitors" value="[left, right]"/>
    <remap from="lidar_filtered" to="/safe/scan"/>
  </node>
</launch>
"""
COMPONENT = """
<launch>
  <node_container pkg="rclcpp_components" exec="component_container" name="box" namespace="">
    <composable_node pkg="demo" plugin="demo::Filter" name="rear" namespace="rover"/>
  </node_container>
</launch>
"""


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    """``src/demo`` beside an ``install`` that holds a binary and no manifest."""
    package(tmp_path / "src/demo", {"src/filter.cpp": FILTER}, CMAKE)
    install(tmp_path)
    return tmp_path


def install(workspace: Path) -> None:
    index = workspace / "install/share/ament_index/resource_index/packages"
    index.mkdir(parents=True)
    for name in ("demo", "rclcpp_components"):
        (index / name).touch()
        program = workspace / "install/lib" / name / {"demo": "filter_node"}.get(name, "component_container")
        program.parent.mkdir(parents=True)
        program.write_bytes(b"\x7fELF\0")
        program.chmod(0o755)


def plan(workspace: Path, launch: str = LAUNCH, **options: object) -> LaunchPlan:
    file = workspace / "test.launch.xml"
    write(file, launch)
    return resolve(file, options=ResolveOptions(prefixes=(workspace / "install",), **options))  # type: ignore[arg-type]


def may(plan: LaunchPlan, name: str) -> bool:
    """Whether any enclave may publish or subscribe ``name``."""
    return any(rule.expression == name for rules in plan.derived.reasons.values() for rule in rules)


def test_parameters_remaps_and_namespaces_reach_the_permissions(workspace: Path) -> None:
    planned = plan(workspace)
    assert not planned.problems
    assert may(planned, "/rover/lidar")
    assert may(planned, "/safe/scan")
    assert not may(planned, "/rover/scan")
    assert not may(planned, "/rover/lidar_filtered")


def test_a_list_of_the_launch_file_decides_what_is_made(workspace: Path) -> None:
    planned = plan(workspace)
    assert may(planned, "/rover/front/left/ok")
    assert may(planned, "/rover/front/right/ok")
    assert not may(planned, "/rover/front/front/ok")


def test_a_component_is_found_by_its_plugin(workspace: Path) -> None:
    planned = plan(workspace, COMPONENT)
    assert not planned.problems
    assert may(planned, "/rover/scan")
    assert may(planned, "/rover/rear/front/ok")


def test_the_permissions_are_signed(workspace: Path) -> None:
    provisioned = provision(plan(workspace), workspace / "keystore")
    signed = next((workspace / "keystore/enclaves").rglob("permissions.p7s")).read_bytes()
    assert provisioned is not None
    assert b"rt/rover/lidar" in signed
    assert b"rt/rover/scan" not in signed


def test_a_gap_is_refused_with_its_place(workspace: Path) -> None:
    source = FILTER.replace("auto input =", "acme::attach(this); auto input =")
    write(workspace / "src/demo/src/filter.cpp", source)
    planned = plan(workspace)
    (problem,) = planned.problems
    assert "filter.cpp:8" in str(problem)
    assert "the node is handed to acme::attach(), which may make interfaces on it" in str(problem)


def test_sources_elsewhere_are_named(workspace: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    elsewhere = tmp_path_factory.mktemp("sources")
    (workspace / "src/demo").rename(elsewhere / "demo")
    assert plan(workspace).problems
    planned = plan(workspace, source_folders=(elsewhere,))
    assert not planned.problems
    assert may(planned, "/rover/lidar")


def test_the_variable_names_sources_too(workspace: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (workspace / "src").rename(workspace / "code")
    assert plan(workspace).problems
    monkeypatch.setenv("SECURE_LAUNCH_SOURCE", os.pathsep.join(["/nowhere", str(workspace / "code")]))
    assert not plan(workspace).problems


def test_a_build_folder_remembers_where_the_sources_lie(
    workspace: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    elsewhere = tmp_path_factory.mktemp("sources")
    (workspace / "src/demo").rename(elsewhere / "demo")
    write(workspace / "build/demo/CMakeCache.txt", f"CMAKE_HOME_DIRECTORY:INTERNAL={elsewhere / 'demo'}\n")
    assert not plan(workspace).problems


def test_without_inference_the_sources_are_not_read(workspace: Path) -> None:
    assert plan(workspace, infer=False).problems


def test_what_is_missing_says_where_was_looked(workspace: Path) -> None:
    (workspace / "src/demo/CMakeLists.txt").write_text("project(demo)\n")
    (workspace / "src/demo/src/filter.cpp").unlink()
    (problem,) = plan(workspace).problems
    assert "makes no executable 'filter_node'" in str(problem)


@pytest.mark.parametrize(("name", "fix"), [("filter", "correct the name"), ("filter_node", "--learn")])
def test_a_program_that_the_build_does_not_make_has_another_name(
    workspace: Path, name: str, fix: str
) -> None:
    """But not one that is installed: it may be of another build."""
    (workspace / "src/demo/CMakeLists.txt").write_text("add_executable(filter_node2 src/filter.cpp)\n")
    (problem,) = plan(workspace, LAUNCH.replace("filter_node", name), allow_missing_packages=True).problems
    assert f"makes no executable '{name}'; did you mean 'filter_node2'?" in str(problem)
    assert fix in problem.remedy and ("looked for a manifest" in str(problem)) == (name == "filter_node")


def test_what_is_easiest_to_close_is_told_first(workspace: Path) -> None:
    """Of one node the short questions first."""
    few = FILTER.replace("auto input =", "acme::attach(this); auto input =")
    many = few.replace(
        "acme::attach(this);", "acme::attach_with_more(this); acme::attach(this); acme::other(this);"
    )
    write(workspace / "src/demo/src/filter.cpp", many)
    planned = plan(workspace, '<launch><node pkg="demo" exec="filter_node" name="front"/></launch>')
    texts = [problem.text for problem in planned.problems]
    assert len(texts) == 3
    assert texts == sorted(texts, key=len)


TWO_NODES = (
    HEAD
    + """
int main(int argc, char ** argv) {
  rclcpp::init(argc, argv);
  auto inner = std::make_shared<rclcpp::Node>("inner");
  auto outer = std::make_shared<rclcpp::Node>("outer");
  std::string channel = inner->declare_parameter<std::string>("channel", "data");
  auto out = outer->create_publisher<std_msgs::msg::Bool>("/cloud/" + channel, 1);
  auto in = inner->create_publisher<std_msgs::msg::Bool>("/" + outer->declare_parameter<std::string>("back", "b"), 1);
  rclcpp::spin(inner);
}
"""
)


def test_a_node_may_take_its_names_from_parameters_of_the_first_one(tmp_path: Path) -> None:
    """The other way round the name is not known, nor one that the program sets itself."""
    folder = package(
        tmp_path / "src/demo", {"src/filter.cpp": TWO_NODES}, "add_executable(filter_node src/filter.cpp)\n"
    )
    install(tmp_path)
    launch = '<launch><node pkg="demo" exec="filter_node" {}><param name="{}" value="one"/></node></launch>'
    for given, name, others in (
        (("", "channel"), "/cloud/one", ("/cloud/data",)),
        (('name="both"', "channel"), "/cloud/one", ("/cloud/data",)),
        (("", "back"), "/cloud/data", ("/cloud/one",)),
    ):
        found = plan(tmp_path, launch.format(*given))
        assert ["parameter back of a node beside it" in each.text for each in found.problems] == [True]
        assert may(found, name)
        assert not any(may(found, other) for other in (*others, "/b", "/one"))
    of_code = TWO_NODES.replace(
        "auto out", 'inner->set_parameter(rclcpp::Parameter("channel", "x")); auto out'
    )
    write(Path(folder, "src/filter.cpp"), of_code)
    found = plan(tmp_path, launch.format("", "channel"))
    assert any("parameter channel, which the program sets" in each.text for each in found.problems)
    assert not any(may(found, name) for name in ("/cloud/one", "/cloud/data", "/cloud/x"))


DECIDES = (
    HEAD
    + """
class Demo : public rclcpp::Node {
public:
  Demo() : Node("demo") {
    if (declare_parameter("camera", true)) { pub("camera"); }
    int legs = 0;
    declare_parameter("legs", 2);
    get_parameter("legs", legs);
    for (int i = 0; i < legs; ++i) { pub("leg" + std::to_string(i)); }
    const auto mode = declare_parameter<std::string>("mode", "");
    pub(mode.size() && mode == "fast" ? "fast" : "slow");
    declare_parameter("spare", false);
    set_parameter(rclcpp::Parameter("spare", true));
    if (get_parameter("spare").as_bool()) { pub("spare"); }
  }
  void pub(std::string t) { create_publisher<std_msgs::msg::Bool>(t, 1); }
};
int main(int argc, char ** argv) {
  rclcpp::init(argc, argv);
  auto demo = std::make_shared<Demo>();
  auto beside = std::make_shared<rclcpp::Node>("beside");
  if (beside->declare_parameter("on", false)) { beside->create_publisher<std_msgs::msg::Bool>("beside", 1); }
  rclcpp::spin(demo);
}
"""
)
PARAMETERS = (
    '<param name="camera" value="false"/><param name="legs" value="3"/><param name="mode" value="fast"/>'
)


IN_A_NAMESPACE = HEAD + (
    'class Arm : public rclcpp::Node { public: Arm() : Node("n", "arm") {'
    'create_publisher<std_msgs::msg::Bool>(std::string(get_namespace()) + "/own", 1);'
    'if (std::string(get_namespace()) == "/arm") { create_publisher<std_msgs::msg::Bool>("/in_arm", 1); } } };\n'
    "int main(int argc, char ** argv) { rclcpp::init(argc, argv); rclcpp::spin(std::make_shared<Arm>()); }\n"
)


@pytest.mark.parametrize(
    ("namespace", "made", "not_made"),
    [("", ("/arm/own", "/in_arm"), "/own"), ('namespace="left"', ("/left/own",), "/in_arm")],
    ids=["of the code", "of the launch"],
)
def test_a_node_says_the_namespace_that_the_launch_or_else_the_code_gives(
    namespace: str, made: tuple[str, ...], not_made: str, tmp_path: Path
) -> None:
    package(tmp_path / "src/demo", {"src/arm.cpp": IN_A_NAMESPACE}, "add_executable(filter_node src/arm.cpp)")
    install(tmp_path)
    planned = plan(tmp_path, f'<launch><node pkg="demo" exec="filter_node" {namespace}/></launch>')
    assert all(may(planned, name) for name in made)
    assert not may(planned, not_made)


HELPERS = (
    HEAD
    + """
#include <rclcpp_components/register_node_macro.hpp>
namespace demo {
class Filter : public rclcpp::Node {
public:
  explicit Filter(const rclcpp::NodeOptions & options) : Node("filter", options) {
    auto helper_ = std::make_shared<rclcpp::Node>("helper");
    a_ = helper_->create_publisher<std_msgs::msg::Bool>("by_process", 1);
    auto alone = rclcpp::NodeOptions().use_global_arguments(false);
    auto map_ = std::make_shared<rclcpp::Node>("map", get_namespace(), alone);
    b_ = map_->create_publisher<std_msgs::msg::Bool>("by_namespace", 1);
    c_ = create_publisher<std_msgs::msg::Bool>("by_component", 1);
  }
};
}
RCLCPP_COMPONENTS_REGISTER_NODE(demo::Filter)
"""
)


def test_nodes_that_a_component_makes_for_itself_have_the_names_that_rcl_gives_them(workspace: Path) -> None:
    write(workspace / "src/demo/src/filter.cpp", HELPERS)
    planned = plan(workspace, COMPONENT.replace('namespace=""', 'namespace="cell"'))
    assert not planned.problems
    assert may(planned, "/cell/by_process")
    assert may(planned, "/rover/by_namespace")
    assert may(planned, "/rover/by_component")
    assert not any(may(planned, name) for name in ("/by_process", "/rover/by_process", "/by_namespace"))
