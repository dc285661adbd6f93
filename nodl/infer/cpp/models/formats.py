"""Texts by a format: ``snprintf`` and its kin."""

from __future__ import annotations

import re
from collections.abc import Sequence

from nodl.infer.cpp.libraries import Call, library_function
from nodl.infer.cpp.running.assignments import assign
from nodl.infer.cpp.running.machine import Machine
from nodl.infer.cpp.running.values import BOTTOM, Value, concatenated, literal, plain, unknown
from nodl.infer.cpp.syntax import unwrapped

_PERCENT = re.compile(r"%(?P<flags>0?\d*)(?:hh|h|ll|l|z|j|t)?(?P<kind>[diusc%])|%")


@library_function("snprintf", "std::snprintf", "sprintf", "std::sprintf")
def _printed(run: Machine, call: Call) -> Value:
    """(buffer, [size,] format, ...): the text goes to the buffer."""
    first = 2 if _name(call).endswith("snprintf") else 1
    written = _percent(call.value(first), call.values[first + 1 :])
    if first == 2 and not _fits(written, call.value(1)):
        written = unknown("a text that may be cut off")
    target = unwrapped(call.given[0]) if call.given else None
    if target is not None:
        assign(run, target, written, call.frame)
    return unknown("the length of a text")


def _name(call: Call) -> str:
    return (call.node.named_children[0].text or b"").decode("utf-8", "replace")


def _fits(written: Value, size: Value) -> bool:
    """Whether nothing of a text is cut off; taken for granted where the size is that of the buffer."""
    length = max((len(plain(atom) or "") for atom in written), default=0)
    return not any(isinstance(atom, int) and length >= atom for atom in size)


def _percent(form: Value, values: Sequence[Value]) -> Value:
    """Return ``"topic_%02d"`` with its values; a conversion that is not followed makes a part that is not known."""
    written = plain(form[0]) if len(form) == 1 else None
    if written is None:
        return unknown("a text by a format that is not known")
    pieces, waiting, position = [], list(values), 0
    for match in _PERCENT.finditer(written):
        pieces.append(literal(written[position : match.start()]))
        position = match.end()
        value = literal("%") if match[0] == "%%" else BOTTOM
        if not value:
            value = _converted(
                match, waiting.pop(0) if waiting else unknown("a value that a format asks for")
            )
        pieces.append(value)
    return concatenated(*pieces, literal(written[position:]))


def _converted(match: re.Match[str], value: Value) -> Value:
    atom = value[0] if len(value) == 1 else None
    if match["kind"] in ("d", "i", "u"):
        is_number = isinstance(atom, int) and not isinstance(atom, bool)
        return literal(f"%{match['flags']}d" % atom) if is_number else unknown("a number by a format")
    return value if match["kind"] == "s" and not match["flags"] else unknown("a text by a format")
