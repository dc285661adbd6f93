"""What CMake left in the build folder decides conditionals and names, for the target that is started. CMake is real.

Without a build, what sources are compiled with is open.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from enclave_addons.inference import InferredSystem, infer_paths
from tests.addons.inference.cpp.workspace import gaps, in_class, names, package, write

pytest.importorskip("tree_sitter_cpp", reason="the extra cpp is not installed")

PUB = "create_publisher<std_msgs::msg::String>"


def build(source: Path) -> None:
    """Configure a package as colcon does: ``build/<package>`` beside ``src``."""
    if not (shutil.which("cmake") and shutil.which("make")):
        assert os.environ.get("CI") != "true", "apt install cmake make"
        pytest.skip("CMake is not installed")
    target = source.parents[1] / "build" / source.name
    words = ["cmake", "-G", "Unix Makefiles", "-S", str(source), "-B", str(target)]
    subprocess.run(words, check=True, capture_output=True)


def infer(folder: Path, source: str, cmake: str, *, built: bool, **more: str) -> InferredSystem:
    made = package(folder / "src/demo", {"src/main.cpp": source, **more}, cmake)
    head = "cmake_minimum_required(VERSION 3.16)\nset(CMAKE_CXX_COMPILER_WORKS 1)\n"
    write(made / "CMakeLists.txt", head + (made / "CMakeLists.txt").read_text())
    if built:
        build(made)
    return infer_paths([made])


CONDITIONAL = in_class(f"""
#ifdef WITH_CAMERA
  {PUB}("camera", 1);
#endif
#ifdef WITH_RADAR
  {PUB}("radar", 1);
#endif
  {PUB}("always", 1);
""")


RADAR = "publisher radar is made only where the build says defined(WITH_RADAR)"


def test_a_name_that_the_build_gives(tmp_path: Path) -> None:
    cmake = 'add_executable(node src/main.cpp)\ntarget_compile_definitions(node PRIVATE TOPIC="front/scan")'
    built = infer(tmp_path, in_class(f"{PUB}(TOPIC, 1);"), cmake, built=True)
    assert (names(built), gaps(built)) == (["front/scan"], [])


def test_each_target_has_its_own_definitions(tmp_path: Path) -> None:
    """One file, two programs: neither is taken for the other."""
    cmake = """add_executable(front src/main.cpp)
target_compile_definitions(front PRIVATE "TOPIC=\\"front\\"")
add_executable(rear src/main.cpp)
target_compile_definitions(rear PRIVATE "TOPIC=\\"rear\\"")"""
    system = infer(tmp_path, in_class(f"{PUB}(TOPIC, 1);"), cmake, built=True)
    assert gaps(system) == []
    assert {node.executable: [str(e.name) for e in node.endpoints] for node in system.nodes} == {
        "front": ["front"], "rear": ["rear"],
    }  # fmt: skip


LIBRARY = """#include <rclcpp/rclcpp.hpp>
void attach(rclcpp::Node * node) {
#ifdef DEBUG_TOPICS
  node->create_publisher<std_msgs::msg::String>("debug", 1);
#endif
}
"""
LINKED = """add_library(attached SHARED src/attach.cpp)
add_executable(node src/main.cpp)
target_link_libraries(node attached)
"""


def test_what_one_file_alone_is_compiled_with_leaves_the_rest_open(tmp_path: Path) -> None:
    cmake = (
        "add_executable(node src/main.cpp)\n"
        "set_source_files_properties(src/main.cpp PROPERTIES COMPILE_DEFINITIONS WITH_RADAR)"
    )
    system = infer(tmp_path, CONDITIONAL, cmake, built=True)
    assert (RADAR in gaps(system)) != ("radar" in names(system))


# --- without a build ------------------------------------------------------------------------------------------------

EITHER = in_class(f"""
#ifdef SIM
  {PUB}("simulated", 1);
#else
  {PUB}("real", 1);
#endif
""")
