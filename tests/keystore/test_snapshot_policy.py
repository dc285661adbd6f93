"""Policies that come from SROS2: snapshots of a running system, patterns of node names, Dashing and Eloquent."""

from __future__ import annotations

import pytest

from keystore import Rule
from keystore.formats.permissions import dds_rules
from keystore.formats.policy import Operation, PolicyError, Qualifier
from keystore.formats.policy_xml import PolicyDocument, parse_policy, policy_xml
from tests.keystore.test_policy_xml import GROUP, policy

PRIVATE = '<services reply="ALLOW"><service>~/get_parameters</service></services>'


def read(node: str, body: str = PRIVATE) -> PolicyDocument:
    return parse_policy(policy(body, profile=f'ns="/" node="{node}"').encode(), "p.xml")


@pytest.mark.parametrize(
    ("node", "pattern"),
    [
        ("transform_listener_impl_55d0c8a1b2c0", "transform_listener_impl_*"),
        ("rqt_gui_py_node_4711", "rqt_gui_py_node_*"),
        ("rosbridge_4711_1690000000000", "rosbridge_*"),
        ("bridge_7f3c2a9e", "bridge_*"),
    ],
)
def test_a_name_that_no_other_start_has_becomes_a_pattern_and_is_named(node: str, pattern: str) -> None:
    document = read(node)
    ((profile,),) = (enclave.profiles for enclave in document.policy.enclaves)
    assert profile.node == pattern
    assert [w for w in document.warnings if node in w and pattern in w]
    assert document.policy.wildcards() == {"/talker": (f"/{pattern}/get_parameters",)}


@pytest.mark.parametrize(
    "node", ["driver", "lidar_2", "arm_left", "camera_front", "joint_deadbeef", "robot_2026"]
)
def test_a_name_that_stays_is_left_alone(node: str) -> None:
    document = read(node)
    ((profile,),) = (enclave.profiles for enclave in document.policy.enclaves)
    assert profile.node == node and document.policy.wildcards() == {}


def test_a_number_that_may_be_a_process_id_is_only_reported() -> None:
    (warning,) = read("lidar_4711").warnings
    assert warning.endswith("lidar_4711 ends in a number; if that is a process id, write lidar_*")
    assert read("lidar_1").warnings == ()


@pytest.mark.parametrize("node", ["_ros2cli_4711", "_ros2cli_daemon_0_3f2ac81e", "launch_ros_12345"])
def test_nodes_of_tools_that_were_running_are_left_out_and_named(node: str) -> None:
    other = f'<profile ns="/" node="driver">{GROUP}</profile></profiles>'
    text = policy(PRIVATE, profile=f'ns="/" node="{node}"').replace("</profiles>", other)
    document = parse_policy(text.encode(), "p.xml")
    assert [[p.node for p in enclave.profiles] for enclave in document.policy.enclaves] == [["driver"]]
    assert [w for w in document.warnings if f"left out: {node} " in w]
    assert read(node).policy.enclaves == (), "an enclave of tools alone is none of the robot's"
    assert read(node.rpartition("_")[0] + "_*").policy.enclaves, "who writes a pattern means it"


def test_names_of_such_nodes_in_the_rules_of_others() -> None:
    services = "".join(
        f"<service>/{node}/get_parameters</service>"
        for node in ("transform_listener_impl_55d0c8a1b2c0", "_ros2cli_4711")
    )
    document = read("driver", f'<services request="ALLOW">{services}</services>')
    ((profile,),) = (enclave.profiles for enclave in document.policy.enclaves)
    wanted = "/transform_listener_impl_*/get_parameters"
    assert profile.rules == (Rule(Operation.REQUEST, Qualifier.ALLOW, wanted),)
    assert [("left out" in w, "granted is" in w) for w in document.warnings] == [(False, True), (True, False)]


def test_a_pattern_of_node_names_is_granted_as_sros2_writes_it_and_reported() -> None:
    document = read("gui_*", PRIVATE + '<topics subscribe="ALLOW"><topic>scan</topic></topics>')
    (enclave,) = document.policy.enclaves
    rules = dds_rules(enclave)
    assert rules.permits("subscribe", "rq/gui_7/get_parametersRequest")
    assert not rules.permits("subscribe", "rq/gui/get_parametersRequest")
    assert rules.permits("subscribe", "rt/scan") and not rules.permits("subscribe", "rt/scan2")
    assert document.notes == ("p.xml:1: enclave /talker: wildcard ALLOW reply /gui_*/get_parameters",)
    assert document.policy.wildcards() == {"/talker": ("/gui_*/get_parameters",)}
    assert parse_policy(policy_xml(document.policy)).policy == document.policy
    for wrong in ("gui*/x", "7_*", "{a,b}", "gui_[^a]"):
        with pytest.raises(PolicyError, match="is not a node name, nor a pattern"):
            read(wrong)


def test_a_policy_of_eloquent_gives_each_node_its_enclave() -> None:
    text = (
        f'<policy version="0.1.0"><profiles><profile ns="/arm" node="hand">{GROUP}</profile>'
        f'<profile ns="/" node="talker">{GROUP}</profile></profiles></policy>'
    )
    document = parse_policy(text.encode(), "p.xml")
    granted = {enclave.path: dds_rules(enclave) for enclave in document.policy.enclaves}
    assert set(granted) == {"/arm/hand", "/talker"}
    assert granted["/arm/hand"].permits("publish", "rt/arm/chatter")
    assert not granted["/talker"].permits("publish", "rt/arm/chatter")
    assert "each node gets the enclave of its name" in document.warnings[0]
    with pytest.raises(PolicyError, match="expected <profiles>"):
        parse_policy(text.replace("profiles>", "enclaves>").encode())
