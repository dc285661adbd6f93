"""The inverse of expansion and remapping: whatever the source writes is among the names that are given back."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from enclave_addons.recording.record.written import final_names, written_names
from nodl.names import InvalidNameError
from nodl.node_interface import EndpointKind as Kind
from nodl.remap import RemapRules, parse_rule

TOKENS = st.sampled_from(["a", "b", "n", "ns"])  # few, so that rules and names meet
PATHS = st.lists(TOKENS, min_size=1, max_size=3).map("/".join)
WRITTEN = st.tuples(st.sampled_from(["", "/", "~/"]), PATHS).map("".join)
FQNS = PATHS.map(lambda path: f"/{path}")
RULES = st.lists(
    st.tuples(st.sampled_from(["", "n:", "rostopic://", "rosservice://"]), WRITTEN, WRITTEN).map(
        lambda parts: f"{parts[0]}{parts[1]}:={parts[2]}"
    ),
    max_size=3,
)
KINDS = st.sampled_from(list(Kind))


def rules_of(*texts: str) -> RemapRules:
    return RemapRules(process=tuple(map(parse_rule, texts)))


@given(KINDS, WRITTEN, FQNS, RULES)
def test_what_the_source_writes_is_found_again(kind: Kind, written: str, fqn: str, texts: list[str]) -> None:
    rules = rules_of(*texts)
    try:
        finals = final_names(kind, written, fqn, rules)
    except InvalidNameError:
        return
    for final in finals:
        found = written_names(kind, final, fqn, rules)
        assert written in found
        assert all(final in final_names(kind, each, fqn, rules) for each in found)


CASES = [
    # (kind, final name, node, rules, candidates)
    (Kind.PUBLISHER, "/chatter", "/talker", [], ("chatter", "/chatter")),
    (Kind.PUBLISHER, "/r1/chatter", "/r1/talker", [], ("chatter", "/r1/chatter")),
    (Kind.PUBLISHER, "/chatter", "/r1/talker", [], ("/chatter",)),
    (Kind.PUBLISHER, "/r1/t/state", "/r1/t", [], ("~/state", "t/state", "/r1/t/state")),
    # a rule's source comes first; what nobody remapped may have been written so as well
    (Kind.PUBLISHER, "/conversation", "/talker", ["chatter:=/conversation"],
     ("chatter", "/chatter", "conversation", "/conversation")),
    # two topics that were joined: both stay
    (Kind.SUBSCRIPTION, "/in", "/n", ["left:=in", "right:=in"],
     ("left", "/left", "right", "/right", "in", "/in")),
    # the first rule that matches wins: /b goes to /c, and nothing that is written gives /b
    (Kind.SUBSCRIPTION, "/b", "/n", ["b:=c"], ()),
    # rules for another node, and for services only, do not count
    (Kind.PUBLISHER, "/x", "/n", ["other:a:=x", "rosservice://c:=x"], ("x", "/x")),
    (Kind.SERVICE_SERVER, "/x", "/n", ["rosservice://c:=x"], ("c", "/c", "x", "/x")),
]  # fmt: skip


@pytest.mark.parametrize(("kind", "final", "fqn", "rules", "expected"), CASES)
def test_candidates(kind: Kind, final: str, fqn: str, rules: list[str], expected: tuple[str, ...]) -> None:
    assert written_names(kind, final, fqn, rules_of(*rules)) == expected
