"""Texts made of values: f-strings, ``%``, ``format``, ``join``."""

from __future__ import annotations

import ast
import re
import string
from collections.abc import Iterable
from collections.abc import Sequence as Sequences
from contextlib import suppress

from enclave_addons.inference.interpreter.run import Arguments, Run
from enclave_addons.inference.text import Hole, Text, TextAtom, common_text, concatenations
from enclave_addons.inference.values import (
    ANY,
    BOTTOM,
    RESULT,
    External,
    Frame,
    Items,
    Sequence,
    Unknown,
    Value,
    join,
    sole,
    unknown,
)


def _hole(why: str) -> Text:
    return Text((Hole(why),))


def as_texts(value: Value) -> list[TextAtom]:
    """Return the texts that formatting ``value`` may give."""
    texts = list(dict.fromkeys(_text_of_atom(atom) for atom in value))
    if not texts:
        return [_hole("a value that is never set")]
    return texts if len(texts) <= 32 else [common_text(texts, "too many possible values")]


def _text_of_atom(atom: object) -> TextAtom:
    if isinstance(atom, (str, Text)):
        return atom
    if isinstance(atom, (int, float, type(None))):
        return str(atom)
    if isinstance(atom, Unknown):
        return _hole(atom.why)
    if isinstance(atom, External):
        return _hole(f"a result of {atom.path.removesuffix(RESULT)}")
    return _hole("the text of an object")


def text_value(texts: Iterable[TextAtom]) -> Value:
    """Return a value of ``texts``; a text that is one hole is simply unknown."""
    result: Value = BOTTOM
    for text in texts:
        hole = text.pieces[0] if isinstance(text, Text) and text.is_hole else None
        result = join(result, unknown(hole.why) if isinstance(hole, Hole) else (text,))
    return result


def f_string(run: Run, node: ast.JoinedStr, frame: Frame) -> Value:
    """Return the texts that an f-string may give, with holes for what is not known."""
    operands: list[list[TextAtom]] = []
    for part in node.values:
        if isinstance(part, ast.Constant):
            operands.append([str(part.value)])
        elif isinstance(part, ast.FormattedValue):
            operands.append(_formatted(run, part, frame))
    return text_value(concatenations(operands))


def _formatted(run: Run, part: ast.FormattedValue, frame: Frame) -> list[TextAtom]:
    value = run.evaluate(part.value, frame)
    spec: Value = ("",) if part.format_spec is None else run.evaluate(part.format_spec, frame)
    if part.conversion not in (-1, 115):  # !r and !a quote their argument
        return [_hole("text made with !r")]
    if part.format_spec is None:
        return as_texts(value)
    known = sole(spec)
    return formatted(value, known if isinstance(known, str) else None)


_WIDE = re.compile(r"\d{4}")  # a width or precision that makes texts of no use, and of any size


def formatted(value: Value, spec: str | None) -> list[TextAtom]:
    """Run ``format(value, spec)`` for constants; what depends on the rest is a hole."""
    if spec == "":
        return as_texts(value)
    texts: list[TextAtom] = []
    for atom in value:
        if spec is None or not isinstance(atom, (str, int, float)) or _WIDE.search(spec):
            texts.append(_hole("formatted text"))
            continue
        with suppress(ValueError, TypeError, OverflowError):  # an error at run time, no text
            texts.append(format(atom, spec))
    return texts or [_hole("formatted text")]


_DIRECTIVE = re.compile(r"%(?:s|(\d*(?:\.\d+)?[dfx]))")


def percent(left: Value, right: Value) -> Value:
    """Run ``'text %s' % values`` where ``'text {}'.format(*values)`` says the same."""
    template, given = sole(left), sole(right)
    if not isinstance(template, str) or "%" in _DIRECTIVE.sub("", template):
        return unknown("a text made with %")
    several = given.items.exact if isinstance(given, Sequence) and given.kind == "tuple" else (right,)
    escaped = template.replace("{", "{{").replace("}", "}}")
    fields = _DIRECTIVE.sub(lambda found: f"{{:{found[1] or ''}}}", escaped)
    return text_value(str_format(fields, Arguments(list(several or ()))))


def str_format(template: TextAtom, args: Arguments) -> list[TextAtom]:
    """Run ``template.format(...)``."""
    if not isinstance(template, str):
        return [_hole("a format that is not known")]
    operands: list[Sequences[TextAtom]] = []
    automatic = 0
    try:
        fields = list(string.Formatter().parse(template))
    except ValueError:
        return [_hole("an invalid format")]
    for literal, name, spec, conversion in fields:
        operands.append([literal])
        if name is None:
            continue
        if name == "":
            name = str(automatic)
            automatic += 1
        value = (args.at(int(name)) if name.isdigit() else args.at(-1, name)) or ANY
        plain = not conversion and "{" not in (spec or "")
        operands.append(formatted(value, spec or "") if plain else [_hole("formatted text")])
    return concatenations(operands)


def joined(separators: Value, items: Items) -> list[TextAtom]:
    """Run ``separator.join(items)``."""
    separator_texts = [atom for atom in separators if isinstance(atom, (str, Text))]
    if items.exact is None or len(items.exact) > 32 or not separator_texts:
        return [_hole("joined texts")]
    results: list[TextAtom] = []
    for separator in separator_texts:
        operands: list[Sequences[TextAtom]] = []
        for index, element in enumerate(items.exact):
            operands.append([separator] if index else [""])
            operands.append(as_texts(element))
        results.extend(concatenations(operands))
    return results
