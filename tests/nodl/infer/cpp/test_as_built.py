"""What CMake left in the build folder decides conditionals and names, for the target that is started. CMake is real.

Without a build, what CMake's files define under a condition is open.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from nodl.infer import InferredSystem, infer_paths
from tests.nodl.infer.cpp.workspace import gaps, in_class, names, package, write

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


def test_what_the_build_does_not_define_is_not_made(tmp_path: Path) -> None:
    cmake = """option(RADAR "" OFF)
add_compile_definitions(WITH_CAMERA)
add_executable(node src/main.cpp)
if(RADAR)
  target_compile_definitions(node PRIVATE WITH_RADAR)
endif()"""
    built = infer(tmp_path / "built", CONDITIONAL, cmake, built=True)
    assert (names(built), gaps(built)) == (["always", "camera"], [])
    assert RADAR in gaps(infer(tmp_path / "unbuilt", CONDITIONAL, cmake, built=False))


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


def test_what_only_the_library_defines_is_not_taken_for_undefined(tmp_path: Path) -> None:
    main = in_class("attach(this);", before="void attach(rclcpp::Node * node);")
    library = {"src/attach.cpp": LIBRARY}
    with_it = LINKED + "target_compile_definitions(attached PRIVATE DEBUG_TOPICS)"
    (why,) = gaps(infer(tmp_path / "with", main, with_it, built=True, **library))
    assert why == "publisher debug is made only where the build says defined(DEBUG_TOPICS)"
    without = infer(tmp_path / "without", main, LINKED, built=True, **library)
    assert (names(without), gaps(without)) == ([], [])


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
CERTAIN = {
    "of the target": "add_executable(node src/main.cpp)\ntarget_compile_definitions(node PRIVATE SIM)",
    "of all targets": "add_definitions(-DSIM)\nadd_executable(node src/main.cpp)",
    "in a variable": "set(D SIM)\nadd_executable(node src/main.cpp)\ntarget_compile_definitions(node PRIVATE ${D})",
    "on Linux": "if(UNIX)\nadd_definitions(-DSIM)\nendif()\nadd_executable(node src/main.cpp)",
}
OPEN = {
    "an option": 'option(SIM "" OFF)\nif(SIM)\nadd_definitions(-DSIM)\nendif()\nadd_executable(node src/main.cpp)',
    "of the target": "add_executable(node src/main.cpp)\n"
    "if(SIM)\ntarget_compile_definitions(node PRIVATE SIM)\nendif()",
    "a variable under a condition": "if(SIM)\nset(D SIM)\nendif()\nadd_executable(node src/main.cpp)\n"
    "target_compile_definitions(node PRIVATE ${D})",
    "a list under a condition": "set(D OTHER)\nif(SIM)\nlist(APPEND D SIM)\nendif()\n"
    "add_executable(node src/main.cpp)\ntarget_compile_definitions(node PRIVATE ${D})",
    "a function under a condition": "function(define what)\nadd_definitions(-D${what})\nendfunction()\n"
    "if(SIM)\ndefine(SIM)\nendif()\nadd_executable(node src/main.cpp)",
    "a generator expression": "add_executable(node src/main.cpp)\n"
    "target_compile_definitions(node PRIVATE $<$<CONFIG:Debug>:SIM>)",
    "taken back": "add_definitions(-DSIM)\nremove_definitions(-DSIM)\nadd_executable(node src/main.cpp)",
    "only of another target": "add_library(attached SHARED src/attach.cpp)\nadd_executable(node src/main.cpp)\n"
    "target_link_libraries(node attached)\ntarget_compile_definitions(attached PRIVATE SIM)",
}


@pytest.mark.parametrize("cmake", CERTAIN.values(), ids=CERTAIN)
def test_what_cmake_certainly_defines_decides(tmp_path: Path, cmake: str) -> None:
    system = infer(tmp_path, EITHER, cmake, built=False)
    assert (names(system), gaps(system)) == (["simulated"], [])


@pytest.mark.parametrize("cmake", OPEN.values(), ids=OPEN)
def test_what_cmake_defines_under_a_condition_is_open(tmp_path: Path, cmake: str) -> None:
    system = infer(tmp_path, EITHER, cmake, built=False, **{"src/attach.cpp": "int attached() { return 1; }"})
    assert any("else of defined(SIM)" in why for why in gaps(system))


def test_a_value_that_two_conditions_give_is_open(tmp_path: Path) -> None:
    cmake = """if(SIM)
  add_definitions(-DTOPIC="simulated")
else()
  add_definitions(-DTOPIC="real")
endif()
add_executable(node src/main.cpp)"""
    assert names(infer(tmp_path, in_class(f"{PUB}(TOPIC, 1);"), cmake, built=False)) == ["?"]
