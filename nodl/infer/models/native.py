"""Methods of strings, lists, sets, dictionaries."""

from __future__ import annotations

import collections
from collections.abc import Callable

from nodl.infer.interpreter import special
from nodl.infer.interpreter.assign import copy_dictionary, store_item
from nodl.infer.interpreter.formatting import joined, str_format, text_value
from nodl.infer.interpreter.frames import Arguments, Call
from nodl.infer.interpreter.iterate import elements, keys_of, values_of
from nodl.infer.interpreter.run import Run
from nodl.infer.interpreter.subscripts import variable
from nodl.infer.methods import Variables
from nodl.infer.models import concrete
from nodl.infer.text import MAX_LENGTH, Text, TextAtom, edited, input_of, with_edit
from nodl.infer.values import (
    ABSENT,
    ANY,
    BOOLEAN,
    BOTTOM,
    ITEMS,
    NONE,
    OTHER,
    OTHER_KEYS,
    Dictionary,
    Instance,
    Items,
    Key,
    Sequence,
    Value,
    join,
    join_all,
    present,
    sole,
    unknown,
)

# Methods of str whose result is computed outright when everything is constant.
_PURE = frozenset({
    "strip", "lstrip", "rstrip", "lower", "upper", "title", "capitalize", "replace", "removeprefix",
    "removesuffix", "zfill", "ljust", "rjust", "center", "casefold", "swapcase", "startswith", "endswith",
    "isdigit", "isalpha", "find", "rfind", "index", "count", "isidentifier", "islower", "isupper",
})  # fmt: skip
_SPLITS = frozenset({"split", "rsplit", "splitlines", "partition", "rpartition"})


def call_method(run: Run, receiver: object, name: str, call: Call) -> Value:
    """What a method of a text or container gives and, in a container, changes; unknown without a model."""
    if isinstance(receiver, str | Text):
        return _text_method(run, receiver, name, call)
    if isinstance(receiver, bytes):
        found = concrete.compute(run, getattr(receiver, name, None) or _absent, call)
        return found if found is not None else unknown(f"the result of bytes.{name}()")
    if isinstance(receiver, Dictionary):
        run.spend(len(receiver.cells))
        if receiver.kind == "Counter" and name in _OF_COUNTERS:
            real = concrete.to_python(run, (receiver,), call)
            if isinstance(real, collections.Counter):
                return concrete.compute(run, getattr(real, name), call) or ANY
        model = _DICTIONARY.get(name)
        return model(run, receiver, call) if model else _lost(run, receiver, call)
    if isinstance(receiver, Variables):
        return _variables_method(run, receiver, name, call)
    if isinstance(receiver, Sequence):
        run.spend(len(receiver.items.exact or receiver.items.rest))
        if name not in ("append", "add"):
            changed = _real_method(run, receiver, name, call)
            if changed is not None:
                return changed
        method = _SEQUENCE.get(name)
        return method(run, receiver, call) if method else _lost(run, receiver, call)
    run.escape(call.args)
    return unknown(f"the result of {name}()")


def _variables_method(run: Run, receiver: Variables, name: str, call: Call) -> Value:
    named = receiver.named()
    if name == "get":
        found = variable(run, receiver, call.args.at(0) or ANY, call.node, call.frame)
        return join(found, call.args.at(1) or NONE)
    if name == "update":
        run.gap(call.node, call.frame, "variables are set from a dictionary")
        run.escape(call.args)
        return NONE
    if name not in ("keys", "values", "items"):
        return _lost(run, receiver, call)
    certain = not receiver.owner.summary and all(present(value) is value for value in named.values())
    rows: list[tuple[Value, Value]] = [((key,), present(value)) for key, value in named.items()]
    if name == "items":
        items = Items(tuple(run.tuple_of(row) for row in rows))
    else:
        items = Items(tuple(key if name == "keys" else value for key, value in rows))
    return run.sequence(call.node, "list", items if certain else Items(None, items.any_element()))


_OF_COUNTERS = frozenset({"most_common", "elements", "total"})


def _absent(*_: object) -> object:
    raise concrete.NotConcrete


def _real_method(run: Run, owner: Sequence, name: str, call: Call) -> Value | None:
    """A method of a list, set or tuple whose elements are known one by one, as Python does it."""
    real = concrete.to_python(run, (owner,), call)
    if isinstance(real, concrete.Opaque):
        return None
    if isinstance(real, list) and name in _OF_QUEUES:
        real = collections.deque(real)
    method = getattr(real, name, None)
    if method is None or name.startswith("_"):
        return None
    before = list(real)
    given = call
    if name in ("extend", "update", "extendleft") and call.args.positional:
        items = [elements(run, each, call.node, call.frame) for each in call.args.positional]
        if any(each.exact is None for each in items):
            return None
        rows = [run.tuple_of(each.exact or ()) for each in items]
        given = Call(Arguments(rows), call.node, call.frame)
    found = concrete.compute(run, method, given)
    if found is None:
        return None
    after = list(real)
    if len(after) != len(before) or any(a is not b for a, b in zip(after, before, strict=True)):
        after = concrete.in_order(after) if isinstance(real, set) else after
        parts = tuple(concrete.from_python(run, each, call) for each in after)
        run.state.store(owner, ITEMS, (Items(parts),))
    return found


_OF_QUEUES = frozenset({"rotate", "appendleft", "popleft", "extendleft"})


def _lost(run: Run, receiver: object, call: Call) -> Value:
    """A method that is not modelled: it may call what it is given and change its object."""
    run.escape(call.args)
    run.escape_value((receiver,))
    return ANY


# --- text ---------------------------------------------------------------------------------------------------


def _text_method(run: Run, text: TextAtom, name: str, call: Call) -> Value:
    if name == "format":
        return text_value(str_format(text, special.spoken_each(run, call.args, call.node, call.frame)))
    if name == "join":
        return text_value(joined((text,), elements(run, call.args.at(0) or ANY, call.node, call.frame)))
    if isinstance(text, str) and name in ("translate", "expandtabs", "encode", "format_map"):
        return _constant_method(run, text, name, (), call)
    arguments = tuple(sole(value) for value in call.args.positional)
    constant = all(isinstance(argument, str | int | type(None)) for argument in arguments)
    if not constant or call.args.keywords or call.args.more:
        return unknown(f"the result of str.{name}()")
    if isinstance(text, str):
        return _constant_method(run, text, name, arguments, call)
    if name in ("startswith", "endswith", "isdigit", "isalpha"):
        return BOOLEAN
    divided = input_of(text)
    if name == "split" and divided is not None and all(isinstance(each, str) for each in arguments):
        part = with_edit(divided, "split", tuple(str(each) for each in arguments))
        return run.sequence(call.node, "list", Items(None, (part,)))
    symbolic = edited(text, name, tuple(argument for argument in arguments if isinstance(argument, str)))
    return unknown(f"the result of str.{name}()") if symbolic is None else (symbolic,)


def _constant_method(run: Run, text: str, name: str, arguments: tuple[object, ...], call: Call) -> Value:
    if name not in _PURE and name not in _SPLITS:
        found = concrete.compute(run, getattr(text, name, None) or _absent, call, owner=text)
        return found if found is not None else unknown(f"the result of str.{name}()")
    size = len(text) + sum(len(each) if isinstance(each, str) else 0 for each in arguments)
    if size > MAX_LENGTH or any(type(each) is int and each > MAX_LENGTH for each in arguments):
        return unknown(f"the result of str.{name}() of a very long text")
    try:
        result = getattr(text, name)(*arguments)
    except (TypeError, ValueError, OverflowError):
        return ANY
    if name in _SPLITS:
        return run.sequence(call.node, "list", Items(tuple((part,) for part in result)))
    return (result,) if not isinstance(result, str) or len(result) < 4096 else ANY


# --- sequences ----------------------------------------------------------------------------------------------


def _append(run: Run, owner: Sequence, call: Call) -> Value:
    value = call.args.at(0) or ANY
    items = owner.items
    if items.exact is not None and not owner.summary and len(items.exact) < 2048:
        run.state.store(owner, ITEMS, (Items((*items.exact, value)),))
    else:
        run.state.store(owner, ITEMS, (Items(None, join(items.any_element(), value)),))
    return NONE


def _extend(run: Run, owner: Sequence, call: Call) -> Value:
    added = elements(run, call.args.at(0) or ANY, call.node, call.frame)
    items = owner.items
    if items.exact is not None and added.exact is not None and len(items.exact + added.exact) < 2048:
        run.state.store(owner, ITEMS, (Items(items.exact + added.exact),))
    else:
        everything = join(items.any_element(), added.any_element())
        run.state.store(owner, ITEMS, (Items(None, everything),))
    return NONE


def _insert(run: Run, owner: Sequence, call: Call) -> Value:
    run.state.store(owner, ITEMS, (Items(None, join(owner.items.any_element(), call.args.at(1) or ANY)),))
    return NONE


def _pop(run: Run, owner: Sequence, call: Call) -> Value:
    element = owner.items.any_element()
    exact = owner.items.exact
    if exact and not call.args.positional and not owner.summary and not owner.escaped:
        run.state.store(owner, ITEMS, (Items(exact[:-1]),))
        return exact[-1]
    run.state.store(owner, ITEMS, (Items(None, element),))
    return element or ANY


def _forget_length(run: Run, owner: Sequence, call: Call) -> Value:
    run.state.store(owner, ITEMS, (Items(None, owner.items.any_element()),))
    return NONE


def _sorted_in_place(run: Run, owner: Sequence, call: Call) -> Value:
    element = owner.items.any_element()
    if "key" not in call.args.keywords and any(isinstance(atom, Instance) for atom in element):
        element = join(element, unknown("an object in an order that the program defines"))
    run.state.store(owner, ITEMS, (Items(None, element),))
    return NONE


def _copy_sequence(run: Run, owner: Sequence, call: Call) -> Value:
    return run.sequence(call.node, owner.kind, owner.items)


def _united(run: Run, owner: Sequence, call: Call) -> Value:
    added = [elements(run, value, call.node, call.frame).any_element() for value in call.args.positional]
    return run.sequence(call.node, owner.kind, Items(None, join_all((owner.items.any_element(), *added))))


SequenceMethod = Callable[[Run, Sequence, Call], Value]
_SEQUENCE: dict[str, SequenceMethod] = {
    "append": _append,
    "add": _append,
    "appendleft": _append,
    "extend": _extend,
    "update": _extend,
    "insert": _insert,
    "pop": _pop,
    "popleft": _pop,
    "remove": _forget_length,
    "discard": _forget_length,
    "clear": _forget_length,
    "sort": _sorted_in_place,
    "reverse": _forget_length,
    "copy": _copy_sequence,
    "union": _united,
    "intersection": _united,
    "difference": _copy_sequence,
}


# --- dictionaries -------------------------------------------------------------------------------------------


def _get(run: Run, owner: Dictionary, call: Call) -> Value:
    key = call.args.at(0) or ANY
    found = present(owner.cells.get(OTHER, BOTTOM))
    missing = False
    for atom in key:
        held, certain = owner.held(atom) if special.is_key(atom) else (BOTTOM, False)
        missing = missing or not certain
        found = join(found, held)
        if not held and not special.is_constant(atom):
            found = join(found, values_of(owner).any_element())
    if missing or owner.is_open:
        found = join(found, call.args.at(1, "default") or NONE)
    return join(found, ANY) if owner.escaped else found


def _setdefault(run: Run, owner: Dictionary, call: Call) -> Value:
    value = _get(run, owner, call)
    store_item(run, owner, call.args.at(0) or ANY, value)
    return value


def _pairs(run: Run, owner: Dictionary, call: Call) -> Value:
    keys, values = keys_of(owner), values_of(owner)
    if keys.exact is not None and values.exact is not None:
        pairs = tuple(run.tuple_of((key, value)) for key, value in zip(keys.exact, values.exact, strict=True))
        return run.sequence(call.node, "list", Items(pairs))
    key, value = keys.any_element() or ANY, values.any_element() or ANY
    if len(owner.cells.get(OTHER_KEYS, BOTTOM)) > 1 and len(value) > 1:
        key = ANY  # which of them goes with which value was not kept
    return run.sequence(call.node, "list", Items(None, run.tuple_of((key, value))))


def _update(run: Run, owner: Dictionary, call: Call) -> Value:
    given = call.args.at(0)
    if given is not None:
        add_entries(run, owner, given, call)
    for name, value in call.args.keywords.items():
        run.state.store(owner, Key(name), value)
    if call.args.more_keywords:
        run.state.store(owner, OTHER, join(owner.cells.get(OTHER, BOTTOM), call.args.more_keywords))
    return NONE


def add_entries(run: Run, owner: Dictionary, given: Value, call: Call) -> None:
    """What ``dict.update`` takes: a mapping, or pairs."""
    for atom in given:
        if not isinstance(atom, Sequence):
            copy_dictionary(run, owner, (atom,))
            continue
        items = elements(run, (atom,), call.node, call.frame)
        for pair in items.exact if items.exact is not None else (items.any_element(),):
            parts = elements(run, pair, call.node, call.frame).exact
            if parts and len(parts) == 2 and items.exact is not None:
                store_item(run, owner, *parts)
            else:
                held = parts[1] if parts and len(parts) == 2 else ANY
                run.state.store(owner, OTHER, join(owner.cells.get(OTHER, BOTTOM), held))


def _pop_item(run: Run, owner: Dictionary, call: Call) -> Value:
    found = _get(run, owner, call)
    key = sole(call.args.at(0))
    if isinstance(key, str | int | float | bool | type(None)) and not owner.summary:
        run.state.write(owner.cells, Key(key), ABSENT)
    return found


def _clear_dictionary(run: Run, owner: Dictionary, call: Call) -> Value:
    for cell in list(owner.cells):
        run.state.store(owner, cell, ABSENT)
    return NONE


def _last_item(run: Run, owner: Dictionary, call: Call) -> Value:
    entries = owner.entries()
    if entries and not owner.is_open and entries[-1][2]:
        key, value, _ = entries[-1]
        run.state.write(owner.cells, key, ABSENT)
        return run.tuple_of(((key.constant,), value))
    run.escape_value((owner,))
    return run.tuple_of((keys_of(owner).any_element() or ANY, values_of(owner).any_element() or ANY))


def _copy_dictionary(run: Run, owner: Dictionary, call: Call) -> Value:
    copied = run.allocate(call.node, "dict", Dictionary)
    copied.default = join(copied.default, owner.default)
    copy_dictionary(run, copied, (owner,))
    if owner.escaped and not copied.escaped:
        copied.escaped = True
        run.state.learned += 1
        run.state.opened += copied.cells.born != run.state.period
    return (copied,)


DictionaryMethod = Callable[[Run, Dictionary, Call], Value]
_DICTIONARY: dict[str, DictionaryMethod] = {
    "get": _get,
    "setdefault": _setdefault,
    "keys": lambda run, owner, call: run.sequence(call.node, "list", keys_of(owner)),
    "values": lambda run, owner, call: run.sequence(call.node, "list", values_of(owner)),
    "items": _pairs,
    "update": _update,
    "pop": _pop_item,
    "popitem": _last_item,
    "clear": _clear_dictionary,
    "copy": _copy_dictionary,
}
