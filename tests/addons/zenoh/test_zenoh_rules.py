"""Zenoh's side of a policy: key expressions, rules, router and session files (rmw_zenoh docs/design.md)."""

from __future__ import annotations

import json

import pytest

from enclave_addons.zenoh.configuration import (
    Subject,
    TlsFiles,
    router_configuration,
    session_configuration,
)
from enclave_addons.zenoh.denials import meaning
from enclave_addons.zenoh.grants import (
    Grants,
    Types,
    Use,
    grants_of_policy,
)
from enclave_addons.zenoh.key_expressions import (
    NotExpressible,
    cache,
    data_keys,
    history,
    mangled,
    name_expressions,
    type_chunk,
)
from enclave_addons.zenoh.rules import AccessRule, access_rules
from enclave_addons.zenoh.types import types_of_interface, united_types
from keystore import Domains, EnclavePolicy, Operation, Profile, Qualifier, Rule

STRING = "std_msgs::msg::dds_::String_"
FILES = TlsFiles("/ks/public/identity_ca.cert.pem", "/ks/x/cert.pem", "/ks/x/key.pem")


def policy(*rules: tuple[str, str] | tuple[str, str, str]) -> EnclavePolicy:
    made = [Rule(Operation(one[0]), Qualifier(one[2] if len(one) == 3 else "ALLOW"), one[1]) for one in rules]
    return EnclavePolicy("/talker", (Profile("/", "talker", tuple(made)),))


def rules(
    *given: tuple[str, str] | tuple[str, str, str], domain: str = "0", types: Types | None = None
) -> dict[str, AccessRule]:
    grants = grants_of_policy(policy(*given), types or {})
    return {rule.name: rule for rule in access_rules("/talker", grants, Domains.parse(domain))}


def test_a_topic_has_its_name_unmangled_and_two_chunks_for_type_and_hash() -> None:
    assert list(data_keys(["0"], "/robot1/chatter", [])) == ["0/robot1/chatter/*/*"]
    assert list(data_keys(["2"], "/chatter", [STRING])) == [f"2/chatter/{STRING}/*"]


def test_types_are_those_of_dds_and_the_hash_stays_open() -> None:
    assert type_chunk("std_msgs/msg/String") == STRING
    assert type_chunk("example_interfaces/srv/AddTwoInts") == "example_interfaces::srv::dds_::AddTwoInts_"
    for unknown in ("", "String", "std_msgs/String", "std_msgs/msg/*", "std_msgs/msg/String/x"):
        assert type_chunk(unknown) is None


@pytest.mark.parametrize(
    ("pattern", "expressions"),
    [
        ("/a/*", ["a/*/**"]),
        ("/*", ["*/**"]),
        ("/cam*", ["cam$*/**"]),
        ("/*/status", ["*/**/status"]),
        ("/a/*/*/b", ["a/*/*/**/b"]),
        ("/a*b", ["a$*/**/$*b", "a$*b"]),
        ("/a/*b", ["a/$*b", "a/*/**/$*b"]),
    ],
)
def test_a_wildcard_of_a_policy_crosses_slashes_and_its_key_expression_does_too(
    pattern: str, expressions: list[str]
) -> None:
    assert sorted(name_expressions(pattern)) == sorted(expressions)


def test_everything_below_a_name_is_written_as_zenoh_wants_it() -> None:
    assert list(data_keys(["0"], "/a/*", [])) == ["0/a/*/*/*/**"]
    assert list(data_keys(["0"], "/a/*", [STRING])) == [f"0/a/*/**/{STRING}/*"]


@pytest.mark.parametrize("pattern", ["/cam?", "/cam[12]", "/a*b*c*d*e"])
def test_what_no_key_expression_says_exactly_is_refused_and_never_widened(pattern: str) -> None:
    with pytest.raises(NotExpressible):
        name_expressions(pattern)
    grants = grants_of_policy(policy(("publish", pattern), ("publish", "/chatter")))
    assert grants.of(Use.PUBLISH) == ("/chatter",) and "publish" in grants.gaps[0]


def test_a_denied_name_is_taken_out_and_a_wildcard_that_holds_it_is_not_granted_at_all() -> None:
    plain = grants_of_policy(
        policy(("publish", "/a"), ("publish", "/secret"), ("publish", "/secret", "DENY"))
    )
    assert plain.of(Use.PUBLISH) == ("/a",) and not plain.gaps
    wide = grants_of_policy(policy(("publish", "/*"), ("publish", "/secret", "DENY"), ("subscribe", "/*")))
    assert wide.of(Use.PUBLISH) == () and "denials do not hold on Zenoh" in wide.gaps[0]
    assert wide.of(Use.SUBSCRIBE) == ("/*",)


def test_the_rules_of_a_publisher() -> None:
    found = rules(("publish", "/chatter"), types={(Use.PUBLISH, "/chatter"): (STRING,)})
    key = f"0/chatter/{STRING}/*"
    assert [tuple(rule) for rule in found.values()] == [
        ("publish", "ingress", ("put", "reply"), (key,)),
        ("learn of subscriptions", "egress", ("declare_subscriber",), (key,)),
        ("offer history", "ingress", ("put", "declare_queryable", "liveliness_token"), (cache(key),)),
        ("be asked for history", "egress", ("query", "declare_subscriber"), (history(key),)),
        (
            "be seen", "ingress", ("liveliness_token",),
            ("@ros2_lv/0/*/*/*/NN/%talker/*/*", f"@ros2_lv/0/*/*/*/MP/%talker/*/*/%chatter/{STRING}/*/*"),
        ),
        ("look at the graph", "ingress", ("liveliness_query", "declare_liveliness_subscriber"), ("@ros2_lv/0/**",)),
        ("see the graph", "egress", ("liveliness_token",), ("@ros2_lv/0/**",)),
    ]  # fmt: skip


def test_the_rules_of_a_subscription() -> None:
    found, key = rules(("subscribe", "/chatter")), "0/chatter/*/*"
    assert (found["subscribe"].messages, found["subscribe"].keys) == (("declare_subscriber",), (key,))
    assert (found["receive"].flow, found["receive"].messages) == ("egress", ("put", "reply"))
    assert found["ask for history"].keys == ("0/chatter/*/*/@adv/**",)
    assert found["learn of history"].keys == ("0/chatter/*/*/@adv/pub/**",)
    assert "publish" not in found


def test_the_rules_of_a_client_and_of_a_server() -> None:
    client, server = rules(("request", "/add")), rules(("reply", "/add"))
    assert client["call"][1:] == ("ingress", ("query",), ("0/add/*/*",))
    assert client["be answered"][1:] == ("egress", ("reply", "declare_queryable"), ("0/add/*/*",))
    assert server["serve"][1:] == ("ingress", ("declare_queryable", "reply"), ("0/add/*/*",))
    assert server["be called"][1:] == ("egress", ("query",), ("0/add/*/*",))
    assert not set(client) & {"serve", "be called"} and not set(server) & {"call", "be answered"}
    assert "@ros2_lv/0/*/*/*/SC/%talker/*/*/%add/*/*/*" in client["be seen"].keys
    assert "@ros2_lv/0/*/*/*/SS/%talker/*/*/%add/*/*/*" in server["be seen"].keys


@pytest.mark.parametrize(
    ("operation", "service", "topic"),
    [("call", Use.CALL, Use.SUBSCRIBE), ("execute", Use.SERVE, Use.PUBLISH)],
)
def test_an_action_is_three_services_and_two_topics(operation: str, service: Use, topic: Use) -> None:
    grants = grants_of_policy(policy((operation, "/fib")))
    parts = ("cancel_goal", "get_result", "send_goal")
    assert grants.of(service) == tuple(f"/fib/_action/{part}" for part in parts)
    assert grants.of(topic) == ("/fib/_action/feedback", "/fib/_action/status")
    others = set(Use) - {service, topic}
    assert not any(grants.of(use) for use in others)


def test_the_types_of_an_action_are_those_that_rosidl_makes() -> None:
    known = united_types(types_of_interface(Operation.EXECUTE, "/fib", "test_msgs/action/Fibonacci"))
    assert known == {
        (Use.PUBLISH, "/fib/_action/feedback"): ("test_msgs::action::dds_::Fibonacci_FeedbackMessage_",),
        (Use.PUBLISH, "/fib/_action/status"): ("action_msgs::msg::dds_::GoalStatusArray_",),
        (Use.SERVE, "/fib/_action/cancel_goal"): ("action_msgs::srv::dds_::CancelGoal_",),
        (Use.SERVE, "/fib/_action/get_result"): ("test_msgs::action::dds_::Fibonacci_GetResult_",),
        (Use.SERVE, "/fib/_action/send_goal"): ("test_msgs::action::dds_::Fibonacci_SendGoal_",),
    }


def test_a_name_with_one_unknown_type_may_have_any() -> None:
    both = [
        *types_of_interface(Operation.PUBLISH, "/a", "std_msgs/msg/String"),
        *types_of_interface(Operation.PUBLISH, "/b", "std_msgs/msg/String"),
        *types_of_interface(Operation.PUBLISH, "/b", ""),
    ]
    assert united_types(both) == {(Use.PUBLISH, "/a"): (STRING,)}


def test_each_domain_has_keys_of_its_own_and_all_of_them_one() -> None:
    found = rules(("publish", "/chatter"), domain="0,2-3")
    assert found["publish"].keys == ("0/chatter/*/*", "2/chatter/*/*", "3/chatter/*/*")
    assert found["look at the graph"].keys == ("@ros2_lv/0/**", "@ros2_lv/2/**", "@ros2_lv/3/**")
    assert rules(("publish", "/chatter"), domain="all")["publish"].keys == ("*/chatter/*/*",)


def test_enclave_and_name_are_one_chunk_of_a_token() -> None:
    assert mangled("/front/camera") == "%front%camera" and mangled("/") == "%"
    below = rules(("publish", "/cam/*"))["be seen"].keys
    assert "@ros2_lv/0/*/*/*/MP/%talker/*/*/%cam%$*/*/*/*" in below


def test_an_enclave_without_grants_has_no_rules() -> None:
    assert access_rules("/idle", Grants({}), Domains.single(0)) == ()


def router(*subjects: Subject) -> dict[str, object]:
    text = router_configuration(["tls/localhost:7447"], FILES, subjects, {})
    found: dict[str, object] = json.loads(text)
    return found


def test_the_router_binds_each_rule_to_one_certificate_and_denies_the_rest() -> None:
    chatter = access_rules("/talker", Grants({Use.PUBLISH: ("/chatter",)}), Domains.single(0))
    control = router(Subject("/talker", "ros.talker", chatter), Subject("/idle", "ros.idle", ()))[
        "access_control"
    ]
    assert isinstance(control, dict)
    assert control["enabled"] is True and control["default_permission"] == "deny"
    assert control["subjects"] == [{"id": "/talker", "cert_common_names": ["ros.talker"]}]
    ids = [rule["id"] for rule in control["rules"]]
    assert len(ids) == len(set(ids)) and control["policies"] == [{"rules": ids, "subjects": ["/talker"]}]
    assert all(rule["permission"] == "allow" and len(rule["flows"]) == 1 for rule in control["rules"])


def test_the_router_takes_only_mutual_tls_and_tells_nobody_of_others() -> None:
    found = router()
    transport, scouting = found["transport"], found["scouting"]
    assert isinstance(transport, dict) and isinstance(scouting, dict)
    assert transport["link"]["protocols"] == ["tls"] and transport["shared_memory"] == {"enabled": False}
    tls = transport["link"]["tls"]
    assert tls["enable_mtls"] is True and tls["close_link_on_expiration"] is True
    assert scouting == {"multicast": {"enabled": False}, "gossip": {"enabled": False}}
    assert found["adminspace"] == {"enabled": False}


def test_a_process_is_a_client_that_checks_who_the_router_is() -> None:
    found = json.loads(session_configuration(["tls/localhost:7447"], FILES))
    assert found["mode"] == "client" and found["listen"] == {"endpoints": []}
    tls = found["transport"]["link"]["tls"]
    assert tls["verify_name_on_connect"] is True and tls["connect_private_key"] == "/ks/x/key.pem"
    assert found["scouting"]["gossip"] == {"enabled": False} == found["scouting"]["multicast"]
    assert found["timestamping"]["enabled"]["client"] is True  # without it transient local keeps nothing


@pytest.mark.parametrize(
    "name", ["/chatter", "/a/b/c", "/fleet/*", "/cam*", "/ca*ra", "/a/*/b", "/*", "/a*b*"]
)
@pytest.mark.parametrize("types", [(), ("std_msgs::msg::dds_::String_",)])
def test_keys_read_back_are_the_names_that_they_were_made_from(name: str, types: tuple[str, ...]) -> None:
    for key in data_keys(("3",), name, types):
        found = meaning("ingress", "put", key)
        assert found is not None and (found.use, found.name, found.domain) == (Use.PUBLISH, name, "3")
        assert found.type in ("", *(["std_msgs/msg/String"] if types else []))
        assert meaning("egress", "query", f"{key}/@adv/**") == found
