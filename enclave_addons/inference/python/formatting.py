"""Texts made of values: f-strings, ``%``, ``format``, ``join``."""

from __future__ import annotations

import re
import string
from collections.abc import Iterable, Sequence
from contextlib import suppress

from enclave_addons.inference.kernel.texts import AnyText, Hole, Text, common_text, concatenations
from enclave_addons.inference.kernel.values import (
    BOTTOM,
    External,
    Items,
    Obj,
    Unknown,
    Value,
    join,
    sole,
    unknown,
)
from enclave_addons.inference.python.objects import Arguments

_WIDE = re.compile(r"\d{4}")
_DIRECTIVE = re.compile(r"%(?:s|(\d*(?:\.\d+)?[dfx]))")


def hole(why: str) -> Text:
    """Return a text of which nothing is known."""
    return Text((Hole(why),))


def as_texts(value: Value) -> list[AnyText]:
    """Return the texts that ``str`` of ``value`` may give."""
    texts = list(dict.fromkeys(map(_text_of, value)))
    if not texts:
        return [hole("a value that is never set")]
    return texts if len(texts) <= 32 else [common_text(texts, "too many possible values")]


def _text_of(atom: object) -> AnyText:
    if isinstance(atom, (str, Text)):
        return atom
    if isinstance(atom, (int, float, type(None))):
        return str(atom)
    if isinstance(atom, Unknown):
        return hole(atom.why)
    return hole(f"a result of {atom.path}" if isinstance(atom, External) else "the text of an object")


def text_value(texts: Iterable[AnyText]) -> Value:
    """Return the value of ``texts``. A text that is one hole is simply unknown."""
    result: Value = BOTTOM
    for text in texts:
        only = text.hole if isinstance(text, Text) else None
        result = join(result, unknown(only.why) if only else (text,))
    return result


def formatted(value: Value, spec: str | None) -> list[AnyText]:
    """Return what ``format(value, spec)`` gives; ``None``: a format that is not known."""
    if spec == "":
        return as_texts(value)
    texts: list[AnyText] = []
    for atom in value:
        if spec is None or not isinstance(atom, (str, int, float)) or _WIDE.search(spec):
            texts.append(hole("formatted text"))
            continue
        with suppress(ValueError, TypeError, OverflowError):  # an error at run time, and no text
            texts.append(format(atom, spec))
    return texts or [hole("formatted text")]


def percent(left: Value, right: Value) -> Value:
    """Return ``'text %s' % values``."""
    template, given = sole(left), sole(right)
    if not isinstance(template, str) or "%" in _DIRECTIVE.sub("", template):
        return unknown("a text made with %")
    several: Sequence[Value] | None = [right]
    if isinstance(given, Obj) and given.kind == "tuple":
        items = given.cells["[items]"][0]
        several = items.exact if isinstance(items, Items) else None
    escaped = template.replace("{", "{{").replace("}", "}}")
    fields = _DIRECTIVE.sub(lambda found: f"{{:{found[1] or ''}}}", escaped)
    return text_value(str_format(fields, Arguments(list(several or ()))))


def str_format(template: str | Text, args: Arguments) -> list[AnyText]:
    """Return ``template.format(...)``."""
    if not isinstance(template, str):
        return [hole("a format that is not known")]
    operands: list[Sequence[AnyText]] = []
    counted = 0
    try:
        fields = list(string.Formatter().parse(template))
    except ValueError:
        return [hole("a format that is not valid")]
    for literal, name, spec, conversion in fields:
        operands.append([literal])
        if name is None:
            continue
        if name == "":
            name, counted = str(counted), counted + 1
        value = args.at(int(name)) if name.isdigit() else args.at(-1, name)
        plain = value is not None and conversion in (None, "s") and "{" not in (spec or "")
        operands.append(formatted(value or BOTTOM, spec or "") if plain else [hole("formatted text")])
    return concatenations(operands)


def joined(separator: str | Text, items: Items) -> list[AnyText]:
    """Return ``separator.join(items)``."""
    if items.exact is None:
        return [hole("texts that are joined")]
    operands: list[Sequence[AnyText]] = []
    for index, element in enumerate(items.exact):
        operands += [[separator], as_texts(element)] if index else [as_texts(element)]
    return concatenations(operands)
