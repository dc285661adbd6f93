"""Methods of strings, lists, sets, dictionaries."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from enclave_addons.inference.interpreter.define import is_constant
from enclave_addons.inference.interpreter.elements import (
    any_of,
    change,
    chosen_by_launch,
    elements,
    keys_of,
    values_of,
    with_other_entries,
)
from enclave_addons.inference.interpreter.formatting import joined, str_format, text_value
from enclave_addons.inference.interpreter.run import Call, Run
from enclave_addons.inference.models.stdlib import fill
from enclave_addons.inference.text import MAX_LENGTH, Input, Text, TextAtom, constant_text
from enclave_addons.inference.values import (
    ABSENT,
    ANY,
    BOTTOM,
    ITEMS,
    LAZY,
    NONE,
    OF_LAUNCH,
    OTHER_KEYS,
    Dictionary,
    Items,
    Key,
    Sequence,
    Value,
    join,
    join_all,
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
    """Return what a method of a text or container gives and, in a container, changes; unknown without a model."""
    if isinstance(receiver, (str, Text)):
        return _text_method(run, receiver, name, call)
    if isinstance(receiver, Dictionary):
        run.spend(len(receiver.cells))
        model = _DICTIONARY.get(name)
        return model(run, receiver, call) if model else _lost(run, receiver, call)
    if isinstance(receiver, Sequence):
        run.spend(len(receiver.items.exact or receiver.items.rest))
        method = _SEQUENCE.get(name)
        return method(run, receiver, call) if method else _lost(run, receiver, call)
    run.escape(call.args)
    return unknown(f"the result of {name}()")


def _lost(run: Run, receiver: object, call: Call) -> Value:
    """Handle a method that is not modelled: it may call what it is given and change its object."""
    run.escape(call.args)
    run.escape_value((receiver,))
    return ANY


# --- text ---------------------------------------------------------------------------------------------------


def _text_method(run: Run, text: TextAtom, name: str, call: Call) -> Value:
    if name == "format":
        return text_value(str_format(text, call.args))
    if name == "join":
        return text_value(joined((text,), elements(run, call.args.at(0) or ANY, call.node, call.frame)))
    arguments = tuple(sole(value) for value in call.args.positional)
    constant = all(isinstance(argument, (str, int, type(None))) for argument in arguments)
    if not constant or call.args.keywords or call.args.more:
        return unknown(f"the result of str.{name}()")
    if isinstance(text, str):
        return _constant_method(run, text, name, arguments, call)
    asks = any(isinstance(piece, Input) for piece in text.pieces)
    return OF_LAUNCH if asks else unknown(f"the result of str.{name}()")


def _constant_method(run: Run, text: str, name: str, arguments: tuple[object, ...], call: Call) -> Value:
    if name not in _PURE and name not in _SPLITS:
        return unknown(f"the result of str.{name}()")
    size = len(text) + sum(len(each) if isinstance(each, str) else 0 for each in arguments)
    if size > MAX_LENGTH or any(type(each) is int and each > MAX_LENGTH for each in arguments):
        return unknown(f"the result of str.{name}() of a very long text")
    try:
        result = getattr(text, name)(*arguments)
    except (TypeError, ValueError, OverflowError):
        return ANY
    if name in _SPLITS:
        return run.sequence(call.node, "list", Items(tuple((part,) for part in result)))
    return (result,) if not isinstance(result, str) or len(result) < MAX_LENGTH else ANY


# --- sequences ----------------------------------------------------------------------------------------------


def _append(run: Run, owner: Sequence, call: Call) -> Value:
    change(run, owner, call.args.at(0) or ANY, taken=False)
    return NONE


def _extend(run: Run, owner: Sequence, call: Call) -> Value:
    added = (elements(run, value, call.node, call.frame).any_element() for value in call.args.positional)
    change(run, owner, join_all(added) if call.args.positional else ANY, taken=False)
    return NONE


def _pop(run: Run, owner: Sequence, call: Call, index: int = -1) -> Value:
    place, left = sole(call.args.at(0) or (index,)), list(owner.items.exact or ())
    certain = owner.kind != "set" and not owner.summary
    if certain and isinstance(place, int) and -len(left) <= place < len(left):
        taken = left.pop(place)
        run.state.write(owner.cells, ITEMS, (Items(tuple(left)),))
        return taken
    element = any_of(owner.items.any_element())
    change(run, owner, BOTTOM)
    return element or ANY


def _index(run: Run, owner: Sequence, call: Call) -> Value:
    wanted, elements_ = constant_text(sole(call.args.at(0))), owner.items.exact
    known = [constant_text(sole(each)) for each in elements_ or ()]
    plain = (
        elements_ is not None and all(map(is_constant, (wanted, *known))) and len(call.args.positional) == 1
    )
    return (known.index(wanted),) if plain and wanted in known else ANY


def _edited(run: Run, owner: Sequence, call: Call) -> Value:
    """Handle ``insert``, ``remove``, ``sort`` ...: what is left, in which order, is not known."""
    run.escape_value(call.args.keywords.get("key", NONE))
    change(run, owner, join_all(call.args.positional))
    return NONE


SequenceMethod = Callable[[Run, Sequence, Call], Value]
_SEQUENCE: dict[str, SequenceMethod] = {
    **dict.fromkeys(("append", "add", "appendleft"), _append),
    **dict.fromkeys(("extend", "update"), _extend),
    **dict.fromkeys(("insert", "remove", "discard", "sort", "reverse", "clear"), _edited),
    "pop": _pop,
    "popleft": partial(_pop, index=0),
    "index": _index,
}


# --- dictionaries -------------------------------------------------------------------------------------------


def _get(run: Run, owner: Dictionary, call: Call) -> Value:
    key = call.args.at(0) or ANY
    key = tuple(map(constant_text, key))
    found: Value = BOTTOM
    missing = False
    for atom in key:
        held, certain = owner.held(atom) if is_constant(atom) else (BOTTOM, False)
        missing = missing or not certain
        found = join(found, held)
        if not held and not is_constant(atom):
            found = chosen_by_launch(run, key, join(found, values_of(owner).any_element()))
    found = with_other_entries(owner, found)
    if missing or owner.is_open:
        found = join(found, call.args.at(1, "default") or NONE)
    return join(found, ANY) if owner.escaped else found


def _pairs(run: Run, owner: Dictionary, call: Call) -> Value:
    keys, values = keys_of(owner), values_of(owner)
    if keys.exact is not None and values.exact is not None:
        pairs = tuple(run.tuple_of((key, value)) for key, value in zip(keys.exact, values.exact, strict=True))
        return run.sequence(call.node, LAZY, Items(pairs))
    key, value = keys.any_element() or ANY, values.any_element() or ANY
    if len(owner.cells.get(OTHER_KEYS, BOTTOM)) > 1 and len(value) > 1:
        key = ANY  # which of them goes with which value was not kept
    return run.sequence(call.node, LAZY, Items(None, run.tuple_of((key, value))))


def _update(run: Run, owner: Dictionary, call: Call) -> Value:
    fill(run, owner, call)
    return NONE


def _pop_item(run: Run, owner: Dictionary, call: Call) -> Value:
    found = _get(run, owner, call)
    key = sole(call.args.at(0))
    if is_constant(key) and not owner.summary:
        run.state.write(owner.cells, Key(key), ABSENT)
    return found


DictionaryMethod = Callable[[Run, Dictionary, Call], Value]
_DICTIONARY: dict[str, DictionaryMethod] = {
    "get": _get,
    "keys": lambda run, owner, call: run.sequence(call.node, LAZY, keys_of(owner)),
    "values": lambda run, owner, call: run.sequence(call.node, LAZY, values_of(owner)),
    "items": _pairs,
    "update": _update,
    "pop": _pop_item,
}
