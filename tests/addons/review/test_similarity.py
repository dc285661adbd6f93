"""Merges with their cost, splits with their gain."""

from __future__ import annotations

from enclave_addons.review.review_text import suggestions_text
from enclave_addons.review.similarity import merges, splits
from tests.addons.review.conftest import plan


def test_alike_enclaves_cheapest_first_and_no_others() -> None:
    found = merges(
        plan(
            {
                "/a": {"/a": {"publish": ["/x", "/y"]}},
                "/b": {"/b": {"publish": ["/x", "/y"]}},
                "/c": {"/c": {"publish": ["/x", "/y", "/z"]}},
                "/d": {"/d": {"subscribe": ["/x"]}},
            }
        )
    )
    assert [(merge.one, merge.two, round(merge.similarity, 2), merge.cost) for merge in found] == [
        ("/a", "/b", 1.0, 0),
        ("/a", "/c", 0.67, 1),
        ("/b", "/c", 0.67, 1),
    ]


def test_a_split_saves_what_a_node_does_not_ask_for() -> None:
    box = plan({"/box": {"/a": {"publish": ["/x"]}, "/b": {"publish": ["/x"], "subscribe": ["/y"]}}})
    (split,) = splits(box)
    assert (split.enclave, split.gain) == ("/box", 1)
    assert suggestions_text([], [split]) == "split /box: saves 1 permission\n  /a would lose: subscribe /y\n"
    assert splits(plan({"/box": {"/a": {"publish": ["/x"]}, "/b": {"publish": ["/x"]}}})) == []
