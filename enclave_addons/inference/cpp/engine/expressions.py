"""How expressions run: literals, names, members, operators, closures. Calls are in ``calls``."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from enclave_addons.inference.cpp.engine.frames import NEXT, Frame
from enclave_addons.inference.cpp.engine.invocation import call_methods
from enclave_addons.inference.cpp.engine.launch_values import decided, settled
from enclave_addons.inference.cpp.engine.machine import Machine, expression
from enclave_addons.inference.cpp.engine.objects import (
    TEXTS,
    arguments,
    construct,
    converted,
    copied,
    default_of,
    made_of,
)
from enclave_addons.inference.cpp.engine.places import (
    declared_type,
    element,
    named_constant,
    place_of_name,
    places_of,
    read,
    step_of,
    write_all,
)
from enclave_addons.inference.cpp.engine.values import (
    BOTTOM,
    END,
    NULL,
    Atom,
    Bound,
    Const,
    Group,
    Lambda,
    Map,
    Obj,
    Param,
    Place,
    Pointer,
    Text,
    Unknown,
    Value,
    concatenated,
    join,
    literal,
    only,
    plain,
    unknown,
)
from enclave_addons.inference.cpp.reading.declarations import Function
from enclave_addons.inference.cpp.syntax import Node, children, field_of, text, unwrapped, words_in

_ESCAPES = {"n": "\n", "t": "\t", "r": "\r", "0": "\0", "\\": "\\", '"': '"', "'": "'"}


@expression("string_literal", "raw_string_literal")
def _string(run: Machine, node: Node, frame: Frame) -> Value:
    written = text(node)
    if node.type == "raw_string_literal":
        matched = re.search(r'R"([^(]*)\((.*)\)\1"', written, re.DOTALL)
        return literal(matched[2]) if matched else unknown("a raw text")
    inner = written[written.find('"') + 1 : -1]
    return literal(re.sub(r"\\(.)", lambda m: _ESCAPES.get(m[1], m[1]), inner))


@expression("concatenated_string")
def _concatenated(run: Machine, node: Node, frame: Frame) -> Value:
    return concatenated(*(run.evaluate(child, frame) for child in children(node)))


@expression("number_literal")
def _number(run: Machine, node: Node, frame: Frame) -> Value:
    written = text(node).replace("'", "").rstrip("uUlLzZ")
    try:
        return (int(written, 0) if not re.fullmatch(r"0[0-7]+", written) else int(written, 8),)
    except ValueError:
        pass
    try:
        return (float(written.rstrip("fF")),)
    except ValueError:
        return unknown("a number")


@expression("char_literal")
def _char(run: Machine, node: Node, frame: Frame) -> Value:
    inner = text(node)[1:-1]
    return literal(_ESCAPES.get(inner[1:], inner[1:]) if inner.startswith("\\") else inner)


@expression("true", "false")
def _bool(run: Machine, node: Node, frame: Frame) -> Value:
    return (node.type == "true",)


@expression("null")
def _null(run: Machine, node: Node, frame: Frame) -> Value:
    return (NULL,)


@expression("this")
def _this(run: Machine, node: Node, frame: Frame) -> Value:
    return (frame.this,) if frame.this is not None else unknown("this")


@expression("user_defined_literal", "parenthesized_expression", "dependent_name", "condition_clause", "cast_expression",
           "co_await_expression", "parameter_pack_expansion", "argument_list_item")  # fmt: skip
def _inner(run: Machine, node: Node, frame: Frame) -> Value:
    inner = field_of(node, "value") or field_of(node, "pattern") or next(iter(children(node)), None)
    return run.evaluate(inner, frame)


@expression(
    "sizeof_expression", "alignof_expression", "offsetof_expression", "type_descriptor", "delete_expression"
)
def _number_of_types(run: Machine, node: Node, frame: Frame) -> Value:
    return unknown("a number")


@expression("comma_expression", "ERROR")
def _several(run: Machine, node: Node, frame: Frame) -> Value:
    found = [run.evaluate(child, frame) for child in children(node)]
    return found[-1] if found and node.type != "ERROR" else unknown("what the parser did not understand")


# --- names --------------------------------------------------------------------------------------------------------


@expression("identifier", "qualified_identifier", "field_identifier", "template_function")
def _name(run: Machine, node: Node, frame: Frame) -> Value:
    return named(run, text(node), frame)


def named(run: Machine, name: str, frame: Frame) -> Value:
    """Return what a name means: a variable, constant, enumerator or function."""
    place = place_of_name(run, name, frame)
    if place is not None:
        return read(run, place)
    constant = named_constant(run, name)
    if constant is not None:
        return constant
    functions = functions_named(run, name, frame)
    if functions:
        return tuple(Bound(each, None) for each in functions)
    name = "".join(name.split())
    if name in ("NULL", "nullptr", "std::nullopt"):
        return (NULL,)
    if "::" in name and re.search(r"::[A-Z][A-Z0-9_]*$", name):
        return (Const(run.type_of(name.rpartition("::")[0], frame).name + "::" + name.rpartition("::")[2]),)
    return unknown(f"the value of {name}")


def functions_named(run: Machine, name: str, frame: Frame) -> list[Function]:
    """Return the functions that a name means: methods of the class around, or free ones."""
    name = re.sub(r"<.*>", "", "".join(name.split()))
    head, _, last = name.rpartition("::")
    if head:
        cls = run.class_of(run.type_of(head, frame), frame)
        if cls is not None:
            found = run.names.find_methods(cls, last)
            if found:
                return found
    elif frame.this is not None:
        found = run.names.find_methods(frame.this.cls, last)
        if found:
            return found
    return run.names.find_functions(name, frame.scope, frame.file)


@expression("field_expression")
def _field(run: Machine, node: Node, frame: Frame) -> Value:
    owners = run.evaluate(field_of(node, "argument"), frame)
    name = text(field_of(node, "field"))
    return join(*(member_of(run, atom, name) for atom in owners)) or unknown(
        f"{name} of something that is not set"
    )


def member_of(run: Machine, atom: Atom, name: str) -> Value:
    """Return a data member of a value."""
    if isinstance(atom, Pointer):
        return join(*(member_of(run, each, name) for each in read(run, atom.place)))
    if isinstance(atom, Obj):
        for cls in run.names.ancestry(atom.cls):
            if name in cls.fields and cls.fields[name].static:
                return (
                    read(run, place)
                    if (place := place_of_name(run, f"{cls.qualified}::{name}", _at(cls)))
                    else BOTTOM
                )
        if (atom, name) in run.store:
            return run.store.get((atom, name))
        methods = run.names.find_methods(atom.cls, name)
        return tuple(Bound(each, atom) for each in methods) or unknown(f"{name} of {atom.type.last}")
    if isinstance(atom, Group) and name in ("first", "second") and len(atom.items) == 2:
        return atom.items[name == "second"]
    if atom == NULL:
        return BOTTOM
    return unknown(atom.why) if isinstance(atom, Unknown) else unknown(f"the member {name} of a value")


def _at(cls: object) -> Frame:
    return Frame(cls.file, cls.scope)  # type: ignore[attr-defined]


@expression("subscript_expression")
def _subscript(run: Machine, node: Node, frame: Frame) -> Value:
    container = run.evaluate(field_of(node, "argument"), frame)
    index = field_of(node, "indices") or field_of(node, "index")
    given = children(index) if index is not None and index.type == "subscript_argument_list" else [index]
    key = run.evaluate(given[0] if given else None, frame)
    return entry_of(run, container, key, node, field_of(node, "argument"), frame)


def entry_of(
    run: Machine, container: Value, key: Value, node: Node, base: Node | None, frame: Frame
) -> Value:
    """Return ``container[key]``, an entry of a map that is not there yet has the first value of its type."""
    found = element(run, container, step_of(run, container, key))
    if not found and any(isinstance(atom, Map) for atom in container):
        kind = declared_type(run, base, frame)
        if len(kind.arguments) > 1:
            inner = replace(frame, path=run.path(frame.path, key))
            found = default_of(run, kind.arguments[1], node, inner)
            places = places_of(run, node, frame) if node.type == "subscript_expression" else []
            write_all(run, places, found)
    return found or unknown("an entry that is not there")


@expression("pointer_expression")
def _pointer(run: Machine, node: Node, frame: Frame) -> Value:
    argument = field_of(node, "argument")
    if text(node).startswith("*"):
        found = run.evaluate(argument, frame)
        return join(*(read(run, atom.place) if isinstance(atom, Pointer) else (atom,) for atom in found))
    inner = unwrapped(argument)
    if inner is not None and inner.type == "qualified_identifier":
        functions = functions_named(run, text(inner), frame)
        if functions:
            return tuple(Bound(each, None) for each in functions)
    value = run.evaluate(argument, frame)
    if value and all(isinstance(atom, Obj | Lambda | Bound) for atom in value):
        return value
    places = places_of(run, argument, frame)
    return tuple(Pointer(place) for place in places) or value


# --- operators ----------------------------------------------------------------------------------------------------


@expression("binary_expression")
def _binary(run: Machine, node: Node, frame: Frame) -> Value:
    sign = text(field_of(node, "operator"))
    left_node, right_node = field_of(node, "left"), field_of(node, "right")
    left = run.evaluate(left_node, frame)
    if sign in ("&&", "and", "||", "or"):
        return _logical(run, left, sign in ("&&", "and"), right_node, frame)
    right = run.evaluate(right_node, frame)
    if sign == "<<" and not isinstance(only(left), int):
        return _streamed(run, left, right, left_node, frame)
    if sign == ">>" and not isinstance(only(left), int):
        write_all(run, places_of(run, right_node, frame), unknown("what is read from a stream"))
        return left
    if sign in ("==", "!=", "<", ">", "<=", ">="):
        return _compared(run, sign, left, right)
    methods = [
        m for a in left if isinstance(a, Obj) for m in run.names.find_methods(a.cls, f"operator{sign}")
    ]
    owner = next((a for a in left if isinstance(a, Obj)), None)
    if methods and owner is not None:
        return call_methods(run, methods, owner, [right], node, frame, ())
    return calculated(sign, left, right)


def _logical(run: Machine, left: Value, is_and: bool, right_node: Node | None, frame: Frame) -> Value:
    known = decided(run, left)
    if known is not None and known is not is_and:
        run.kill(right_node, frame, "what stands before it decides")
        return (not is_and,)
    if known is not None:
        right = run.evaluate(right_node, frame)
        found = decided(run, right)
        return right if found is None else (found,)
    found_right: list[Value] = []

    def rest() -> int:
        found_right.append(run.evaluate(right_node, frame))
        return NEXT

    run.branches([rest, lambda: NEXT])
    other = decided(run, found_right[0])
    return (not is_and,) if other is not None and other is not is_and else unknown("a condition")


def _compared(run: Machine, sign: str, left: Value, right: Value) -> Value:
    first, second = only(settled(run, left)), only(settled(run, right))
    if first is None or second is None:
        return unknown("a comparison")
    if NULL in (first, second):
        other = second if first == NULL else first
        same = True if other == NULL else False if isinstance(other, Obj | Lambda | Bound | Pointer) else None
        return unknown("a comparison") if same is None else (same is (sign == "=="),)
    if END in (first, second) and sign in ("==", "!="):
        other = second if first == END else first
        if isinstance(other, Unknown):
            return unknown("a comparison")
        return ((other == END) is (sign == "=="),)
    if isinstance(first, int | float) and isinstance(second, int | float):
        return (_COMPARE[sign](first, second),)
    if isinstance(first, Text) and isinstance(second, Text):
        texts = plain(first), plain(second)
        return unknown("a comparison") if None in texts else (_COMPARE[sign](*texts),)
    if isinstance(first, Const) and isinstance(second, Const) and sign in ("==", "!="):
        return ((first == second) is (sign == "=="),)
    return unknown("a comparison")


def calculated(sign: str, left: Value, right: Value) -> Value:
    """Return the sum of texts or numbers, or what another operator gives."""
    if sign == "+" and (_is_text(left) or _is_text(right)):
        return concatenated(
            left or unknown("a text that is never set"), right or unknown("a text that is never set")
        )
    first, second = only(left), only(right)
    if isinstance(first, int | float) and isinstance(second, int | float):
        try:
            return (_arithmetic(sign, first, second),)
        except (ArithmeticError, ValueError, KeyError, TypeError):
            return unknown("a number")
    if sign == "/" and _is_text(left):
        return concatenated(left, literal("/"), right)
    return unknown("a number")


_ARITHMETIC: dict[str, Callable[[Any, Any], Any]] = {
    "+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv, "%": operator.mod,
    ">>": operator.rshift, "&": operator.and_, "|": operator.or_, "^": operator.xor,
}  # fmt: skip
_COMPARE: dict[str, Callable[[Any, Any], bool]] = {
    "==": operator.eq, "!=": operator.ne, "<": operator.lt, ">": operator.gt, "<=": operator.le, ">=": operator.ge,
}  # fmt: skip


def _arithmetic(sign: str, a: int | float, b: int | float) -> int | float:
    whole = isinstance(a, int) and isinstance(b, int)
    if sign in ("/", "%") and whole:
        quotient = abs(int(a)) // abs(int(b)) * (1 if (a < 0) == (b < 0) else -1)
        return quotient if sign == "/" else int(a) - quotient * int(b)
    result: int | float = _ARITHMETIC[sign](a, b)
    if abs(result) > 1 << 64:
        raise ArithmeticError
    return result


def _is_text(value: Value) -> bool:
    return any(isinstance(atom, Text | Param) for atom in value)


def _streamed(run: Machine, left: Value, right: Value, left_node: Node | None, frame: Frame) -> Value:
    """Run ``stream << text``: a stream is the text that was written to it."""
    target = unwrapped(left_node)
    while target is not None and target.type == "binary_expression":
        target = unwrapped(field_of(target, "left"))
    found = calculated("+", left, right) if _is_text(left) else left
    if target is not None and _is_text(left):
        places = places_of(run, target, frame)
        if declared_type(run, target, frame).name in TEXTS:
            write_all(run, places, found)
    return found


@expression("unary_expression")
def _unary(run: Machine, node: Node, frame: Frame) -> Value:
    sign = text(field_of(node, "operator"))
    value = run.evaluate(field_of(node, "argument"), frame)
    if sign in ("!", "not"):
        known = decided(run, value)
        return unknown("a condition") if known is None else (not known,)
    number = only(value)
    if isinstance(number, int | float) and sign in ("-", "+"):
        return (-number if sign == "-" else number,)
    return unknown("a number")


@expression("update_expression")
def _update(run: Machine, node: Node, frame: Frame) -> Value:
    target = field_of(node, "argument")
    before = run.evaluate(target, frame)
    after = calculated(text(field_of(node, "operator"))[:1], before, (1,))
    if any(isinstance(atom, Pointer | Obj | Group) for atom in before):
        return before
    write_all(run, places_of(run, target, frame), after)
    return after if text(node)[:2] in ("++", "--") else before


@expression("conditional_expression")
def _conditional(run: Machine, node: Node, frame: Frame) -> Value:
    test = decided(run, run.evaluate(field_of(node, "condition"), frame))
    yes, no = field_of(node, "consequence"), field_of(node, "alternative")
    if test is not None:
        run.kill(no if test else yes, frame, "the condition before it is decided")
        return run.evaluate(yes if test else no, frame)
    found: list[Value] = []

    def side(each: Node | None) -> int:
        found.append(run.evaluate(each, frame))
        return NEXT

    run.branches([lambda: side(yes), lambda: side(no)])
    return join(*found)


@expression("assignment_expression")
def _assignment(run: Machine, node: Node, frame: Frame) -> Value:
    target, sign = field_of(node, "left"), text(field_of(node, "operator"))
    value = run.evaluate(field_of(node, "right"), frame)
    if sign != "=":
        value = updated(run.evaluate(target, frame), sign[:-1], value)
    return assign(run, target, value, frame, field_of(node, "right"))


def updated(before: Value, sign: str, value: Value) -> Value:
    """Return what ``x += value`` and its neighbours give."""
    return calculated(sign, before, value)


def assign(run: Machine, target: Node | None, value: Value, frame: Frame, right: Node | None = None) -> Value:
    """Write a value to what ``target`` means; return it."""
    if target is None:
        return value
    kind = declared_type(run, target, frame)
    path = replace(frame, path=run.path(frame.path, "assigned", target.start_byte))
    if right is not None and right.type != "pointer_expression" and not kind.pointer:
        value = copied(run, value, right, path)
    value = converted(run, value, kind, target, path)
    if text(target).startswith("std::tie"):
        listed = arguments(field_of(target, "arguments"))
        for index, each in enumerate(listed):
            assign(run, each, element(run, value, index), frame)
        return value
    places = places_of(run, target, frame)
    if not places or any(isinstance(place.cell[0], Obj) and place.cell[0].cls is None for place in places):
        run.later([value])  # an option of a library's object
    write_all(run, places, value)
    return value


# --- closures, objects, lists -------------------------------------------------------------------------------------


@expression("lambda_expression")
def _lambda(run: Machine, node: Node, frame: Frame) -> Value:
    listed = text(field_of(node, "captures")).strip("[] \n")
    words = words_in(node)
    parts = [part.strip() for part in re.split(r",(?![^({]*[)}])", listed) if part.strip()]
    by_value = "=" in parts
    named_ones = {part.lstrip("&*").partition("=")[0].strip(" .") for part in parts}
    captured: list[tuple[str, Place | Value]] = []
    for name, variable in frame.variables.items():
        if name not in words or (name not in named_ones and not by_value and "&" not in parts):
            continue
        refers = f"&{name}" in parts or ("&" in parts and name not in named_ones)
        held = variable.place if refers else copied(run, read(run, variable.place), node, frame)
        captured.append((name, held))
    captures = field_of(node, "captures")
    for each in children(captures):
        if each.type in ("lambda_capture_initializer", "assignment_expression", "init_declarator"):
            inner = children(each)
            name = text(field_of(each, "left") or inner[0]).lstrip("&")
            captured.append((name, run.evaluate(field_of(each, "right") or inner[-1], frame)))
    return (Lambda(node.id, frame.this, tuple(captured), node, frame),)


@expression("new_expression")
def _new(run: Machine, node: Node, frame: Frame) -> Value:
    kind = run.type_of(text(field_of(node, "type")), frame)
    given = arguments(field_of(node, "arguments"))
    values = [run.evaluate(each, frame) for each in given]
    if "[" in text(node)[:200].partition("(")[0].partition("{")[0]:
        return unknown("an array that is made with new")
    return construct(run, kind, values, node, frame, heap=True, given=given)


@expression("compound_literal_expression")
def _literal_object(run: Machine, node: Node, frame: Frame) -> Value:
    kind = run.type_of(text(field_of(node, "type")), frame)
    listed = children(field_of(node, "value"))
    values = [run.evaluate(each, frame) for each in listed]
    run.handle(node, frame)
    return made_of(run, kind, values, listed, node, frame, braces=True)


@expression("initializer_list")
def _list(run: Machine, node: Node, frame: Frame) -> Value:
    return (Group(tuple(run.evaluate(each, frame) for each in children(node))),)


@expression("initializer_pair")
def _designated(run: Machine, node: Node, frame: Frame) -> Value:
    return run.evaluate(field_of(node, "value"), frame)
