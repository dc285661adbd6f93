"""What the outside may call: callbacks, overrides of libraries' classes, destructors, in any order, again and again.

Run until nothing changes. A callback that makes no interface runs too when it may change what one of the others reads.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial

from enclave_addons.inference.cpp.reading.declarations import Class
from enclave_addons.inference.cpp.running.effects import effects_of, may_mean, with_held
from enclave_addons.inference.cpp.running.invocation import HOOKS, call_lambda, invoke
from enclave_addons.inference.cpp.running.left_out import forget_writes
from enclave_addons.inference.cpp.running.machine import NEXT, Frame, Machine
from enclave_addons.inference.cpp.running.memory import Cell, Reads, name_of
from enclave_addons.inference.cpp.running.references import forget_everything
from enclave_addons.inference.cpp.running.values import (
    BOTTOM,
    Bound,
    Lambda,
    Map,
    Seq,
    Text,
    Value,
    as_one_map,
    in_any_order,
    join,
    open_sequence,
    unknown,
)
from nodl.source_ref import SourceRef

PATIENCE = 3
"""Rounds after which a variable that callbacks still change counts as not known."""
MAX_ROUNDS = 32
MAX_CALLERS = 8
"""For which a closure runs that leads to no interface; what it may write for further ones is not known."""
Key = tuple[object, object]


@dataclass
class _Ran:
    """When a callback ran last: what it read, and how many nodes there were."""

    reads: Reads
    nodes: int


@dataclass
class _Rounds:
    run: Machine
    last: dict[Key, _Ran] = field(default_factory=dict)
    cells_read: dict[str, set[Cell]] = field(default_factory=dict)  # by callbacks, by their names


def run_callbacks(run: Machine) -> None:
    """Initialise a controller, configure a lifecycle node and activate it, before anything else that its transitions
    have prepared.
    """
    rounds = _Rounds(run)
    run.calls_back = True
    run.store.as_others_find_it()
    for name in ("on_init", *HOOKS[:2]):
        _find_overrides(run)
        for key, (atom, frame) in list(run.callbacks.items()):
            if getattr(key[0], "name", "") == name:
                _call(rounds, key, atom, frame, certainly=True)
    run.store.as_others_find_it()
    for number in range(MAX_ROUNDS):
        _find_overrides(run)
        mark, steps = run.store.mark(), run.steps
        if not _round(rounds):
            return
        run.store.as_others_find_it()
        if number:
            _widen(run, mark, steps, number >= PATIENCE)
    place = next(iter(run.callbacks.values()))[1].file.file
    run.gap_at(SourceRef(place), "callbacks change variables for more rounds than are followed")


def run_meanwhile(run: Machine) -> None:
    """Know nothing of what callbacks may write, which run where the program spins and goes on."""
    registered = [] if run.calls_back else [atom for atom, _ in run.callbacks.values()]
    for code in dict.fromkeys(each for atom in registered for each in with_held(run, atom)):
        if forget_writes(run, code.function if isinstance(code, Bound) else code) is None:
            forget_everything(run, "what a callback may have written meanwhile")


def _round(rounds: _Rounds) -> bool:
    """Run each callback once, without those that would do what they did before; return whether any ran."""
    ran = False
    for key, (atom, frame) in list(rounds.run.callbacks.items()):
        ran |= _call(rounds, key, atom, frame)
    return ran


def _call(rounds: _Rounds, key: Key, atom: object, frame: Frame, certainly: bool = False) -> bool:
    run = rounds.run
    if not certainly and not _matters(rounds, atom):
        if isinstance(atom, Bound):
            run.called.add(atom.function)
        return False
    last = rounds.last.get(key)
    if (
        not certainly
        and last is not None
        and last.nodes == len(run.nodes)
        and run.store.holds(last.reads, in_any_order=True)
    ):
        return False

    if last is None and isinstance(atom, Lambda) and _runs_often_enough(rounds, atom):
        forgotten = forget_writes(run, atom)
        if forgotten is not None:
            return forgotten

    def go() -> int:
        reads = run.store.watched(partial(_run, run, atom, frame, key in run.conditional))
        rounds.last[key] = _Ran(reads, len(run.nodes))
        for cell in reads.cells:
            rounds.cells_read.setdefault(name_of(cell), set()).add(cell)
        return NEXT

    run.branches([go] if certainly else [go, lambda: NEXT])
    return True


def _run(run: Machine, atom: object, frame: Frame, conditional: bool) -> None:
    skips, run.skips = run.skips, int(conditional)
    if isinstance(atom, Lambda):
        call_lambda(run, atom, [], atom.node, atom.frame)
    elif isinstance(atom, Bound):
        given = atom.fixed or [unknown(f"the argument {p.name}") for p in atom.function.parameters]
        invoke(run, atom.function, atom.this, given, atom.function.node, frame, ())
    run.skips = skips


def _matters(rounds: _Rounds, atom: object) -> bool:
    """Return whether it may make an interface or a node, give one away, or change what a callback has read."""
    for each in with_held(rounds.run, atom):
        effects = effects_of(rounds.run, each)
        written = effects.written.assigned | effects.written.changed | effects.written.seen
        if (
            _makes(rounds.run, each)
            or effects.leaving.gives_node
            or effects.leaving.makes_node
            or any(
                may_mean(rounds.run, effects.owners, cell)
                for name in written & rounds.cells_read.keys()
                for cell in rounds.cells_read[name]
            )
        ):
            return True
    return False


def _runs_often_enough(rounds: _Rounds, closure: Lambda) -> bool:
    """Return whether a closure that leads to no interface runs for many callers already: answers that ask again."""
    callers = sum(code == closure.node.id for code, _ in rounds.last)
    return (
        callers >= MAX_CALLERS
        and not _makes(rounds.run, closure)
        and not any(effects_of(rounds.run, closure).leaving)
    )


def _makes(run: Machine, atom: object) -> bool:
    if isinstance(atom, Lambda):
        return run.subtree_matters(atom.node)
    return isinstance(atom, Bound) and run.makes_interfaces(atom.function)


def _widen(run: Machine, mark: int, steps: int, give_up: bool) -> None:
    """Widen lists that grow: they lose their order and length; in the end what still changes is not known."""
    for cell, before, present in [*run.moved(mark, steps)]:
        value = in_any_order(present)
        run.store.set(cell, join(*(_settled(atom, before) for atom in value)) if give_up else value)


def _settled(atom: object, before: Value) -> Value:
    """Replace a text or number that is new by one that is not known, also within a list or map."""
    if atom in before:
        return (atom,)
    if isinstance(atom, Text | int):
        return unknown("a value that callbacks change")
    if isinstance(atom, Seq):
        return (open_sequence(join(*(_settled(each, BOTTOM) for each in item)) for item in atom.items),)
    if isinstance(atom, Map):
        values = [_settled(each, BOTTOM) for _, value in atom.entries for each in value]
        return (as_one_map([(unknown("one of many keys"), join(*values))], True),)
    return (atom,)


def _find_overrides(run: Machine) -> None:
    """Call destructors, and what a base in a library calls: overrides of classes whose base is not in reach."""
    for obj in list(run.objects.values()):
        if obj.cls is None:
            continue
        hosted = bool(obj.foreign_base or obj.is_node)
        known = hosted and _PLAIN_NODES.issuperset(_library_bases(run, obj.cls))
        for cls in run.names.ancestry(obj.cls):
            for name, methods in run.names.methods.get(cls, {}).items():
                in_force = hosted and methods == run.names.find_methods(obj.cls, name)
                for method in methods:
                    hook = in_force and (name in HOOKS or (method.virtual and not known))
                    if hook or name.startswith("~"):
                        frame = Frame(method.file, method.scope, None, obj)
                        run.callbacks.setdefault((method, (obj, ())), (Bound(method, obj), frame))


_PLAIN_NODES = frozenset({"rclcpp::Node", "rclcpp_lifecycle::LifecycleNode"})
"""Of whose methods only the transitions of ``HOOKS`` are virtual."""


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
