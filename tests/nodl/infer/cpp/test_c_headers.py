"""What a header of C defines is made without a gap; a class that nobody knows is one."""

from __future__ import annotations

from pathlib import Path

import pytest

from nodl.infer.cpp.reading.known_headers import is_of_c
from tests.nodl.infer.cpp.workspace import gaps, in_class, infer

pytest.importorskip("tree_sitter_cpp", reason="the extra cpp is not installed")

OF_C = [
    ("linux/videodev2.h", "v4l2_fmtdesc"),
    ("time.h", "time_t"),
    ("ctime", "tm"),
    ("SDL.h", "SDL_Event"),
    ("SDL2/SDL_joystick.h", "SDL_Joystick"),
    ("linux/joystick.h", "js_event"),
    ("linux/can/raw.h", "can_frame"),
    ("termios.h", "termios"),
    ("netinet/in.h", "sockaddr_in"),
    ("libusb-1.0/libusb.h", "libusb_device_handle"),
    ("dirent.h", "DIR"),
]


@pytest.mark.parametrize(("header", "name"), OF_C)
def test_a_structure_of_a_header_of_c_is_no_gap(tmp_path: Path, header: str, name: str) -> None:
    source = f"#include <{header}>\n" + in_class(f"auto * made = new {name}(); use(made);")
    assert gaps(infer(tmp_path, source)) == []


@pytest.mark.parametrize(
    ("header", "name"),
    [
        ("vector", "v4l2_fmtdesc"),  # the header is not included
        ("linux/videodev2.h", "Camera"),  # it does not define this
        ("vendor/SDL_node.hpp", "SDL_Node"),  # a header of C++
        ("time.h", "mytime::time_t"),
        ("unistd.h", "robot_t"),
        ("linux/serial.h", "serial_node"),
    ],
)
def test_what_may_be_of_somebody_else_stays_a_gap(tmp_path: Path, header: str, name: str) -> None:
    assert not is_of_c(name, [header])
    source = f"#include <{header}>\n" + in_class(f"auto * made = new {name}(this); use(made);")
    assert any(name.rpartition("::")[2] in why for why in gaps(infer(tmp_path, source)))


def test_a_class_of_the_workspace_under_the_name_of_a_structure_is_followed(tmp_path: Path) -> None:
    makes = 'n->create_publisher<std_msgs::msg::String>("a", 1);'
    own = f"struct v4l2_node {{ explicit v4l2_node(rclcpp::Node * n) {{ {makes} }} }};"
    system = infer(tmp_path, "#include <linux/videodev2.h>\n" + in_class("new v4l2_node(this);", before=own))
    assert [endpoint.name.text for node in system.nodes for endpoint in node.endpoints] == ["a"]


def test_a_node_that_goes_to_a_structure_of_c_is_told_all_the_same(tmp_path: Path) -> None:
    source = "#include <SDL.h>\n" + in_class("auto * held = new SDL_Holder(this); use(held);")
    assert any("handed to" in why for why in gaps(infer(tmp_path, source)))
