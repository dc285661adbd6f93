"""Denials on real DDS: what a policy denies is refused, what it allows can be created.

Cyclone DDS before 11.0 lets a denial of one direction block the topic in both (cyclonedds issues 1922,
2267), with the order of rules that SROS2 writes. Our order must not.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from keystore import EnclavePolicy, Operation, Profile, Qualifier, Rule
from keystore.formats.permissions import dds_rules
from tests.dds.our_keystore import provision
from tests.dds.probe import Participant, Probe

pytestmark = pytest.mark.dds

ALLOW, DENY = Qualifier.ALLOW, Qualifier.DENY
PUBLISH, SUBSCRIBE = Operation.PUBLISH, Operation.SUBSCRIBE

# case -> rules, and for each (verb, topic) whether it must be allowed
CASES: dict[str, tuple[tuple[Rule, ...], dict[tuple[str, str], bool]]] = {
    "literal": (
        (Rule(PUBLISH, ALLOW, "/x"), Rule(SUBSCRIBE, ALLOW, "/x"), Rule(PUBLISH, DENY, "/x")),
        {("publish", "rt/x"): False, ("subscribe", "rt/x"): True},
    ),
    "below_a_wildcard": (
        (Rule(PUBLISH, ALLOW, "/*"), Rule(SUBSCRIBE, ALLOW, "/x"), Rule(PUBLISH, DENY, "/x")),
        {("publish", "rt/x"): False, ("subscribe", "rt/x"): True, ("publish", "rt/y"): True},
    ),
    "both_wildcards": (
        (Rule(PUBLISH, ALLOW, "/*"), Rule(SUBSCRIBE, ALLOW, "/*"), Rule(SUBSCRIBE, DENY, "/s/*")),
        {("subscribe", "rt/s/a"): False, ("publish", "rt/s/a"): True, ("subscribe", "rt/t"): True},
    ),
    "service_role": (
        (
            Rule(Operation.REPLY, ALLOW, "/*"),
            Rule(Operation.REQUEST, ALLOW, "/r"),
            Rule(Operation.REPLY, DENY, "/r"),
        ),
        {
            ("publish", "rq/rRequest"): True,
            ("subscribe", "rr/rReply"): True,
            ("publish", "rr/rReply"): False,
            ("subscribe", "rq/rRequest"): False,
            ("publish", "rr/otherReply"): True,
        },
    ),
}


def test_what_is_denied_is_refused_and_the_other_direction_is_not(
    dds: Probe, domain_id: int, tmp_path: Path
) -> None:
    policies = [EnclavePolicy(f"/{case}", (Profile("/", "n", rules),)) for case, (rules, _) in CASES.items()]
    assert [dds_rules(policy).hazards for policy in policies] == [()] * len(CASES)
    provision(tmp_path / "ks", domain_id, policies)
    answers = dds.try_endpoints(
        domain_id,
        [
            Participant(
                case,
                tmp_path / "ks" / "enclaves" / case,
                publish=tuple(topic for verb, topic in expected if verb == "publish"),
                subscribe=tuple(topic for verb, topic in expected if verb == "subscribe"),
            )
            for case, (_, expected) in CASES.items()
        ],
    )
    assert answers.participants == dict.fromkeys(CASES, True), answers.log
    for case, (_, expected) in CASES.items():
        assert {key: answers.may(case, *key) for key in expected} == expected, f"{case}\n{answers.log}"
