"""Methods of texts that are known: as ``std::string`` and ``std::string_view`` compute them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from nodl.infer.cpp.running.values import NPOS, Value, literal, plain

CHANGES = frozenset({
    "erase", "replace", "insert", "pop_back", "assign", "resize", "remove_prefix", "remove_suffix", "swap", "clear",
    "push_back", "append",
})  # fmt: skip
"""Methods after which the text is another one."""


def asked(known: str, name: str, values: Sequence[Value]) -> Value | None:
    """What a method tells of the text ``known``; ``None`` if that is not certain."""
    arguments = _plain(values)
    answer = _ASKED.get(name)
    if answer is None or arguments is None:
        return None
    try:
        return answer(known, *arguments)
    except (TypeError, IndexError, ValueError):
        return None


def changed(known: str, name: str, values: Sequence[Value]) -> str | None:
    """The text ``known`` after a method that changes it; ``None`` if that is not certain."""
    arguments = _plain(values)
    change = _CHANGED.get(name)
    if change is None or arguments is None:
        return None
    try:
        return change(known, *arguments)
    except (TypeError, IndexError, ValueError):
        return None


def _plain(values: Sequence[Value]) -> list[str | int] | None:
    found: list[str | int] = []
    for value in values:
        if len(value) != 1:
            return None
        one = value[0]
        known = one if isinstance(one, int) and not isinstance(one, bool) else _text(one)
        if one == NPOS:
            known = _TO_THE_END
        if known is None:
            return None
        found.append(known)
    return found


_TO_THE_END = 1 << 40


def _text(atom: object) -> str | None:
    return None if isinstance(atom, int | float) else plain(atom)


def _found(position: int) -> Value:
    return (position,) if position >= 0 else (NPOS,)


def _part(known: str, start: int = 0, count: int = _TO_THE_END) -> str:
    if not 0 <= start <= len(known):
        raise IndexError
    return known[start : start + count]


def _without(known: str, start: int = 0, count: int = _TO_THE_END) -> str:
    return known[:start] + known[len(known[:start]) + len(_part(known, start, count)) :]


def _exchanged(known: str, start: int, count: int, new: str) -> str:
    return known[:start] + _checked(new) + known[start + len(_part(known, start, count)) :]


def _with(known: str, start: int, new: str) -> str:
    return _part(known, 0, start) + _checked(new) + _part(known, start)


def _checked(new: object) -> str:
    if not isinstance(new, str):
        raise TypeError
    return new


_ASKED: dict[str, Callable[..., Value]] = {
    "find": lambda known, what, start=0: _found(known.find(_checked(what), start)),
    "rfind": lambda known, what: _found(known.rfind(_checked(what))),
    "find_first_of": lambda known, what: _found(next((i for i, c in enumerate(known) if c in what), -1)),
    "find_last_of": lambda known, what: _found(max((i for i, c in enumerate(known) if c in what), default=-1)),
    "size": lambda known: (len(known),), "length": lambda known: (len(known),), "empty": lambda known: (not known,),
    "front": lambda known: literal(known[0]), "back": lambda known: literal(known[-1]),
    "at": lambda known, at: literal(_part(known, at, 1) or _checked(None)),
    "substr": lambda known, *where: literal(_part(known, *where)),
    "starts_with": lambda known, what: (known.startswith(what),),
    "ends_with": lambda known, what: (known.endswith(what),),
    "contains": lambda known, what: (_checked(what) in known,),
    "compare": lambda known, other: ((known > _checked(other)) - (known < _checked(other)),),
}  # fmt: skip
_CHANGED: dict[str, Callable[..., str]] = {
    "erase": _without, "replace": _exchanged, "insert": _with, "pop_back": lambda known: _checked(known and known[:-1]),
    "assign": lambda known, new: _checked(new), "clear": lambda known: "",
    "push_back": lambda known, new: known + _checked(new), "append": lambda known, new: known + _checked(new),
    "resize": lambda known, size: known[:size] if size <= len(known) else _checked(None),
    "remove_prefix": lambda known, size: _part(known, size),
    "remove_suffix": lambda known, size: _part(known, 0, len(known) - size),
}  # fmt: skip
