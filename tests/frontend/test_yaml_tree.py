"""YAML text -> values: those of ``yaml.safe_load``, with lines, within limits."""

from __future__ import annotations

from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from enclave_launch.boundary.yaml_nodes import MAX_NESTING, RefusedYaml
from enclave_launch.frontend.yaml_tree import parse_yaml


def test_mappings_and_lists_know_their_lines() -> None:
    document = parse_yaml("launch:\n- arg:\n    name: a\n\n- group:\n  - node: {pkg: p}\n")
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
    assert parse_yaml(text).root == yaml.safe_load(text)


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
        parse_yaml(text)
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
        parse_yaml(text)


def test_a_value_inside_itself_is_refused() -> None:
    with pytest.raises(RefusedYaml, match="a value contains itself: line 2"):
        parse_yaml("x: 1\na: &a [1, *a]")


def test_an_anchor_used_a_thousand_times_is_fine() -> None:
    text = "a: &a {b: [1, 2, 3]}\nc: [" + "*a, " * 1000 + "]"
    assert len(parse_yaml(text).root["c"]) == 1000


DEEP = {
    "flow lists": "[" * 100_000,
    "flow mappings": "{a: " * 100_000,
    "compact block lists": "- " * 100_000 + "a",
    "indented mappings": "\n".join(" " * i + "a:" for i in range(MAX_NESTING + 2)),
}


@pytest.mark.parametrize("text", DEEP.values(), ids=DEEP.keys())
def test_deep_nesting_is_an_error_and_no_crash(text: str) -> None:
    with pytest.raises(RefusedYaml, match=f"nested more than {MAX_NESTING} deep"):
        parse_yaml(text)


VALUES: st.SearchStrategy[Any] = st.recursive(
    st.none() | st.booleans() | st.integers() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=20,
)


@given(VALUES)
def test_what_pyyaml_writes_is_read_back(value: Any) -> None:
    assert parse_yaml(yaml.safe_dump(value)).root == value


@given(st.text())
def test_any_text_gives_what_pyyaml_gives(text: str) -> None:
    try:
        expected = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError) as error:
        with pytest.raises(type(error)):
            parse_yaml(text)
    else:
        assert parse_yaml(text).root == expected
