"""What iterating over a value and ``owner[key]`` give; assignment to names, fields, elements and patterns of them."""

from __future__ import annotations

import ast
import sys
from functools import partial

from enclave_addons.inference.interpreter.conditions import is_of_launch
from enclave_addons.inference.interpreter.define import (
    enumeration_members,
    is_constant,
    is_enumeration,
    linearized,
    member_with_name,
    setter_of,
)
from enclave_addons.inference.interpreter.run import Arguments, Run
from enclave_addons.inference.models.signatures import NODE_PRIVATE
from enclave_addons.inference.text import Text, constant_text
from enclave_addons.inference.values import (
    ABSENT,
    ANY,
    BOTTOM,
    COMMAND_LINE,
    ITEMS,
    LAZY,
    MODULES,
    OF_LAUNCH,
    OTHER,
    OTHER_KEYS,
    RESULT,
    TOO_MANY,
    WITHOUT_PROGRAM,
    WITHOUT_ROS,
    ClassValue,
    Dictionary,
    External,
    Frame,
    FunctionValue,
    Instance,
    Items,
    Key,
    ModuleValue,
    Sequence,
    Unknown,
    Value,
    external,
    join,
    join_all,
    present,
    result_of,
    sole,
    unknown,
)


def subscript(run: Run, node: ast.Subscript, frame: Frame) -> Value:
    """Return what ``owner[key]`` gives for each owner but ``None``; ``ANY`` when nothing comes of it."""
    owner = run.evaluate(node.value, frame)
    key: Value = ANY
    if isinstance(node.slice, ast.Slice):
        given = (node.slice.lower, node.slice.upper, node.slice.step)
        bounds = [sole(run.evaluate(each, frame)) if each is not None else None for each in given]
        if all(each is None or type(each) is int for each in bounds) and bounds[2] != 0:
            key = (slice(*bounds),)
    else:
        key = run.evaluate(node.slice, frame)
    result: Value = BOTTOM
    for atom in owner:
        if atom is not None:
            result = join(result, _element(run, atom, key, node, frame))
    return result or ANY


def _element(run: Run, atom: object, key: Value, node: ast.Subscript, frame: Frame) -> Value:
    if isinstance(atom, Dictionary):
        return dictionary_item(run, atom, key, node, frame)
    if isinstance(atom, Sequence):
        if isinstance(node.slice, ast.Slice):
            return _sliced(run, atom, key[0] if isinstance(key[0], slice) else None, node)
        return _sequence_item(run, atom, key)
    if isinstance(atom, str):
        return _character(atom, key)
    if isinstance(atom, Text):
        return OF_LAUNCH if is_of_launch(atom) else unknown("a part of a text that is not known")
    if isinstance(atom, ClassValue):
        return member_with_name(run, atom, key) if is_enumeration(atom) else (atom,)  # Generic[T]
    if isinstance(atom, External) and atom.path == "os.environ":
        return run.call(external("os.environ.__getitem__"), Arguments([key]), node, frame)
    if sole(key) == _BEHIND_PROGRAM and (atom,) == unknown(COMMAND_LINE):
        return unknown(WITHOUT_PROGRAM)
    if sole(key) == _BEHIND_PROGRAM and (atom,) == result_of("rclpy"):  # what remove_ros_args() leaves
        return unknown(WITHOUT_ROS)
    if isinstance(atom, External):
        if atom.path.startswith(("typing.", "builtins.")) or atom.path.endswith(("[]", RESULT)):
            return (atom,)
        return external(f"{atom.path}[]")
    if isinstance(atom, Unknown) and atom.why in _WORDS and isinstance(node.slice, ast.Slice):
        return (atom,) if sole(key) == slice(None) else unknown("a part of the command line")
    return (atom,) if isinstance(atom, Unknown) else ANY


_BEHIND_PROGRAM = slice(1, None)
_WORDS = (COMMAND_LINE, WITHOUT_PROGRAM, WITHOUT_ROS)


def dictionary_item(run: Run, obj: Dictionary, key: Value, node: ast.AST, frame: Frame) -> Value:
    """Return what ``obj[key]`` gives; fills a ``defaultdict``."""
    key = tuple(map(constant_text, key))
    result: Value = BOTTOM
    everything = False
    everywhere = not obj.escaped
    for atom in key:
        held, certain = obj.held(atom) if is_constant(atom) else (BOTTOM, False)
        result = join(result, held)
        everywhere = everywhere and certain
        everything = everything or not (held or is_constant(atom))
    if everything:
        run.spend(len(obj.cells))
        result = chosen_by_launch(run, key, join(result, values_of(obj).any_element()))
        everywhere = False
    result = with_other_entries(obj, result)
    if obj.escaped or not result:
        result = join(result, unknown("an element of a dictionary that is filled elsewhere"))
    return result


def with_other_entries(obj: Dictionary, found: Value) -> Value:
    """Return ``found`` or what is under keys that are not constants; of several texts nobody knows which is meant."""
    others = present(obj.cells.get(OTHER, BOTTOM))
    found = join(found, others)
    several = sum(isinstance(atom, (str, Text)) for atom in found) > 1
    return join(found, unknown("which entry of a dictionary is meant")) if others and several else found


def _sequence_item(run: Run, sequence: Sequence, key: Value) -> Value:
    items = sequence.items
    if items.exact is None:
        found = items.any_element()
        one_of_several = len(found) > 1 and all(type(index) is int for index in key)
        return join(found, ANY) if one_of_several else found or ANY
    if all(isinstance(index, int) for index in key):
        length = len(items.exact)
        result: Value = BOTTOM
        for index in key:
            if isinstance(index, int) and -length <= index < length:
                result = join(result, items.exact[index])
        return result or ANY
    return chosen_by_launch(run, key, items.any_element()) or ANY


def chosen_by_launch(run: Run, key: Value, found: Value) -> Value:
    """Return one of ``found``, the entries of a table: which one, only a launch says if it decides the ``key``."""
    if len(found) < 2 or not any(map(is_of_launch, key)):
        return found
    run.asks_launch = True
    return join(found, OF_LAUNCH)


def _sliced(run: Run, sequence: Sequence, bounds: slice | None, node: ast.AST) -> Value:
    """Return the elements between known bounds; else some, nobody knows which."""
    exact = sequence.items.exact
    if exact is not None and bounds is not None:
        return run.sequence(node, sequence.kind, Items(exact[bounds]))
    return run.sequence(node, sequence.kind, Items(None, any_of(sequence.items.any_element())))


def _character(text: str, key: Value) -> Value:
    index = sole(key)
    if isinstance(index, slice) or (type(index) is int and -len(text) <= index < len(text)):
        return (text[index],)
    return unknown("a part of a text")


def elements(run: Run, value: Value, node: ast.AST, frame: Frame) -> Items:
    """Return the elements of every iterable that ``value`` may be; ``None`` among others is not iterable."""
    run.spend(len(value))
    found = [_elements_of(run, atom, node, frame) for atom in value if atom is not None]
    if not found:
        return Items(None, ANY)
    if len(found) == 1:
        return found[0]
    return Items(None, join_all(items.any_element() for items in found))


def _elements_of(run: Run, atom: object, node: ast.AST, frame: Frame) -> Items:
    if isinstance(atom, Sequence):
        return atom.items
    if isinstance(atom, Dictionary):
        return keys_of(atom)
    if isinstance(atom, str):
        return Items(tuple((character,) for character in atom)) if len(atom) <= 256 else Items(None, ANY)
    if isinstance(atom, Text):
        return Items(None, OF_LAUNCH if is_of_launch(atom) else unknown("the characters of a text"))
    if isinstance(atom, ClassValue) and is_enumeration(atom):
        return Items(tuple((member,) for member in enumeration_members(run, atom)))
    return Items(None, (atom,) if isinstance(atom, Unknown) else ANY)


def keys_of(obj: Dictionary) -> Items:
    """Return the keys in order if all are known and certainly there; else what any key may be."""
    return _in_order(
        obj, tuple((cell.constant,) for cell, _, _ in obj.entries()), obj.cells.get(OTHER_KEYS, ANY)
    )


def values_of(obj: Dictionary) -> Items:
    """Return the values in the order of their keys if all are known and certainly there; else what any may be."""
    return _in_order(obj, tuple(value for _, value, _ in obj.entries()), obj.cells.get(OTHER, BOTTOM))


def _in_order(obj: Dictionary, known: tuple[Value, ...], others: Value) -> Items:
    if obj.is_open:
        result = join_all((present(others), *known))
        return Items(None, join(result, ANY) if obj.escaped else result)
    certain = all(certain for _, _, certain in obj.entries()) and not obj.summary
    return Items(known) if certain else Items(None, join_all(known))


EDITED = unknown("an element of a list that is edited while that is undecided")


def assign(run: Run, target: ast.expr, value: Value, frame: Frame) -> None:
    """Bind ``value`` to a name, field or element, or take it apart for a tuple or list of targets."""
    at_once = isinstance(target, ast.Tuple | ast.List)
    if not at_once and any(type(atom) is Sequence and atom.kind == LAZY for atom in value):
        value = _stored(run, value, target)
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


def _stored(run: Run, value: Value, node: ast.AST) -> Value:
    """Return ``value`` as it is in a variable: what an iterator or a view of a dictionary gives later is not known."""
    later = unknown("what an iterator or view gives later")
    lazy = [atom.items.any_element() for atom in value if isinstance(atom, Sequence) and atom.kind == LAZY]
    others = tuple(atom for atom in value if not (isinstance(atom, Sequence) and atom.kind == LAZY))
    return join(run.sequence(node, "list", Items(None, join(join_all(lazy), later))), others)


def store_attribute(run: Run, owners: Value, name: str, value: Value, node: ast.AST, frame: Frame) -> None:
    """Run ``owner.name = value``."""
    certain = len(owners) == 1
    if name.startswith("__") and name.endswith("__") and name not in _DESCRIBING:
        run.gap(node, frame, f"{name} is set; what Python then does otherwise is not followed")
    for owner in owners:
        setter = setter_of(owner, name) if run.has_setters and isinstance(owner, Instance) else BOTTOM
        if setter:
            call = partial(run.call, setter, Arguments([(owner,), value]), node, frame)
            call() if certain else run.state.perhaps(call)
        elif isinstance(owner, (Instance, ClassValue, ModuleValue)):
            if name in NODE_PRIVATE:
                note_private(run, owner, name, node, frame)
            if isinstance(owner, Instance) and _is_of_one_thread(owner):
                value = join(value, unknown("an attribute that each thread has for itself"))
            kept = BOTTOM if certain else owner.cells.get(name, BOTTOM)
            run.state.store(owner, name, join(kept, value))
        else:
            run.escape_value(value)  # whoever holds it may call it
            if isinstance(owner, FunctionValue) and name == "__name__":
                owner.name = ""
            if owner is MODULES[0]:
                run.gap(node, frame, "a variable of a module out of sys.modules is set")
            if isinstance(owner, External):
                _patched(run, owner, name, value, node, frame)


def note_private(run: Run, owner: object, name: str, node: ast.AST, frame: Frame) -> None:
    """Add a gap where the program asks rclpy's node for ``name`` (one of ``NODE_PRIVATE``), or sets it."""
    if owner in run.findings.node_of:
        run.gap(node, frame, f"{name} of rclpy's node is used, which is not followed")


def _is_of_one_thread(owner: Instance) -> bool:
    order = linearized(owner.cls) if isinstance(owner.cls, ClassValue) else ()
    return any(isinstance(base, External) and base.path == "threading.local" for base in order)


_DESCRIBING = frozenset({"__name__", "__qualname__", "__doc__", "__module__", "__version__", "__wrapped__"})
_UNMODELLED = frozenset({"unittest", "pytest", "tkinter"})  # whose objects hold attributes of the program


def _patched(run: Run, owner: External, name: str, value: Value, node: ast.AST, frame: Frame) -> None:
    """Add a gap for a replaced attribute of a library's module or class, if its other users are modelled.

    A constant assigned in a third-party library (``torch.backends.cudnn.benchmark = True``) does not change ROS.
    Neither does a built-in type under its own name (``numpy.float = float``, removed in numpy 1.24).
    """
    root = owner.path.partition(".")[0]
    own = (*external(f"builtins.{name}"), *(atom for atom in value if is_constant(atom)))
    if root not in sys.stdlib_module_names and all(atom in own for atom in value):
        return
    modelled = root in sys.stdlib_module_names or run.tables.keeps_off(owner.path)
    if root in _UNMODELLED or not modelled:
        return
    if "(" not in owner.path and "[" not in owner.path and ".qos" not in owner.path:
        run.gap(node, frame, f"{owner.path}.{name} is replaced; what its users then do is not analysed")


def store_item(run: Run, obj: Dictionary, key: Value, value: Value) -> None:
    """Run ``obj[key] = value``."""
    if len(key) == 1 and is_constant(key[0]):
        cell = Key(key[0])
        if not run.repeated and obj.cells.get(cell) == ABSENT:
            del obj.cells[cell]  # it comes last again; undone, it is as absent as before
        run.state.store(obj, cell, value)
        return
    known = [atom for atom in key if is_constant(atom)]
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
                change(run, owner, added)
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
        change(run, owner, value)
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
    if exact is not None:
        element = any_of(element)
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
    elif isinstance(owner, (ClassValue, ModuleValue)) and name in owner.cells:
        run.gap(node, frame, f"{name} is deleted; what is found instead is not analysed")


def _delete_item(run: Run, owner: object, key: Value, certain: bool) -> None:
    if isinstance(owner, Sequence):
        change(run, owner, BOTTOM)
    elif isinstance(owner, Dictionary):
        strong = certain and len(key) == 1 and not owner.summary
        if strong and is_constant(key[0]):
            run.state.write(owner.cells, Key(key[0]), ABSENT)


def change(run: Run, owner: Sequence, added: Value, taken: bool = True) -> None:
    """Let ``added`` come to the elements; in which order they are is not kept.

    ``taken``: an unknown element was removed; any text or class among the elements may be that one.
    """
    others = join(owner.items.any_element(), added)
    if taken and any(isinstance(atom, ClassValue) for atom in others):
        others = join(others, unknown(TOO_MANY))
    if taken and any(isinstance(atom, (str, Text)) for atom in others):
        others = join(tuple(atom for atom in others if not isinstance(atom, (str, Text))), EDITED)
    run.state.touch(owner, ITEMS)
    run.state.store(owner, ITEMS, (Items(None, others),))


def any_of(found: Value) -> Value:
    """Return one of several elements, nobody knows which: of texts nothing is known then."""
    if len(found) < 2:
        return found
    return join(tuple(atom for atom in found if not isinstance(atom, (str, Text))), ANY)
