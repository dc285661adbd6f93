"""The short way to type a value gives what ``yaml.safe_load`` gives, or leaves it to PyYAML."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from enclave_launch.frontend import yaml_scalar


def outcome(load: Any, text: str) -> tuple[type, str]:
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
def test_golden_words(text: str) -> None:
    assert outcome(yaml_scalar.load, text) == outcome(yaml.safe_load, text)


PIECES = st.lists(
    st.sampled_from([*"abnyotNULfe019+-._:#,[]{}'\"$()/ \\=~<!", ": ", " #", "$(var ", "on", "null", "true"]),
    max_size=8,
).map("".join)


@given(st.one_of(st.text(), PIECES, st.from_regex(r"\A[-+]?[0-9._:ex]{1,12}\Z")))
def test_any_text(text: str) -> None:
    assert outcome(yaml_scalar.load, text) == outcome(yaml.safe_load, text)


def test_a_list_is_a_new_one_each_time() -> None:
    yaml_scalar.load("[1, 2]").append(3)
    assert yaml_scalar.load("[1, 2]") == [1, 2]


def test_ordinary_values_do_not_load_pyyaml() -> None:
    program = (
        "import sys; from enclave_launch.frontend.yaml_scalar import load\n"
        "assert [load(t) for t in ('$(var x)', 'on', '12', '-1.5', '/a/b.yaml', 'a b')]"
        " == ['$(var x)', True, 12, -1.5, '/a/b.yaml', 'a b']\n"
        "assert 'yaml' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", program], check=True)
