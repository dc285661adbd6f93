"""Laws of joining namespaces, and of the enclave scope that follows."""

from __future__ import annotations

from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from enclave_launch.ros_rules.namespaces import (
    ENCLAVE_SCOPE,
    NAMESPACE,
    enclave_scope,
    make_namespace_absolute,
    prefix_namespace,
    push_enclave_scope,
)

tokens = st.from_regex(r"[a-z_][a-z0-9_]{0,5}", fullmatch=True)
relative = st.lists(tokens, min_size=1, max_size=3).map("/".join)
absolute = st.one_of(st.just("/"), relative.map("/{}".format))
anything = st.text(alphabet="ab/_", max_size=8)


@given(anything, absolute)
def test_an_absolute_namespace_drops_the_base(base: str, namespace: str) -> None:
    assert prefix_namespace(base, namespace) == namespace


@given(st.one_of(st.none(), anything), st.one_of(st.none(), anything))
def test_the_result_never_ends_in_a_slash_unless_it_is_the_root(
    base: str | None, namespace: str | None
) -> None:
    joined = prefix_namespace(base, namespace)
    if base is None or namespace is not None:
        assert joined is None or joined == "/" or not joined.endswith("/")
    assert (joined is None) == (base is None and namespace is None)


@given(absolute, relative, relative)
def test_joining_is_associative(base: str, first: str, second: str) -> None:
    left = prefix_namespace(prefix_namespace(base, first), second)
    assert left == prefix_namespace(base, prefix_namespace(first, second))


@given(anything)
def test_nothing_given_keeps_the_base(base: str) -> None:
    assert prefix_namespace(base, None) == (base if base == "/" else base.rstrip("/"))


@given(anything)
def test_making_absolute_twice_changes_nothing(namespace: str) -> None:
    once = make_namespace_absolute(namespace)
    assert once.startswith("/")
    assert make_namespace_absolute(once) == once


@given(st.lists(st.one_of(relative, absolute), max_size=5))
def test_without_enclaves_the_scope_is_the_namespace(pushes: list[str]) -> None:
    configurations: dict[str, Any] = {}
    for pushed in pushes:
        push_enclave_scope(configurations, None, pushed)
        joined = make_namespace_absolute(prefix_namespace(configurations.get(NAMESPACE), pushed))
        configurations[NAMESPACE] = joined
    assert ENCLAVE_SCOPE not in configurations
    assert enclave_scope(configurations) == configurations.get(NAMESPACE)


@given(st.lists(relative, max_size=4), absolute)
def test_an_absolute_enclave_forgets_what_was_pushed(pushes: list[str], enclave: str) -> None:
    configurations: dict[str, Any] = {}
    for pushed in pushes:
        push_enclave_scope(configurations, pushed)
    push_enclave_scope(configurations, enclave)
    assert enclave_scope(configurations) == enclave
