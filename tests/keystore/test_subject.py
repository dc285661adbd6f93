"""Common names: different for different enclaves, and never a subset of another's in Cyclone's comparison."""

from __future__ import annotations

import hashlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from keystore import SubjectScheme
from keystore.formats.subject import borrowable, common_name, scheme_of, subject_name
from tests.keystore.kit import ARTICLE

segment = st.text(alphabet="ab_Z", min_size=1, max_size=30)
enclave = (
    st.lists(segment, max_size=6)
    .map(lambda parts: "/" + "/".join(parts))
    .filter(lambda name: len(name) <= 245)
)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("/", "ros"),
        ("/talker", "ros.talker"),
        ("/front/camera", "ros.front.camera"),
        ("/" + "a" * 60, "ros." + "a" * 60),
    ],
)
def test_exact_names(name: str, expected: str) -> None:
    assert common_name(name) == expected
    assert subject_name(expected) == f"CN={expected}"


def test_longer_names_are_shortened_to_a_fixed_form() -> None:
    cn = common_name("/robot/" + "a" * 60)
    digest = hashlib.sha256(b"/robot/" + b"a" * 60).hexdigest()[:40]
    assert cn == f"ros-{digest}-" + "a" * 19
    assert len(cn) == 64


@given(st.sets(enclave, min_size=2, max_size=8))
def test_different_enclaves_have_different_names_within_64_characters(names: set[str]) -> None:
    for scheme in SubjectScheme:
        made = {common_name(name, scheme) for name in names}
        assert len(made) == len(names)
        assert all(1 <= len(cn) <= 64 for cn in made)


@given(st.sets(enclave, min_size=2, max_size=8))
def test_nobody_can_borrow_among_exact_names(names: set[str]) -> None:
    assert borrowable({name: common_name(name) for name in names}) == []


@given(st.sets(enclave, min_size=1, max_size=5), st.sets(enclave, min_size=1, max_size=5))
def test_nor_between_exact_and_sros2_names(exact: set[str], compatible: set[str]) -> None:
    names = {f"exact{name}": common_name(name) for name in exact}
    names |= {f"sros2{name}": name for name in compatible if len(name) <= 64}
    assert all(a.startswith("sros2") and b.startswith("sros2") for a, b in borrowable(names))


def test_the_pairs_that_cyclone_confuses_are_found() -> None:
    """Measured on Cyclone DDS 0.10.2: these identities may use these documents, and no others of the set."""
    names = {name: common_name(name, SubjectScheme.COMPATIBLE) for name in ARTICLE}
    assert set(borrowable(names)) == {
        ("/", "/a"), ("/", "/a/b"), ("/", "/b/a"), ("/", "/a/b/c"),
        ("/a", "/a/b"), ("/a", "/b/a"), ("/a", "/a/b/c"),
        ("/a/b", "/b/a"), ("/b/a", "/a/b"), ("/a/b", "/a/b/c"), ("/b/a", "/a/b/c"),
    }  # fmt: skip


def test_neighbours_do_not_borrow() -> None:
    assert borrowable({"/robot/talker": "/robot/talker", "/other": "/other"}) == []


def test_the_scheme_is_seen_from_the_name() -> None:
    assert scheme_of("/a/b") is SubjectScheme.COMPATIBLE
    assert scheme_of("ros.a.b") is SubjectScheme.EXACT
