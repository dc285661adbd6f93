"""Recorded endpoints told apart by who made them, and names as their sources mean them."""

from __future__ import annotations

import pytest

from enclave_addons.recording.record.lines import EndpointMade
from enclave_addons.recording.record.requested import EndpointRole, role_of
from enclave_addons.recording.record.written import meant_name, private_name
from nodl.node_interface import EndpointKind
from nodl.remap import RemapRules, parse_rule

P, S, R, C = (
    EndpointKind.PUBLISHER,
    EndpointKind.SUBSCRIPTION,
    EndpointKind.SERVICE_SERVER,
    EndpointKind.SERVICE_CLIENT,
)
A = EndpointKind.ACTION_SERVER
CPP, PY = "librclcpp.so", "_rclpy_pybind11.cpython-312-x86_64-linux-gnu.so"
EVENT = "rcl_interfaces/msg/ParameterEvent"


def made(kind: EndpointKind, written: str, by: str, type_name: str = "", final: str = "") -> EndpointMade:
    return EndpointMade(kind, 1, 1, 0, 1, 0, written, "/a/me", final or written, type_name, by)


@pytest.mark.parametrize(
    ("endpoint", "role"),
    [
        (made(P, "/rosout", "librcl.so"), EndpointRole.BUILT_IN),
        (made(R, "/a/me/get_type_description", "librcl.so"), EndpointRole.BUILT_IN),
        (made(P, "/a/do/_service_event", "librcl.so"), EndpointRole.INTROSPECTION),
        (made(P, "/rosout", CPP), EndpointRole.OWN),
        (made(R, "~/change_state", "librcl_lifecycle.so"), EndpointRole.LIFECYCLE),
        (made(C, "other/change_state", CPP), EndpointRole.OWN),
        (made(R, "fib/_action/send_goal", "librcl_action.so"), EndpointRole.PART_OF_ACTION),
        (made(A, "fib", "librcl_action.so"), EndpointRole.REPEATED),
        (made(A, "fib", PY), EndpointRole.OWN),
        (made(R, "me/get_parameters", CPP, "rcl_interfaces/srv/GetParameters"), EndpointRole.BUILT_IN),
        (made(R, "/a/me/get_parameters", CPP, "rcl_interfaces/srv/GetParameters"), EndpointRole.BUILT_IN),
        (made(R, "you/get_parameters", CPP, "rcl_interfaces/srv/GetParameters"), EndpointRole.OWN),
        (made(R, "me/get_parameters", CPP, "my_msgs/srv/GetParameters"), EndpointRole.OWN),
        (made(C, "you/get_parameters", CPP, "rcl_interfaces/srv/GetParameters"), EndpointRole.OWN),
        (
            made(R, "me/get_logger_levels", CPP, "rcl_interfaces/srv/GetLoggerLevels"),
            EndpointRole.LOGGER_SERVICE,
        ),
        (made(R, "~/_container/load_node", CPP), EndpointRole.CONTAINER),
        (made(P, "/parameter_events", PY, EVENT), EndpointRole.BUILT_IN),
        (made(S, "/parameter_events", CPP, EVENT), EndpointRole.BUILT_IN),
        (made(S, "/parameter_events", PY, EVENT), EndpointRole.OWN),
        (made(P, "/statistics", CPP, "statistics_msgs/msg/MetricsMessage"), EndpointRole.OWN),
    ],
)
def test_who_made_an_endpoint_decides_what_it_is(endpoint: EndpointMade, role: EndpointRole) -> None:
    assert role_of(endpoint) is role


@pytest.mark.parametrize(
    ("written", "name"),
    [
        ("chatter", "chatter"),
        ("/chatter", "/chatter"),
        ("~/x", "~/x"),
        ("me/map", "~/map"),  # get_name() + "/map"
        ("/a/me/map", "~/map"),  # get_fully_qualified_name() + "/map"
        ("menu/map", "menu/map"),
        ("a/me/map", "a/me/map"),
        ("{node}/sub", "~/sub"),
        ("{ns}/x", "x"),
        ("{namespace}/x", "x"),
        ("me", "me"),
    ],
)
def test_a_name_made_from_the_nodes_own_is_private(written: str, name: str) -> None:
    assert private_name(written, "/a/me") == name


def rules(*texts: str) -> RemapRules:
    return RemapRules(process=tuple(parse_rule(text) for text in texts))


def test_what_the_launch_remaps_stays_as_the_source_writes_it() -> None:
    meant = meant_name(P, "chatter", "/a/gossip", "/a/me", rules("chatter:=gossip"))
    assert (meant.name, meant.moved) == ("chatter", False)


def test_what_the_program_remaps_itself_is_held_as_the_final_name() -> None:
    meant = meant_name(P, "chatter", "/code/chatter", "/a/me", rules())
    assert (meant.name, meant.moved) == ("/code/chatter", True)


@pytest.mark.parametrize("final", ["/a/fib", "/moved"])
def test_an_action_may_have_been_remapped_or_not(final: str) -> None:
    """rcl does it since kilted."""
    assert not meant_name(A, "fib", final, "/a/me", rules("fib:=/moved")).moved
