"""Zenoh's own key expressions as the judge of ours."""

from __future__ import annotations

from fnmatch import fnmatchcase

import zenoh
from hypothesis import given
from hypothesis import strategies as st

from enclave_addons.zenoh.key_expressions import (
    NotExpressible,
    cache,
    data_keys,
    endpoint_tokens,
    history,
    name_expressions,
)
from tests.addons.zenoh.kit import token

PARTS = st.text("ab", min_size=1, max_size=3)
NAMES = st.lists(PARTS, min_size=1, max_size=4).map(lambda parts: "/" + "/".join(parts))
PATTERNS = st.lists(st.text("ab*", min_size=1, max_size=3), min_size=1, max_size=4).map(
    lambda parts: "/" + "/".join(parts)
)
TYPE = "std_msgs::msg::dds_::String_"


def includes(expressions: tuple[str, ...], key: str) -> bool:
    return any(zenoh.KeyExpr(one).includes(zenoh.KeyExpr(key)) for one in expressions)


@given(PATTERNS, NAMES)
def test_a_wildcard_grants_the_names_that_it_matches_in_a_policy_and_no_others(
    pattern: str, name: str
) -> None:
    try:
        keys = tuple(data_keys(["0"], pattern, []))
    except NotExpressible:
        return
    assert includes(keys, f"0{name}/{TYPE}/RIHS01_1") is fnmatchcase(name, pattern)
    typed = tuple(data_keys(["0"], pattern, [TYPE]))
    assert includes(typed, f"0{name}/{TYPE}/RIHS01_1") is fnmatchcase(name, pattern)
    assert not includes(typed, f"0{name}/other::msg::dds_::Other_/RIHS01_1")


@given(PATTERNS)
def test_every_key_expression_is_canonical(pattern: str) -> None:
    try:
        expressions = name_expressions(pattern)
    except NotExpressible:
        return
    for key in (*expressions, *data_keys(["0"], pattern, []), *data_keys(["*"], pattern, [TYPE])):
        for each in (key, history(key), cache(key)):
            assert str(zenoh.KeyExpr(each)) == each


@given(NAMES, NAMES)
def test_a_plain_name_grants_itself_in_its_domain_and_nothing_else(name: str, other: str) -> None:
    keys = tuple(data_keys(["0"], name, []))
    assert includes(keys, f"0{other}/{TYPE}/RIHS01_1") is (name == other)
    assert not includes(keys, f"1{name}/{TYPE}/RIHS01_1") and not includes(
        keys, f"0{name}/below/{TYPE}/RIHS01_1"
    )
    assert not includes(keys, f"0{name}/{TYPE}/RIHS01_1/@adv/pub/1/2/_")


@given(PATTERNS, NAMES)
def test_a_token_names_what_is_granted(pattern: str, name: str) -> None:
    tokens = tuple(endpoint_tokens(["0"], "MP", "/e", pattern, []))
    assert includes(tokens, token("/e", "MP", name)) is fnmatchcase(name, pattern)
    assert not includes(tokens, token("/f", "MP", name)) and not includes(tokens, token("/e", "MS", name))
