"""YAML text -> values: those of ``yaml.safe_load``, with lines, within limits."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from enclave_common.yaml_reader import (
    MAX_BASE_60,
    MAX_NESTING,
    RefusedYaml,
    load_yaml,
    load_yaml_with_lines,
)


def test_mappings_and_lists_know_their_lines() -> None:
    document = load_yaml_with_lines("launch:\n- arg:\n    name: a\n\n- group:\n  - node: {pkg: p}\n")
    actions = document.root["launch"]
    assert [document.lines[id(action)] for action in actions] == [2, 5]
    assert document.lines[id(actions)] == 2
    assert document.lines[id(actions[1]["group"][0])] == 6


SAME_AS_PYYAML = {
    "empty": "",
    "only a comment": "# c\n",
    "scalars of YAML 1.1": "[on, 010, 0x1F, 1:30, 1e3, 1.0e+3, ~, .inf, 'x', \"y\\t\", 2020-01-01]",
    "anchor and alias": "a: &x {b: 1}\nc: *x\n",
    "merge key": "a: &x {b: 1, c: 2}\nd: {<<: *x, c: 3}\n",
    "later duplicate wins": "a: 1\na: 2\n",
    "byte order mark": "\ufeffa: 1\n",
    "block text": "a: |\n  x\n  y\nb: >\n  x\n  y\n",
    "set and ordered map": "a: !!set {x, y}\nb: !!omap [x: 1]\n",
    "document start and end": "---\na: 1\n...\n",
    "lone tag, which libyaml reads as text": "a: !",
    "inner mark, which libyaml drops": "\n\ufeffa: 1",
}


@pytest.mark.parametrize("text", SAME_AS_PYYAML.values(), ids=SAME_AS_PYYAML.keys())
def test_same_values_as_pyyaml(text: str) -> None:
    assert load_yaml(text) == yaml.safe_load(text)


REFUSED_BY_PYYAML = {
    "NUL": "a: \0",
    "tab": "a:\n\t- b",
    "trailing tab, which libyaml accepts": "a: 1\t",
    "question mark in a flow list, which libyaml accepts": "[a?]",
    "unclosed": "a: [1, 2",
    "two documents": "a: 1\n---\nb: 2\n",
    "python object": "a: !!python/object/apply:os.system ['true']",
    "unknown alias": "a: *x",
    "unhashable key": "? [1]\n: 2",
}


@pytest.mark.parametrize("text", REFUSED_BY_PYYAML.values(), ids=REFUSED_BY_PYYAML.keys())
def test_same_error_as_pyyaml(text: str) -> None:
    with pytest.raises(yaml.YAMLError) as theirs:
        yaml.safe_load(text)
    with pytest.raises(yaml.YAMLError) as ours:
        load_yaml(text)
    assert (type(ours.value), str(ours.value)) == (type(theirs.value), str(theirs.value))


def doubling(levels: int, first: str, level: str) -> str:
    return first + "".join(level.format(i, i - 1) for i in range(1, levels))


BOMBS = {
    "lists": doubling(40, "a0: &a0 [x, x]\n", "a{0}: &a{0} [*a{1}, *a{1}]\n"),
    "merge keys": doubling(40, "a0: &a0 {{x: 1}}\n".format(), "a{0}: &a{0} {{<<: [*a{1}, *a{1}]}}\n"),
}


@pytest.mark.parametrize("text", BOMBS.values(), ids=BOMBS.keys())
def test_billion_laughs_are_refused(text: str) -> None:
    with pytest.raises(RefusedYaml, match="aliases stand for more than"):
        load_yaml(text)


def test_a_value_inside_itself_is_refused() -> None:
    with pytest.raises(RefusedYaml, match="a value contains itself: line 2"):
        load_yaml("x: 1\na: &a [1, *a]")


def test_an_anchor_used_a_thousand_times_is_fine() -> None:
    text = "a: &a {b: [1, 2, 3]}\nc: [" + "*a, " * 1000 + "]"
    assert len(load_yaml(text)["c"]) == 1000


DEEP = {
    "flow lists": "[" * 100_000,
    "flow mappings": "{a: " * 100_000,
    "compact block lists": "- " * 100_000 + "a",
    "indented mappings": "\n".join(" " * i + "a:" for i in range(MAX_NESTING + 2)),
}


@pytest.mark.parametrize("text", DEEP.values(), ids=DEEP.keys())
def test_deep_nesting_is_an_error_and_no_crash(text: str) -> None:
    with pytest.raises(RefusedYaml, match=f"nested more than {MAX_NESTING} deep"):
        load_yaml(text)


VALUES: st.SearchStrategy[Any] = st.recursive(
    st.none() | st.booleans() | st.integers() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=20,
)


@given(VALUES)
def test_what_pyyaml_writes_is_read_back(value: Any) -> None:
    assert load_yaml(yaml.safe_dump(value)) == value


def outcome(load: Callable[[str], Any], text: str) -> tuple[type, str]:
    """Type and text of the value, so that nan and -0.0 compare; type of the error."""
    try:
        value = load(text)
    except (yaml.YAMLError, ValueError, OverflowError) as error:
        return type(error), ""
    return type(value), repr(value)


WORDS = [
    *("yes", "Yes", "YES", "yEs", "no", "on", "On", "off", "y", "n", "true", "True", "TRUE", "tRUE"),
    *("null", "Null", "NULL", "nULL", "~", "", " ", "#x", "-", "=", "<<", "*", "&a", "!x", "%x", "@x", "`x"),
    *("0", "-0", "+5", "007", "010", "08", "0x10", "0b1", "0o7", "1_000", "1:30", "190:20:30", "-1:30"),
    *("1e3", "1.0e+3", "1.", ".5", "-.5", "1.5", "-0.0", "+1.5", "1_0.5", ".inf", "-.Inf", ".nan", "inf"),
    *("2020-01-01", "2020-01-01 10:00:00", "1.2.3", "a: b", "a:b", "a:", "a :b", "a #b", "a#b", "'x'"),
    *("[1, 2]", "[1", "{a: 1}", "a, b", "a]b", "a{b", "$(var x)", "$(var x 'a: b')", "$(eval 'a # b')"),
    *("/abs/path.yaml", "a b  c", " a", "a ", "a\tb", "a\nb", "a\\n", "é", "\x85", "\0", "---", "..."),
    *("_x", "? a", "?a", "- a", "-a", ":a", "9" * 30, "9" * 5000, "1" * 30 + ".5", "|", "> x", "\ufeffa"),
    *('"x"', "key: [1", "nan", "--- a", "$(f)/x", "a'b", "false", "FALSE", "NO", "N"),
]


@pytest.mark.parametrize("text", WORDS)
def test_a_word_is_typed_as_pyyaml_types_it(text: str) -> None:
    assert outcome(load_yaml, text) == outcome(yaml.safe_load, text)


PIECES = st.lists(
    st.sampled_from([*"abnyotNULfe019+-._:#,[]{}'\"$()/ \\=~<!", ": ", " #", "$(var ", "on", "null", "true"]),
    max_size=8,
).map("".join)


@given(st.one_of(st.text(), PIECES, st.from_regex(r"\A[-+]?[0-9._:ex]{1,12}\Z")))
def test_any_text_gives_what_pyyaml_gives(text: str) -> None:
    assert outcome(load_yaml, text) == outcome(yaml.safe_load, text)


def test_an_integer_to_base_60_is_read_and_an_endless_one_refused() -> None:
    assert load_yaml("a: 1:30:00") == {"a": 5400}
    with pytest.raises(
        RefusedYaml, match=f"line 2: an integer to base 60 has more than {MAX_BASE_60} characters"
    ):
        load_yaml("x: 1\na: 1" + ":30" * 150_000)


def test_a_text_is_limited() -> None:
    assert load_yaml("[1, 2]", limit=6) == [1, 2]
    with pytest.raises(RefusedYaml, match="more than 5 characters"):
        load_yaml("[1, 2]", limit=5)
