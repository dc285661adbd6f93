"""DDS names and what a ROS node means by them, in both directions."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from enclave_addons.observation.graph.wire_names import Part, part_of
from nodl.node_interface import EndpointKind as Kind

NAMES = st.lists(st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,6}", fullmatch=True), min_size=1, max_size=4).map(
    lambda tokens: "/" + "/".join(tokens)
)
CASES = [
    ("rt/chatter", "s::msg::dds_::String_", True, Part(Kind.PUBLISHER, "/chatter", "topic", "s/msg/String")),
    ("rt/a/b", "a::msg::dds_::C_", False, Part(Kind.SUBSCRIPTION, "/a/b", "topic", "a/msg/C")),
    # a topic that is called as half of a service is
    ("rt/fooRequest", "a::msg::dds_::C_", True, Part(Kind.PUBLISHER, "/fooRequest", "topic", "a/msg/C")),
    ("rq/xRequest", "a::srv::dds_::S_Request_", False, Part(Kind.SERVICE_SERVER, "/x", "request", "a/srv/S")),
    ("rr/xReply", "a::srv::dds_::S_Response_", True, Part(Kind.SERVICE_SERVER, "/x", "reply", "a/srv/S")),
    ("rq/xRequest", "a::srv::dds_::S_Request_", True, Part(Kind.SERVICE_CLIENT, "/x", "request", "a/srv/S")),
    # exactly one suffix is cut
    ("rq/yRequestRequest", "a::srv::dds_::S_Request_", True, Part(Kind.SERVICE_CLIENT, "/yRequest", "request", "a/srv/S")),  # noqa: E501
    (
        "rq/n/_action/send_goalRequest",
        "a::action::dds_::A_SendGoal_Request_",
        False,
        Part(Kind.ACTION_SERVER, "/n", "send_goal request", "a/action/A"),
    ),
    # the types of these two are the same for every action, so they tell nothing
    (
        "rq/n/_action/cancel_goalRequest",
        "action_msgs::srv::dds_::CancelGoal_Request_",
        True,
        Part(Kind.ACTION_CLIENT, "/n", "cancel_goal request", ""),
    ),
    ("rt/n/_action/status", "a::msg::dds_::GoalStatusArray_", True, Part(Kind.ACTION_SERVER, "/n", "status", "")),
]  # fmt: skip
NOT_ROS = [
    "ros_discovery_info",
    "DCPSParticipant",
    "chatter",
    "rq/xReply",
    "rr/xRequest",
    "rq/x",
    "rqx/xRequest",
    "rt",
    "rt/",
    "rt/a//b",
    "rt/1a",
    "rt/a b",
    "rq/Request",
]


@pytest.mark.parametrize(("topic", "type_name", "writes", "part"), CASES, ids=[case[0] for case in CASES])
def test_a_dds_endpoint_is_a_part_of_a_ros_endpoint(
    topic: str, type_name: str, writes: bool, part: Part
) -> None:
    assert part_of(topic, type_name, writes=writes) == part


@pytest.mark.parametrize("topic", NOT_ROS)
def test_what_lacks_prefix_suffix_or_name_is_not_ros(topic: str) -> None:
    assert part_of(topic, "a::msg::dds_::C_", writes=True) is None


def test_a_type_that_rosidl_did_not_name_stays_as_it_is() -> None:
    part = part_of("rt/x", "HelloWorld", writes=True)
    assert part is not None and part.type == "HelloWorld"


@given(NAMES, st.booleans())
def test_whatever_a_service_is_called_both_halves_give_its_name(name: str, serves: bool) -> None:
    request = part_of(f"rq{name}Request", "a::srv::dds_::S_Request_", writes=not serves)
    reply = part_of(f"rr{name}Reply", "a::srv::dds_::S_Response_", writes=serves)
    assert request is not None and reply is not None
    assert (request.kind, request.name, request.type) == (reply.kind, reply.name, reply.type)
    assert request.name == name


@given(st.text(max_size=60), st.text(max_size=60), st.booleans())
def test_no_text_breaks_it(topic: str, type_name: str, writes: bool) -> None:
    part_of(topic, type_name, writes=writes)
