"""Calls that need not run: they lead to no interface, and what they may change is not known already or not looked at.

What such a call may have changed is not known afterwards. Most code of a robot is of this kind: it computes.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import zip_longest

from enclave_addons.inference.cpp.reading.declarations import Class, Field, Function, Global, type_text
from enclave_addons.inference.cpp.running.assignments import assign
from enclave_addons.inference.cpp.running.effects import CallEffects, effects_of, looked_at, may_mean
from enclave_addons.inference.cpp.running.machine import Frame, Machine
from enclave_addons.inference.cpp.running.memory import Cell, name_of
from enclave_addons.inference.cpp.running.values import (
    BOTTOM,
    Atom,
    Group,
    Lambda,
    Map,
    Obj,
    Seq,
    Text,
    Unknown,
    Value,
    holds_callable,
    join,
    may_name,
    unknown,
)
from enclave_addons.inference.cpp.syntax import Node, addressed, children, field_of

LEAST_SIZE = 400
"""Bytes of source, with everything that it may call, from which on leaving a call out is worth its look."""
_LOOKED_AT_IN_A_STEP = 4
"""Variables that are looked at for what a call may change, while an expression is evaluated elsewhere."""
_NUMBERS = re.compile(
    r"(?:const\s+)?(?:void|bool|int|double|float|(?:std::)?size_t|unsigned|unsigned int|unsigned char|u?int\d+_t)"
)
_OF_NUMBERS = re.compile(
    r"(?:(?:const|std|vector|array|list|deque|set|map|pair|tuple|optional|(?:unique|shared)_ptr|void|bool|int|double|float|"
    r"size_t|unsigned|char|u?int\d+_t|\w+::(?:msg|srv|action)::\w+|(?:Unique|Shared)Ptr|\d+)|[<>,&*\s]|::)+"
)
"""Types of numbers and messages, and of containers of and pointers to such: few of them are part of a name."""
_FRACTION = re.compile(r"(?:const\s+)?(?:double|float)")
_LEADS_ELSEWHERE = re.compile(r"\b(?:auto|It)\b|[Ii]ter")
"""Parameters through which a call may write to variables that are not its arguments."""
_VARIABLES = ("identifier", "field_expression", "subscript_expression")


def leave_out(run: Machine, function: Function, values: Sequence[Value], node: Node, frame: Frame) -> bool:
    """Leave a call out, if that loses nothing that matters.

    Returns:
        Whether it was: then what it may have changed is not known any more.
    """
    if run.makes_interfaces(function) or function.name == function.owner.rpartition("::")[2]:
        return False
    if (
        _never_returns(function)
        or function.templates
        or any(_LEADS_ELSEWHERE.search(each.type) for each in function.parameters)
    ):
        return False
    effects = effects_of(run, function)
    if effects.size < LEAST_SIZE or not effects.only_variables or not _is_unused(run, function, node):
        return False
    if not run.store.callables.keys().isdisjoint(effects.words) or effects.may_hide_writes:
        return False
    if any(
        holds_callable(atom) or (isinstance(atom, Obj) and atom.node is not None)
        for v in values
        for atom in v
    ):
        return False
    targets, changes = _targets(function, node), _changes(run, effects)
    if changes is None or None in targets:
        return False
    why = unknown(f"what {function.name}() may have written")
    for cell, value in changes.items():
        run.store.set(cell, join(value, why))
    for target in targets:
        _forget(run, target, why, frame)
    return True


def _never_returns(function: Function) -> bool:
    """Return whether the last thing that a function does is to throw."""
    statements = children(function.body)
    return bool(statements) and statements[-1].type == "throw_statement"


def _is_unused(run: Machine, function: Function, call: Node) -> bool:
    """Return whether the result of a call is not used, or is of numbers, a message, a condition or an enumerator."""
    is_statement = call.type != "call_expression" or (
        call.parent is not None and call.parent.type == "expression_statement"
    )
    if is_statement or _OF_NUMBERS.fullmatch(type_text(function.node)):
        return True
    kind = run.names.resolve(type_text(function.node), function.scope, function.file)
    return not kind.pointer and (_NUMBERS.fullmatch(kind.name) is not None or kind.last in run.names.enums)


def forget_writes(run: Machine, of: Function | Lambda) -> bool | None:
    """Make all that a function or closure may write unknown, instead of running it.

    Returns:
        Whether anything was known before; ``None`` if a pointer hides what it writes to.
    """
    effects = effects_of(run, of)
    changes = _changes(run, effects, certainly=True)
    if changes is None:
        return None
    if isinstance(of, Lambda):
        for name in effects.written.assigned | effects.written.changed:
            owner = of.frame.owner_of(name)
            value = run.store.get((owner, name)) or BOTTOM
            if value and _would_change(value, True, True):
                changes[owner, name] = value
    for cell, value in changes.items():
        run.store.set(cell, join(value, unknown("what a call that is not followed may have written")))
    return bool(changes)


def _changes(run: Machine, effects: CallEffects, certainly: bool = False) -> dict[Cell, Value] | None:
    """Return the variables that may change, with their values.

    ``None`` if they are not known by their names or, unless ``certainly``, if one of them matters and is known now.
    """
    store, written, matters = run.store, effects.written, {} if certainly else looked_at(run)
    pointers = run.names.pointers_to_plain
    behind = pointers.keys() & (written.assigned | written.changed)
    if not written.lasting.isdisjoint(matters) or any(
        not pointers[name].isdisjoint(run.used_classes()) and run.names.may_show_variables(name)
        for name in behind
    ):
        return None
    if effects.kept_by is not None and not certainly:
        cell, is_assigned, is_changed = effects.kept_by
        value = store.get(cell) or BOTTOM
        if _would_change(value, is_assigned, is_changed) and _decides(run, cell, value):
            return None
    every = written.assigned | written.changed | written.seen
    found: dict[Cell, Value] = {}
    waiting = [
        (cell, name, name in written.assigned, name in written.changed)
        for name in (*sorted(every & matters.keys()), *sorted(every - matters.keys()))
        for cell in store.named(name)
        if may_mean(run, effects.owners, cell)
    ]
    run.count(len(waiting) // _LOOKED_AT_IN_A_STEP)
    done: set[Cell] = set()
    while waiting:
        cell, name, is_assigned, is_changed = waiting.pop()
        if cell in done:
            continue
        done.add(cell)
        value = store.get(cell) or BOTTOM
        if _would_change(value, is_assigned, is_changed):
            if may_mean(run, matters, cell) and _decides(run, cell, value):
                effects.kept_by = (cell, is_assigned, is_changed)
                return None
            found[cell] = value
        if is_assigned:
            waiting += [((obj, field), field, True, True) for obj, field in _members(run, value)]
    for cell in _never_set(run, every):
        name = name_of(cell)
        if not may_mean(run, effects.owners, cell):
            continue
        if name in written.assigned and may_mean(run, matters, cell) and not _is_number(run, cell, name):
            return None
        found[cell] = BOTTOM
    return found


def _would_change(value: Value, is_assigned: bool, is_changed: bool) -> bool:
    """Return whether a variable with this value is known now, and something else may be in it afterwards."""
    if any(isinstance(atom, Unknown) for atom in value):
        return False
    return is_assigned or not _of_objects(value, containers=not is_changed)


def _decides(run: Machine, cell: Cell, value: Value) -> bool:
    """Return whether ``value`` of a variable may be part of a name or decide a condition; fractions do not."""
    owner, name = cell
    if isinstance(owner, Obj):
        declared = _declared(run, owner, name)
        if owner.cls is None or (declared is not None and _FRACTION.fullmatch(declared.type)):
            value = tuple(atom for atom in value if isinstance(atom, Text | Seq | Group | Map | Obj))
    return any(
        type(atom) in (bool, int) or (may_name((atom,)) and not _is_of_numbers(run, atom)) for atom in value
    )


def _is_of_numbers(run: Machine, atom: Atom) -> bool:
    """Return whether it is a number, a structure of such that makes no interfaces, as a point is, or a list of such."""
    if isinstance(atom, int | Unknown):
        return True
    if isinstance(atom, Seq):
        return all(_is_of_numbers(run, inner) for item in atom.items for inner in item)
    if not isinstance(atom, Obj) or atom.cls is None or atom.node is not None:
        return False
    classes = run.names.ancestry(atom.cls)
    methods = (
        each for cls in classes for listed in run.names.methods.get(cls, {}).values() for each in listed
    )
    return not any(map(run.makes_interfaces, methods)) and all(
        not each.pointer and _NUMBERS.fullmatch(each.type) for cls in classes for each in cls.fields.values()
    )


def _members(run: Machine, value: Value) -> Iterator[tuple[Obj, str]]:
    """Yield the members of the program's own objects in ``value``."""
    for atom in value:
        if isinstance(atom, Obj) and atom.cls is not None:
            for each in run.names.ancestry(atom.cls):
                for name in each.fields:
                    yield atom, name


def _never_set(run: Machine, names: frozenset[str]) -> Iterator[Cell]:
    """Yield members, static members and globals of these names that nothing has set or read yet."""
    static = run.names.static_members
    objects = list(run.objects.values())
    of_class = {cls: run.names.members(cls) & names for cls in {obj.cls for obj in objects}}
    cells: list[Cell] = [
        (obj, name) for obj in objects for name in of_class[obj.cls] if obj.cls not in static.get(name, ())
    ]
    for name in names:
        cells += [(cls, name) for cls in static.get(name, ())]
        cells += [(each, "") for each in run.names.globals.get(name, ())]
    run.count(len(cells) // _LOOKED_AT_IN_A_STEP)
    yield from (cell for cell in cells if run.store.get(cell) is None)


def _is_number(run: Machine, cell: Cell, name: str) -> bool:
    declared = _declared(run, cell[0], name)
    return declared is not None and not declared.pointer and _NUMBERS.fullmatch(declared.type) is not None


def _declared(run: Machine, owner: object, name: str) -> Field | Global | None:
    """Return how a member of a class of the program, or a global, is declared."""
    if isinstance(owner, Global):
        return owner
    cls = owner.cls if isinstance(owner, Obj) else owner if isinstance(owner, Class) else None
    return next((each.fields[name] for each in run.names.ancestry(cls) if name in each.fields), None)


def _of_objects(value: Value, containers: bool) -> bool:
    """Return whether ``value`` consists of objects alone; with ``containers`` also of containers of such."""
    for atom in value:
        if isinstance(atom, Obj):
            continue
        if not containers or not isinstance(atom, Seq | Group | Map):
            return False
        items = atom.items if isinstance(atom, Seq | Group) else [each for _, each in atom.entries]
        if not all(_of_objects(each, containers) for each in items):
            return False
    return True


def _targets(function: Function, node: Node) -> list[Node | None]:
    """Return the caller's variables that the call may write to; ``None`` for one that is no plain variable."""
    found: list[Node | None] = []
    given = children(field_of(node, "arguments"))
    for parameter, argument in zip_longest(function.parameters, given[: len(function.parameters)]):
        if not parameter.written_back:
            continue
        target = addressed(argument)  # without an argument: what stands for it by default
        found.append(target if target is not None and target.type in (*_VARIABLES, "this") else None)
    return found


def _forget(run: Machine, target: Node | None, why: Value, frame: Frame) -> None:
    """Make what the caller's variable holds unknown; objects stay who they are."""
    if target is None or target.type == "this":
        return
    before = run.evaluate(target, frame)
    if not any(isinstance(atom, Unknown) for atom in before) and not _of_objects(before, containers=False):
        assign(run, target, join(before, why), frame)
