"""Built-in functions that walk along things: lists, ranges, ``zip``, ``sorted``, ``dict``."""

from __future__ import annotations

from collections.abc import Callable

from nodl.infer.interpreter import special
from nodl.infer.interpreter.assign import copy_dictionary
from nodl.infer.interpreter.conditions import truth
from nodl.infer.interpreter.frames import Arguments, Call
from nodl.infer.interpreter.iterate import elements
from nodl.infer.interpreter.run import Run
from nodl.infer.text import input_of, with_edit
from nodl.infer.values import (
    ANY,
    BOTTOM,
    NONE,
    OTHER,
    Dictionary,
    Instance,
    Items,
    Key,
    Value,
    join,
    join_all,
    sole,
    unknown,
)

MAX_RANGE = 64


def argument_items(run: Run, call: Call, index: int = 0) -> Items:
    """The elements of the argument at ``index``; an empty sequence when it is not given."""
    value = call.args.at(index)
    return Items(()) if value is None else elements(run, value, call.node, call.frame)


def call_range(run: Run, call: Call) -> Value:
    """``range``: the numbers if they are known and few; else any number, tied to an input that bounds it."""
    bounds = [sole(value) for value in call.args.positional]
    items = Items(None, unknown("a number of a loop"))
    if not bounds or call.args.more:  # range(*bounds)
        return run.sequence(call.node, "tuple", items)
    counted = input_of(bounds[-1]) if len(bounds) < 3 else None
    if counted is not None and counted.item is None and (len(bounds) == 1 or isinstance(bounds[0], int)):
        items = Items(None, (with_edit(counted, "range", tuple(map(str, bounds[:-1]))),))
    integers = [bound for bound in bounds if isinstance(bound, int)]
    if len(integers) == len(bounds) and (len(bounds) in (1, 2) or (len(bounds) == 3 and integers[2])):
        numbers = range(*integers)
        if len(numbers) <= MAX_RANGE:
            items = Items(tuple((number,) for number in numbers))
    return run.sequence(call.node, "tuple", items)


def made_sequence(kind: str) -> Callable[[Run, Call], Value]:
    """The model of ``list`` or ``tuple``: a sequence of that kind with the elements of the argument."""

    def make(run: Run, call: Call) -> Value:
        return run.sequence(call.node, kind, argument_items(run, call))

    return make


def call_set(run: Run, call: Call) -> Value:
    """``set`` and ``frozenset``: element by element if all are known texts, else what any element may be."""
    items = argument_items(run, call)
    if items.exact is not None and not all(
        len(item) == 1 and isinstance(item[0], str) for item in items.exact
    ):
        items = Items(None, items.any_element())
    return run.sequence(call.node, "set", items)


def call_sorted(run: Run, call: Call) -> Value:
    """``sorted``: known texts in order without a key; else each place may hold any of the elements."""
    items = argument_items(run, call)
    if "key" in call.args.keywords:
        run.call(call.args.keywords["key"], Arguments([items.any_element() or ANY]), call.node, call.frame)
    exact = items.exact
    if exact is not None and all(len(item) == 1 and isinstance(item[0], str) for item in exact):
        reverse = truth(call.args.keywords.get("reverse", (False,)))
        if "key" not in call.args.keywords and reverse is not None:
            ordered = sorted(exact, key=lambda item: str(item[0]), reverse=reverse)
            return run.sequence(call.node, "list", Items(tuple(ordered)))
    element = items.any_element()
    if "key" not in call.args.keywords and any(isinstance(atom, Instance) for atom in element):
        element = join(element, unknown("an object in an order that the program defines"))
    if exact is not None:
        items = Items(tuple(element for _ in exact))
    return run.sequence(call.node, "list", items)


def call_reversed(run: Run, call: Call) -> Value:
    """``reversed``: known elements in reverse order, others as they are."""
    items = argument_items(run, call)
    if items.exact is not None:
        items = Items(items.exact[::-1])
    return run.sequence(call.node, "list", items)


def call_enumerate(run: Run, call: Call) -> Value:
    """``enumerate``: a list of pairs; one pair stands for all if the length or the start is not known."""
    items = argument_items(run, call)
    start = sole(call.args.at(1, "start") or (0,))
    if items.exact is not None and type(start) is int:
        pairs = tuple(run.tuple_of(((start + index,), element)) for index, element in enumerate(items.exact))
        return run.sequence(call.node, "list", Items(pairs))
    pair = run.tuple_of((unknown("a number of a loop"), items.any_element() or ANY))
    return run.sequence(call.node, "list", Items(None, pair))


def call_zip(run: Run, call: Call) -> Value:
    """``zip``: a list of rows, one for all if a length is not known; unknown if ``*x`` cannot be counted."""
    columns = [elements(run, value, call.node, call.frame) for value in call.args.positional]
    if call.args.more:
        return ANY
    if all(column.exact is not None for column in columns):
        rows = zip(*(column.exact or () for column in columns), strict=False)
        return run.sequence(call.node, "list", Items(tuple(run.tuple_of(tuple(row)) for row in rows)))
    row = run.tuple_of(tuple(column.any_element() or ANY for column in columns))
    return run.sequence(call.node, "list", Items(None, row))


def call_map(run: Run, call: Call) -> Value:
    """``map``: the function is called for each element, or once for all if they are not known one by one."""
    function = call.args.at(0) or ANY
    items = argument_items(run, call, 1)
    if len(call.args.positional) != 2 or items.exact is None:
        element = run.call(function, Arguments([items.any_element() or ANY]), call.node, call.frame)
        return run.sequence(call.node, "list", Items(None, element))
    results = []
    for index, element in enumerate(items.exact):
        previous = run.enter(("map", id(call.node), index))
        results.append(run.call(function, Arguments([element]), call.node, call.frame))
        run.context = previous
    return run.sequence(call.node, "list", Items(tuple(results)))


def call_filter(run: Run, call: Call) -> Value:
    """``filter``: any element may be in the list; the function is called once for all of them."""
    items = argument_items(run, call, 1)
    element = items.any_element()
    function = call.args.at(0) or NONE
    if element and function != NONE:
        run.call(function, Arguments([element]), call.node, call.frame)
    return run.sequence(call.node, "list", Items(None, element))


def call_dict(run: Run, call: Call) -> Value:
    """``dict``: made of dictionaries, pairs and keywords; keys that are not constant go under ``OTHER``."""
    obj = run.allocate(call.node, "dict", Dictionary)
    for atom in call.args.at(0) or BOTTOM:
        if isinstance(atom, Dictionary):
            copy_dictionary(run, obj, (atom,))
        else:
            _store_pairs(run, obj, elements(run, (atom,), call.node, call.frame), call)
    for name, value in call.args.keywords.items():
        run.state.store(obj, Key(name), value)
    return (obj,)


def _store_pairs(run: Run, obj: Dictionary, items: Items, call: Call) -> None:
    for pair in items.exact if items.exact is not None else (items.any_element(),):
        parts = elements(run, pair, call.node, call.frame).exact
        key = sole(parts[0]) if parts and len(parts) == 2 else None
        if parts and len(parts) == 2 and special.is_key(key):
            run.state.store(obj, Key(key), parts[1])
        else:
            value = parts[1] if parts and len(parts) == 2 else ANY
            run.state.store(obj, OTHER, join(obj.cells.get(OTHER, BOTTOM), value))


def chosen(run: Run, call: Call) -> Value:
    """``min``, ``max``, ``next``, ``random.choice``: one of the elements."""
    if len(call.args.positional) > 1 and not call.args.more:
        return join_all((*call.args.positional, argument_items(run, call).any_element())) or ANY
    return argument_items(run, call).any_element() or ANY
