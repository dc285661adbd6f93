"""Remap rules: what rcl's lexer accepts, and which rule changes which name (rcl arguments.c, remap.c)."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nodl.names import MAX_NAME_LENGTH, InvalidNameError
from nodl.remap import (
    InvalidRemapRuleError,
    NodeNames,
    RemapKind,
    RemapRules,
    parse_rule,
)

SERVICES = ("send_goal", "cancel_goal", "get_result")  # rcl_action names.c
TOPICS = ("feedback", "status")


def rules(*texts: str, local: tuple[str, ...] = ()) -> RemapRules:
    return RemapRules(
        local=tuple(parse_rule(text, "local") for text in local),
        process=tuple(parse_rule(text, "process") for text in texts),
    )


ACCEPTED = {
    "__node:=n": (RemapKind.NODE_NAME, None),
    "__name:=n": (RemapKind.NODE_NAME, None),
    "old:__node:=n": (RemapKind.NODE_NAME, "old"),
    "__ns:=/": (RemapKind.NAMESPACE, None),
    "__ns:=/a/b": (RemapKind.NAMESPACE, None),
    "__ns:=/a/": (RemapKind.NAMESPACE, None),
    "old:__ns:=/a": (RemapKind.NAMESPACE, "old"),
    "_:=kq": (RemapKind.ANY_NAME, None),
    "a:=b": (RemapKind.ANY_NAME, None),
    "~/a:=~/b": (RemapKind.ANY_NAME, None),
    "/a/b:=c": (RemapKind.ANY_NAME, None),
    "n:/a1:=/b2": (RemapKind.ANY_NAME, "n"),
    "rostopic:=/a": (RemapKind.ANY_NAME, None),
    "rosservice:/a:=b": (RemapKind.ANY_NAME, "rosservice"),
    "rostopic://a:=b": (RemapKind.TOPIC, None),
    "rostopic:///a:=b": (RemapKind.TOPIC, None),
    "rosservice://a:=b": (RemapKind.SERVICE, None),
    "n:rosservice://~/a:=b": (RemapKind.SERVICE, "n"),
}


@pytest.mark.parametrize("text", ACCEPTED)
def test_rules_that_rcl_accepts(text: str) -> None:
    rule = parse_rule(text)
    assert (rule.kind, rule.node) == ACCEPTED[text]


REJECTED = (
    *("", "a", ":", "1", "~", ":=", "a:=", ":=b", "::=", "1:=", "~:=", "~:=b", "a:=~"),
    *(
        "/:=b",
        "a:=/",
        "a/:=b",
        "a:=b/",
        "a//b:=c",
        "a b:=c",
        "a:=b c",
        "a-b:=c",
        "a.b:=c",
        "1a:=b",
        "a/1b:=c",
    ),
    *("a__b:=c", "a:=b__c", "__x:=b", "a:=__node", "~abc:=d", "a:=~abc", "{node}:=a", "f{oo:=/b", "a:=/b}c"),
    *("n1:n2:a:=b", "/ns/n:a:=b", "rostopic://n:a:=b", "a:=b:=c", "a:=rostopic://b", "rostopic://:=b"),
    *("rostopic::=b", "__node:=", "__node:=a/b", "__ns:=", "__ns:=a", "__ns:=//", "__ns:=/1", "a\n:=b"),
    *(":__node:=n", "~:__node:=n", "*:=a", "a:=**", r"a:=\1", "n__x:a:=b"),
)


@pytest.mark.parametrize("text", REJECTED)
def test_rules_at_which_rcl_refuses_to_start(text: str) -> None:
    with pytest.raises(InvalidRemapRuleError):
        parse_rule(text)


def test_a_bad_rule_is_told_with_its_place() -> None:
    with pytest.raises(
        InvalidRemapRuleError, match=r"demo.launch.xml:7: invalid remap rule 'a__b:=c': .*'__'"
    ):
        parse_rule("a__b:=c", "demo.launch.xml:7")


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("*:=a", "'*' uses a pattern, which rcl has not implemented"),
        ("a:=b*", "the replacement 'b*' uses a pattern"),
        (r"a:=\1", "uses a pattern"),
        ("a:=b__c", "contains '__'"),
        ("__ns:=a", "the namespace (it must be absolute) 'a' is not a valid name"),
        ("__node:=", "the node name is empty"),
        ("1:=b", "the name to match '1' is not a valid name"),
        ("a", "must have the form FROM:=TO"),
    ],
)
def test_what_is_wrong_with_a_rule_is_said(text: str, why: str) -> None:
    with pytest.raises(InvalidRemapRuleError) as refused:
        parse_rule(text)
    assert why in str(refused.value)


# name in code, rule, topic, service; for node /ns/n
MATCHES = [
    ("a", "a:=b", "/ns/b", "/ns/b"),
    ("a", "/ns/a:=b", "/ns/b", "/ns/b"),
    ("a", "/a:=b", "/ns/a", "/ns/a"),
    ("/a", "a:=b", "/a", "/a"),
    ("/a", "/a:=/b", "/b", "/b"),
    ("~/a", "~/a:=c", "/ns/c", "/ns/c"),
    ("~/a", "n/a:=c", "/ns/c", "/ns/c"),
    ("a", "rosservice://a:=b", "/ns/a", "/ns/b"),
    ("a", "rostopic://a:=b", "/ns/b", "/ns/a"),
    ("a", "n:a:=b", "/ns/b", "/ns/b"),
    ("a", "other:a:=b", "/ns/a", "/ns/a"),
    ("a", "a:=~/b", "/ns/n/b", "/ns/n/b"),
]


@pytest.mark.parametrize(("name", "rule", "topic", "service"), MATCHES)
def test_matching(name: str, rule: str, topic: str, service: str) -> None:
    names = NodeNames("n", "/ns", rules(rule))
    assert (names.topic(name).name, names.service(name).name) == (topic, service)


def test_the_first_match_wins_and_nothing_is_applied_to_the_result() -> None:
    names = NodeNames("n", "/", rules("a:=b", "b:=c", "a:=d"))
    assert names.topic("a").name == "/b"
    assert names.topic("b").name == "/c"


def test_local_rules_come_before_those_of_the_process() -> None:
    names = NodeNames("n", "/", rules("a:=global", "b:=global", local=("a:=own",)))
    assert names.topic("a").name == "/own"
    assert [rule.origin for rule in names.topic("a").rules] == ["local"]
    assert names.topic("b").name == "/global"


def test_local_name_and_namespace_come_before_those_of_the_process() -> None:
    both = rules("__node:=global", "__ns:=/global", local=("__node:=own", "__ns:=/own"))
    assert (both.node_name("n").name, both.namespace("/", "n").name) == ("own", "/own")
    other = rules("__node:=global", "__ns:=/global", local=("other:__node:=own", "other:__ns:=/own"))
    assert (other.node_name("n").name, other.namespace("/", "n").name) == ("global", "/global")


def test_the_rules_for_names_are_those_that_are_for_no_node() -> None:
    chosen = rules("__ns:=/a", "a:=b", local=("__node:=m", "rostopic://c:=d"))
    assert [rule.text for rule in chosen.names] == ["rostopic://c:=d", "a:=b"]


@pytest.mark.parametrize("rule", ["rostopic://a:=b", "rosservice://a:=b"])
def test_a_rule_of_one_kind_is_a_rule(rule: str) -> None:
    names = NodeNames("n", "/", rules(rule))
    assert names.has_rules
    assert [found and found.text for found in map(names.rule_matching, ("/a", "/b"))] == [rule, None]
    assert not NodeNames("n", "/", rules("__ns:=/a")).has_rules


def test_node_name_and_namespace_take_the_first_rule_that_applies() -> None:
    chosen = rules("other:__node:=x", "__node:=y", "__node:=z", "y:__ns:=/new", "n:__ns:=/old")
    assert chosen.node_name("n").name == "y"
    assert chosen.namespace("/", "y").name == "/new"  # NODE: compares with the new name
    assert RemapRules().node_name("n").name == "n"


def test_a_rule_for_the_original_name_no_longer_matches_names_of_the_renamed_node() -> None:
    # rcl_resolve_name hands the final node name to the matching, rcl_remap_node_name the original one
    assert NodeNames("new", "/", rules("old:a:=b")).topic("a").name == "/a"
    assert NodeNames("new", "/", rules("new:a:=b")).topic("a").name == "/b"


def test_action_names_as_a_whole_follow_topic_rules() -> None:
    names = NodeNames("n", "/", rules("fib:=fibonacci"))
    assert names.action("fib", as_a_whole=True).name == "/fibonacci"
    assert names.action("fib", as_a_whole=False).name == "/fib"
    assert NodeNames("n", "/", rules("rosservice://fib:=x")).action("fib", as_a_whole=True).name == "/fib"
    assert names.action_parts("/fib") is None


def test_parts_of_an_action_are_remapped_one_by_one() -> None:
    names = NodeNames("n", "/", rules("fib/_action/feedback:=news", "rosservice://fib/_action/send_goal:=go"))
    parts = names.action_parts("/fib")
    assert parts is not None
    assert {k: r.name for k, r in parts.topics.items()} == {
        "feedback": "/news",
        "status": "/fib/_action/status",
    }
    assert parts.services["send_goal"].name == "/go"
    assert parts.services["get_result"].name == "/fib/_action/get_result"


@pytest.mark.parametrize("part", [f"fib/_action/{part}" for part in (*SERVICES, *TOPICS)])
def test_each_part_of_an_action_is_found(part: str) -> None:
    parts = NodeNames("n", "/", rules(f"{part}:=elsewhere", "other:=x")).action_parts("/fib")
    assert parts is not None
    moved = [name for name, found in {**parts.services, **parts.topics}.items() if found.rules]
    assert moved == [part.rpartition("/")[2]]
    assert [rule.replacement for rule in parts.rules] == ["elsewhere"]


def test_a_rule_for_parts_of_another_action_moves_nothing() -> None:
    assert NodeNames("n", "/", rules("other/_action/feedback:=news", "a:=b")).action_parts("/fib") is None


def test_an_action_moves_as_a_whole_where_all_five_parts_do() -> None:
    every = [f"fib/_action/{part}:=/new/_action/{part}" for part in (*SERVICES, *TOPICS)]
    whole = NodeNames("n", "/", rules(*every)).action_parts("/fib")
    assert whole is not None and whole.moved_together == "/new"
    for missing in range(5):
        apart = NodeNames("n", "/", rules(*every[:missing], *every[missing + 1 :])).action_parts("/fib")
        assert apart is not None and apart.moved_together is None


def test_an_action_whose_longest_part_is_too_long_is_refused() -> None:
    names = NodeNames("n", "/")
    longest = "/" + "a" * (MAX_NAME_LENGTH - len("//_action/cancel_goal"))
    assert names.action_parts(longest) is None
    with pytest.raises(InvalidNameError):
        names.action_parts(longest + "a")


words = st.from_regex(r"[a-z]{1,4}", fullmatch=True)
names_in_code = st.builds(lambda head, tail: head + tail, st.sampled_from(["", "/", "~/"]), words)


@given(st.lists(st.tuples(names_in_code, names_in_code), max_size=5), names_in_code)
def test_a_name_that_no_rule_matches_stays(pairs: list[tuple[str, str]], name: str) -> None:
    plain = NodeNames("node", "/space")
    chosen = rules(*(f"{a}:={b}" for a, b in pairs))
    resolved = NodeNames("node", "/space", chosen).topic(name)
    first = next((b for a, b in pairs if plain.expand(a) == plain.expand(name)), None)
    assert resolved.name == plain.expand(name if first is None else first)
    assert bool(resolved.rules) == (first is not None)


@given(st.text(max_size=20))
def test_any_text_is_either_a_rule_or_an_error_of_ours(text: str) -> None:
    try:
        rule = parse_rule(text)
    except InvalidRemapRuleError:
        return
    assert "__" not in rule.match + rule.replacement
    assert parse_rule(rule.text) == rule
