"""Assignment: to names, fields, elements and patterns of them."""

from __future__ import annotations

import ast

from nodl.infer.interpreter.define import is_key
from nodl.infer.interpreter.elements import elements
from nodl.infer.interpreter.frames import Frame
from nodl.infer.interpreter.run import Run
from nodl.infer.values import (
    ABSENT,
    ANY,
    BOTTOM,
    ITEMS,
    OTHER,
    OTHER_KEYS,
    ClassValue,
    Dictionary,
    External,
    Instance,
    Items,
    Key,
    ModuleValue,
    Sequence,
    Value,
    join,
    join_all,
    present,
    unknown,
)

EDITED = unknown("an element of a list that is edited")


def assign(run: Run, target: ast.expr, value: Value, frame: Frame) -> None:
    """Bind ``value`` to a name, field or element, or take it apart for a tuple or list of targets."""
    if isinstance(target, ast.Name):
        run.assign_name(target.id, value, frame)
    elif isinstance(target, ast.Attribute):
        store_attribute(run, run.evaluate(target.value, frame), target.attr, value, target, frame)
    elif isinstance(target, ast.Subscript):
        _store_subscript(run, target, value, frame)
    elif isinstance(target, (ast.Tuple, ast.List)):
        _unpack(run, target.elts, value, frame)
    elif isinstance(target, ast.Starred):
        assign(run, target.value, value, frame)


def store_attribute(run: Run, owners: Value, name: str, value: Value, node: ast.AST, frame: Frame) -> None:
    """Run ``owner.name = value``."""
    certain = len(owners) == 1
    for owner in owners:
        if isinstance(owner, (Instance, ClassValue, ModuleValue)):
            kept = BOTTOM if certain else owner.cells.get(name, BOTTOM)
            run.state.store(owner, name, join(kept, value))
        else:
            run.escape_value(value)  # whoever holds it may call it
            if isinstance(owner, External):
                _patched(run, owner, name, node, frame)


_UNMODELLED = frozenset({"unittest", "pytest", "tkinter"})  # whose objects hold attributes of the program


def _patched(run: Run, owner: External, name: str, node: ast.AST, frame: Frame) -> None:
    """Add a gap for a replaced attribute of a library's module or class, if its other users are modelled."""
    if owner.path.partition(".")[0] in _UNMODELLED:
        return
    if "(" not in owner.path and "[" not in owner.path and ".qos" not in owner.path:
        run.gap(node, frame, f"{owner.path}.{name} is replaced; what its users then do is not analysed")


def store_item(run: Run, obj: Dictionary, key: Value, value: Value) -> None:
    """Run ``obj[key] = value``."""
    if len(key) == 1 and is_key(key[0]):
        cell = Key(key[0])
        if not run.repeated and obj.cells.get(cell) == ABSENT:
            del obj.cells[cell]  # it comes last again; undone, it is as absent as before
        run.state.store(obj, cell, value)
        return
    known = [atom for atom in key if isinstance(atom, str | int)]
    for atom in known:
        cell = Key(atom)
        run.state.write(obj.cells, cell, join(obj.cells.get(cell, ABSENT), value))
    if len(known) < len(key):
        run.state.write(obj.cells, OTHER, join(obj.cells.get(OTHER, BOTTOM), value))
        run.state.write(obj.cells, OTHER_KEYS, join(obj.cells.get(OTHER_KEYS, BOTTOM), key))


def copy_dictionary(run: Run, target: Dictionary, source: Value) -> None:
    """Add the entries of ``source``; what is escaped or not a dictionary may add any value under any key."""
    for atom in source:
        if isinstance(atom, Dictionary):
            for key, value, certain in atom.entries():
                if len(source) > 1 or not certain:
                    value = join(target.cells.get(key, ABSENT), value)
                run.state.store(target, key, value)
            if not atom.is_open:
                continue
            for cell in (OTHER, OTHER_KEYS):
                held = present(atom.cells.get(cell, BOTTOM))
                run.state.store(target, cell, join(target.cells.get(cell, BOTTOM), held))
            if not atom.escaped:
                continue
        run.escape_value((atom,))
        run.state.store(target, OTHER, join(target.cells.get(OTHER, BOTTOM), ANY))


def _store_subscript(run: Run, target: ast.Subscript, value: Value, frame: Frame) -> None:
    owners = run.evaluate(target.value, frame)
    if isinstance(target.slice, ast.Slice):
        added = elements(run, value, target.slice, frame).any_element()
        for owner in owners:
            if isinstance(owner, Sequence):
                _edited(run, owner, added)
            else:
                run.escape_value(value)
        return
    key = run.evaluate(target.slice, frame)
    for owner in owners:
        if isinstance(owner, Dictionary):
            if len(owners) > 1:
                value = join(value, run.evaluate(_loaded(target), frame))
            store_item(run, owner, key, value)
        elif isinstance(owner, Sequence):
            _store_element(run, owner, key, value)
        elif isinstance(owner, External) and owner.path == "os.environ":
            _set_environment(run, key, value, target, frame)
        elif isinstance(owner, Instance):
            run.escape_value(value)  # what its class does with it is called from outside
        else:
            run.escape_value(value)


def _set_environment(run: Run, key: Value, value: Value, node: ast.AST, frame: Frame) -> None:
    """Remember what the program puts into its environment: it reads that later."""
    if len(key) == 1 and isinstance(key[0], str):
        run.state.write(run.environment, key[0], value)
    else:
        run.gap(node, frame, "an environment variable whose name is made at run time is set")


def _loaded(target: ast.Subscript) -> ast.expr:
    return ast.copy_location(ast.Subscript(target.value, target.slice, ast.Load()), target)


def _store_element(run: Run, owner: Sequence, key: Value, value: Value) -> None:
    items = owner.items
    exact = items.exact
    if exact is None:
        _edited(run, owner, value)
        return
    index = key[0] if len(key) == 1 else None
    if isinstance(index, int) and -len(exact) <= index < len(exact):
        index %= len(exact)
        changed = (*exact[:index], value, *exact[index + 1 :])
    else:
        changed = tuple(join(element, value) for element in exact)
    run.state.store(owner, ITEMS, (Items(changed),))


def _unpack(run: Run, targets: list[ast.expr], value: Value, frame: Frame) -> None:
    items = elements(run, value, targets[0] if targets else ast.Pass(), frame)
    exact = items.exact
    starred = any(isinstance(target, ast.Starred) for target in targets)
    if exact is not None and not starred and len(exact) == len(targets):
        for target, element in zip(targets, exact, strict=True):
            assign(run, target, element, frame)
        return
    element = items.any_element() or ANY
    if exact is not None and len(element) > 1:
        element = join(element, ANY)  # which of them is not known
    for target in targets:
        if isinstance(target, ast.Starred):
            assign(run, target, run.sequence(target, "list", Items(None, element)), frame)
        else:
            assign(run, target, element, frame)


def delete(run: Run, target: ast.expr, frame: Frame) -> None:
    """Run ``del``: of elements that are known exactly what goes; else the length is unknown, and all may stay."""
    if isinstance(target, ast.Attribute):
        owners = run.evaluate(target.value, frame)
        for owner in owners:
            _delete_attribute(run, owner, target.attr, len(owners) == 1, target, frame)
    elif isinstance(target, ast.Subscript):
        owners = run.evaluate(target.value, frame)
        key = ANY if isinstance(target.slice, ast.Slice) else run.evaluate(target.slice, frame)
        for owner in owners:
            _delete_item(run, owner, key, len(owners) == 1)


def _delete_attribute(run: Run, owner: object, name: str, certain: bool, node: ast.AST, frame: Frame) -> None:
    if isinstance(owner, Instance):
        if name in owner.cells:
            kept = BOTTOM if certain and not owner.summary else owner.cells[name]
            run.state.write(owner.cells, name, join(kept, ABSENT))
    elif isinstance(owner, ClassValue | ModuleValue) and name in owner.cells:
        run.gap(node, frame, f"{name} is deleted; what is found instead is not analysed")


def _delete_item(run: Run, owner: object, key: Value, certain: bool) -> None:
    if isinstance(owner, Sequence):
        _edited(run, owner, BOTTOM)
    elif isinstance(owner, Dictionary):
        strong = certain and len(key) == 1 and not owner.summary
        if strong and isinstance(key[0], str | int | float | bool | type(None)):
            run.state.write(owner.cells, Key(key[0]), ABSENT)


def _edited(run: Run, owner: Sequence, added: Value) -> None:
    """Let some elements go and ``added`` come: each may be any."""
    run.state.store(owner, ITEMS, (Items(None, join_all((owner.items.any_element(), added, EDITED))),))
