"""What expressions are: literals, variables, operators, lambdas. Calls are in ``calls``."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from nodl.infer.cpp.machine import NEXT, Frame, Machine, expression
from nodl.infer.cpp.names import Type
from nodl.infer.cpp.objects import as_map, construct, copied, default_value, made, nodes_in
from nodl.infer.cpp.syntax import children, text, unwrapped, walk
from nodl.infer.cpp.values import (
    BOTTOM,
    END,
    NPOS,
    Bound,
    Const,
    Group,
    Lambda,
    Map,
    Obj,
    Param,
    Seq,
    Text,
    Unknown,
    Value,
    concatenated,
    join,
    literal,
    plain,
    truth,
    unknown,
)

if TYPE_CHECKING:
    from tree_sitter import Node

_ESCAPES = {"n": "\n", "t": "\t", "\\": "\\", '"': '"', "'": "'", "0": "\0", "r": "\r"}


@expression("string_literal")
def string_literal(run: Machine, node: Node, frame: Frame) -> Value:
    whole = text(node)
    inner = whole[whole.find('"') + 1 : -1]
    return literal(re.sub(r"\\(.)", lambda m: _ESCAPES.get(m[1], m[1]), inner))


@expression("raw_string_literal")
def raw_string(run: Machine, node: Node, frame: Frame) -> Value:
    return literal(text(node).partition("(")[2].rpartition(")")[0])


@expression("concatenated_string")
def concatenated_string(run: Machine, node: Node, frame: Frame) -> Value:
    return concatenated(*(run.evaluate(child, frame) for child in children(node)))


@expression("user_defined_literal")
def user_defined(run: Machine, node: Node, frame: Frame) -> Value:
    inner = children(node)
    return run.evaluate(inner[0], frame) if inner else unknown("a literal")


@expression("char_literal")
def character(run: Machine, node: Node, frame: Frame) -> Value:
    inner = text(node)[1:-1]
    return literal(_ESCAPES.get(inner[1:], inner[1:]) if inner.startswith("\\") else inner)


@expression("number_literal")
def number(run: Machine, node: Node, frame: Frame) -> Value:
    written = (
        text(node).replace("'", "").rstrip("uUlLfF")
        if not text(node).startswith("0x")
        else text(node).rstrip("uUlL")
    )
    try:
        return (
            int(written, 0)
            if not written.startswith("0") or len(written) == 1 or written[1] in "xXbB"
            else int(written, 8),
        )
    except ValueError:
        try:
            return (float(written),)
        except ValueError:
            return unknown("a number")


@expression("true", "false")
def boolean(run: Machine, node: Node, frame: Frame) -> Value:
    return (node.type == "true",)


@expression("null", "nullptr")
def null(run: Machine, node: Node, frame: Frame) -> Value:
    return BOTTOM


@expression("this")
def this(run: Machine, node: Node, frame: Frame) -> Value:
    owner: Frame | None = frame
    while owner is not None and owner.this is None:
        owner = owner.outer
    return (owner.this,) if owner is not None and owner.this is not None else unknown("this")


@expression(
    "parenthesized_expression",
    "condition_clause",
    "dependent_name",
    "init_statement",
    "parameter_pack_expansion",
)
def inside(run: Machine, node: Node, frame: Frame) -> Value:
    return run.evaluate(
        unwrapped(node) if node.type != "parameter_pack_expansion" else node.named_children[0], frame
    )


@expression("comma_expression")
def comma(run: Machine, node: Node, frame: Frame) -> Value:
    found = BOTTOM
    for child in children(node):
        found = run.evaluate(child, frame)
    return found


# --- names ----------------------------------------------------------------------------------------------------


@expression("identifier", "field_identifier", "namespace_identifier", "type_identifier")
def identifier(run: Machine, node: Node, frame: Frame) -> Value:
    return variable(run, text(node), frame)


@expression("qualified_identifier")
def qualified(run: Machine, node: Node, frame: Frame) -> Value:
    return variable(run, re.sub(r"\s+", "", text(node)), frame)


def variable(run: Machine, name: str, frame: Frame) -> Value:
    """Local variable, member, constant, enumerator or function of that name."""
    owner = frame.owner_of(name)
    if owner is not None:
        return run.store.get((owner, name)) or BOTTOM
    this_object = current_object(frame)
    if this_object is not None and "::" not in name:
        found = member(run, this_object, name, frame)
        if found is not None:
            return found
    found = constant(run, name, frame)
    if found is not None:
        return found
    if name.endswith("string::npos"):
        return (NPOS,)
    return unknown(f"the value of {name}")


def current_object(frame: Frame | None) -> Obj | None:
    while frame is not None:
        if frame.this is not None:
            return frame.this
        frame = frame.outer
    return None


def member(run: Machine, owner: Obj, name: str, frame: Frame) -> Value | None:
    """The field ``name`` of an object; ``None`` when its class has no such field in reach."""
    value = run.store.get((owner, name))
    if value is not None:
        return value
    if owner.cls is None:
        return None
    for each in run.names.ancestry(owner.cls):
        declared = each.fields.get(name)
        if declared is not None and declared.static:
            return static_member(run, each, name)
        if declared is not None:
            return BOTTOM
    return None


def static_member(run: Machine, cls: object, name: str) -> Value:
    from nodl.infer.cpp.declarations import Class

    assert isinstance(cls, Class)
    cell = (cls, name)
    known = run.store.get(cell)
    if known is not None:
        return known
    declared = cls.fields[name]
    frame = Frame(cls.file, cls.scope)
    outside = next(
        (g for g in run.names.globals.get(name, ()) if g.value is not None and g.scope[-1:] == (cls.name,)),
        None,
    )
    if declared.default is not None:
        found = _initial(run, declared.default, declared.type, frame)
    elif outside is not None:
        found = _initial(run, outside.value, declared.type, Frame(outside.file, cls.scope))
    else:
        kind = run.names.resolve(declared.type, cls.scope, cls.file)
        found = BOTTOM if declared.pointer or kind.pointer else default_value(run, declared.node, kind, frame)
    run.store.set(cell, found)
    return found


def _initial(run: Machine, value: Node | None, written: str, frame: Frame) -> Value:
    if value is not None and value.type in ("initializer_list", "argument_list"):
        return made(run, value, run.type_of(written, frame), children(value), frame)
    return run.evaluate(value, frame)


def constant(run: Machine, name: str, frame: Frame) -> Value | None:
    cell_owner = run.names.find_global(name, frame.scope, frame.file)
    if cell_owner is not None:
        cell = (cell_owner, "")
        known = run.store.get(cell)
        if known is None:
            inner = Frame(cell_owner.file, cell_owner.scope)
            run.store.set(cell, BOTTOM)
            kind = run.names.resolve(cell_owner.type, cell_owner.scope, cell_owner.file)
            if cell_owner.value is not None:
                known = _initial(run, cell_owner.value, cell_owner.type, inner)
            else:
                known = (
                    BOTTOM
                    if cell_owner.pointer or kind.pointer
                    else default_value(run, cell_owner.node, kind, inner)
                )
            run.store.set(cell, known)
        return known
    head, separator, last = name.rpartition("::")
    if separator:
        kind = run.type_of(head, frame)
        cls = run.names.class_of(kind, frame.scope, frame.file)
        for each in run.names.ancestry(cls) if cls is not None else ():
            if last in each.fields and each.fields[last].static:
                return static_member(run, each, last)
    if name in run.names.enumerators:
        return (Const(run.names.enumerators[name]),)
    if separator and f"{head.rpartition('::')[2]}::{last}" in run.names.enumerators:
        return (Const(run.names.enumerators[f"{head.rpartition('::')[2]}::{last}"]),)
    function = run.names.find_functions(name, frame.scope, frame.file)
    if function:
        return tuple(Bound(each, None) for each in function)
    return None


@expression("field_expression")
def field(run: Machine, node: Node, frame: Frame) -> Value:
    owners = run.evaluate(node.child_by_field_name("argument"), frame)
    name = text(node.child_by_field_name("field"))
    found: list[Value] = []
    for atom in owners:
        if isinstance(atom, Obj):
            value = member(run, atom, name, frame)
            if value is None and atom.cls is None and name.endswith(("options", "callbacks")):
                value = (run.obj(("field", atom, name), Type("")),)  # options in options
                run.store.set((atom, name), value)
            found.append(value if value is not None else unknown(f"the value of {name}"))
        elif isinstance(atom, Group) and name in ("first", "second") and len(atom.items) == 2:
            found.append(atom.items[name == "second"])
        else:
            found.append(unknown(f"the value of {text(node)[:60]}"))
    return join(*found) if found else unknown(f"the value of {text(node)[:60]}")


# --- operators ------------------------------------------------------------------------------------------------


@expression("binary_expression")
def binary(run: Machine, node: Node, frame: Frame) -> Value:
    operator = text(node.child_by_field_name("operator"))
    left_node, right_node = node.child_by_field_name("left"), node.child_by_field_name("right")
    left = run.evaluate(left_node, frame)
    if operator in ("&&", "||", "and", "or"):
        return _logical(run, operator in ("||", "or"), left, right_node, frame)
    right = run.evaluate(right_node, frame)
    if operator == ">>" and _has_text(left):
        return _extracted(run, left_node, left, right_node, frame)
    if operator == "<<":
        return _streamed(run, left_node, left, right, frame)
    if operator == "+" and (_has_text(left) or _has_text(right)):
        return concatenated(left, right)
    if operator == "/" and (_has_text(left) or _has_text(right)):
        return concatenated(left, literal("/"), right)
    if len(left) == 1 and len(right) == 1:
        return _computed(operator, left[0], right[0])
    return unknown(f"the value of {text(node)[:60]}")


def _has_text(value: Value) -> bool:
    return any(isinstance(atom, Text | Param) for atom in value)


def _logical(run: Machine, either: bool, left: Value, right_node: Node | None, frame: Frame) -> Value:
    known = truth(left)
    if known is either and known is not None:
        if right_node is not None:
            run.kill(right_node, frame, "the condition before decides")
        return (either,)
    if known is not None:
        value = truth(run.evaluate(right_node, frame))
        return (value,) if value is not None else unknown("a condition")
    found: list[Value] = []

    def second() -> int:
        found.append(run.evaluate(right_node, frame))
        return NEXT

    run.branches([second, lambda: NEXT])
    right = truth(found[0])
    return (either,) if right is either else unknown("a condition")


def _computed(operator: str, left: object, right: object) -> Value:
    if operator in ("==", "!="):
        same = _same(left, right)
        return unknown("a comparison") if same is None else (same == (operator == "=="),)
    if not isinstance(left, int | float) or not isinstance(right, int | float):
        return unknown("a computed value")
    try:
        return (_ARITHMETIC[operator](left, right),)
    except (KeyError, ZeroDivisionError, TypeError, ValueError, OverflowError):
        return unknown("a computed value")


def _same(left: object, right: object) -> bool | None:
    first, second = plain(left), plain(right)
    if first is not None and second is not None:
        return first == second
    if isinstance(left, Const) and isinstance(right, Const):
        return left == right
    if END in (left, right) and isinstance(left if right == END else right, Obj | Group | Text | Bound):
        return False  # an element that was found
    if NPOS in (left, right) and isinstance(left if right == NPOS else right, int):
        return False
    return None


_ARITHMETIC: dict[str, Callable[[Any, Any], Any]] = {
    "+": lambda a, b: a + b, "-": lambda a, b: a - b, "*": lambda a, b: a * b,
    "/": lambda a, b: a // b if isinstance(a, int) and isinstance(b, int) else a / b,
    "%": lambda a, b: a % b, "<": lambda a, b: a < b, ">": lambda a, b: a > b, "<=": lambda a, b: a <= b,
    ">=": lambda a, b: a >= b, "|": lambda a, b: a | b, "&": lambda a, b: a & b,
}  # fmt: skip


def _streamed(run: Machine, target: Node | None, left: Value, right: Value, frame: Frame) -> Value:
    """``stream << text``; the stream is a text that grows."""
    if not _has_text(left):
        return left or unknown("a stream")
    found = concatenated(left, right) if right else left
    inner = target
    while inner is not None and inner.type == "binary_expression":
        inner = inner.child_by_field_name("left")
    if inner is not None and inner.type in ("identifier", "field_expression", "field_identifier"):
        assign(run, inner, found, frame)
    return found


def _extracted(run: Machine, stream: Node | None, left: Value, right: Node | None, frame: Frame) -> Value:
    """``stream >> word``: the first word of a text that is known, and the rest stays."""
    words = [run.text_of(atom) for atom in left]
    if len(words) != 1 or words[0] is None or stream is None or right is None:
        if right is not None:
            assign(run, right, unknown("a word that is read from a stream"), frame)
        return unknown("a stream")
    found = words[0].split(None, 1)
    assign(run, stream, literal(found[1] if len(found) > 1 else ""), frame)
    if found:
        assign(run, right, literal(found[0]), frame)
    return (bool(found),)


@expression("unary_expression")
def unary(run: Machine, node: Node, frame: Frame) -> Value:
    operator = text(node.child_by_field_name("operator"))
    value = run.evaluate(node.child_by_field_name("argument"), frame)
    if operator in ("!", "not"):
        known = truth(value)
        return unknown("a condition") if known is None else (not known,)
    if operator == "-" and len(value) == 1 and isinstance(value[0], int | float):
        return (-value[0],)
    return value if operator == "+" else unknown("a computed value")


@expression("pointer_expression")
def pointer(run: Machine, node: Node, frame: Frame) -> Value:
    argument = node.child_by_field_name("argument")
    if text(node).startswith("&") and argument is not None and argument.type == "qualified_identifier":
        found = method_pointer(run, argument, frame)
        if found is not None:
            return found
    return run.evaluate(argument, frame)


def method_pointer(run: Machine, node: Node, frame: Frame) -> Value | None:
    """``&Foo::on_message``."""
    head, _, last = re.sub(r"\s+", "", text(node)).rpartition("::")
    kind = run.type_of(re.sub(r"<.*>$", "", head), frame)
    cls = run.names.class_of(kind, frame.scope, frame.file)
    if cls is None and (this_object := current_object(frame)) is not None and this_object.cls is not None:
        cls = next((c for c in run.names.ancestry(this_object.cls) if c.name == kind.last), None)
    methods = run.names.find_methods(cls, last) if cls is not None else []
    return tuple(Bound(each, None) for each in methods) or None


@expression("conditional_expression")
def conditional(run: Machine, node: Node, frame: Frame) -> Value:
    known = truth(run.evaluate(node.child_by_field_name("condition"), frame))
    sides = {True: node.child_by_field_name("consequence"), False: node.child_by_field_name("alternative")}
    if known is not None:
        other = sides[not known]
        if other is not None:
            run.kill(other, frame, "the condition before decides")
        return run.evaluate(sides[known], frame)
    found: list[Value] = []

    def side(which: Node | None) -> int:
        found.append(run.evaluate(which, frame))
        return NEXT

    run.branches([lambda: side(sides[True]), lambda: side(sides[False])])
    return join(*found)


@expression("assignment_expression")
def assignment(run: Machine, node: Node, frame: Frame) -> Value:
    left, operator = node.child_by_field_name("left"), text(node.child_by_field_name("operator"))
    right = node.child_by_field_name("right")
    if left is None:
        return BOTTOM
    if operator == "=" and right is not None and right.type == "initializer_list":
        value = _braced(run, left, right, frame)
    else:
        value = run.evaluate(right, frame)
    if operator == "=":
        value = copied(run, value, node, frame)
    elif operator == "+=":
        before = run.evaluate(left, frame)
        if _has_text(before):
            value = concatenated(before, value)
        elif len(before) == 1 and len(value) == 1:
            value = _computed("+", before[0], value[0])
        else:
            value = unknown("a computed value")
    else:
        value = unknown("a computed value")
    assign(run, left, value, frame)
    return value


def _braced(run: Machine, left: Node, right: Node, frame: Frame) -> Value:
    """``x = {...}``: of the type of x where that is known."""
    written = declared_type(run, left, frame)
    if written is not None and written[0].name:
        return made(run, right, written[0], children(right), frame)
    return run.evaluate(right, frame)


def declared_type(run: Machine, node: Node, frame: Frame) -> tuple[Type, bool] | None:
    """The type that a variable or member was declared with, and whether it is a pointer."""
    name = text(node).removeprefix("this->")
    owner = frame.owner_of(name)
    if owner is not None:
        written = owner.types.get(name, "")
        kind = run.type_of(written, owner)
        return kind, kind.pointer or written.endswith(("&", "*"))
    this_object = current_object(frame)
    if this_object is not None and this_object.cls is not None:
        for each in run.names.ancestry(this_object.cls):
            if name in each.fields:
                found = each.fields[name]
                kind = run.names.resolve(found.type, each.scope, each.file, this_object.bindings.get(each))
                return kind, found.pointer or kind.pointer
    outside = run.names.find_global(name, frame.scope, frame.file)
    if outside is not None:
        kind = run.names.resolve(outside.type, outside.scope, outside.file)
        return kind, outside.pointer or kind.pointer
    return None


def assign(run: Machine, target: Node, value: Value, frame: Frame) -> None:
    """Write to a variable, a member, an element."""
    inner = unwrapped(target)
    if inner is None:
        return
    if inner.type in ("identifier", "field_identifier", "qualified_identifier"):
        _assign_name(run, text(inner), value, frame)
    elif inner.type == "field_expression":
        _assign_field(run, inner, value, frame)
    elif inner.type == "subscript_expression":
        _assign_element(run, inner, value, frame)
    elif inner.type == "pointer_expression":
        argument = inner.child_by_field_name("argument")
        if argument is not None:
            assign(run, argument, value, frame)


def _assign_name(run: Machine, name: str, value: Value, frame: Frame) -> None:
    owner = frame.owner_of(name)
    if owner is not None:
        run.store.set((owner, name), value)
        return
    this_object = current_object(frame)
    if this_object is not None and "::" not in name:
        for each in run.names.ancestry(this_object.cls) if this_object.cls is not None else ():
            if name in each.fields:
                run.store.set((each if each.fields[name].static else this_object, name), value)
                return
    outside = run.names.find_global(name, frame.scope, frame.file)
    if outside is not None:
        run.store.set((outside, ""), value)
    elif this_object is not None:
        run.store.set((this_object, name), value)


def _assign_field(run: Machine, node: Node, value: Value, frame: Frame) -> None:
    owners = run.evaluate(node.child_by_field_name("argument"), frame)
    name = text(node.child_by_field_name("field"))
    objects = [atom for atom in owners if isinstance(atom, Obj)]
    if any(not isinstance(atom, Obj) or atom.cls is None for atom in owners) or not owners:
        for atom in value:  # a library keeps it and may call it
            run.later(atom, frame)
    for each in objects:
        strong = len(owners) == 1
        before = run.store.get((each, name)) or BOTTOM
        run.store.set((each, name), value if strong else join(before, value))


def _assign_element(run: Machine, node: Node, value: Value, frame: Frame) -> None:
    container = node.child_by_field_name("argument")
    keys = [run.evaluate(child, frame) for child in children(node.child_by_field_name("indices"))]
    if container is None:
        return
    found: list[Value] = []
    for atom in run.evaluate(container, frame):
        if isinstance(atom, Map) and keys:
            found.append((with_entry(atom, keys[0], value),))
        elif isinstance(atom, Seq):
            found.append((_with_item(atom, keys[0] if keys else BOTTOM, value),))
        else:
            found.append((atom,))
    if found:
        assign(run, container, join(*found), frame)


def with_entry(atom: Map, key: Value, value: Value) -> Map:
    definite = len(key) == 1 and plain(key[0]) is not None
    kept = tuple(entry for entry in atom.entries if not (definite and entry[0] == key))
    return Map((*kept, (key, value)), atom.open or not definite)


def _with_item(atom: Seq, key: Value, value: Value) -> Seq:
    if len(key) == 1 and isinstance(key[0], int) and 0 <= key[0] < len(atom.items) and not atom.open:
        return Seq((*atom.items[: key[0]], value, *atom.items[key[0] + 1 :]))
    return Seq((*atom.items, value), open=True)


@expression("update_expression")
def update(run: Machine, node: Node, frame: Frame) -> Value:
    argument = node.child_by_field_name("argument")
    before = run.evaluate(argument, frame)
    step = 1 if "++" in text(node) else -1
    after = (before[0] + step,) if len(before) == 1 and isinstance(before[0], int) else unknown("a counter")
    if argument is not None:
        assign(run, argument, after, frame)
    return before if not text(node).startswith(("++", "--")) else after


@expression("subscript_expression")
def subscript(run: Machine, node: Node, frame: Frame) -> Value:
    container = node.child_by_field_name("argument")
    keys = [run.evaluate(child, frame) for child in children(node.child_by_field_name("indices"))]
    found = [element(run, atom, keys[0] if keys else BOTTOM) for atom in run.evaluate(container, frame)]
    result = join(*found) if found else BOTTOM
    return result or unknown(f"the value of {text(node)[:60]}")


def element(run: Machine, atom: object, key: Value) -> Value:
    """``container[key]``."""
    from nodl.infer.cpp.objects import items_of

    if isinstance(atom, Map):
        definite = [value for known, value in atom.entries if len(key) == 1 and known == key]
        if definite and not atom.open:
            return definite[-1]
        return (
            join(*(value for _, value in atom.entries), unknown("an element of a map"))
            if atom.open or not definite
            else definite[-1]
        )
    if isinstance(atom, Seq | Group | Param):
        items, exact = items_of(run, atom)
        if exact and len(key) == 1 and isinstance(key[0], int) and 0 <= key[0] < len(items):
            return items[key[0]]
        return join(*items) if items else unknown("an element of a list")
    if isinstance(atom, Unknown):
        return (atom,)
    written = run.settled_text(atom) if isinstance(atom, Text) else None
    if written is not None and len(key) == 1 and isinstance(key[0], int) and 0 <= key[0] < len(written):
        return literal(written[key[0]])
    return unknown("an element of something that is not known")


# --- what makes something ---------------------------------------------------------------------------------------


@expression("initializer_list")
def initializer_list(run: Machine, node: Node, frame: Frame) -> Value:
    items = [run.evaluate(child, frame) for child in children(node)]
    pairs = [
        item for item in items if len(item) == 1 and isinstance(item[0], Seq) and len(item[0].items) == 2
    ]
    if items and len(pairs) == len(items) and all(_has_text(p[0].items[0]) for p in pairs):
        return as_map(items)
    return (Seq(tuple(items)),)


@expression("initializer_pair")
def initializer_pair(run: Machine, node: Node, frame: Frame) -> Value:
    return run.evaluate(node.child_by_field_name("value"), frame)


@expression("argument_list")
def argument_list(run: Machine, node: Node, frame: Frame) -> Value:
    inner = children(node)
    return (
        run.evaluate(inner[0], frame)
        if len(inner) == 1
        else (Group(tuple(run.evaluate(c, frame) for c in inner)),)
    )


@expression("compound_literal_expression")
def compound_literal(run: Machine, node: Node, frame: Frame) -> Value:
    kind = run.type_of(text(node.child_by_field_name("type")), frame)
    return made(run, node, kind, children(node.child_by_field_name("value")), frame)


@expression("new_expression")
def new(run: Machine, node: Node, frame: Frame) -> Value:
    kind = run.type_of(text(node.child_by_field_name("type")), frame)
    given = [run.evaluate(child, frame) for child in children(node.child_by_field_name("arguments"))]
    return construct(run, kind._replace(pointer=False), given, node, frame, heap=True)


@expression(
    "delete_expression",
    "sizeof_expression",
    "alignof_expression",
    "offsetof_expression",
    "requires_expression",
)
def nothing_known(run: Machine, node: Node, frame: Frame) -> Value:
    return unknown("a computed value")


@expression("cast_expression")
def cast(run: Machine, node: Node, frame: Frame) -> Value:
    return run.evaluate(node.child_by_field_name("value"), frame)


@expression("lambda_expression")
def lambda_(run: Machine, node: Node, frame: Frame) -> Value:
    """Captures by value keep what the variable holds now; the rest is looked up where the lambda was made."""
    inner = Frame(
        frame.file, frame.scope, frame.function, None, frame.bindings, frame, frame.path, run.conditions(node, frame),
        depth=frame.depth,
    )  # fmt: skip
    outer: Frame | None = frame
    while outer is not None:
        outer.captured, outer = True, outer.outer
    captures = children(node.child_by_field_name("captures"))
    for child in captures:
        if child.type == "lambda_capture_initializer" and len(children(child)) >= 2:
            named = children(child)
            run.local(inner, text(named[0]).lstrip("&"), run.evaluate(named[-1], frame))
    names = {text(child) for child in captures if child.type == "identifier"}
    if "=" in {text(child) for child in captures} | {text(node.child_by_field_name("captures"))[1:2]}:
        names |= set(words_of(node))
    for name in sorted(names):
        owner = frame.owner_of(name)
        if owner is not None and name not in inner.names:
            run.local(inner, name, run.store.get((owner, name)) or BOTTOM, owner.types.get(name, ""))
    return (Lambda(node, inner),)


def words_of(node: Node) -> list[str]:
    return [text(each) for each in walk(node) if each.type in ("identifier", "field_identifier")]


__all__ = ["nodes_in"]
