"""Texts by a format: ``snprintf`` and its kin, ``fmt::format``, ``std::format``."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from nodl.infer.cpp.libraries import Call, library_function
from nodl.infer.cpp.running.assignments import assign
from nodl.infer.cpp.running.machine import Machine
from nodl.infer.cpp.running.values import Value, concatenated, literal, plain, unknown
from nodl.infer.cpp.syntax import unwrapped

_PERCENT = re.compile(r"%(?P<flags>0?\d*)(?:hh|h|ll|l|z|j|t)?(?P<kind>[diusc%])|%")
_BRACES = re.compile(r"\{\{|\}\}|\{(?P<index>\d*)\}|[{}]")


@library_function("snprintf", "std::snprintf", "sprintf", "std::sprintf")
def _printed(run: Machine, call: Call) -> Value:
    """Model (buffer, [size,] format, ...): the text goes to the buffer."""
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
    """Return whether nothing of a text is cut off; taken for granted if the size is that of the buffer."""
    length = max((len(plain(atom) or "") for atom in written), default=0)
    return not any(isinstance(atom, int) and length >= atom for atom in size)


def _percent(form: Value, values: Sequence[Value]) -> Value:
    """Fill ``"topic_%02d"`` with its values; a conversion that is not followed makes a part that is not known."""
    pieces, waiting = [], list(values)
    for piece, match in _pieces(form, _PERCENT):
        if match is None or match[0] == "%%":
            pieces.append(literal(piece if match is None else "%"))
        else:
            value = waiting.pop(0) if waiting else unknown("a value that a format asks for")
            pieces.append(_converted(match, value))
    return concatenated(*pieces) if pieces else unknown("a text by a format that is not known")


def _converted(match: re.Match[str], value: Value) -> Value:
    atom = value[0] if len(value) == 1 else None
    if match["kind"] in ("d", "i", "u"):
        is_number = isinstance(atom, int) and not isinstance(atom, bool)
        return literal(f"%{match['flags']}d" % atom) if is_number else unknown("a number by a format")
    return value if match["kind"] == "s" and not match["flags"] else unknown("a text by a format")


@library_function("fmt::format", "std::format")
def _formatted(run: Machine, call: Call) -> Value:
    """Model (format, ...): ``{}`` and ``{0}`` are filled in; other fields make a part that is not known."""
    pieces, position = [], 0
    for piece, match in _pieces(call.value(0), _BRACES):
        if match is None or match[0] in ("{{", "}}"):
            pieces.append(literal(piece[:1] if match is not None else piece))
            continue
        index = int(match["index"]) if match["index"] else position
        position += 1
        known = match["index"] is not None and index + 1 < len(call.values)
        pieces.append(_shown(call.values[index + 1]) if known else unknown("a field of a format"))
    return concatenated(*pieces) if pieces else unknown("a text by a format that is not known")


def _shown(value: Value) -> Value:
    is_float = any(isinstance(atom, float | bool) for atom in value)
    return unknown("a number by a format") if is_float else value


def _pieces(form: Value, pattern: re.Pattern[str]) -> Iterator[tuple[str, re.Match[str] | None]]:
    """Split a format that is one known text into what is as written and what needs a value."""
    written = plain(form[0]) if len(form) == 1 else None
    position = 0
    for match in pattern.finditer(written or ""):
        if match.start() > position:
            yield (written or "")[position : match.start()], None
        yield match[0], match
        position = match.end()
    if written is not None:
        yield written[position:], None
