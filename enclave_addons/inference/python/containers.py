"""Lists, tuples, sets and dictionaries: elements, entries, subscripts, and their methods; methods of texts."""

from __future__ import annotations

from collections.abc import Callable

from enclave_addons.inference.kernel.texts import Input, Text, input_of
from enclave_addons.inference.kernel.values import (
    ABSENT,
    ANY,
    BOTTOM,
    CONSTANTS,
    ITEMS,
    NONE,
    OF_LAUNCH,
    OTHER,
    External,
    Items,
    Key,
    Obj,
    Unknown,
    Value,
    boolean,
    join,
    join_all,
    present,
    sole,
    unknown,
)
from enclave_addons.inference.python.formatting import joined, str_format, text_value
from enclave_addons.inference.python.objects import Arguments, Call, Class
from enclave_addons.inference.python.run import COMMAND_LINE, MAX_EXACT, Run

SEQUENCES = ("list", "tuple", "set", "lazy")
MAX_TEXT = 4096
_PLAIN_BASES = ("enum.IntEnum", "enum.StrEnum", "enum.IntFlag", "builtins.str", "builtins.int")


def plain(atom: object) -> object:
    """Return the value of a member of an enumeration whose members are texts or numbers; others as they are."""
    if not isinstance(atom, Obj) or not isinstance(atom.cls, Class) or "_value_" not in atom.cells:
        return atom
    return sole(atom.cells["_value_"]) if any(path in _PLAIN_BASES for path in atom.cls.foreign()) else atom


def is_key(atom: object) -> bool:
    """Return whether ``atom`` is one certain key of a dictionary."""
    if isinstance(atom, Obj):
        return (atom.kind == "instance" and not atom.summary) or atom.kind in ("class", "module")
    return isinstance(atom, (*CONSTANTS, External, Text)) and not (isinstance(atom, Text) and atom.hole)


# --- elements -----------------------------------------------------------------------------------------------


def elements(run: Run, value: Value) -> Items:
    """Return what iterating over ``value`` gives."""
    atoms = [atom for atom in value if atom is not None]
    if len(atoms) == 1:
        return _elements(run, atoms[0])
    several = [_elements(run, atom) for atom in atoms]
    lengths = {len(each.exact) if each.exact is not None else -1 for each in several}
    if several and len(lengths) == 1 and -1 not in lengths:
        return Items(
            tuple(join_all(column) for column in zip(*(each.exact or () for each in several), strict=True))
        )
    return Items(None, join_all(each.any_element() for each in several) or ANY)


def _elements(run: Run, atom: object) -> Items:
    if isinstance(atom, Obj):
        if atom.kind in SEQUENCES:
            return run.items_of(atom)
        if atom.kind == "dict":
            return keys(run, atom)
        if isinstance(atom, Class):
            return Items(
                tuple(member for name, member in atom.cells.items() if is_member(atom, name, member))
            )
        if isinstance(atom.cls, Class) and run.class_attribute(atom.cls, "__iter__"):
            return Items(None, unknown("what an __iter__ of the program gives"))
    if isinstance(atom, str) and len(atom) <= MAX_EXACT:
        return Items(tuple((letter,) for letter in atom))
    piece = input_of(atom)
    if piece is not None and piece.item is None:
        return Items(None, run.of_launch(piece._replace(item="each")))
    if isinstance(atom, Unknown) and atom.why == COMMAND_LINE:
        return Items(None, (atom,))
    why = atom.why if isinstance(atom, Unknown) else "an element of something that is not known"
    return Items(None, unknown(why))


def is_member(cls: Class, name: object, held: Value) -> bool:
    """Return whether a class attribute is a member of an enumeration."""
    return isinstance(name, str) and isinstance(sole(held), Obj) and getattr(sole(held), "cls", None) is cls


def entries(run: Run, obj: Obj) -> tuple[list[tuple[object, Value]], bool]:
    """Return known keys with their values, and whether these are certainly all and certainly there."""
    found: list[tuple[object, Value]] = []
    certain = not obj.summary
    for cell, value in list(obj.cells.items()):
        value = run.store.read(obj.cells, cell)
        if isinstance(cell, Key) and present(value):
            found.append((cell.constant, present(value)))
            certain = certain and ABSENT[0] not in value
        elif cell == OTHER and present(value):
            certain = False
    run.store.read(obj.cells, OTHER)
    run.store.read(obj.cells, ITEMS)
    return found, certain


def keys(run: Run, obj: Obj) -> Items:
    """Return the keys of a dictionary."""
    found, certain = entries(run, obj)
    listed: tuple[Value, ...] = tuple((key,) for key, _ in found)
    if certain and len(listed) <= MAX_EXACT:
        return Items(listed)
    others = unknown("a key that is not known") if present(obj.cells.get(OTHER, BOTTOM)) else BOTTOM
    return Items(None, join(join_all(listed), others))


def values(run: Run, obj: Obj) -> Items:
    """Return the values of a dictionary."""
    found, certain = entries(run, obj)
    if certain and len(found) <= MAX_EXACT:
        return Items(tuple(value for _, value in found))
    return Items(None, join(join_all(value for _, value in found), present(obj.cells.get(OTHER, BOTTOM))))


def pairs(run: Run, call: Call, obj: Obj) -> Value:
    """Return ``items()`` of a dictionary."""
    found, certain = entries(run, obj)
    rows = tuple(run.tuple_of((key,), value) for key, value in found)
    if certain and len(found) <= MAX_EXACT:
        return run.tuple_of(*rows)
    other = present(obj.cells.get(OTHER, BOTTOM))
    if other:
        rows = (*rows, run.tuple_of(unknown("a key that is not known"), other))
    return run.sequence(call.node, "list", Items(None, join_all(rows)), "items")


# --- subscripts ---------------------------------------------------------------------------------------------


def subscript(run: Run, owner: Value, key: Value) -> Value:
    """Return ``owner[key]``."""
    atoms = [atom for atom in owner if atom is not None]
    return join_all(_subscript(run, atom, key) for atom in atoms) or ANY


def _subscript(run: Run, atom: object, key: Value) -> Value:
    if isinstance(atom, Obj) and atom.kind == "dict":
        return held(run, atom, key) or unknown("an entry that is not set here")
    if isinstance(atom, Obj) and atom.kind in SEQUENCES:
        items = run.items_of(atom)
        index = sole(key)
        if (
            items.exact is not None
            and isinstance(index, int)
            and -len(items.exact) <= index < len(items.exact)
        ):
            return items.exact[index]
        return items.any_element() or unknown("an element of an empty list")
    index = sole(key)
    if isinstance(atom, str) and isinstance(index, int) and -len(atom) <= index < len(atom):
        return (atom[index],)
    piece = input_of(atom)
    if piece is not None and piece.item is None and isinstance(index, int):
        return run.of_launch(piece._replace(item=index))
    if isinstance(atom, Class) and isinstance(index, str) and index in atom.cells:
        return atom.cells[index]  # a member of an enumeration
    if isinstance(atom, (External, Class)):
        return (atom,)  # List[str], Generic[T]; what a library's object holds is the library's
    if isinstance(atom, Unknown):
        return (atom,)
    return OF_LAUNCH if isinstance(atom, Text) else unknown("an element of something that is not known")


def held(run: Run, obj: Obj, key: Value) -> Value:
    """Return what a dictionary may hold under ``key``."""
    found: Value = BOTTOM
    for atom in key:
        if is_key(atom) and not isinstance(atom, Text):
            cell = run.store.read(obj.cells, Key(atom))
            found = join(found, present(cell))
            if not cell or ABSENT[0] in cell:
                found = join(found, present(run.store.read(obj.cells, OTHER)))
        else:
            run.store.read(obj.cells, OTHER)
            found = join(found, values(run, obj).any_element())
    return found


def is_certain(run: Run, obj: Obj, key: Value) -> bool | None:
    """Return whether a dictionary has ``key``; ``None`` if it may."""
    atom = sole(key)
    if not is_key(atom) or isinstance(atom, Text):
        return None
    cell = run.store.read(obj.cells, Key(atom))
    if present(cell):
        return True if not obj.summary and ABSENT[0] not in cell else None
    return None if obj.summary or present(run.store.read(obj.cells, OTHER)) else False


def store_item(run: Run, owner: Value, key: Value, value: Value) -> None:
    """Run ``owner[key] = value``."""
    for atom in owner:
        if not isinstance(atom, Obj):
            continue
        new = value
        if atom.kind == "dict":
            index = sole(key)
            cell: object = Key(index) if is_key(index) else OTHER
            if len(owner) > 1 or cell == OTHER:
                new = join(atom.cells.get(cell, ABSENT), value)
            run.store.store(atom, cell, new)
        elif atom.kind == "list":
            items, index = run.items_of(atom), sole(key)
            if (
                items.exact is not None
                and isinstance(index, int)
                and -len(items.exact) <= index < len(items.exact)
            ):
                listed = list(items.exact)
                listed[index] = value if len(owner) == 1 else join(listed[index], value)
                run.store.store(atom, ITEMS, (Items(tuple(listed)),))
            else:
                run.store.store(atom, ITEMS, (Items(None, join(items.any_element(), value)),))


def delete_item(run: Run, owner: Value, key: Value) -> None:
    """Run ``del owner[key]``."""
    for atom in owner:
        if isinstance(atom, Obj) and atom.kind == "dict" and is_key(sole(key)):
            run.store.store(atom, Key(sole(key)), ABSENT)
        elif isinstance(atom, Obj) and atom.kind == "list":
            run.store.store(atom, ITEMS, (Items(None, run.items_of(atom).any_element()),))


def fill(run: Run, obj: Obj, given: Value, keywords: dict[str, Value], more: Value = BOTTOM) -> None:
    """Add what ``dict`` and ``dict.update`` are given to ``obj``."""
    for atom in given:
        if isinstance(atom, Obj) and atom.kind == "dict":
            for key, value in entries(run, atom)[0]:
                store_item(run, (obj,), (key,), value)
            more = join(more, present(atom.cells.get(OTHER, BOTTOM)))
        elif isinstance(atom, Obj) and atom.kind in SEQUENCES:
            items = run.items_of(atom)
            for row in items.exact if items.exact is not None else (items.rest,):
                pair = elements(run, row).exact if row else None
                if pair is not None and len(pair) == 2 and items.exact is not None:
                    store_item(run, (obj,), pair[0], pair[1])
                elif row:
                    more = join(more, pair[1] if pair is not None and len(pair) == 2 else ANY)
        elif atom is not None:
            more = join(more, ANY)
    for name, value in keywords.items():
        store_item(run, (obj,), (name,), value)
    if more:
        run.store.store(obj, OTHER, join(obj.cells.get(OTHER, ABSENT), more))


def new_dictionary(
    run: Run, call: Call, given: Value, keywords: dict[str, Value], more: Value = BOTTOM
) -> Value:
    """Return a new dictionary with what ``dict`` is given."""
    obj = run.allocate(call.node, "dict")
    fill(run, obj, given, keywords, more)
    return (obj,)


def from_dictionary(run: Run, mapping: Obj, args: Arguments) -> None:
    """Add the entries of a dictionary as keyword arguments."""
    from_entries, certain = entries(run, mapping)
    for key, value in from_entries:
        if isinstance(key, str):
            args.keywords[key] = value
    if not certain:
        args.more_keywords = join(args.more_keywords, present(mapping.cells.get(OTHER, BOTTOM)))


# --- methods ------------------------------------------------------------------------------------------------


def _append(run: Run, owner: Obj, call: Call) -> Value:
    added = join_all(call.args.positional[-1:]) or ANY
    items = run.items_of(owner)
    if (
        owner.kind == "list"
        and items.exact is not None
        and len(items.exact) < MAX_EXACT
        and not owner.summary
    ):
        run.store.write(owner.cells, ITEMS, (Items((*items.exact, added)),))
    else:
        run.store.store(owner, ITEMS, (Items(None, join(items.any_element(), added)),))
    return NONE


def extend(run: Run, owner: Obj, given: Value) -> None:
    """Add the elements of ``given``."""
    items, added = run.items_of(owner), elements(run, given)
    known = items.exact is not None and added.exact is not None and owner.kind == "list" and not owner.summary
    if known and len(items.exact or ()) + len(added.exact or ()) <= MAX_EXACT:
        run.store.write(owner.cells, ITEMS, (Items((*(items.exact or ()), *(added.exact or ()))),))
    else:
        run.store.store(owner, ITEMS, (Items(None, join(items.any_element(), added.any_element())),))


def _extend(run: Run, owner: Obj, call: Call) -> Value:
    for value in call.args.positional:
        extend(run, owner, value)
    return NONE


def _pop(run: Run, owner: Obj, call: Call, index: int = -1) -> Value:
    place, items = sole(call.at(0) or (index,)), run.items_of(owner)
    left = list(items.exact or ())
    if (
        isinstance(place, int)
        and -len(left) <= place < len(left)
        and owner.kind == "list"
        and not owner.summary
    ):
        taken = left.pop(place)
        run.store.write(owner.cells, ITEMS, (Items(tuple(left)),))
        return taken
    run.store.store(owner, ITEMS, (Items(None, items.any_element()),))
    return items.any_element() or ANY


def _reordered(run: Run, owner: Obj, call: Call) -> Value:
    items = run.items_of(owner)
    if call.args.positional:
        rest = join(items.any_element(), call.args.positional[-1])
        run.store.store(owner, ITEMS, (Items(None, rest),))
    elif items.exact is not None:
        run.store.store(owner, ITEMS, (Items(tuple(items.any_element() for _ in items.exact)),))
    return NONE


def _clear(run: Run, owner: Obj, call: Call) -> Value:
    run.store.store(owner, ITEMS, (Items(()),))
    return NONE


def _index(run: Run, owner: Obj, call: Call) -> Value:
    wanted, exact = sole(call.at(0)), run.items_of(owner).exact
    known = [sole(each) for each in exact or ()]
    plain = exact is not None and all(isinstance(each, CONSTANTS) for each in (wanted, *known))
    return (known.index(wanted),) if plain and wanted in known else ANY


def _copy(run: Run, owner: Obj, call: Call) -> Value:
    return run.sequence(call.node, owner.kind, run.items_of(owner), "copy")


SEQUENCE_METHODS: dict[str, Callable[[Run, Obj, Call], Value]] = {
    **dict.fromkeys(("append", "add", "appendleft", "put", "put_nowait"), _append),
    **dict.fromkeys(("extend", "update"), _extend),
    **dict.fromkeys(("insert", "remove", "discard", "sort", "reverse"), _reordered),
    "clear": _clear,
    "pop": _pop,
    **dict.fromkeys(("get", "get_nowait"), lambda run, owner, call: run.items_of(owner).any_element() or ANY),
    "popleft": lambda run, owner, call: _pop(run, owner, call, 0),
    "index": _index,
    "copy": _copy,
}


def _get(run: Run, owner: Obj, call: Call) -> Value:
    key = call.at(0) or ANY
    found = held(run, owner, key)
    if is_certain(run, owner, key) is True:
        return found
    default = call.at(1, "default") or NONE
    return join(found, default)


def _set_default(run: Run, owner: Obj, call: Call) -> Value:
    found = _get(run, owner, call)
    if is_certain(run, owner, call.at(0) or ANY) is not True:
        store_item(run, (owner,), call.at(0) or ANY, found)
    return found


def _pop_entry(run: Run, owner: Obj, call: Call) -> Value:
    found = _get(run, owner, call)
    delete_item(run, (owner,), call.at(0) or ANY)
    return found


def _update(run: Run, owner: Obj, call: Call) -> Value:
    fill(run, owner, call.at(0) or BOTTOM, call.args.keywords, call.args.more_keywords)
    return NONE


def _clear_entries(run: Run, owner: Obj, call: Call) -> Value:
    for cell in list(owner.cells):
        run.store.store(owner, cell, ABSENT)
    return NONE


def _copied(run: Run, owner: Obj, call: Call) -> Value:
    return new_dictionary(run, call, (owner,), {})


DICTIONARY_METHODS: dict[str, Callable[[Run, Obj, Call], Value]] = {
    "get": _get,
    "setdefault": _set_default,
    "pop": _pop_entry,
    "update": _update,
    "clear": _clear_entries,
    "copy": _copied,
    "keys": lambda run, owner, call: run.sequence(call.node, "lazy", keys(run, owner), "keys"),
    "values": lambda run, owner, call: run.sequence(call.node, "lazy", values(run, owner), "values"),
    "items": lambda run, owner, call: pairs(run, call, owner),
}


# --- texts --------------------------------------------------------------------------------------------------

_PURE = frozenset({
    "strip", "lstrip", "rstrip", "lower", "upper", "title", "capitalize", "replace", "removeprefix", "removesuffix",
    "zfill", "ljust", "rjust", "center", "casefold", "startswith", "endswith", "isdigit", "isalpha", "find", "rfind",
    "index", "count", "isidentifier", "islower", "isupper",
})  # fmt: skip
_SPLITS = frozenset({"split", "rsplit", "splitlines", "partition", "rpartition"})


def _text_method(run: Run, text: str | Text, name: str, call: Call) -> Value:
    if name == "format":
        return text_value(str_format(text, call.args))
    if name == "join":
        return text_value(joined(text, elements(run, call.at(0) or ANY)))
    arguments = [sole(value) for value in call.args.positional]
    if isinstance(text, Text):
        return _of_partial(run, text, name, arguments)
    known = all(isinstance(each, (str, int, type(None))) for each in arguments) and not call.args.keywords
    if (
        not known
        or name not in _PURE | _SPLITS
        or any(isinstance(each, int) and each > MAX_TEXT for each in arguments)
    ):
        return unknown(f"the result of str.{name}()")
    try:
        result = getattr(text, name)(*arguments)
    except (TypeError, ValueError, OverflowError):
        return ANY
    if name in _SPLITS:
        return run.sequence(call.node, "list", Items(tuple((part,) for part in result)), f"{name} {text}")
    return (result,)


def _of_partial(run: Run, text: Text, name: str, arguments: list[object]) -> Value:
    first = text.pieces[0]
    if (
        name == "startswith"
        and isinstance(first, str)
        and isinstance(arguments[0] if arguments else None, str)
    ):
        start = str(arguments[0])
        if len(first) >= len(start) or not start.startswith(first):
            return boolean(first.startswith(start))
    asks = any(isinstance(piece, Input) for piece in text.pieces)
    return OF_LAUNCH if asks else unknown(f"the result of str.{name}()")


# --- calls of methods ---------------------------------------------------------------------------------------


def call_container(run: Run, receiver: object, name: str, call: Call) -> Value:
    """Call a method of a text or a container."""
    if isinstance(receiver, (str, Text)):
        return _text_method(run, receiver, name, call)
    assert isinstance(receiver, Obj)
    table = DICTIONARY_METHODS if receiver.kind == "dict" else SEQUENCE_METHODS
    method = table.get(name)
    return method(run, receiver, call) if method else unknown(f"the result of {name}()")


def iterate_call(run: Run, function: Value, given: Value, call: Call) -> Items:
    """Return what calling ``function`` for each of the elements gives."""
    items = elements(run, given)
    if items.exact is None:
        return Items(None, run.call(function, Arguments([items.rest or ANY]), call.node, call.frame))
    outer, found = run.context, []
    for index, element in enumerate(items.exact):
        run.context = (outer, "element", index)
        found.append(run.call(function, Arguments([element]), call.node, call.frame))
    run.context = outer
    return Items(tuple(found))
