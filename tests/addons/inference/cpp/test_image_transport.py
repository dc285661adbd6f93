"""image_transport takes the final name of an image and puts transports below it, the camera's settings beside it."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_launch import LaunchPlan, ResolveOptions, resolve
from nodl.verb import main
from tests.addons.inference.cpp.test_in_a_launch import install, may, plan
from tests.addons.inference.cpp.workspace import gaps, in_class, infer, names, package, write

pytest.importorskip("tree_sitter_cpp", reason="the extra cpp is not installed")

SOURCE = in_class(
    """
    in_ = image_transport::create_camera_subscription(this, "image_raw", [](const auto &, const auto &) {}, "raw");
    out_ = image_transport::create_publisher(this, "image_rect");
    """,
    before="#include <image_transport/image_transport.hpp>\n",
)
LAUNCH = """
<launch>
  <node pkg="demo" exec="filter_node" name="rectify">
    {parameter}
    <remap from="image_raw" to="/front/image"/>
    <remap from="image_rect" to="/front/rect"/>
  </node>
</launch>
"""
COMPRESSED = '<param name="image_transport" value="compressed"/>'


def live(workspace: Path, parameter: str, source: str = SOURCE) -> LaunchPlan:
    package(workspace / "src/demo", {"src/main.cpp": source}, "add_executable(filter_node src/main.cpp)")
    install(workspace)
    return plan(workspace, LAUNCH.format(parameter=parameter))


def documented(workspace: Path, parameter: str) -> LaunchPlan:
    folder = package(
        workspace / "src/demo", {"src/main.cpp": SOURCE}, "add_executable(filter_node src/main.cpp)"
    )
    main(["infer", "-o", str(workspace / "nodl"), str(folder)])
    install(workspace)
    write(workspace / "test.launch.xml", LAUNCH.format(parameter=parameter))
    document = workspace / "nodl/filter_node.nodl.yaml"
    options = ResolveOptions(prefixes=(workspace / "install",), manifests=(document,), infer=False)
    return resolve(workspace / "test.launch.xml", options=options)


@pytest.mark.parametrize("way", [live, documented])
def test_transports_and_settings_follow_the_remapped_image(way, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    planned = way(tmp_path, "")
    assert not planned.problems
    assert may(planned, "/front/image")
    assert may(planned, "/front/camera_info")
    assert may(planned, "/front/rect/compressed")
    assert not may(planned, "/image_rect/compressed")
    assert not may(planned, "/camera_info")
    assert not may(planned, "/front/image/compressed")


def test_a_transport_that_nothing_tells_is_a_gap(tmp_path: Path) -> None:
    source = SOURCE.replace('"raw"', 'std::string(std::getenv("T"))')
    assert any("transport of this image subscription" in why for why in gaps(infer(tmp_path, source)))


HINTED = SOURCE.replace('"raw"', "image_transport::TransportHints(this).getTransport()")
DECLARED = HINTED.replace("in_ =", 'declare_parameter<std::string>("image_transport", "raw");\n in_ =', 1)
OTHERWISE_NAMED = HINTED.replace("(this)", '(this, "compressed", "t")')
BY_AN_OBJECT = SOURCE.replace(
    "in_ = image_transport::create_camera_subscription(this,",
    "image_transport::ImageTransport it(shared_from_this()); in_ = it.subscribeCamera(",
).replace(', "raw"', "")


@pytest.mark.parametrize(
    ("source", "parameter", "plain", "compressed"),
    [
        (HINTED, "", True, False),
        (DECLARED, "", True, False),
        (DECLARED, COMPRESSED, False, True),
        (HINTED, COMPRESSED, True, True),  # it counts only where the node's options declare what launch sets
        (OTHERWISE_NAMED, "", False, True),
        (OTHERWISE_NAMED, COMPRESSED, False, True),
        (BY_AN_OBJECT, "", True, False),
        (BY_AN_OBJECT, COMPRESSED, True, True),
    ],
)
def test_the_parameter_of_transport_hints_decides(
    tmp_path: Path, source: str, parameter: str, plain: bool, compressed: bool
) -> None:
    planned = live(tmp_path, parameter, source)
    assert not planned.problems
    assert may(planned, "/front/image") == plain
    assert may(planned, "/front/image/compressed") == compressed


def test_a_transport_whose_type_is_not_known_is_a_gap(tmp_path: Path) -> None:
    assert live(tmp_path, COMPRESSED.replace("compressed", "draco"), DECLARED).problems


def test_without_a_launch_the_parameter_of_transport_hints_is_a_gap(tmp_path: Path) -> None:
    found = infer(tmp_path, HINTED)
    assert "image_raw" in names(found)
    assert any("depends on parameter image_transport" in why for why in gaps(found))


def test_a_resolved_name_is_the_name_as_launch_makes_it(tmp_path: Path) -> None:
    body = 'create_publisher<std_msgs::msg::String>(get_node_topics_interface()->resolve_topic_name("a"), 1);'
    assert names(infer(tmp_path, in_class(body))) == ["a"]


def test_the_topic_beside_an_image_is_open_and_leaves_the_image_as_it_is(tmp_path: Path) -> None:
    body = """std::string image = "cam/image"; std::string info = image_transport::getCameraInfoTopic(image);
    create_publisher<std_msgs::msg::String>(image, 1); create_publisher<std_msgs::msg::String>(info, 1);"""
    assert names(infer(tmp_path, in_class(body))) == ["?", "cam/image"]


@pytest.mark.parametrize(
    "interfaces",
    ["rclcpp::node_interfaces::NodeInterfaces<TopicsInterface>", "image_transport::RequiredInterfaces"],
)
def test_interfaces_of_a_node_stand_for_it(tmp_path: Path, interfaces: str) -> None:
    made = f"""image_transport::create_subscription({interfaces}{{*this}}, "a", f, "raw");
    {interfaces} these(*this); rclcpp::create_publisher<std_msgs::msg::String>(these, "b", 1);"""
    found = infer(tmp_path, in_class(made))
    assert (names(found), gaps(found)) == (["a", "b"], [])
    of_an_unknown_node = infer(tmp_path / "unknown", in_class(made.replace("*this", "of_another")))
    assert gaps(of_an_unknown_node)


@pytest.mark.parametrize(
    "made",
    [
        'p_ = std::make_shared<image_transport::CameraPublisher>(image_transport::create_camera_publisher(this, "a"));',
        'image_transport::CameraPublisher p(this, "a");',
    ],
)
def test_a_publisher_that_is_copied_or_made_by_its_class(tmp_path: Path, made: str) -> None:
    found = infer(tmp_path, in_class(made, before="#include <image_transport/image_transport.hpp>\n"))
    assert names(found) == ["a", "a/compressed", "a/compressedDepth", "a/theora", "camera_info"]
    assert gaps(found) == []


def test_nothing_is_made_under_an_empty_name(tmp_path: Path) -> None:
    body = (
        'std::string t; if (now().seconds() > 1) { t = "a"; } create_publisher<std_msgs::msg::String>(t, 1);'
    )
    assert names(infer(tmp_path, in_class(body))) == ["a"]


def test_an_empty_name_alone_is_a_gap(tmp_path: Path) -> None:
    assert any("empty" in why for why in gaps(infer(tmp_path, in_class('create_publisher<M>("", 1);'))))
