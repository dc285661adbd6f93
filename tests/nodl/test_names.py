"""Names, valid and expanded as rcl does it (ros2/design topic_and_service_names, rcl expand_topic_name.c)."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nodl.names import (
    InvalidNameError,
    expand_name,
    is_full_name,
    join,
    split_fqn,
    validate_full_name,
    validate_name,
    validate_namespace,
    validate_node_name,
    validate_written_name,
)

EXPANSIONS = [
    # name in code, namespace, node, fully qualified
    ("a", "/", "n", "/a"),
    ("a", "/ns", "n", "/ns/a"),
    ("a/b", "/ns/sub", "n", "/ns/sub/a/b"),
    ("/a", "/ns", "n", "/a"),
    ("~", "/ns", "n", "/ns/n"),
    ("~/a", "/ns", "n", "/ns/n/a"),
    ("~/a", "/", "n", "/n/a"),
    ("~a", "/ns", "node", "/ns/nodea"),  # rcl lets this two-character name pass
    ("{node}", "/ns", "n", "/ns/n"),
    ("{node}/x", "/", "n", "/n/x"),
    ("{ns}/x", "/ns", "n", "/ns/x"),
    ("{namespace}/x", "/ns/a", "n", "/ns/a/x"),
    ("/{node}_x", "/ns", "n", "/n_x"),
    ("a__b", "/ns", "n", "/ns/a__b"),  # double underscores are fine in names, not in rules
    ("_hidden", "/", "n", "/_hidden"),
]


@pytest.mark.parametrize(("name", "namespace", "node", "expected"), EXPANSIONS)
def test_expansion(name: str, namespace: str, node: str, expected: str) -> None:
    assert expand_name(name, namespace=namespace, node=node) == expected


REFUSED = [
    ("", "empty"),
    ("/", "end with"),
    ("a/", "end with"),
    ("1a", "digit"),
    ("a/1b", "digit"),
    ("a//b", "//"),
    ("a b", "must not contain ' '"),
    (" a", "must not contain"),
    ("a\n", "must not contain"),
    ("a-b", "must not contain"),
    ("a.b", "must not contain"),
    ("a*", "must not contain"),
    ("é", "must not contain"),
    ("a~", "only be the first"),
    ("~abc", "followed by"),
    ("{what}", "unknown substitution"),
    ("{}", "unknown substitution"),
    ("{node", "without '}'"),
    ("node}", "without '{'"),
    ("{a{b}}", "inside"),
    ("{a/b}", "inside"),
    ("{1a}", "digit"),
]


@pytest.mark.parametrize(("name", "reason"), REFUSED)
def test_names_that_rcl_refuses(name: str, reason: str) -> None:
    with pytest.raises(InvalidNameError, match=re.escape(reason)):
        expand_name(name, namespace="/ns", node="n")


def test_root_namespace_substitution_gives_an_empty_part_as_in_rcl() -> None:
    with pytest.raises(InvalidNameError, match="becomes '//x'"):
        expand_name("{ns}/x", namespace="/", node="n")


@pytest.mark.parametrize("name", ["~a", "~abc", "a//b", "a*", "a?", "[ab]", "{other}/x", "a/"])
def test_names_that_a_manifest_may_not_hold(name: str) -> None:
    with pytest.raises(InvalidNameError):
        validate_written_name(name)


def test_a_wildcard_in_a_manifest_is_told_where_it_belongs() -> None:
    with pytest.raises(InvalidNameError, match=r"--policy\) \(character 5\)"):
        validate_written_name("cam/*")


def test_length_limits() -> None:
    validate_full_name("/" + "a" * 246)
    with pytest.raises(InvalidNameError, match="longer than 247"):
        validate_full_name("/" + "a" * 247)
    with pytest.raises(InvalidNameError, match="longer than 247"):
        expand_name("a" * 240, namespace="/namespace", node="n")
    validate_namespace("/" + "a" * 244)
    with pytest.raises(InvalidNameError, match="longer than 245"):
        validate_namespace("/" + "a" * 245)
    validate_node_name("a" * 255)
    with pytest.raises(InvalidNameError, match="longer than 255"):
        validate_node_name("a" * 256)


@pytest.mark.parametrize("namespace", ["", "a", "/a/", "//a", "/1", "/a-b", "/a\n", "/a/../b"])
def test_namespaces_that_are_refused(namespace: str) -> None:
    with pytest.raises(InvalidNameError):
        validate_namespace(namespace)


@pytest.mark.parametrize("node", ["", "a/b", "1a", "a-b", "a\n", "a ", "ü"])
def test_node_names_that_are_refused(node: str) -> None:
    with pytest.raises(InvalidNameError):
        validate_node_name(node)


def test_a_name_with_control_characters_is_shown_escaped() -> None:
    with pytest.raises(InvalidNameError) as caught:
        validate_name("a\x1b[31m")
    assert "\x1b" not in str(caught.value)


tokens = st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,8}", fullmatch=True)
paths = st.lists(tokens, min_size=1, max_size=4).map("/".join)
namespaces = st.one_of(st.just("/"), paths.map(lambda path: "/" + path))


@given(paths, namespaces, tokens)
def test_expanding_twice_changes_nothing(path: str, namespace: str, node: str) -> None:
    for name in (path, f"/{path}", f"~/{path}"):
        once = expand_name(name, namespace=namespace, node=node)
        assert expand_name(once, namespace="/elsewhere", node="other") == once


@given(paths, namespaces, tokens)
def test_where_each_kind_of_name_ends_up(path: str, namespace: str, node: str) -> None:
    assert expand_name(path, namespace=namespace, node=node) == join(namespace, path)
    assert expand_name(f"~/{path}", namespace=namespace, node=node) == f"{join(namespace, node)}/{path}"
    assert expand_name(f"/{path}", namespace=namespace, node=node) == f"/{path}"


@given(st.text(max_size=12), namespaces, tokens)
def test_whatever_is_accepted_is_a_valid_full_name(name: str, namespace: str, node: str) -> None:
    try:
        full = expand_name(name, namespace=namespace, node=node)
    except InvalidNameError as error:
        assert error.position is None or 0 <= error.position <= len(name)
    else:
        assert re.fullmatch(r"(/[A-Za-z_][A-Za-z0-9_]*)+", full)


@given(namespaces, tokens)
def test_splitting_undoes_joining(namespace: str, node: str) -> None:
    assert split_fqn(join(namespace, node)) == (namespace, node)


REASONS = [
    (validate_node_name, "", "must not be empty", None),
    (validate_node_name, "a/b", "must not contain '/'", 1),
    (validate_node_name, "1a", "must not start with a digit", 0),
    (validate_node_name, "n" * 256, "is longer than 255 characters", None),
    (validate_namespace, "", "must not be empty", None),
    (validate_namespace, "a", "must be absolute", 0),
    (validate_namespace, "/a/", "must not end with '/'", 2),
    (validate_namespace, "/a b", "must not contain ' '", 2),
    (validate_namespace, "/a/1b", "no part may start with a digit", 3),
    (validate_namespace, "/a//b", "must not contain '//'", 2),
    (validate_namespace, "/" + "n" * 245, "is longer than 245 characters", None),
    (validate_full_name, "/" + "n" * 247, "is longer than 247 characters", None),
    (validate_name, "1a", "must not start with a digit", 0),
    (validate_name, "a/1b", "no part may start with a digit", 2),
    (validate_name, "~ab", "'~' must be followed by '/'", 1),
    (validate_name, "{1}", "a substitution must not start with a digit", 1),
    (validate_written_name, "a*", "wildcards are not allowed here", 1),
    (validate_written_name, "~a", "'~' must be followed by '/'", 1),
    (validate_written_name, "a//b", "must not contain '//'", 1),
    (validate_written_name, "a/{me}", "unknown substitution {me}", 2),
]


@pytest.mark.parametrize(("check", "name", "reason", "position"), REASONS)
def test_what_is_wrong_with_a_name_is_said_with_its_place(
    check: Callable[[str], None], name: str, reason: str, position: int | None
) -> None:
    with pytest.raises(InvalidNameError) as refused:
        check(name)
    assert refused.value.reason.startswith(reason) and refused.value.position == position
    assert str(refused.value).startswith("invalid ") and reason in str(refused.value)


@pytest.mark.parametrize(
    ("check", "name"),
    [
        (validate_node_name, "n" * 255),
        (validate_namespace, "/"),
        (validate_namespace, "/" + "n" * 244),
        (validate_full_name, "/" + "n" * 246),
        (validate_name, "~"),
        (validate_name, "~a"),
        (validate_name, "a1"),
        (validate_name, "{a1}"),
        (validate_written_name, "~/{node}/{ns}/{namespace}"),
    ],
)
def test_their_neighbours_are_names(check: Callable[[str], None], name: str) -> None:
    check(name)


def test_the_longest_name_is_one_and_the_next_is_none() -> None:
    longest = expand_name("n" * 242, namespace="/abc", node="x")
    assert len(longest) == 247 and is_full_name(longest)
    with pytest.raises(InvalidNameError, match="which is longer than 247 characters"):
        expand_name("n" * 243, namespace="/abc", node="x")
