"""Interface types as C++ names them."""

from __future__ import annotations

import pytest

from enclave_addons.inference.cpp.reading.type_names import Type, ros_type


@pytest.mark.parametrize(
    ("written", "type_name"),
    [
        ("std_msgs::msg::String", "std_msgs/msg/String"),
        ("std_msgs::msg::String_", "std_msgs/msg/String"),  # the template of the generated header
        ("std_srvs::srv::Empty", "std_srvs/srv/Empty"),
        ("demo::Talker", ""),
        ("a::b::C", ""),
    ],
)
def test_an_interface_type_is_known_by_its_middle_part(written: str, type_name: str) -> None:
    assert ros_type(Type(written)) == type_name
