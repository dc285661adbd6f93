"""What ``--dump-params`` prints is read back by rcl's rules as the same values."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from enclave_launch.description.parameters.yaml_text import dump_for_rcl
from enclave_launch.ros_rules.parameter_file import sections_of_text

TEXTS = st.text(st.characters(codec="utf-8", exclude_categories=["Cc", "Cs"]), max_size=8)
NUMBER_LIKE = st.text("0123456789+-.eExXinfaNyY_ ", max_size=6)
SCALARS = (
    st.booleans(),
    st.integers(-(2**63), 2**63 - 1),
    st.floats(allow_nan=False),
    st.one_of(TEXTS, NUMBER_LIKE),
)
VALUES = st.one_of(*SCALARS, *(st.lists(each, min_size=1, max_size=3) for each in SCALARS))


def read_back(value: object) -> object:
    text = dump_for_rcl({"/n": {"ros__parameters": {"p": value}}}, allow_unicode=False)
    (section,) = sections_of_text(text).values()
    read = dict(section)["p"]
    return list(read) if isinstance(read, tuple) else read


@given(VALUES)
def test_values_come_back_as_they_were(value: object) -> None:
    read = read_back(value)
    assert read == value
    both = (read, value) if isinstance(value, list) else ([read], [value])
    assert [type(each) for each in both[0]] == [type(each) for each in both[1]]  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("value", "written"), [("n", "'n'"), ("0483", "'0483'"), ("chatter", "chatter"), (True, "true")]
)
def test_only_what_rcl_would_take_for_another_type_is_quoted(value: object, written: str) -> None:
    text = dump_for_rcl({"/n": {"ros__parameters": {"p": value}}}, allow_unicode=False)
    assert f"    p: {written}\n" in text
