"""Assignment: to names, fields, elements and patterns of them."""

from __future__ import annotations

import ast

from nodl.infer.interpreter.iterate import elements
from nodl.infer.interpreter.run import Arguments, Frame, Run
from nodl.infer.values import (
    ANY,
    BOTTOM,
    ITEMS,
    ClassValue,
    Dictionary,
    Instance,
    Items,
    ModuleValue,
    Sequence,
    Value,
    join,
)


def assign(run: Run, target: ast.expr, value: Value, frame: Frame) -> None:
    if isinstance(target, ast.Name):
        run.assign_name(target.id, value, frame)
    elif isinstance(target, ast.Attribute):
        store_attribute(run, run.evaluate(target.value, frame), target.attr, value)
    elif isinstance(target, ast.Subscript):
        _store_subscript(run, target, value, frame)
    elif isinstance(target, ast.Tuple | ast.List):
        _unpack(run, target.elts, value, frame)
    elif isinstance(target, ast.Starred):
        assign(run, target.value, value, frame)


def assign_unknown(run: Run, target: ast.expr, frame: Frame) -> None:
    assign(run, target, ANY, frame)


def store_attribute(run: Run, owners: Value, name: str, value: Value) -> None:
    certain = len(owners) == 1
    for owner in owners:
        if isinstance(owner, Instance | ClassValue | ModuleValue):
            if certain:
                run.state.store(owner, name, value)
            else:
                run.state.write(owner.cells, name, join(owner.cells.get(name, BOTTOM), value))
        else:
            run.escape_value(value)  # whoever holds it may call it


def _store_subscript(run: Run, target: ast.Subscript, value: Value, frame: Frame) -> None:
    from nodl.infer.interpreter.loops import store_item

    owners = run.evaluate(target.value, frame)
    key = run.evaluate(target.slice, frame)
    for owner in owners:
        if isinstance(owner, Dictionary):
            if len(owners) > 1:
                value = join(value, run.evaluate(_loaded(target), frame))
            store_item(run, owner, key, value)
        elif isinstance(owner, Sequence):
            _store_element(run, owner, key, value)
        elif isinstance(owner, Instance):
            setter = run.attribute((owner,), "__setitem__", target, frame)
            run.call(setter, Arguments([key, value]), target, frame)
        else:
            run.escape_value(value)


def _loaded(target: ast.Subscript) -> ast.expr:
    return ast.copy_location(ast.Subscript(target.value, target.slice, ast.Load()), target)


def _store_element(run: Run, owner: Sequence, key: Value, value: Value) -> None:
    items = owner.items
    exact = items.exact
    if exact is None:
        run.state.store(owner, ITEMS, (Items(None, join(items.rest, value)),))
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
    star = next((i for i, target in enumerate(targets) if isinstance(target, ast.Starred)), None)
    if exact is not None and star is None and len(exact) == len(targets):
        for target, element in zip(targets, exact, strict=True):
            assign(run, target, element, frame)
        return
    if exact is not None and star is not None and len(exact) >= len(targets) - 1:
        _unpack_star(run, targets, star, exact, frame)
        return
    element = items.any_element() or ANY
    for target in targets:
        if isinstance(target, ast.Starred):
            assign(run, target, run.sequence(target, "list", Items(None, element)), frame)
        else:
            assign(run, target, element, frame)


def _unpack_star(
    run: Run, targets: list[ast.expr], star: int, exact: tuple[Value, ...], frame: Frame
) -> None:
    after = len(targets) - star - 1
    middle = exact[star : len(exact) - after]
    for target, element in zip(targets[:star], exact[:star], strict=True):
        assign(run, target, element, frame)
    assign(run, targets[star], run.sequence(targets[star], "list", Items(middle)), frame)
    for target, element in zip(targets[star + 1 :], exact[len(exact) - after :], strict=True):
        assign(run, target, element, frame)


def delete(run: Run, target: ast.expr, frame: Frame) -> None:
    """``del``: a removed element makes the length of a list unknown; all else may stay (it only adds)."""
    if not isinstance(target, ast.Subscript):
        return
    for owner in run.evaluate(target.value, frame):
        if isinstance(owner, Sequence):
            run.state.store(owner, ITEMS, (Items(None, owner.items.any_element()),))
