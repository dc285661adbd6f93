"""Inputs near enough to valid documents to come past the first check: cut, doubled, mixed, sprinkled with words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from hypothesis import strategies as st


class Edit(NamedTuple):
    """At a position (of 1000) for a length: drop it, double it, or put a word there."""

    kind: str
    at: int
    length: int
    word: bytes

    def apply(self, document: bytes) -> bytes:
        start = self.at * len(document) // 1000
        end = min(len(document), start + self.length)
        head, part, tail = document[:start], document[start:end], document[end:]
        middle = {
            "drop": b"",
            "double": part + part,
            "word": self.word + part,
            "repeat": self.word * self.length,
        }
        return head + middle[self.kind] + tail


def damaged(seeds: Sequence[bytes], words: Sequence[bytes]) -> st.SearchStrategy[bytes]:
    """One of the seeds after up to eight edits, or text made of words alone, or any bytes."""
    any_word = st.one_of(st.sampled_from([*words, *_ANYWHERE]), st.binary(max_size=6))
    edit = st.builds(
        Edit,
        st.sampled_from(["drop", "double", "word", "repeat"]),
        st.integers(0, 1000),
        st.integers(0, 60),
        any_word,
    )
    return st.one_of(
        st.builds(_edited, st.sampled_from(list(seeds)), st.lists(edit, max_size=8)),
        st.lists(any_word, max_size=40).map(b"".join),
        st.binary(max_size=200),
    )


def _edited(document: bytes, edits: Sequence[Edit]) -> bytes:
    for edit in edits:
        document = edit.apply(document)
    return document


_ANYWHERE = (
    b"\0",
    b"\xff",
    b"\xef\xbb\xbf",
    b"\r",
    b"\n",
    b"\t",
    b"\x1b[2J",
    "\u202e".encode(),
    b"'",
    b'"',
    b"\\",
    b" ",
)
