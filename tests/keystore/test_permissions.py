"""Permissions documents: names, order of rules, denials, form (DDS-Security 9.4.1.3, measured behaviour)."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from keystore import Domains, EnclavePolicy, InvalidInputError, Operation, Profile, Qualifier, Rule, Validity
from keystore.formats.permissions import dds_rules, permissions_document
from keystore.formats.permissions_document import granted_rules, parse_permissions
from keystore.formats.permissions_names import dds_topics, full_name
from keystore.formats.permissions_patterns import can_meet, covers
from keystore.formats.permissions_size import (
    FAST_DDS_LIMIT_BYTES,
    WARN_BYTES,
    expected_size,
    size_concern,
)
from keystore.formats.policy import PolicyError

START = datetime(2026, 1, 1, tzinfo=timezone.utc)
VALIDITY = Validity(START, START + timedelta(days=365))
DOMAIN_0 = Domains.single(0)


def allow(operation: str, name: str) -> Rule:
    return Rule(Operation(operation), Qualifier.ALLOW, name)


def deny(operation: str, name: str) -> Rule:
    return Rule(Operation(operation), Qualifier.DENY, name)


def enclave(*rules: Rule, ns: str = "/", node: str = "n") -> EnclavePolicy:
    return EnclavePolicy("/enclave", (Profile(ns, node, rules),))


def document(policy: EnclavePolicy) -> bytes:
    return permissions_document("CN=/enclave", policy, validity=VALIDITY, domains=DOMAIN_0)


def test_the_whole_document() -> None:
    policy = enclave(allow("publish", "chatter"), ns="/robot")
    assert document(policy).decode().splitlines() == [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:noNamespaceSchemaLocation='
        '"http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_permissions.xsd">',
        "<permissions>",
        '<grant name="/enclave">',
        "<subject_name>CN=/enclave</subject_name>",
        "<validity><not_before>2025-12-31T10:00:00</not_before><not_after>2027-01-01T14:00:00</not_after></validity>",
        "<allow_rule>",
        "<domains><id>0</id></domains>",
        "<publish><topics>",
        "<topic>ros_discovery_info</topic>",
        "<topic>rt/robot/chatter</topic>",
        "</topics></publish>",
        "<subscribe><topics>",
        "<topic>ros_discovery_info</topic>",
        "</topics></subscribe>",
        "</allow_rule>",
        "<default>DENY</default>",
        "</grant>",
        "</permissions>",
        "</dds>",
    ]


TOPICS = {
    "publish": (["rt/x"], []),
    "subscribe": ([], ["rt/x"]),
    "request": (["rq/xRequest"], ["rr/xReply"]),
    "reply": (["rr/xReply"], ["rq/xRequest"]),
    "call": (
        [
            "rq/x/_action/cancel_goalRequest",
            "rq/x/_action/get_resultRequest",
            "rq/x/_action/send_goalRequest",
        ],
        [
            *("rr/x/_action/cancel_goalReply", "rr/x/_action/get_resultReply", "rr/x/_action/send_goalReply"),
            *("rt/x/_action/feedback", "rt/x/_action/status"),
        ],
    ),
}
TOPICS["execute"] = (TOPICS["call"][1], TOPICS["call"][0])


@pytest.mark.parametrize("operation", TOPICS)
def test_dds_names_of_each_operation(operation: str) -> None:
    publish, subscribe = dds_topics(Operation(operation), "/x")
    assert (sorted(publish), sorted(subscribe)) == TOPICS[operation]


NAMES = [
    ("/x", "/a", "/x"),
    ("x", "/a", "/a/x"),
    ("x/y", "/a", "/a/x/y"),
    ("x", "/", "/x"),
    ("~/x", "/a", "/a/n/x"),
    ("~", "/a", "/a/n"),
    ("~/x", "/", "/n/x"),
    ("*", "/a", "/a/*"),
    ("cam[0-9]/image?", "/", "/cam[0-9]/image?"),
    ("[!ab]c", "/", "/[!ab]c"),
]


@pytest.mark.parametrize(("expression", "ns", "name"), NAMES)
def test_names_of_a_policy(expression: str, ns: str, name: str) -> None:
    assert full_name(expression, Profile(ns, "n", ())) == name


@pytest.mark.parametrize(
    "expression",
    [
        *("", " x ", "x ", "x\n", "~x", "a//b", "x/", "/", "1x", "a/1b", "a b", "a-b", "é", "a\\b", "{a,b}"),
        *("[^x]", "[[:alpha:]]x", "[", "x]", "[]", "/" + "a" * 247, "a&b", "<x/>"),
    ],
)
def test_names_that_no_permission_is_written_for(expression: str) -> None:
    with pytest.raises(PolicyError):
        document(enclave(allow("publish", expression)))


@pytest.mark.parametrize(
    ("ns", "node"), [("a", "n"), ("", "n"), ("/a/", "n"), ("/", "n/m"), ("/", ""), ("/1", "n")]
)
def test_profiles_that_cannot_be(ns: str, node: str) -> None:
    with pytest.raises(PolicyError):
        document(enclave(allow("publish", "x"), ns=ns, node=node))


@pytest.mark.parametrize("subject", ["", " CN=/a", "CN=/a\n", "CN=\x1b", "CN=a<&b", "CN=\u00e4"])
def test_a_subject_that_would_not_match_or_not_be_read_alike_is_refused(subject: str) -> None:
    with pytest.raises(PolicyError):
        permissions_document(subject, enclave(), validity=VALIDITY, domains=DOMAIN_0)


def test_an_empty_profile_may_join_and_nothing_else() -> None:
    rules = parse_permissions(document(enclave())).rules
    assert rules.allow == (("ros_discovery_info",), ("ros_discovery_info",))
    assert not rules.first and not rules.deny


def test_several_profiles_become_one_grant() -> None:
    policy = EnclavePolicy(
        "/e", (Profile("/", "a", (allow("publish", "x"),)), Profile("/", "b", (allow("publish", "y"),)))
    )
    rules = parse_permissions(document(policy)).rules
    assert rules.allow.publish == ("ros_discovery_info", "rt/x", "rt/y")


def test_a_literal_denial_takes_the_name_away_and_leaves_no_deny_rule() -> None:
    rules = dds_rules(enclave(allow("publish", "x"), allow("subscribe", "x"), deny("publish", "x")))
    assert not rules.deny
    assert "rt/x" not in rules.allow.publish
    assert "rt/x" in rules.allow.subscribe


def test_a_denial_below_a_wildcard_comes_after_the_other_direction() -> None:
    """Cyclone DDS before 11.0 lets the first rule that mentions a topic in either direction decide."""
    rules = dds_rules(enclave(allow("publish", "/*"), allow("subscribe", "/x"), deny("publish", "/x")))
    assert rules.deny.publish == ("rt/x",)
    assert rules.first.subscribe == ("rt/x",)
    assert rules.first.publish == ()
    assert rules.hazards == ()


def test_the_other_direction_granted_by_a_wildcard_is_named_too() -> None:
    rules = dds_rules(enclave(allow("publish", "/*"), allow("subscribe", "/*"), deny("publish", "/x")))
    assert rules.first.subscribe == ("rt/x",)


def test_a_denial_that_would_still_block_is_told() -> None:
    rules = dds_rules(
        enclave(allow("publish", "/a*"), allow("subscribe", "/?b*"), deny("publish", "/*b")),
    )
    assert rules.deny.publish == ("rt/*b",)
    assert [h for h in rules.hazards if "rt/?b*" in h and "Cyclone DDS before 11.0" in h]


def test_a_denial_that_meets_no_wildcard_is_not_written() -> None:
    rules = dds_rules(
        enclave(allow("publish", "/open/*"), deny("publish", "/closed"), deny("subscribe", "/*"))
    )
    assert not rules.deny


def test_denial_of_one_profile_beats_allowance_of_another() -> None:
    policy = EnclavePolicy(
        "/e", (Profile("/", "a", (allow("reply", "s"),)), Profile("/", "b", (deny("reply", "s"),)))
    )
    assert "rr/sReply" not in dds_rules(policy).allow.publish


def test_no_wildcard_that_the_input_did_not_contain() -> None:
    policy = enclave(*(allow(op, f"/{op}") for op in TOPICS), deny("publish", "/other"))
    assert "*" not in document(policy).decode() and "?" not in document(policy).decode().split("?>", 1)[1]


def test_domains_and_validity() -> None:
    text = permissions_document(
        "CN=x",
        enclave(),
        validity=Validity(START, START + timedelta(days=400 * 365)),
        domains=Domains.parse("3,5-7"),
    ).decode()
    assert "<domains><id>3</id><id_range><min>5</min><max>7</max></id_range></domains>" in text
    assert "<not_after>2262-04-11T00:00:00</not_after>" in text  # later dates are refused by Cyclone DDS


def big(topics: int, nodes: int = 1) -> EnclavePolicy:
    profiles = tuple(
        Profile(
            f"/fleet/robot{i}",
            f"driver{i}",
            tuple(allow("publish", f"~/topic{j}") for j in range(topics // nodes)),
        )
        for i in range(nodes)
    )
    return EnclavePolicy("/fleet", profiles)


@pytest.mark.parametrize(("topics", "expected"), [(1000, "close to"), (1500, "over")])
def test_size_is_warned_of_before_fast_dds_stops_matching(topics: int, expected: str) -> None:
    concern = size_concern(big(topics))
    assert concern and f"{expected} the {FAST_DDS_LIMIT_BYTES} bytes" in concern
    assert str(expected_size(big(topics))) in concern and "/fleet/robot0/driver0/* (" in concern
    assert size_concern(big(100)) is None


@pytest.mark.parametrize("operation", ["publish", "reply", "call"])
@pytest.mark.parametrize("topics", [50, 150, 400, 1200])
def test_the_size_is_foreseen_before_signing(operation: str, topics: int) -> None:
    rules = tuple(allow(operation, f"~/channel{j}") for j in range(topics))
    policy = EnclavePolicy("/fleet", (Profile("/fleet", "driver", rules),))
    unsigned = document(policy)
    real = len(unsigned) + unsigned.count(b"\n") + 2_600  # line ends become CRLF, the signature is added
    foreseen = expected_size(policy)
    assert (foreseen < WARN_BYTES) == (real < WARN_BYTES)
    assert foreseen < WARN_BYTES or abs(foreseen - real) < 200


def test_a_shared_enclave_is_told_which_nodes_to_move_out() -> None:
    concern = size_concern(big(3000, nodes=3))
    assert concern and "Give some of its 3 nodes their own enclave" in concern
    assert "/fleet/robot1/driver1 (about" in concern


# -- laws -----------------------------------------------------------------------------------------

tokens = st.from_regex(r"[a-c]{1,2}", fullmatch=True)
literals = st.lists(tokens, min_size=1, max_size=3).map(lambda parts: "/" + "/".join(parts))
patterns = st.text("ab*?/", min_size=1, max_size=6).map(
    lambda t: "/" + t.replace("//", "/a/").strip("/") + "a"
)
expressions = st.one_of(literals, patterns.filter(lambda text: "//" not in text))
rules_strategy = st.builds(
    Rule, st.sampled_from(tuple(Operation)), st.sampled_from(tuple(Qualifier)), expressions
)


def decide(policy: EnclavePolicy, direction: int, topic: str, cyclone_creation: bool = False) -> bool:
    """First matching rule of the written document; ``cyclone_creation``: a match in any direction decides."""
    rules = dds_rules(policy)
    for allowed, topics in ((True, rules.first), (False, rules.deny), (True, rules.allow)):
        sides = (topics.publish, topics.subscribe)
        own = any(can_meet(expression, topic) for expression in sides[direction])
        other = cyclone_creation and any(can_meet(expression, topic) for expression in sides[1 - direction])
        if own or other:
            return allowed
    return False


def wanted(policy: EnclavePolicy, direction: int, topic: str) -> bool:
    """What the policy says: allowed by some rule and denied by none."""
    verdicts = set()
    for profile in policy.profiles:
        for rule in profile.rules:
            for expression in dds_topics(rule.operation, full_name(rule.expression, profile))[direction]:
                if can_meet(expression, topic):
                    verdicts.add(rule.qualifier)
    return verdicts == {Qualifier.ALLOW}


@settings(max_examples=150, deadline=None)
@given(st.lists(rules_strategy, max_size=6), st.sampled_from((0, 1)), literals)
def test_written_rules_decide_as_the_policy_says(rules: list[Rule], direction: int, name: str) -> None:
    policy = enclave(*rules)
    for topic in (f"rt{name}", f"rq{name}Request", f"rr{name}Reply", f"rt{name}/_action/status"):
        assert decide(policy, direction, topic) == wanted(policy, direction, topic)


@settings(max_examples=150, deadline=None)
@given(st.lists(rules_strategy, max_size=6), st.sampled_from((0, 1)), literals)
def test_what_is_allowed_can_be_created_on_old_cyclone_or_a_hazard_says_so(
    rules: list[Rule], direction: int, name: str
) -> None:
    policy = enclave(*rules)
    topic = f"rt{name}"
    if wanted(policy, direction, topic) and not dds_rules(policy).hazards:
        assert decide(policy, direction, topic, cyclone_creation=True)


@settings(max_examples=60, deadline=None)
@given(st.lists(rules_strategy, max_size=8))
def test_every_document_is_valid_and_the_same_for_any_order(rules: list[Rule]) -> None:
    text = document(enclave(*rules))
    assert text == document(enclave(*reversed(rules)))
    assert parse_permissions(text).document() == text


@settings(max_examples=60, deadline=None)
@given(
    st.lists(
        st.builds(Rule, st.sampled_from(tuple(Operation)), st.just(Qualifier.ALLOW), literals), max_size=6
    )
)
def test_reading_a_document_gives_back_what_the_policy_grants(rules: list[Rule]) -> None:
    permissions = parse_permissions(document(enclave(*rules)))
    again = parse_permissions(document(enclave(*granted_rules(permissions))))
    assert again.rules == permissions.rules


@settings(max_examples=200, deadline=None)
@given(expressions, expressions, literals)
def test_patterns_meet_exactly_when_some_name_fits_both(a: str, b: str, name: str) -> None:
    if can_meet(a, name) and can_meet(b, name):
        assert can_meet(a, b)
    assert can_meet(a, b) == can_meet(b, a)
    if covers(a, b) and can_meet(b, name):
        assert can_meet(a, name)


def wide(pattern: str, count: int) -> tuple[Rule, ...]:
    return tuple(allow("publish", pattern.format(number)) for number in range(count))


def test_thousands_of_wildcards_and_denials_are_compared(count: int = 3_000) -> None:
    denials = (*(deny("publish", f"/x{number}/secret") for number in range(count)), deny("publish", "/y7"))
    rules = dds_rules(enclave(*wide("/x{}/*", count), *wide("/y{}", count), *denials))
    assert len(rules.deny.publish) == count and len(rules.allow.publish) == 2 * count
    assert not rules.permits("publish", "rt/x7/secret") and rules.permits("publish", "rt/x7/other")
    assert not rules.permits("publish", "rt/y7") and rules.permits("publish", "rt/y8")


def test_wildcards_that_all_meet_all_denials_are_refused() -> None:
    grants, denials = wide("/*a" * 40 + "{}*", 1_500), wide("/*b" * 40 + "{}*", 1_500)
    refused = tuple(rule._replace(qualifier=Qualifier.DENY) for rule in denials)
    with pytest.raises(InvalidInputError, match="name the topics one by one"):
        dds_rules(enclave(*grants, *refused))
