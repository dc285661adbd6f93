"""Calls of what is not in reach: a gap where they may make an interface."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import partial

from nodl.infer.cpp.ledger import CREATES
from nodl.infer.cpp.libraries import LIBRARY_CLASSES, is_harmless_class, is_harmless_function
from nodl.infer.cpp.running.assignments import assign
from nodl.infer.cpp.running.constructors import is_plain_type
from nodl.infer.cpp.running.contents import handed_over, iterated, nodes_in
from nodl.infer.cpp.running.machine import Frame, Machine
from nodl.infer.cpp.running.references import is_plain, through
from nodl.infer.cpp.running.standard import INTO_FIRST, called_now, may_write
from nodl.infer.cpp.running.static_types import declared_type, element_type, given_to, seen_type
from nodl.infer.cpp.running.values import (
    BOTTOM,
    Group,
    Map,
    Obj,
    Seq,
    Unknown,
    Value,
    as_one_map,
    join,
    may_name,
    open_sequence,
    unknown,
)
from nodl.infer.cpp.syntax import Node, field_of, text, unwrapped, walk


def without_source(
    run: Machine, name: str, values: Sequence[Value], node: Node, frame: Frame, receiver: Obj | None
) -> Value:
    """Handle what is declared in a header in reach, and defined where we cannot see it."""
    nodes = [o for value in values for o in nodes_in(value)]
    if receiver is not None and receiver.node is not None:
        nodes.append(receiver)
    holder = receiver is not None and receiver.cls is not None and _holds_node(run, receiver)
    if nodes or holder or CREATES.fullmatch(name.rpartition("::")[2]):
        record = nodes[0].node if nodes else None
        run.gap(node, frame, f"the source of {name}() is not in reach; it may make interfaces", record)
    run.handle(node, frame)
    handed_over(run, f"{name}()", [v for v in values if not nodes_in(v)], node, frame)
    may_be_written(run, name, values, given_to(node, frame), frame)
    return unknown(f"the result of {name}()")


def _holds_node(run: Machine, holder: Obj) -> bool:
    for each in run.names.ancestry(holder.cls):
        for name in each.fields:
            if nodes_in(run.store.get((holder, name)) or BOTTOM):
                return True
    return False


def unknown_call(
    run: Machine,
    name: str,
    values: Sequence[Value],
    node: Node,
    given: Sequence[Node],
    frame: Frame,
    receiver: Obj | None = None,
) -> Value:
    """Handle a function of a library that is not modelled."""
    last = name.rpartition("::")[2]
    harmless = is_harmless_function(name) or (receiver is not None and receiver.type.name in LIBRARY_CLASSES)
    owner = name.rpartition("::")[0]
    foreign = "::" in owner and is_harmless_class(owner)
    harmless = harmless or foreign
    if receiver is not None and receiver.foreign_base and is_harmless_class(receiver.foreign_base):
        harmless = True
    if receiver is not None and _is_of_qt(run, receiver) and not CREATES.fullmatch(last):
        harmless = True
    if CREATES.fullmatch(last) and not harmless:
        run.handle(node, frame)
        why = f"{name}() may make an interface; whose is not known"
        run.gap(node, frame, why, receiver.node if receiver else None)
    if receiver is not None and last.startswith("emplace"):  # the element that it makes may be anything
        handed_over(run, f"an element that {last}() makes", values, node, frame)
    if not (harmless and (receiver is not None or name.startswith("rclcpp"))):  # a timer calls nobody at once
        called_now(run, values, node, frame)
    if harmless:
        run.resolve(node, frame)
        if foreign:  # what it makes is none of ROS: ``lcm::LCM::subscribe``
            run.handle(node, frame)
        run.later(values, frame)
        return unknown(f"the result of {name}()")
    handed_over(run, f"{name}()", values, node, frame)
    if receiver is None or receiver.cls is not None:
        may_be_written(run, name, values, given, frame)
    return unknown(f"the result of {name}()")


def _is_of_qt(run: Machine, receiver: Obj) -> bool:
    """Return whether a class of Qt is among its bases, whose methods know nothing of ROS: ``connect``."""
    bases = (base for cls in run.names.ancestry(receiver.cls) for base in cls.bases)
    return any(re.fullmatch(r"Q[A-Z]\w*", base.rpartition("::")[2]) for base in bases)


def may_be_written(
    run: Machine, name: str, values: Sequence[Value], given: Sequence[Node], frame: Frame
) -> None:
    """Note that a text which somebody unknown gets as a variable, or in an object, may be another one afterwards."""
    for atom in (atom for value in values for atom in value if isinstance(atom, Obj) and atom.node is None):
        fields = [field for cls in run.names.ancestry(atom.cls) for field in cls.fields]
        for field in (*fields, *atom.data.get("written", ())):
            held = run.store.get((atom, field)) or BOTTOM
            if is_plain(held) and may_name(held) and not any(isinstance(each, Unknown) for each in held):
                run.store.set((atom, field), join(held, unknown(f"what {name}() may have written")))
    for each in given:
        target = unwrapped(each)
        if target is not None and target.type == "pointer_expression" and text(target).startswith("&"):
            target = field_of(target, "argument")
        if target is None or target.type not in ("identifier", "field_expression"):
            continue
        if is_plain_type(declared_type(run, target, frame)[0].name):  # and it may keep a reference
            run.store.share(
                partial(_changed, run, name, target, frame), unknown(f"what {name} may write later")
            )


def changed_by_standard(run: Machine, name: str, given: Sequence[Node], frame: Frame) -> None:
    """Change every variable among the arguments, as ``std::reverse(x.begin(), x.end())`` may.

    Likewise ``std::getline(stream, x)``, and that of ``std::back_inserter(x)``.
    """
    if _WRITES_FIRST.fullmatch(name):
        given = given[:1]
    seen: set[str] = set()
    targets = [target for each in given for target in _variables(each)]
    if name == "std::swap":
        if any(each.type in ("subscript_expression", "pointer_expression") for each in given):
            targets = list(given)
        values = [run.evaluate(target, frame) for target in targets]
        crossed = values[::-1] if len(values) == len(given) == 2 else [join(*values)] * len(values)
        for target, value in zip(targets, crossed, strict=True):
            assign(run, target, value, frame)
        return
    for each in given:
        if not _variables(each) and _RANGE.search(text(each)):
            through(run, each, frame)
        for target in _variables(each):
            if text(target) not in seen:
                seen.add(text(target))
                _changed(run, name, target, frame)


_WRITES_FIRST = re.compile(f"std::(?:{INTO_FIRST})")


def _variables(given: Node) -> list[Node]:
    """Return variables and members that an argument names, but for those in closures."""
    if given.type in ("identifier", "field_expression") and not (
        given.parent is not None
        and given.parent.type == "call_expression"
        and given == given.parent.named_children[0]
    ):
        return [given]
    if given.type == "lambda_expression":
        return []
    if given.type == "field_expression":  # the method of a call: its object
        argument = field_of(given, "argument")
        return _variables(argument) if argument is not None else []
    return [found for child in given.named_children for found in _variables(child)]


def _changed(run: Machine, name: str, target: Node, frame: Frame) -> None:
    owner = frame.owner_of(text(target))
    if owner is not None and "const" in owner.types.get(text(target), "").split():
        return
    before = run.evaluate(target, frame)
    if is_plain(before):
        pointers = element_type(seen_type(run, target, frame)).pointer
        objects = all(isinstance(atom, Obj) for item in iterated(run, before)[0] for atom in item)
        if pointers and objects and name.startswith("std::") and not may_write(name):
            return  # what they point to was written, where the closure ran
        if pointers or _is_iterator(run, target, frame):
            through(run, target, frame)
        assign(run, target, join(*(_after(atom, name) for atom in before)), frame)


def _is_iterator(run: Machine, target: Node, frame: Frame) -> bool:
    """Return whether a local variable is declared as an iterator or pointer into a container, not as one itself.

    A parameter that is a pointer is none: what is written to it is written to what the caller gave.
    """
    name = text(target)
    owner = frame.owner_of(name)
    if owner is None or name in owner.aliases or name not in owner.types or owner.types[name].endswith("&"):
        return False
    parameters = owner.function.parameters if owner.function is not None else ()
    if any(each.name == name and each.written_back for each in parameters):
        return False
    kind = run.type_of(owner.types[name], owner)
    if "auto" not in owner.types[name].split():
        return kind.pointer or not (is_plain_type(kind.name) or kind.name in _HOLDERS)
    declared = walk(owner.function.node) if owner.function is not None else ()
    return any(
        each.type == "init_declarator"
        and text(field_of(each, "declarator")) == name
        and _RANGE.search(text(field_of(each, "value"))) is not None
        for each in declared
    )


_HOLDERS = frozenset(
    {"std::pair", "std::tuple", "std::variant", "std::optional", "std::stringstream", "std::any"}
)
_RANGE = re.compile(r"\b(?:c?r?(?:begin|end)|find\w*|(?:lower|upper)_bound|next|prev|data)\s*\([^()]*\)\W*$")


def _after(atom: object, name: str) -> Value:
    """Return the list afterwards: it keeps its elements, in another order, and may have others."""
    if isinstance(atom, Seq):
        more = () if _ORDERS.fullmatch(name) else (unknown(f"what {name}() may have written"),)
        return (open_sequence((*atom.items, *more)),)
    changed = unknown(f"what {name}() may have written")
    if isinstance(atom, Map):
        return (as_one_map([(key, join(value, changed)) for key, value in atom.entries], True),)
    if isinstance(atom, Group):
        return (Group(tuple(join(each, changed) for each in atom.items)),)
    return changed if name.startswith("std::") else join((atom,), changed)


_ORDERS = re.compile(
    r"std::(?:\w*sort|reverse|rotate|\w*shuffle|\w*partition|nth_element|\w+_heap|\w+_permutation)"
)
