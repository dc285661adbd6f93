"""What expressions are: literals, names, braces, lambdas. Operators and calls have modules of their own."""

from __future__ import annotations

import re
from contextlib import suppress

from nodl.infer.cpp.running.arithmetic import SIZES
from nodl.infer.cpp.running.constructors import as_map, cast, construct, made
from nodl.infer.cpp.running.machine import Frame, Machine, expression
from nodl.infer.cpp.running.references import keep_references
from nodl.infer.cpp.running.values import (
    BOTTOM,
    Group,
    Lambda,
    Seq,
    Value,
    concatenated,
    has_text,
    literal,
    unknown,
)
from nodl.infer.cpp.running.variables import variable
from nodl.infer.cpp.syntax import Node, children, field_of, text, unwrapped, walk

_ESCAPES = {"n": "\n", "t": "\t", "\\": "\\", '"': '"', "'": "'", "0": "\0", "r": "\r"}


@expression("string_literal")
def string_literal(run: Machine, node: Node, frame: Frame) -> Value:
    """Return the text between the quotes with its escapes resolved; a prefix like ``u8`` is dropped."""
    whole = text(node)
    inner = whole[whole.find('"') + 1 : -1]
    return literal(re.sub(r"\\(x[0-9a-fA-F]+|[0-7]{1,3}|u[0-9a-fA-F]{4}|.)", lambda m: _escaped(m[1]), inner))


def _escaped(written: str) -> str:
    if written[0] in "xu" and len(written) > 1:
        return chr(int(written[1:], 16))
    if written.isdigit() and written[0] in "01234567":
        return chr(int(written, 8))
    return _ESCAPES.get(written, written)


@expression("raw_string_literal")
def raw_string(run: Machine, node: Node, frame: Frame) -> Value:
    """Return the text between the outer parentheses, backslashes as they are."""
    return literal(text(node).partition("(")[2].rpartition(")")[0])


@expression("concatenated_string")
def concatenated_string(run: Machine, node: Node, frame: Frame) -> Value:
    """Join adjacent literals to one text; a macro name between them may become an unknown part of it."""
    return concatenated(*(run.evaluate(child, frame) for child in children(node)))


@expression("user_defined_literal")
def user_defined(run: Machine, node: Node, frame: Frame) -> Value:
    """Return texts with the suffix ``s`` or ``sv``; any other suffix, such as ``ms``, makes an unknown."""
    inner = children(node)
    suffix = text(inner[-1]) if len(inner) > 1 else ""
    plain = suffix in ("s", "sv") and inner[0].type.endswith("string_literal")
    return run.evaluate(inner[0], frame) if plain else unknown(f"a literal with {suffix or 'a suffix'}")


@expression("char_literal")
def character(run: Machine, node: Node, frame: Frame) -> Value:
    """Return the letter as a text, with simple escapes such as that for a newline resolved."""
    inner = text(node)[1:-1]
    return literal(_ESCAPES.get(inner[1:], inner[1:]) if inner.startswith("\\") else inner)


@expression("number_literal")
def number(run: Machine, node: Node, frame: Frame) -> Value:
    """Return an integer if the digits make one, else a float ([lex.icon], [lex.fcon]); unknown if they make neither."""
    written = text(node).replace("'", "").lower()
    digits, hexadecimal = written.rstrip("ulz"), written.startswith("0x")
    octal = digits.isdigit() and digits.startswith("0")
    with suppress(ValueError):
        return (int(digits, 8 if octal else 0),)
    with suppress(ValueError):
        return (float.fromhex(written) if hexadecimal else float(written.rstrip("fl")),)
    return unknown("a number")


@expression("true", "false")
def boolean(run: Machine, node: Node, frame: Frame) -> Value:
    """Return ``true`` and ``false`` as a Python ``bool``."""
    return (node.type == "true",)


@expression("null", "nullptr")
def null(run: Machine, node: Node, frame: Frame) -> Value:
    """Return no alternative at all: a null pointer adds nothing to what a variable may be."""
    return BOTTOM


@expression("this")
def this(run: Machine, node: Node, frame: Frame) -> Value:
    """Return the object whose method runs; in a lambda that of the function around it; unknown outside of both."""
    owner: Frame | None = frame
    while owner is not None and owner.this is None:
        owner = owner.outer
    return (owner.this,) if owner is not None and owner.this is not None else unknown("this")


@expression("parenthesized_expression", "condition_clause", "dependent_name", "init_statement")
def inside(run: Machine, node: Node, frame: Frame) -> Value:
    """Evaluate parentheses, a condition: the value of the expression in them."""
    return run.evaluate(unwrapped(node), frame)


@expression("parameter_pack_expansion")
def expansion(run: Machine, node: Node, frame: Frame) -> Value:
    """Evaluate ``args...``: the value of the expression before the dots."""
    return run.evaluate(node.named_children[0], frame)


@expression("comma_expression")
def comma(run: Machine, node: Node, frame: Frame) -> Value:
    """Evaluate every operand from the left; the value is that of the last."""
    found = BOTTOM
    for child in children(node):
        found = run.evaluate(child, frame)
    return found


# --- names ----------------------------------------------------------------------------------------------------


@expression("identifier", "field_identifier", "namespace_identifier", "type_identifier")
def identifier(run: Machine, node: Node, frame: Frame) -> Value:
    """Look up a variable, member, constant, enumerator or function; unknown if none of that name is in reach."""
    return variable(run, text(node), frame)


@expression("qualified_identifier")
def qualified(run: Machine, node: Node, frame: Frame) -> Value:
    """Look up, as ``identifier``, a name with ``::``, without blanks."""
    return variable(run, re.sub(r"\s+", "", text(node)), frame)


# --- what makes something ---------------------------------------------------------------------------------------


@expression("initializer_list")
def initializer_list(run: Machine, node: Node, frame: Frame) -> Value:
    """Evaluate braces without a type: a map if every item is a pair that starts with a text, else a list."""
    items = [run.evaluate(child, frame) for child in children(node)]
    pairs = [
        item for item in items if len(item) == 1 and isinstance(item[0], Seq) and len(item[0].items) == 2
    ]
    if items and len(pairs) == len(items) and all(has_text(p[0].items[0]) for p in pairs):
        return as_map(items)
    return (Seq(tuple(items)),)


@expression("initializer_pair")
def initializer_pair(run: Machine, node: Node, frame: Frame) -> Value:
    """Return the value of ``.field = value``; who fills an aggregate reads the field."""
    return run.evaluate(field_of(node, "value"), frame)


@expression("argument_list")
def argument_list(run: Machine, node: Node, frame: Frame) -> Value:
    """Return the value of a single argument; several, or none, make a ``Group``."""
    values = [run.evaluate(child, frame) for child in children(node)]
    return values[0] if len(values) == 1 else (Group(tuple(values)),)


@expression("compound_literal_expression")
def compound_literal(run: Machine, node: Node, frame: Frame) -> Value:
    """Evaluate ``Foo{...}``: what the items in the braces make of the type."""
    kind = run.type_of(text(field_of(node, "type")), frame)
    return made(run, node, kind, children(field_of(node, "value")), frame)


@expression("new_expression")
def new(run: Machine, node: Node, frame: Frame) -> Value:
    """Evaluate ``new Foo(...)``: what its constructor makes, on the heap, so that assigning it copies nothing."""
    kind = run.type_of(text(field_of(node, "type")), frame)
    given = children(field_of(node, "arguments"))
    values = [run.evaluate(child, frame) for child in given]
    if kind.name in SIZES and field_of(node, "declarator") is not None:
        return unknown("an array of numbers")
    several = field_of(node, "declarator") is not None
    run.repeated += several
    found = construct(run, kind._replace(pointer=False), values, node, frame, heap=True)
    run.repeated -= several
    keep_references(run, found, given, frame)
    return found


@expression("sizeof_expression")
def size_of(run: Machine, node: Node, frame: Frame) -> Value:
    """Return the bytes of a fundamental type on 64 bit Linux; unknown for any other operand."""
    size = SIZES.get(text(field_of(node, "type") or field_of(node, "value")).strip("() "))
    return unknown("a size") if size is None else (size,)


@expression("delete_expression", "alignof_expression", "offsetof_expression", "requires_expression")
def nothing_known(run: Machine, node: Node, frame: Frame) -> Value:
    """Gives an unknown and leaves the operands unevaluated."""
    return unknown("a computed value")


@expression("cast_expression")
def c_cast(run: Machine, node: Node, frame: Frame) -> Value:
    """Convert ``(T) x`` like ``static_cast<T>(x)``."""
    kind = run.type_of(text(field_of(node, "type")), frame)
    return cast(run, kind, run.evaluate(field_of(node, "value"), frame))


@expression("lambda_expression")
def lambda_(run: Machine, node: Node, frame: Frame) -> Value:
    """Capture by value what the variable holds now; the rest is looked up where the lambda was made."""
    inner = Frame(
        frame.file, frame.scope, frame.function, None, frame.bindings, frame, frame.path, run.conditions(node, frame),
        depth=frame.depth, captured=True,
    )  # fmt: skip
    inner = run.frame((node.id, frame, frame.path), inner)
    if re.search(r"\)\s*mutable\b", text(field_of(node, "declarator"))) and (
        run.subtree_matters(node) or '"' in text(node)
    ):
        run.gap(node, frame, "a mutable closure changes what it captured: what it makes is not followed")
    outer: Frame | None = frame
    while outer is not None:
        outer.captured, outer = True, outer.outer
    captures = children(field_of(node, "captures"))
    for child in captures:
        if child.type == "lambda_capture_initializer" and len(children(child)) >= 2:
            named = children(child)
            run.local(inner, text(named[0]).lstrip("&"), run.evaluate(named[-1], frame))
    if frame.blocks or frame.kept:
        owners = {name: frame.owner_of(name) for name in words_of(node)}
        inner.kept = {name: owner for name, owner in owners.items() if owner is not None}
    names = {text(child) for child in captures if child.type == "identifier" and not _is_by_reference(child)}
    if "=" in {text(child) for child in captures} | {text(field_of(node, "captures"))[1:2]}:
        names |= set(words_of(node))
    for name in sorted(names):
        owner = frame.owner_of(name)
        if owner is not None and name not in inner.names:
            run.local(inner, name, run.store.get((owner, name)) or BOTTOM, owner.types.get(name, ""))
    return (Lambda(node, inner),)


def _is_by_reference(capture: Node) -> bool:
    return capture.prev_sibling is not None and capture.prev_sibling.type == "&"


def words_of(node: Node) -> list[str]:
    """Yield every identifier in ``node``, in order and with repetitions."""
    return [text(each) for each in walk(node) if each.type in ("identifier", "field_identifier")]
