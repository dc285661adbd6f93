"""``split_words`` against the standard library's ``shlex.split``."""

from __future__ import annotations

import shlex

import pytest
from hypothesis import given
from hypothesis import strategies as st

from enclave_launch.boundary.shell_words import split_words


@given(st.text(alphabet="ab \t\n\r'\"\\$()#é\x0b", max_size=20))
def test_any_text_is_split_as_by_the_standard_library(text: str) -> None:
    try:
        expected = shlex.split(text)
    except ValueError as error:
        with pytest.raises(ValueError, match=f"^{error}$"):
            split_words(text)
    else:
        assert split_words(text) == expected


@pytest.mark.parametrize(
    "text", ["x" * 4_000_000, "'" + "x" * 4_000_000, '"' + "\\" * 4_000_001, "x " * 1_000_000]
)
def test_megabytes_take_no_quadratic_time(text: str) -> None:
    """The standard library takes about a quarter of an hour for the first."""
    try:
        words = split_words(text)
    except ValueError:
        return
    assert sum(map(len, words)) == text.count("x")
