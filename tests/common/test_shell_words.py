"""Command lines are split within a limit."""

from __future__ import annotations

import pytest

from enclave_common.shell_words import MAX_WORD, split_words


def test_words_are_those_of_a_shell() -> None:
    assert split_words('a \'b c\' "d\\"e" f\\ g') == ["a", "b c", 'd"e', "f g"]


@pytest.mark.parametrize("text", ["'a", "a\\"])
def test_what_does_not_end_is_an_error(text: str) -> None:
    with pytest.raises(ValueError, match="No "):
        split_words(text)


def test_a_word_has_a_longest_length() -> None:
    assert split_words("x" * MAX_WORD) == ["x" * MAX_WORD]
    assert len(split_words("x " * MAX_WORD)) == MAX_WORD
    with pytest.raises(ValueError, match="more than"):
        split_words("x" * (MAX_WORD + 1))
