"""Documents written of C++ nodes: an entry for each executable and component, parameters kept, gaps inside."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_launch import ResolveOptions, resolve
from nodl.document import read_document
from nodl.verb import main
from tests.addons.inference.cpp.test_in_a_launch import CMAKE, FILTER, LAUNCH, install, may
from tests.addons.inference.cpp.workspace import package, write

pytest.importorskip("tree_sitter_cpp", reason="the extra cpp is not installed")


@pytest.fixture
def sources(tmp_path: Path) -> Path:
    return package(tmp_path / "src/demo", {"src/filter.cpp": FILTER}, CMAKE)


def test_the_document_names_executable_plugin_and_parameter(sources: Path, tmp_path: Path) -> None:
    assert main(["infer", "-o", str(tmp_path / "nodl"), str(sources)]) == 0
    (file,) = (tmp_path / "nodl").iterdir()
    (node,) = read_document(file)
    assert (node.interface.executable, node.interface.plugin) == ("filter_node", "demo::Filter")
    text = file.read_text()
    assert '"scan": {name: "$(param input)"}' in text
    assert '"scan_filtered": {name: "$(param input scan)_filtered"}' in text
    assert '"~/front/ok": {each: "monitors", name: "~/$(item)/ok"}' in text


def test_a_launch_with_the_document_gives_what_live_inference_gives(sources: Path, tmp_path: Path) -> None:
    """Following our own advice freezes no default."""
    main(["infer", "-o", str(tmp_path / "nodl"), str(sources)])
    document = tmp_path / "nodl/filter_node.nodl.yaml"
    document.write_text(document.read_text().partition("    gaps:")[0] + _after_gaps(document.read_text()))
    install(tmp_path)
    write(tmp_path / "test.launch.xml", LAUNCH)
    options = ResolveOptions(prefixes=(tmp_path / "install",), manifests=(document,), infer=False)
    plan = resolve(tmp_path / "test.launch.xml", options=options)
    assert not plan.problems
    assert may(plan, "/rover/lidar")
    assert may(plan, "/safe/scan")
    assert may(plan, "/rover/front/left/ok")
    assert not may(plan, "/rover/scan")


def _after_gaps(text: str) -> str:
    """The document without its gaps: the reader has looked at them."""
    rest = text.partition("    gaps:\n")[2].splitlines(keepends=True)
    return "".join(line for line in rest if not line.startswith("      - {why:"))


def test_gaps_stand_in_the_document(sources: Path, tmp_path: Path) -> None:
    write(sources / "src/filter.cpp", FILTER.replace("auto input =", "acme::attach(this); auto input ="))
    main(["infer", "-o", str(tmp_path / "nodl"), str(sources)])
    (file,) = (tmp_path / "nodl").iterdir()
    assert "the node is handed to acme::attach()" in file.read_text()
    assert read_document(file)


def test_a_node_is_told_once_with_the_programs_that_hold_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    main_file = '#include "filter.hpp"\nint main() { demo::Filter f{rclcpp::NodeOptions()}; }\n'
    files = {
        "src/filter.hpp": FILTER.partition("RCLCPP_COMPONENTS_REGISTER")[0],
        "src/filter.cpp": '#include "filter.hpp"\nRCLCPP_COMPONENTS_REGISTER_NODE(demo::Filter)\n',
        "src/main.cpp": main_file,
    }
    folder = package(tmp_path / "demo", files, f"{CMAKE}\nadd_executable(alone src/main.cpp)")
    assert main(["infer", str(folder)]) == 0
    told = [line for line in capsys.readouterr().out.splitlines() if line.startswith("/filter")]
    assert len(told) == 1
    assert "in demo/alone, demo/filter_node, demo/demo::Filter" in told[0]


@pytest.mark.parametrize("switched_off", [True, False])
def test_the_document_says_that_a_node_has_no_parameter_services(tmp_path: Path, switched_off: bool) -> None:
    options = "rclcpp::NodeOptions()" + (
        ".start_parameter_services(false).start_parameter_event_publisher(false)" * switched_off
    )
    main_cpp = (
        "#include <rclcpp/rclcpp.hpp>\n#include <std_msgs/msg/string.hpp>\n"
        f'int main() {{ auto n = std::make_shared<rclcpp::Node>("n", {options}); '
        'auto p = n->create_publisher<std_msgs::msg::String>("a", 1); rclcpp::spin(n); }'
    )
    folder = package(tmp_path / "src/demo", {"src/main.cpp": main_cpp})
    assert main(["infer", "-o", str(tmp_path / "nodl"), str(folder)]) == 0
    (node,) = read_document(next((tmp_path / "nodl").iterdir()))
    assert node.interface.parameter_services is not switched_off
