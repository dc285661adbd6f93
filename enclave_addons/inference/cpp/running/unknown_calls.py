"""Calls of what is not in reach: a gap where they may make an interface."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import partial

from enclave_addons.inference.cpp.ledger import CREATES
from enclave_addons.inference.cpp.libraries import LIBRARY_CLASSES, is_harmless_class, is_harmless_function
from enclave_addons.inference.cpp.running.assignments import assign
from enclave_addons.inference.cpp.running.contents import handed_over, nodes_in
from enclave_addons.inference.cpp.running.machine import Frame, Machine
from enclave_addons.inference.cpp.running.plain_types import is_plain_type
from enclave_addons.inference.cpp.running.references import forget, is_plain, leads_into
from enclave_addons.inference.cpp.running.standard import INTO_FIRST, called_now
from enclave_addons.inference.cpp.running.static_types import declared_type, given_to
from enclave_addons.inference.cpp.running.values import (
    BOTTOM,
    Obj,
    Unknown,
    Value,
    join,
    may_name,
    unknown,
)
from enclave_addons.inference.cpp.syntax import Node, addressed, text


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
    why = unknown(f"what {name}() may have written")
    for atom in (atom for value in values for atom in value if isinstance(atom, Obj) and atom.node is None):
        fields = [field for cls in run.names.ancestry(atom.cls) for field in cls.fields]
        for field in (*fields, *atom.data.get("written", ())):
            held = run.store.get((atom, field)) or BOTTOM
            if is_plain(held) and may_name(held) and not any(isinstance(each, Unknown) for each in held):
                run.store.set((atom, field), join(held, why))
    for each in given:
        target = addressed(each)
        if target is None or target.type not in ("identifier", "field_expression"):
            continue
        owner = frame.owner_of(text(target))
        is_const = owner is not None and "const" in owner.types.get(text(target), "").split()
        before = run.evaluate(target, frame)
        if not is_const and is_plain(before) and is_plain_type(declared_type(run, target, frame)[0].name):
            # And it may keep a reference.
            run.store.share(partial(assign, run, target, join(before, why), frame), partial(join, why))


def changed_by_standard(run: Machine, name: str, given: Sequence[Node], frame: Frame) -> None:
    """Forget every variable among the arguments, as ``std::reverse(x.begin(), x.end())`` may change it.

    Likewise ``std::getline(stream, x)``, and that of ``std::back_inserter(x)``.
    """
    for each in given[:1] if _WRITES_FIRST.fullmatch(name) else given:
        forget(
            run,
            each,
            frame,
            f"what {name}() may have written",
            told=each.type == "call_expression" and leads_into(each),
        )


_WRITES_FIRST = re.compile(f"std::(?:{INTO_FIRST})")
