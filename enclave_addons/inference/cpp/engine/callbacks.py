"""What the outside may call: callbacks and overrides of libraries' classes, in any order, until nothing changes.

What a callback writes is joined to what was there. A callback that makes no interface runs too when it may change what
one of the others reads.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from enclave_addons.inference.cpp.engine.frames import Frame
from enclave_addons.inference.cpp.engine.invocation import HOOKS, assigned_in, call_callable, invoke
from enclave_addons.inference.cpp.engine.machine import Machine
from enclave_addons.inference.cpp.engine.statements import loosened
from enclave_addons.inference.cpp.engine.store import Footprint
from enclave_addons.inference.cpp.engine.values import Bound, Lambda, unknown
from enclave_addons.inference.cpp.reading.declarations import Class
from enclave_addons.inference.cpp.syntax import Node, text

PATIENCE = 4
"""Rounds after which what callbacks still change counts as not known."""
MAX_ROUNDS = 10
_PLAIN_NODES = frozenset(
    {"rclcpp::Node", "rclcpp_lifecycle::LifecycleNode", "nav2_util::LifecycleNode", "nav2::LifecycleNode"}
)
"""Of whose methods only the transitions of ``HOOKS`` are virtual."""


@dataclass
class _Rounds:
    ran: dict[Lambda | Bound, Footprint] = field(default_factory=dict)
    read: set[str] = field(default_factory=set)  # names of what they read


def run_callbacks(run: Machine) -> None:
    """Configure what a container or manager configures, then run callbacks until nothing changes."""
    for name in ("on_init", "on_initialize", *HOOKS[:2]):
        for obj in list(run.objects.values()):
            if obj.cls is None or not (obj.foreign_base or obj.is_node):
                continue
            for method in run.names.find_methods(obj.cls, name):
                if method.body is not None and method not in run.called:
                    given = [unknown(f"the argument {p.name}") for p in method.parameters]
                    invoke(run, method, obj, given, method.node, Frame(method.file, method.scope, None, obj))
    rounds = _Rounds()
    for number in range(MAX_ROUNDS):
        _expect_overrides(run)
        mark = run.store.mark()
        if not _round(run, rounds):
            return
        if number >= PATIENCE:
            for cell in run.store.moved(mark):
                run.store.set(cell, loosened(run.store.get(cell), "a value that callbacks change"))


def _round(run: Machine, rounds: _Rounds) -> bool:
    """Run each callback once, without those that would do what they did before; return whether any ran."""
    ran = False
    for atom, conditional in list(run.callbacks.items()):
        before = rounds.ran.get(atom)
        if (before is not None and run.store.holds(before)) or not _matters(run, rounds, atom):
            continue
        ran = True
        undecided, run.undecided = run.undecided, int(conditional)
        mark = run.store.mark()
        run.store.begin_record()
        try:
            call_callable(run, atom, [], _node_of(atom), _frame_of(atom))
        finally:
            record = run.store.end_record()
        run.undecided = undecided
        changes = run.store.changes(mark)
        run.store.undo(mark)
        run.store.merge([changes, {}])
        rounds.ran[atom] = record
        rounds.read |= {cell[1].partition("@")[0] for cell in record.reads}
    return ran


def _node_of(atom: Lambda | Bound) -> Node:
    return atom.node if isinstance(atom, Lambda) else atom.function.node


def _frame_of(atom: Lambda | Bound) -> Frame:
    return (
        atom.frame
        if isinstance(atom, Lambda)
        else Frame(atom.function.file, atom.function.scope, None, atom.this)
    )


def _matters(run: Machine, rounds: _Rounds, atom: Lambda | Bound) -> bool:
    """Return whether a callback may make an interface, or change what another one reads."""
    leads = run.leading.code(atom.node) if isinstance(atom, Lambda) else run.leading.function(atom.function)
    if leads:
        return True
    code = text(_node_of(atom))
    called = [
        f
        for word in set(re.findall(r"\b([a-zA-Z_]\w*)\s*\(", code))
        for f in run.names.functions_by_name.get(word, ())
    ]
    written = assigned_in(code).union(*(assigned_in(text(each.node)) for each in called[:40]))
    return not written.isdisjoint(rounds.read)


def _expect_overrides(run: Machine) -> None:
    """Let a base in a library call the methods of the program that override its own."""
    for obj in list(run.objects.values()):
        if obj.cls is None or not (obj.foreign_base or obj.is_node) or obj.data.get("expected"):
            continue
        obj.data["expected"] = True
        for method in (each for name in HOOKS[2:] for each in run.names.find_methods(obj.cls, name)):
            run.callbacks.setdefault(Bound(method, obj), False)
        if not (_library_bases(run, obj.cls) - _PLAIN_NODES):
            continue
        for cls in run.names.ancestry(obj.cls):
            for name, methods in run.names.methods.get(cls, {}).items():
                if methods != run.names.find_methods(obj.cls, name) or name in HOOKS:
                    continue
                for method in methods:
                    told = any(
                        isinstance(a, Bound) and a.function is method and a.this is obj for a in run.callbacks
                    )
                    if method.virtual and not name.startswith("~") and method not in run.called and not told:
                        run.callbacks.setdefault(Bound(method, obj), False)


def _library_bases(run: Machine, cls: Class) -> set[str]:
    """Return the bases whose source is not in reach, but for those of the standard library."""
    names = run.names
    outside = [
        names.resolve(written, each.scope, each.file).name
        for each in names.ancestry(cls)
        for written, base in names.bases(each)
        if base is None
    ]
    return {name for name in outside if not name.startswith("std::")}
