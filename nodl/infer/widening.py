"""Joining at the head of a loop so that it ends: what keeps growing becomes unknown or a pattern."""

from __future__ import annotations

from nodl.infer.text import Text
from nodl.infer.values import (
    ANY,
    TOO_MANY,
    Items,
    Sequence,
    Unknown,
    Value,
    contains,
    join,
    unknown,
    widened_texts,
)


def widen(old: Value, new: Value, texts_too: bool) -> Value:
    """``join`` for the head of a loop: counting numbers become unknown at once, growing texts a pattern."""
    if any(type(atom) is Unknown for atom in old):  # it may be any number or text already
        covered = (int, float, str, Text) if texts_too else (int, float)
        new = tuple(atom for atom in new if not isinstance(atom, covered) or contains(old, atom))
    joined = join(old, new)
    if joined is old:
        return old
    widened = _widened(old, joined, texts_too)
    return old if all(contains(old, atom) for atom in widened) else widened


def _widened(old: Value, joined: Value, texts_too: bool) -> Value:
    if isinstance(joined[0], Items) and old and isinstance(old[0], Items):
        return (_widen_items(old[0], joined[0], texts_too),)
    if any(type(atom) in (int, float) and not contains(old, atom) for atom in joined):
        if not old:
            return joined
        joined = join(tuple(atom for atom in joined if type(atom) not in (int, float)), ANY)
    texts = [atom for atom in joined if isinstance(atom, str | Text)]
    kept = [atom for atom in joined if not isinstance(atom, str | Text)]
    if texts_too and any(isinstance(atom, Sequence) and not contains(old, atom) for atom in kept):
        kept = [atom for atom in kept if not isinstance(atom, Sequence)]
        return join((*kept, *texts), unknown(TOO_MANY))  # containers in containers, without end
    if texts_too and len(texts) > 1 and any(not contains(old, text) for text in texts):
        return join(tuple(kept), (widened_texts(texts),))
    return joined


def _widen_items(old: Items, new: Items, texts_too: bool) -> Items:
    """Elements widen one by one while the length stays; later, and when it changes, all together."""
    if old.exact is not None and new.exact is not None and not texts_too:
        return Items(tuple(widen(a, b, texts_too) for a, b in zip(old.exact, new.exact, strict=True)))
    return Items(None, widen(old.any_element(), new.any_element(), texts_too))
