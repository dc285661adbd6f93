"""The same policy through real SROS2 gives the same grants (values: golden_permissions/README.md)."""

from __future__ import annotations

import fnmatch
import json
from collections.abc import Iterable, Sequence
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import pytest

from keystore import Domains, Validity, read_policy
from keystore.formats.permissions import Permissions, permissions_document
from keystore.formats.permissions_document import parse_permissions

GOLDEN = Path(__file__).parent / "golden_permissions"
CASES = sorted(path.name.removesuffix(".policy.xml") for path in GOLDEN.glob("*.policy.xml"))
VALIDITY = Validity(datetime(2024, 1, 1, tzinfo=timezone.utc), datetime(2034, 1, 1, tzinfo=timezone.utc))

# One rule as (is it an allow rule, (topics to publish, topics to subscribe)), in document order.
Rules = Sequence[tuple[bool, tuple[Sequence[str], Sequence[str]]]]


def ours(case: str) -> Permissions:
    (enclave,) = read_policy(GOLDEN / f"{case}.policy.xml").policy.enclaves
    document = permissions_document(
        f"CN={enclave.path}", enclave, validity=VALIDITY, domains=Domains.single(0)
    )
    return parse_permissions(document)


def theirs(case: str) -> dict[str, Any]:
    value: dict[str, Any] = json.loads((GOLDEN / f"{case}.sros2.json").read_text())
    return value


def our_rules(permissions: Permissions) -> Rules:
    rules = permissions.rules
    return [(True, rules.first), (False, rules.deny), (True, rules.allow)]


def their_rules(document: dict[str, Any]) -> Rules:
    return [(r["rule"] == "allow_rule", (r["publish"], r["subscribe"])) for r in document["rules"]]


def decision(rules: Rules, direction: int, topic: str) -> bool:
    """As Fast DDS and Cyclone DDS decide on an endpoint: the first rule with a matching topic."""
    for rule in rules:
        if any(fnmatch.fnmatchcase(topic, expression) for expression in rule[1][direction]):
            return rule[0]
    return False


def probes(rules: Rules) -> Iterable[str]:
    """Every topic that is named, what fits its wildcards, and neighbours that nobody named."""
    for rule in rules:
        for expression in (*rule[1][0], *rule[1][1]):
            plain = expression.replace("[0-9]", "7").replace("?", "x")
            yield from (plain.replace("*", text) for text in ("", "z", "ly/w", "_secret"))
            yield from (plain.replace("*", "q") + "_more", plain.replace("rt/", "rt/not_"))


@pytest.mark.parametrize("case", CASES)
def test_head_of_the_grant(case: str) -> None:
    permissions, expected = ours(case), theirs(case)
    assert (permissions.subject, permissions.name) == (expected["subject"], expected["name"])
    assert expected["default"] == "DENY" and permissions.domains == Domains.single(0)


@pytest.mark.parametrize("case", [case for case in CASES if case != "denials"])
def test_exactly_the_same_topics_are_granted(case: str) -> None:
    expected = their_rules(theirs(case))
    rules = ours(case).rules
    assert not rules.first and not rules.deny
    for direction, topics in enumerate(rules.allow):
        granted = {topic for each in expected for topic in each[1][direction]}
        assert list(topics) == sorted(granted)


@pytest.mark.parametrize("case", CASES)
def test_every_topic_is_decided_the_same_way(case: str) -> None:
    expected, actual = their_rules(theirs(case)), our_rules(ours(case))
    topics = sorted({*probes(expected), *probes(actual)})
    assert len(topics) > 8
    for direction in (0, 1):
        decided = {topic: decision(actual, direction, topic) for topic in topics}
        assert decided == {topic: decision(expected, direction, topic) for topic in topics}
        assert set(decided.values()) == {True, False}
