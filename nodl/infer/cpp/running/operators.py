"""Operators on values: arithmetic, comparisons, texts put together, streams, pointers."""

from __future__ import annotations

import re
from dataclasses import replace

from nodl.infer.cpp.reading.type_names import Type
from nodl.infer.cpp.running.arithmetic import added, computed
from nodl.infer.cpp.running.assignments import assign
from nodl.infer.cpp.running.constructors import default_value
from nodl.infer.cpp.running.contents import items_of
from nodl.infer.cpp.running.invocation import by_operator, pointed_to
from nodl.infer.cpp.running.launch_values import settled_text, text_of
from nodl.infer.cpp.running.machine import NEXT, Frame, Machine, expression
from nodl.infer.cpp.running.static_types import class_of_member, current_object, seen_type
from nodl.infer.cpp.running.values import (
    BOTTOM,
    Bound,
    Group,
    Map,
    Obj,
    Param,
    Seq,
    Text,
    Unknown,
    Value,
    as_one_map,
    concatenated,
    has_text,
    join,
    literal,
    number_of,
    plain,
    truth,
    unknown,
)
from nodl.infer.cpp.running.variables import member
from nodl.infer.cpp.syntax import Node, children, field_of, text


@expression("field_expression")
def field(run: Machine, node: Node, frame: Frame) -> Value:
    """Evaluate ``x.f`` or ``x->f``: a member of an object, ``first`` or ``second`` of a pair; unknown for all else."""
    owners = run.evaluate(field_of(node, "argument"), frame)
    if text(field_of(node, "operator")) == "->":
        owners = pointed_to(run, owners, "operator->", node, frame)
    name = text(field_of(node, "field")).rpartition("::")[2]
    found: list[Value] = []
    for atom in owners:
        if isinstance(atom, Obj):
            value = member(run, atom, name, class_of_member(run, atom, name, node, frame))
            if value is None and atom.cls is None and name.endswith(("options", "callbacks")):
                value = (run.obj(("field", atom, name), Type("")),)  # options in options
                run.store.set((atom, name), value)
            found.append(value if value is not None else unknown(f"the value of {name}"))
        elif isinstance(atom, Group) and name in ("first", "second") and len(atom.items) == 2:
            found.append(atom.items[name == "second"])
        else:
            found.append(unknown(f"the value of {text(node)[:60]}"))
    return join(*found) if found else unknown(f"the value of {text(node)[:60]}")


@expression("binary_expression")
def binary(run: Machine, node: Node, frame: Frame) -> Value:
    """Evaluate ``a && b`` with ``b`` run only where it may be, arithmetic, comparisons, joined texts, streams."""
    operator = text(field_of(node, "operator"))
    left_node, right_node = field_of(node, "left"), field_of(node, "right")
    left = run.evaluate(left_node, frame)
    if operator in ("&&", "||", "and", "or"):
        return _logical(run, operator in ("||", "or"), left, right_node, frame)
    right = run.evaluate(right_node, frame)
    own = by_operator(run, operator, left, [right], node, frame)
    if own is not None:
        return own
    if operator == ">>" and has_text(left):
        return _extracted(run, left_node, left, right_node, frame)
    if operator == "<<" and not (len(left) == 1 and isinstance(left[0], int)):
        return _streamed(run, left_node, left, right_node, right, frame)
    if operator == "+" and (has_text(left) or has_text(right)):
        return added(left, right)
    if operator == "/" and (has_text(left) or has_text(right)):
        return concatenated(left, literal("/"), right)
    if len(left) == 1 and len(right) == 1:
        return computed(operator, left[0], right[0])
    return unknown(f"the value of {text(node)[:60]}")


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


_MANIPULATORS = re.compile(
    r"std::(?:hex|oct|fixed|scientific|setw|setfill|setprecision|setbase|boolalpha|(?:no)?show\w+|(?:no)?uppercase|left|right|"
    r"internal|put_\w+)\b"
)


def _streamed(
    run: Machine, target: Node | None, left: Value, written: Node | None, right: Value, frame: Frame
) -> Value:
    """Evaluate ``stream << text``; the stream is a text that grows, until something changes how it writes."""
    if not has_text(left):
        return left or unknown("a stream")
    if written is not None and _MANIPULATORS.match(text(written)):
        found = unknown("a stream that writes in a way of its own")
    else:
        pieces = tuple(literal(f"{atom:g}")[0] if isinstance(atom, float) else atom for atom in right)
        found = concatenated(left, pieces) if right else left
    inner = target
    while inner is not None and inner.type == "binary_expression":
        inner = field_of(inner, "left")
    if inner is not None and inner.type in ("identifier", "field_expression", "field_identifier"):
        assign(run, inner, found, frame)
    return found


def _extracted(run: Machine, stream: Node | None, left: Value, right: Node | None, frame: Frame) -> Value:
    """Take the first word of a text that is known for ``stream >> word``; the rest stays."""
    words = [text_of(run, atom) for atom in left]
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
    """Evaluate ``!x``, ``-x`` and ``+x``; unknown for other operators and for what cannot be computed."""
    operator = text(field_of(node, "operator"))
    value = run.evaluate(field_of(node, "argument"), frame)
    own = by_operator(run, operator, value, [], node, frame)
    if own is not None:
        return own
    if operator in ("!", "not"):
        known = truth(value)
        return unknown("a condition") if known is None else (not known,)
    if operator == "-" and len(value) == 1 and isinstance(value[0], int | float):
        return (-value[0],)
    return value if operator == "+" else unknown("a computed value")


@expression("pointer_expression")
def pointer(run: Machine, node: Node, frame: Frame) -> Value:
    """Evaluate ``&x`` and ``*x`` as ``x``; ``&Foo::f`` is the method, ``&text[i]`` is unknown."""
    argument = field_of(node, "argument")
    if text(node).startswith("&") and argument is not None and argument.type == "qualified_identifier":
        found = method_pointer(run, argument, frame)
        if found is not None:
            return found
    found = run.evaluate(argument, frame)
    if argument is not None and argument.type == "subscript_expression" and has_text(found):
        return unknown("a text from some letter on")
    if not text(node).startswith("&"):
        return pointed_to(run, found, "operator*", node, frame)
    own = by_operator(run, "&", found, [], node, frame)
    return found if own is None else own


def method_pointer(run: Machine, node: Node, frame: Frame) -> Value | None:
    """Evaluate ``&Foo::on_message``."""
    head, _, last = re.sub(r"\s+", "", text(node)).rpartition("::")
    kind = run.type_of(re.sub(r"<.*>$", "", head), frame)
    cls = run.class_of(kind, frame)
    if cls is None and (this_object := current_object(frame)) is not None and this_object.cls is not None:
        cls = next((c for c in run.names.ancestry(this_object.cls) if c.name == kind.last), None)
    methods = run.names.find_methods(cls, last)
    return tuple(Bound(each, None) for each in methods) or None


@expression("conditional_expression")
def conditional(run: Machine, node: Node, frame: Frame) -> Value:
    """Evaluate ``a ? b : c``: the side that is chosen, the other one dead; both joined if that is not decided."""
    known = truth(run.evaluate(field_of(node, "condition"), frame))
    sides = {True: field_of(node, "consequence"), False: field_of(node, "alternative")}
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


@expression("update_expression")
def update(run: Machine, node: Node, frame: Frame) -> Value:
    """Evaluate ``++x`` or ``x--``; an ``x`` that was not one known integer becomes unknown."""
    argument = field_of(node, "argument")
    before = run.evaluate(argument, frame)
    own = by_operator(run, "++" if "++" in text(node) else "--", before, [], node, frame)
    if own is not None:
        return own
    step = 1 if "++" in text(node) else -1
    after = (before[0] + step,) if len(before) == 1 and isinstance(before[0], int) else unknown("a counter")
    if argument is not None:
        assign(run, argument, after, frame)
    return before if not text(node).startswith(("++", "--")) else after


@expression("subscript_expression")
def subscript(run: Machine, node: Node, frame: Frame) -> Value:
    """Evaluate ``container[key]`` for all that the container may be; unknown if nothing is found."""
    container = field_of(node, "argument")
    held = run.evaluate(container, frame)
    keys = [run.evaluate(child, frame) for child in children(field_of(node, "indices"))]
    own = by_operator(run, "[]", held, keys, node, frame)
    if own is not None:
        return own
    if container is not None and keys and any(isinstance(atom, Map) for atom in held):
        held = _with_new_entries(run, held, keys[0], container, node, frame)
    found = [element(run, atom, keys[0] if keys else BOTTOM) for atom in held]
    result = join(*found) if found else BOTTOM
    return result or unknown(f"the value of {text(node)[:60]}")


def _with_new_entries(
    run: Machine, held: Value, key: Value, container: Node, node: Node, frame: Frame
) -> Value:
    """Return the maps after ``map[key]``, which makes an entry if there is none under the key ([map.access]).

    Entries of plain values are made for keys that are known alone.
    """
    kind = seen_type(run, container, frame)
    inner = kind.arguments[1] if len(kind.arguments) > 1 else None
    written = plain(key[0]) if len(key) == 1 else None
    after: list[object] = []
    if inner is None or (written is None and run.held_class(inner, frame) is None):
        after = [a._replace(open=True) if isinstance(a, Map) and written is None else a for a in held]
        assign(run, container, tuple(after), frame)
        return held
    for atom in held:
        known = isinstance(atom, Map) and any(entry[0] == key for entry in atom.entries)
        if isinstance(atom, Map) and not known:
            run.repeated += written is None
            place = replace(frame, path=(*frame.path, written))
            made = BOTTOM if inner.pointer else default_value(run, node, inner, place)
            run.repeated -= written is None
            atom = as_one_map((*atom.entries, (key, made)), atom.open or written is None)
        after.append(atom)
    if after != list(held):
        assign(run, container, tuple(after), frame)
    return tuple(after)


def element(run: Machine, atom: object, key: Value) -> Value:
    """Evaluate ``container[key]``."""
    if isinstance(atom, Map):
        definite = [value for known, value in atom.entries if len(key) == 1 and known == key]
        if definite and not atom.open:
            return definite[-1]
        return join(*(value for _, value in atom.entries), unknown("an element of a map"))
    key = tuple(map(number_of, key))
    if isinstance(atom, Seq | Group | Param):
        items, exact = items_of(run, atom)
        if exact and len(key) == 1 and isinstance(key[0], int) and 0 <= key[0] < len(items):
            return items[key[0]]
        return join(*items) if items else unknown("an element of a list")
    if isinstance(atom, Unknown):
        return (atom,)
    written = settled_text(run, atom) if isinstance(atom, Text) else None
    if written is not None and len(key) == 1 and isinstance(key[0], int) and 0 <= key[0] < len(written):
        return literal(written[key[0]])
    return unknown("an element of something that is not known")
