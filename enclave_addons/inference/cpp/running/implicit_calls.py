"""Follow what C++ runs without a call in the text: conversions, some operators, destructors, closures that are kept.

Where they run is not followed, so what they change is a gap or no longer known.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from functools import partial

from enclave_addons.inference.cpp.reading.declarations import Class, Field, Function, Global
from enclave_addons.inference.cpp.reading.writes import writes_of
from enclave_addons.inference.cpp.running.contents import takes_another
from enclave_addons.inference.cpp.running.effects import effects_of, may_mean, with_held
from enclave_addons.inference.cpp.running.machine import Frame, Machine
from enclave_addons.inference.cpp.running.memory import Cell
from enclave_addons.inference.cpp.running.plain_types import NUMBERS, TEXT_CLASSES, is_plain_type
from enclave_addons.inference.cpp.running.references import forget, keep_reference
from enclave_addons.inference.cpp.running.values import (
    BOTTOM,
    Bound,
    Lambda,
    Map,
    Obj,
    Seq,
    Value,
    functions_in,
    join,
    lost,
    unknown,
)
from enclave_addons.inference.cpp.syntax import Node, field_of, text, walk, words_in

_NOT_FOLLOWED = re.compile(r"operator (?!new|delete)\w.*|operator(?:,|&&|\|\||==|<=>)")
_UNSEEN = re.compile(rf"~.*|begin|end|operator[-+*/%&|^<>]+=|{_NOT_FOLLOWED.pattern}")
_WRITES = {"assignment_expression": "left", "update_expression": "argument"}


def check_implicit_calls(run: Machine, cls: Class, node: Node, frame: Frame) -> None:
    """Add a gap for functions that change something and that are called implicitly.

    Conversions, ``,``, comparisons, from which C++20 derives others, and destructors that write to what a member
    refers or points to.
    """
    ancestry = run.names.ancestry(cls)
    fields = {name: member for each in ancestry for name, member in each.fields.items()}
    behind_const = {name for name, each in fields.items() if each.pointer or "mutable" in text(each.node)}
    listed = [
        (name, f) for each in ancestry for name, found in run.names.methods[each].items() for f in found
    ]
    for name, method in listed:
        if name.startswith("~") and _writes_elsewhere(ancestry, method):
            run.gap(node, frame, f"{name} changes what others have: when it runs is not followed")
        if name.startswith("~"):
            _written_when_destroyed(run, method)
        kept = (behind_const if _only_reads(method) else fields.keys()) | run.names.globals.keys()
        if _NOT_FOLLOWED.fullmatch(name) and (run.makes_interfaces(method) or writes_of(method.node) & kept):
            why = f"{name} of {cls.name} changes something: where it runs is not followed"
            run.gap(node, frame, why)


def _written_when_destroyed(run: Machine, destructor: Function) -> None:
    """Know nothing of a plain global or static member that a destructor writes to: when it runs is not followed."""
    written = effects_of(run, destructor).written
    for name in sorted(written.assigned | written.changed):
        cells: list[tuple[Cell, Global | Field, Global | Class]] = [
            ((each, ""), each, each) for each in run.names.globals.get(name, ())
        ]
        cells += [((cls, name), cls.fields[name], cls) for cls in run.names.static_members.get(name, ())]
        for cell, declared, where in cells:
            kind = run.names.resolve(declared.type, where.scope, where.file)
            if is_plain_type(kind.name) and not declared.pointer:
                run.store.share_cell(cell, lambda _: unknown("what a destructor may have written"))


def _writes_elsewhere(ancestry: Sequence[Class], method: Function) -> bool:
    """Return whether a method writes to what a member of its object refers or points to."""
    fields = [field for each in ancestry for field in each.fields.values() if field.pointer]
    references = {each.name for each in fields if "&" in text(each.node)}
    pointers = {each.name for each in fields} - references
    for each in walk(method.node):
        target = field_of(each, _WRITES[each.type]) if each.type in _WRITES else None
        words = words_in(target) if target is not None else frozenset()
        behind = words & pointers and text(target).removeprefix("this->") not in pointers
        if words & references or behind:
            return True
    return False


def keep_closures(run: Machine, this: Obj, cls: Class) -> None:
    """Expect that closures in members which a destructor or conversion mentions run where no call is read."""
    ancestry = run.names.ancestry(cls)
    own = [(name, f) for each in ancestry for name, found in run.names.methods[each].items() for f in found]
    unseen = [f for name, f in own if _UNSEEN.fullmatch(name) or takes_another(f)]
    words = frozenset[str]().union(*(f.words for f in unseen))
    words = words.union(*(f.words for name, f in own if name in words))  # of methods that they call
    for each in ancestry if words else ():
        for name in sorted(each.fields.keys() & words):
            kind = run.names.resolve(each.fields[name].type, each.scope, each.file)
            if kind.name not in TEXT_CLASSES | NUMBERS:
                run.store.share_cell((this, name), partial(_kept, run))


def _kept(run: Machine, value: Value) -> Value:
    called_unseen(run, [value])
    return value


def called_unseen(run: Machine, values: Iterable[Value], *, once: bool = False) -> None:
    """Know nothing, from now on, of what closures among the values write: they run where no call is read.

    Args:
        once: They run now alone; of members and globals only texts and numbers are not known then, not containers.
    """
    for each in closures_kept(run, values):
        effects = effects_of(run, each)
        names = effects.written.assigned | effects.written.changed | effects.written.seen
        local = _around(each, names) if isinstance(each, Lambda) else {}
        for place, frame in local.values():
            if once:
                forget(run, place, frame, _UNSEEN_WRITES, told=False)
            else:
                keep_reference(run, place, frame)
        cells: list[Cell] = [(owner, name) for name, owner in local]
        for name in sorted(names - {name for name, _ in local}):
            cells += [cell for cell in run.store.named(name) if may_mean(run, effects.owners, cell)]
        for cell in cells:
            value = run.store.get(cell) or BOTTOM
            if not once and (
                cell[1] in effects.written.assigned or not all(isinstance(a, Obj) for a in value)
            ):
                run.store.share_cell(cell, _after_unseen)
            elif once and not any(isinstance(atom, Obj | Map | Seq) for atom in value):
                run.store.lose([cell], _UNSEEN_WRITES)


_UNSEEN_WRITES = "what a closure may have written that is called where that is not followed"


def closures_kept(run: Machine, values: Iterable[Value]) -> Iterator[Lambda | Bound]:
    """Yield closures among values, also in a ``std::function``, with those that they call by a variable."""
    values = list(values)
    objects = [
        atom
        for value in values
        for atom in value
        if isinstance(atom, Obj) and atom.type.name == "std::function"
    ]
    for value in (*values, *(given for each in objects for given in each.data.get("arguments", ()))):
        for code in functions_in(value):
            yield from with_held(run, code)


def _after_unseen(value: Value) -> Value:
    return join(lost(value, _UNSEEN_WRITES), unknown(_UNSEEN_WRITES))


def _around(closure: Lambda, names: Collection[str]) -> dict[tuple[str, Frame], tuple[Node, Frame]]:
    """Return the variables of these names that are declared around a closure, with a place that names them.

    What it captured by value may be a pointer; what it made a reference to is a variable, too.
    """
    found: dict[tuple[str, Frame], tuple[Node, Frame]] = {}
    for each in walk(closure.node):
        written = each.parent
        while written is not None and written.type not in ("lambda_capture_initializer", "lambda_expression"):
            written = written.parent
        is_initial = written is not None and written.type == "lambda_capture_initializer"
        if each.type != "identifier" or not (is_initial or text(each) in names):
            continue
        for frame in filter(None, (closure.frame, closure.frame.outer)):
            owner = frame.owner_of(text(each))
            if owner is not None:
                found.setdefault((text(each), owner), (each, frame))
    return found


def _only_reads(method: Function) -> bool:
    """Return whether a method is ``const``, and what it takes, too: it hands its members on to be read."""
    return (
        method.constant
        and "const_cast" not in method.words
        and not any(each.written_back for each in method.parameters)
    )
