"""Operators and text building: ``+``, ``%``, f-strings, ``format``, ``join``."""

from __future__ import annotations

import ast
import operator
import re
import string
from collections.abc import Callable, Iterable
from collections.abc import Sequence as Sequences
from pathlib import PurePath

from nodl.infer.interpreter import special
from nodl.infer.interpreter.frames import Arguments, Call, Frame
from nodl.infer.interpreter.raising import throw
from nodl.infer.interpreter.run import Run
from nodl.infer.text import Hole, Text, TextAtom, common_text, concatenate, concatenations, make_text
from nodl.infer.values import (
    ANY,
    BOTTOM,
    RESULT,
    Dictionary,
    External,
    Instance,
    Items,
    NativeObject,
    Sequence,
    Unknown,
    Value,
    join,
    sole,
    unknown,
)

_ARITHMETIC: dict[type, Callable[[object, object], object]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.Pow: operator.pow,
    ast.LShift: operator.lshift,
    ast.RShift: operator.rshift,
    ast.BitOr: operator.or_,
    ast.BitAnd: operator.and_,
    ast.BitXor: operator.xor,
}
_NUMBERS = (int, float)
_LARGE = 1 << 40


def binary(run: Run, node: ast.BinOp, frame: Frame) -> Value:
    left = run.evaluate(node.left, frame)
    right = run.evaluate(node.right, frame)
    return binary_operation(run, node, left, node.op, right, frame)


def binary_operation(
    run: Run, node: ast.AST, left: Value, op: ast.operator, right: Value, frame: Frame
) -> Value:
    if special.has_own(left) or special.has_own(right):
        defined = special.binary(run, left, op, right, node, frame)
        if defined:
            return defined
    if _holds(left, NativeObject) or _holds(right, NativeObject):
        return _native_binary(run, node, left, op, right, frame)
    containers = (Sequence, Dictionary)
    if len(left) == len(right) == 1 and isinstance(left[0], containers) and isinstance(right[0], containers):
        found = _container_operation(run, node, left, op, right, frame)
        if found is not None:
            return found
    if isinstance(op, ast.Add):
        return _add(run, node, left, right)
    if isinstance(op, ast.Mod) and any(isinstance(atom, str | Text) for atom in left):
        return percent(left, _spoken_operand(run, right, node, frame))
    if isinstance(op, ast.Div) and any(isinstance(atom, Instance) for atom in left):
        return ANY  # a path
    if type(op) in _ARITHMETIC and len(left) * len(right) <= 16:
        return _arithmetic(run, node, left, op, right)
    if isinstance(op, ast.BitOr):
        return join(left, right) if any(hasattr(atom, "cells") for atom in left) else ANY
    return ANY


def _holds(value: Value, kind: type) -> bool:
    for atom in value:  # noqa: SIM110 - asked at every operator
        if type(atom) is kind:
            return True
    return False


def _arithmetic(run: Run, node: ast.AST, left: Value, op: ast.operator, right: Value) -> Value:
    result: Value = BOTTOM
    for a in left:
        for b in right:
            result = join(result, _arithmetic_atoms(run, node, a, op, b))
    return result or ANY


def _arithmetic_atoms(run: Run, node: ast.AST, a: object, op: ast.operator, b: object) -> Value:
    if isinstance(op, ast.Mult) and isinstance(a, Sequence) and isinstance(b, int):
        exact = a.items.exact
        if exact is not None and 0 <= len(exact) * b <= 64:
            return run.sequence(node, a.kind, Items(exact * b))
        return run.sequence(node, a.kind, Items(None, a.items.any_element()))
    if not (isinstance(a, _NUMBERS) and isinstance(b, _NUMBERS)):
        if isinstance(op, ast.Mult) and isinstance(a, str) and isinstance(b, int) and len(a) * b < 300:
            return (a * b,)
        return (b,) if isinstance(b, Unknown) else (a,) if isinstance(a, Unknown) else ANY
    if isinstance(op, ast.Pow | ast.LShift | ast.RShift) and (abs(a) > _LARGE or not 0 <= b <= 64):
        return ANY  # of any size
    try:
        result = _ARITHMETIC[type(op)](a, b)
    except (ArithmeticError, ValueError) as error:
        throw(run, type(error))
        return ANY
    except TypeError:
        return ANY
    return (result,) if isinstance(result, _NUMBERS) and abs(result) < _LARGE else ANY


def _add(run: Run, node: ast.AST, left: Value, right: Value) -> Value:
    if len(left) == 1 and len(right) == 1 and type(left[0]) is str and type(right[0]) is str:
        return (concatenate(left[0], right[0]),)
    texts_left = [atom for atom in left if isinstance(atom, str | Text)]
    texts_right = [atom for atom in right if isinstance(atom, str | Text)]
    sequences = [atom for atom in (*left, *right) if isinstance(atom, Sequence)]
    if sequences:
        return _added_sequences(run, node, left, right, sequences)
    if not texts_left and not texts_right:
        return _arithmetic(run, node, left, ast.Add(), right) if len(left) * len(right) <= 16 else ANY
    # One side is a text, so the sum is only defined where the other one is too.
    return tuple(
        concatenations([texts_left or as_texts(left), texts_right or as_texts(right)])
        if _pure(left) and _pure(right)
        else concatenations([_text_side(left), _text_side(right)])
    )


def _container_operation(
    run: Run, node: ast.AST, left: Value, op: ast.operator, right: Value, frame: Frame
) -> Value | None:
    """Union, difference ... of sets, and ``|`` of dictionaries."""
    from nodl.infer.interpreter.expressions import copy_dictionary
    from nodl.infer.models import concrete

    if isinstance(left[0], Dictionary) and isinstance(op, ast.BitOr):
        merged = run.allocate(node, "merged", Dictionary)
        assert isinstance(merged, Dictionary)
        copy_dictionary(run, merged, left)
        copy_dictionary(run, merged, right)
        return (merged,)
    function = {
        ast.BitOr: operator.or_,
        ast.BitAnd: operator.and_,
        ast.BitXor: operator.xor,
        ast.Sub: operator.sub,
    }
    chosen = function.get(type(op))
    call = Call(Arguments([left, right]), node, frame)
    return concrete.compute(run, chosen, call) if chosen is not None else None


def _native_binary(
    run: Run, node: ast.AST, left: Value, op: ast.operator, right: Value, frame: Frame
) -> Value:
    """A path divided by a text, for instance."""
    from nodl.infer.models import concrete

    function = getattr(
        operator, special.OPERATORS[type(op)].replace("or", "or_").replace("and", "and_"), None
    )
    call = Call(Arguments([left, right]), node, frame)
    found = concrete.compute(run, function, call) if function is not None else None
    return found if found is not None else ANY


def _spoken_operand(run: Run, right: Value, node: ast.AST, frame: Frame) -> Value:
    """The right side of ``%`` with the program's objects as their texts."""
    atom = sole(right)
    if isinstance(atom, Sequence) and atom.kind == "tuple" and atom.items.exact is not None:
        return run.tuple_of(tuple(special.spoken(run, each, node, frame) for each in atom.items.exact))
    return special.spoken(run, right, node, frame)


def _pure(value: Value) -> bool:
    return not any(isinstance(atom, Unknown) for atom in value)


def _text_side(value: Value) -> list[TextAtom]:
    found: list[TextAtom] = []
    for atom in value:
        if isinstance(atom, str | Text):
            found.append(atom)
        elif isinstance(atom, Unknown):
            found.append(make_text((Hole(atom.why),)))
    return found or as_texts(value)


def _added_sequences(run: Run, node: ast.AST, left: Value, right: Value, sequences: list[Sequence]) -> Value:
    kind = sequences[0].kind
    if len(left) == len(right) == 1 and len(sequences) == 2:
        first, second = sequences[0].items, sequences[1].items
        if first.exact is not None and second.exact is not None and len(first.exact + second.exact) <= 256:
            return run.sequence(node, kind, Items(first.exact + second.exact))
    element: Value = BOTTOM
    for sequence in sequences:
        element = join(element, sequence.items.any_element())
    if any(not isinstance(atom, Sequence) for atom in (*left, *right)):
        element = join(element, ANY)
    return run.sequence(node, kind, Items(None, element))


# --- text ---------------------------------------------------------------------------------------------------


def as_texts(value: Value, convert: bool = True) -> list[TextAtom]:
    """The texts that formatting ``value`` may give."""
    texts = list(dict.fromkeys(_text_of_atom(atom) for atom in value))
    if not texts:
        return [make_text((Hole("a value that is never set"),))]
    return texts if len(texts) <= 32 else [common_text(texts, "too many possible values")]


def _text_of_atom(atom: object) -> TextAtom:
    if isinstance(atom, str | Text):
        return atom
    if isinstance(atom, int | float | type(None)):
        return str(atom)
    if isinstance(atom, Unknown):
        return make_text((Hole(atom.why),))
    if isinstance(atom, External):
        return make_text((Hole(f"a result of {atom.path.removesuffix(RESULT)}"),))
    if isinstance(atom, NativeObject) and isinstance(atom.object, PurePath):
        return str(atom.object)
    if isinstance(atom, Instance) and "_value_" in atom.cells:
        value = sole(atom.cells["_value_"])
        if isinstance(value, str):
            return value
    return make_text((Hole("the text of an object"),))


def text_value(texts: Iterable[TextAtom]) -> Value:
    """A value of ``texts``; a text that is one hole is simply unknown."""
    result: Value = BOTTOM
    for text in texts:
        if isinstance(text, Text) and text.is_hole:
            hole = text.pieces[0]
            assert isinstance(hole, Hole)
            result = join(result, unknown(hole.why))
        else:
            result = join(result, (text,))
    return result


def f_string(run: Run, node: ast.JoinedStr, frame: Frame) -> Value:
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
    said = special.spoken(run, value, part, frame, spec if part.conversion == -1 else None)
    if said is not value and part.conversion == -1:
        return as_texts(said)
    value = said
    if part.conversion not in (-1, 115):  # !r and !a quote their argument
        return [make_text((Hole("text made with !r"),))]
    if part.format_spec is None:
        return as_texts(value)
    known = sole(spec)
    return formatted(value, known if isinstance(known, str) else None)


_WIDE = re.compile(r"\d{4}")  # a width or precision that makes texts of no use, and of any size


def formatted(value: Value, spec: str | None) -> list[TextAtom]:
    """``format(value, spec)`` for constants; what depends on the rest is a hole."""
    if spec == "":
        return as_texts(value)
    texts: list[TextAtom] = []
    for atom in value:
        if spec is not None and isinstance(atom, str | int | float) and not _WIDE.search(spec):
            try:
                texts.append(format(atom, spec))
                continue
            except (ValueError, TypeError, OverflowError):
                continue  # an error at run time, no text
        texts.append(make_text((Hole("formatted text"),)))
    return texts or [make_text((Hole("formatted text"),))]


def percent(left: Value, right: Value) -> Value:
    """``'text %s' % values``."""
    results: list[TextAtom] = []
    for atom in left:
        if isinstance(atom, str):
            results.extend(_percent_one(atom, right))
        elif isinstance(atom, Text):
            results.append(make_text((Hole("a format that is not known"),)))
    return text_value(results) or ANY


_DIRECTIVE = re.compile(r"%(?:\((?P<key>[^)]{0,200})\))?(?P<flags>[#0\- +]*\d*(?:\.\d+)?)(?P<type>[a-zA-Z%])")


def _percent_one(template: str, right: Value) -> list[TextAtom]:
    atom = sole(right)
    positional: tuple[Value, ...] | None = (right,)
    if isinstance(atom, Sequence) and atom.kind == "tuple":
        positional = atom.items.exact
    operands: list[Sequences[TextAtom]] = []
    position = used = 0
    for match in _DIRECTIVE.finditer(template):
        operands.append([template[position : match.start()]])
        position = match.end()
        if match["type"] == "%":
            operands.append(["%"])
            continue
        if match["key"] is not None:
            value = _mapping_item(atom, match["key"])
        elif positional is not None and used < len(positional):
            value = positional[used]
        else:
            value = ANY
        used += 1
        operands.append(_percent_text(match, value))
    operands.append([template[position:]])
    return concatenations(operands)


def _percent_text(match: re.Match[str], value: Value) -> list[TextAtom]:
    if match["type"] == "s" and not match["flags"]:
        return as_texts(value)
    texts: list[TextAtom] = []
    for atom in value:
        if isinstance(atom, str | int | float) and not _WIDE.search(match["flags"]):
            try:
                texts.append(f"%{match['flags']}{match['type']}" % atom)
                continue
            except (TypeError, ValueError, OverflowError):
                continue
        texts.append(make_text((Hole("formatted text"),)))
    return texts or [make_text((Hole("formatted text"),))]


def _mapping_item(atom: object, key: str) -> Value:
    return (atom.held(key)[0] or ANY) if isinstance(atom, Dictionary) else ANY


def str_format(template: TextAtom, args: Arguments) -> list[TextAtom]:
    """``template.format(...)``."""
    if not isinstance(template, str):
        return [make_text((Hole("a format that is not known"),))]
    operands: list[Sequences[TextAtom]] = []
    automatic = 0
    try:
        fields = list(string.Formatter().parse(template))
    except ValueError:
        return [make_text((Hole("an invalid format"),))]
    for literal, name, spec, conversion in fields:
        operands.append([literal])
        if name is None:
            continue
        if name == "":
            name = str(automatic)
            automatic += 1
        value = _format_argument(name, args)
        operands.append(
            formatted(value, spec or "")
            if not conversion and "{" not in (spec or "")
            else [make_text((Hole("formatted text"),))]
        )
    return concatenations(operands)


def _format_argument(name: str, args: Arguments) -> Value:
    if name.isdigit():
        return args.at(int(name)) or ANY
    return args.at(-1, name) or ANY


def joined(separators: Value, items: Items) -> list[TextAtom]:
    """``separator.join(items)``."""
    separator_texts = [atom for atom in separators if isinstance(atom, str | Text)]
    if items.exact is None or len(items.exact) > 32 or not separator_texts:
        return [make_text((Hole("joined texts"),))]
    results: list[TextAtom] = []
    for separator in separator_texts:
        operands: list[Sequences[TextAtom]] = []
        for index, element in enumerate(items.exact):
            operands.append([separator] if index else [""])
            operands.append(as_texts(element))
        results.extend(concatenations(operands))
    return results
