"""``--explain``, what nodes gain by sharing, the policy file merged over, and the launcher's own node."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from enclave_common.source_location import SourceLocation
from enclave_launch.policy import PolicyOptions, RunningNode, derive_policy
from enclave_launch.policy.derivation import allowed_names
from enclave_launch.policy.launcher import LAUNCHER_ENCLAVE, launcher_node
from enclave_launch.policy.sharing import gains_by_sharing
from enclave_launch.process import LauncherCall
from enclave_launch.report.explained import explain
from keystore import read_policy
from keystore.formats.permissions import dds_rules
from keystore.formats.policy_xml import PolicyDocument, parse_policy
from nodl.document.v1 import parse_v1
from nodl.name_template import NameTemplate, UnknownPart
from nodl.node_interface import Endpoint, EndpointKind

NodeMaker = Callable[..., RunningNode]


def test_explaining_a_topic(node: NodeMaker) -> None:
    derived = derive_policy(
        [node("pub chatter", remap=("chatter:=/talk",)), node("sub /talk", name="listener")], distro="humble"
    )
    assert explain(derived, "/talk") == [
        "name /talk in enclave /",
        "  publish /talk",
        "    node /talker: demo.nodl.xml:1: 'chatter'",
        "      remapped by chatter:=/talk at demo.launch.xml:7",
        "  subscribe /talk",
        "    node /listener: demo.nodl.xml:1: '/talk'",
    ]
    assert explain(derived, "talk") == explain(derived, "/talk")


def test_explaining_a_node_shows_built_in_rows_with_their_source(node: NodeMaker) -> None:
    derived = derive_policy([node("pub a"), node("pub b", name="other")], distro="jazzy")
    lines = explain(derived, "/talker")
    assert lines[0] == "node /talker in enclave /"
    assert "    node /talker: built-in (every node; rcl logging_rosout.c)" in lines
    assert any("since iron; rcl node_type_description_service.c" in line for line in lines)
    assert not any("/other" in line for line in lines)


def test_explaining_an_enclave_and_the_unknown(node: NodeMaker) -> None:
    derived = derive_policy([node("pub a", enclave="/e")], distro="humble")
    assert explain(derived, "/e")[0] == "enclave /e"
    assert len([line for line in explain(derived, "/e") if line.startswith("  ") and line[2] != " "]) == 9
    assert explain(derived, "/nothing") == []


def test_v1_habit_of_writing_the_node_name_for_private_names(node: NodeMaker) -> None:
    text = (
        '<interface version="1"><node name="talker" executable="talker">'
        '<topic name="/talker/state" type="x/msg/Y" role="publisher"/></node></interface>'
    )
    (manifest,) = parse_v1(text.encode(), "demo.nodl.xml")
    renamed = node(*manifest.interface.endpoints, name="mouth", namespace="/tester")
    derived = derive_policy([renamed], distro="humble")
    lines = explain(derived, "/tester/mouth/state")
    assert lines[1:] == [
        "  publish /tester/mouth/state",
        "    node /tester/mouth: demo.nodl.xml:1: '/talker/state'",
        "      /talker/state is taken as the private name ~/state",
    ]


def test_what_components_gain_by_sharing_a_container(node: NodeMaker) -> None:
    derived = derive_policy(
        [
            node(name="box", role="container"),
            node("pub secret", name="a", role="component"),
            node("sub open", name="b", role="component"),
            node("pub alone", name="c", enclave="/c"),
        ],
        distro="humble",
    )
    assert [str(gain) for gain in gains_by_sharing(derived)] == [
        "node /a shares a container and may thereby also subscribe /open",
        "node /b shares a container and may thereby also publish /secret",
        "node /box shares a container and may thereby also publish /secret, subscribe /open",
    ]


def test_nodes_that_share_by_scope_are_told_apart_from_composed_ones(node: NodeMaker) -> None:
    derived = derive_policy([node("pub a", name="a"), node("pub b", name="b")], distro="humble")
    assert [gain.composed for gain in gains_by_sharing(derived)] == [False, False]
    assert gains_by_sharing(derived, composed_only=True) == ()


# -- the policy file ------------------------------------------------------------------------------------


def document(body: str, *, enclave: str = "/", profile: str = 'ns="/" node="talker"') -> PolicyDocument:
    text = (
        f'<policy version="0.2.0"><enclaves><enclave path="{enclave}"><profiles>\n'
        f"<profile {profile}>{body}</profile></profiles></enclave></enclaves></policy>"
    )
    return parse_policy(text.encode(), "site.policy.xml")


def test_a_policy_file_adds_names_with_their_place(node: NodeMaker) -> None:
    options = PolicyOptions(policy_file=document('<topics subscribe="ALLOW"><topic>~/extra</topic></topics>'))
    derived = derive_policy([node("pub a")], distro="humble", options=options)
    assert explain(derived, "/talker/extra")[1:] == [
        "  subscribe /talker/extra",
        "    node /talker: policy file site.policy.xml:2: '~/extra'",
    ]


def test_wildcards_come_in_only_this_way_and_are_reported(node: NodeMaker) -> None:
    options = PolicyOptions(policy_file=document('<topics subscribe="ALLOW"><topic>/diag/*</topic></topics>'))
    derived = derive_policy([node("pub a")], distro="humble", options=options)
    assert "rt/diag/*" in dds_rules(derived.policy.enclaves[0]).allow.subscribe
    assert tuple(map(str, derived.warnings)) == (
        "site.policy.xml:2: enclave /: wildcard ALLOW subscribe /diag/*",
    )


def test_a_denial_takes_a_permission_away_and_says_who_will_miss_it(node: NodeMaker) -> None:
    options = PolicyOptions(policy_file=document('<topics publish="DENY"><topic>a</topic></topics>'))
    derived = derive_policy([node("pub a")], distro="humble", options=options)
    assert "rt/a" not in dds_rules(derived.policy.enclaves[0]).allow.publish
    assert str(derived.warnings[-1]) == (
        "site.policy.xml:2: publish /a is denied in enclave /, but node /talker needs publish /a (demo.nodl.xml:1)"
    )
    assert "  DENY publish /a" in explain(derived, "/a")


def test_lists_for_people_name_what_is_allowed_and_nothing_that_is_denied(node: NodeMaker) -> None:
    kinds = ("pub a", "sub b", "serve c", "call d", "action e", "goal f")
    options = PolicyOptions(policy_file=document('<topics publish="DENY"><topic>denied</topic></topics>'))
    derived = derive_policy([node(*kinds)], distro="humble", options=options)
    listed = allowed_names(derived.policy.enclaves[0])
    assert {key: [name for name in names if len(name) == 2] for key, names in listed.items()} == {
        "publish": ["/a"],
        "subscribe": ["/b"],
        "serve_services": ["/c"],
        "call_services": ["/d"],
        "serve_actions": ["/e"],
        "call_actions": ["/f"],
    }
    assert not any("/denied" in names for names in listed.values())


def test_enclaves_that_this_launch_does_not_use_are_left_out(node: NodeMaker) -> None:
    body = '<topics publish="ALLOW"><topic>x</topic></topics>'
    options = PolicyOptions(policy_file=document(body, enclave="/other"))
    derived = derive_policy([node("pub a")], distro="humble", options=options)
    assert [enclave.path for enclave in derived.policy.enclaves] == ["/"]
    assert tuple(map(str, derived.warnings)) == (
        "enclave /other of the policy file is not used by this launch and was left out",
    )


def test_a_policy_file_can_answer_for_a_name_that_nobody_knows(node: NodeMaker) -> None:
    unknown = Endpoint(
        EndpointKind.PUBLISHER,
        NameTemplate((UnknownPart("a loop"),)),
        "x/msg/Y",
        SourceLocation("talker.py", 3),
    )
    options = PolicyOptions(policy_file=document('<topics publish="ALLOW"><topic>/loop1</topic></topics>'))
    derived = derive_policy([node(unknown)], distro="humble", options=options)
    assert derived.problems == ()
    assert str(derived.warnings[0]).endswith("the policy file says what it may do")
    other = PolicyOptions(policy_file=document('<topics subscribe="ALLOW"><topic>/loop1</topic></topics>'))
    assert len(derive_policy([node(unknown)], distro="humble", options=other).problems) == 1


def test_a_policy_file_from_disk(node: NodeMaker, tmp_path: Path) -> None:
    path = tmp_path / "site.xml"
    path.write_text(
        '<policy version="0.2.0"><enclaves><enclave path="/"><profiles><profile ns="/ns" node="n">'
        '<services request="ALLOW"><service>ask</service></services>'
        "</profile></profiles></enclave></enclaves></policy>"
    )
    derived = derive_policy(
        [node("pub a")], distro="humble", options=PolicyOptions(policy_file=read_policy(path))
    )
    assert "rq/ns/askRequest" in dds_rules(derived.policy.enclaves[0]).allow.publish


# -- the launcher itself ----------------------------------------------------------------------------------


def call(service: str, type_name: str, line: int = 4) -> LauncherCall:
    return LauncherCall(service, type_name, SourceLocation("demo.launch.xml", line))


def test_the_launcher_gets_exactly_its_calls_and_what_every_rclpy_node_has() -> None:
    launcher = launcher_node(
        [
            call("/box/_container/load_node", "composition_interfaces/srv/LoadNode"),
            call("/box/_container/load_node", "composition_interfaces/srv/LoadNode"),
            call("/arm/change_state", "lifecycle_msgs/srv/ChangeState", 6),
        ]
    )
    derived = derive_policy([launcher], distro="humble")
    reasons = derived.reasons[LAUNCHER_ENCLAVE]
    declared = {
        f"{r.operation.value} {r.expression}" for r, w in reasons.items() if w[0].origin == "declared"
    }
    assert declared == {
        "request /box/_container/load_node",
        "request /arm/change_state",
        "subscribe /arm/transition_event",
    }
    assert {r.expression for r, w in reasons.items() if w[0].origin == "built-in"} == {
        *("/rosout", "/parameter_events"),
        *(
            f"/launcher/{name}"
            for name in (
                *("describe_parameters", "get_parameter_types", "get_parameters"),
                *("list_parameters", "set_parameters", "set_parameters_atomically"),
            )
        ),
    }
    assert "demo.launch.xml:6" in explain(derived, "/arm/transition_event")[2]


@pytest.mark.parametrize(
    ("service", "type_name"),
    [
        ("/arm/change_state", "my_msgs/srv/ChangeState"),
        ("/arm/other", "lifecycle_msgs/srv/ChangeState"),
        ("/arm/get_state", "lifecycle_msgs/srv/GetState"),
    ],
)
def test_only_who_asks_for_transitions_follows_them(service: str, type_name: str) -> None:
    launcher = launcher_node([call(service, type_name)])
    assert [each.kind.value for each in launcher.interface.endpoints] == ["service_client"]
    assert (launcher.role, launcher.interface.library.value) == ("launcher", "rclpy")


@pytest.mark.parametrize("service", ["/<node_name_unspecified>/change_state", "/a b/_container/load_node"])
def test_a_call_to_a_service_whose_name_is_not_known_is_a_problem(service: str) -> None:
    derived = derive_policy([launcher_node([call(service, "x/srv/Y")])], distro="humble")
    assert len(derived.problems) == 1 and str(derived.problems[0]).startswith(
        "demo.launch.xml:4: node /launcher"
    )
