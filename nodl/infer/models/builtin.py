"""Python's built-in functions, for the values that can end in names."""

from __future__ import annotations

import ast
from collections.abc import Callable

from nodl.infer.interpreter import patterns, special
from nodl.infer.interpreter.assign import store_attribute
from nodl.infer.interpreter.conditions import truth
from nodl.infer.interpreter.define import complete_class, linearized
from nodl.infer.interpreter.expressions import copy_dictionary
from nodl.infer.interpreter.frames import Arguments, Call
from nodl.infer.interpreter.imports import import_module
from nodl.infer.interpreter.iterate import elements, keys_of
from nodl.infer.interpreter.operators import as_texts, formatted, text_value
from nodl.infer.interpreter.raising import throw
from nodl.infer.interpreter.run import Run
from nodl.infer.methods import BoundMethod, PropertyValue, Variables
from nodl.infer.text import Text, input_of, with_edit
from nodl.infer.values import (
    ANY,
    BOOLEAN,
    BOTTOM,
    NONE,
    OF_A_NODE,
    OTHER,
    ClassValue,
    Dictionary,
    External,
    FunctionValue,
    HeapObject,
    Instance,
    Items,
    Key,
    ModuleValue,
    Sequence,
    Unknown,
    Value,
    constant_strings,
    join,
    present,
    sole,
    unknown,
)

Model = Callable[[Run, Call], Value]
MAX_RANGE = 64


def argument_items(run: Run, call: Call, index: int = 0) -> Items:
    value = call.args.at(index)
    return Items(()) if value is None else elements(run, value, call.node, call.frame)


def _str(run: Run, call: Call) -> Value:
    value = call.args.at(0)
    if value is None:
        return ("",)
    return text_value(as_texts(special.spoken(run, value, call.node, call.frame)))


def _int(run: Run, call: Call) -> Value:
    atom = sole(call.args.at(0))
    if isinstance(atom, str | int | float):
        try:
            return (int(atom),)
        except (ValueError, OverflowError):
            return ANY
    return (atom,) if isinstance(atom, Unknown) else ANY


def _float(run: Run, call: Call) -> Value:
    atom = sole(call.args.at(0))
    return (float(atom),) if isinstance(atom, int | float) else ANY


def _bool(run: Run, call: Call) -> Value:
    outcome = truth(special.tested(run, call.args.at(0) or (False,), call.node, call.frame))
    return BOOLEAN if outcome is None else (outcome,)


def _len(run: Run, call: Call) -> Value:
    atom = sole(call.args.at(0))
    own = special.call_special(run, atom, "__len__", call.node, call.frame)
    if own:
        return own
    if isinstance(atom, str):
        return (len(atom),)
    if isinstance(atom, Sequence) and atom.items.exact is not None and not atom.escaped:
        return (len(atom.items.exact),)
    if isinstance(atom, Dictionary):
        keys = keys_of(atom).exact
        return (len(keys),) if keys is not None else ANY
    return ANY


def _range(run: Run, call: Call) -> Value:
    bounds = [sole(value) for value in call.args.positional]
    integers = [bound for bound in bounds if isinstance(bound, int)]
    if len(integers) == len(bounds) and (len(bounds) in (1, 2) or (len(bounds) == 3 and integers[2])):
        numbers = range(*integers)
        if len(numbers) <= MAX_RANGE:
            return run.sequence(call.node, "tuple", Items(tuple((number,) for number in numbers)))
    counted = input_of(bounds[-1]) if len(bounds) < 3 else None
    if counted is not None and counted.item is None and (len(bounds) == 1 or isinstance(bounds[0], int)):
        first = (str(bounds[0]),) if len(bounds) == 2 else ()
        return run.sequence(call.node, "tuple", Items(None, (with_edit(counted, "range", first),)))
    return run.sequence(call.node, "tuple", Items(None, unknown("a number of a loop")))


def _sequence(kind: str) -> Model:
    def make(run: Run, call: Call) -> Value:
        return run.sequence(call.node, kind, argument_items(run, call))

    return make


def _set(run: Run, call: Call) -> Value:
    items = argument_items(run, call)
    if items.exact is not None and not all(
        len(item) == 1 and isinstance(item[0], str) for item in items.exact
    ):
        items = Items(None, items.any_element())
    return run.sequence(call.node, "set", items)


def _sorted(run: Run, call: Call) -> Value:
    items = argument_items(run, call)
    if "key" in call.args.keywords:
        run.call(call.args.keywords["key"], Arguments([items.any_element() or ANY]), call.node, call.frame)
    exact = items.exact
    if exact is not None and all(len(item) == 1 and isinstance(item[0], str) for item in exact):
        reverse = truth(call.args.keywords.get("reverse", (False,)))
        if "key" not in call.args.keywords and reverse is not None:
            ordered = sorted(exact, key=lambda item: str(item[0]), reverse=reverse)
            return run.sequence(call.node, "list", Items(tuple(ordered)))
    if exact is not None:
        element = items.any_element()
        items = Items(tuple(element for _ in exact))
    return run.sequence(call.node, "list", items)


def _reversed(run: Run, call: Call) -> Value:
    items = argument_items(run, call)
    if items.exact is not None:
        items = Items(items.exact[::-1])
    return run.sequence(call.node, "list", items)


def _enumerate(run: Run, call: Call) -> Value:
    items = argument_items(run, call)
    start = sole(call.args.at(1, "start") or (0,))
    if items.exact is not None and type(start) is int:
        pairs = tuple(run.tuple_of(((start + index,), element)) for index, element in enumerate(items.exact))
        return run.sequence(call.node, "list", Items(pairs))
    pair = run.tuple_of((unknown("a number of a loop"), items.any_element() or ANY))
    return run.sequence(call.node, "list", Items(None, pair))


def _zip(run: Run, call: Call) -> Value:
    columns = [elements(run, value, call.node, call.frame) for value in call.args.positional]
    if call.args.more:
        return ANY
    if all(column.exact is not None for column in columns):
        rows = zip(*(column.exact or () for column in columns), strict=False)
        return run.sequence(call.node, "list", Items(tuple(run.tuple_of(tuple(row)) for row in rows)))
    row = run.tuple_of(tuple(column.any_element() or ANY for column in columns))
    return run.sequence(call.node, "list", Items(None, row))


def _map(run: Run, call: Call) -> Value:
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


def _filter(run: Run, call: Call) -> Value:
    items = argument_items(run, call, 1)
    element = items.any_element()
    function = call.args.at(0) or NONE
    if element and function != NONE:
        run.call(function, Arguments([element]), call.node, call.frame)
    return run.sequence(call.node, "list", Items(None, element))


def _dict(run: Run, call: Call) -> Value:
    obj = run.allocate(call.node, "dict", Dictionary)
    assert isinstance(obj, Dictionary)
    for atom in call.args.at(0) or BOTTOM:
        if isinstance(atom, Dictionary):
            copy_dictionary(run, obj, (atom,))
        else:
            _store_pairs(run, obj, elements(run, (atom,), call.node, call.frame), call)
    for name, value in call.args.keywords.items():
        run.state.store(obj, Key(name), value)
    return (obj,)


def _store_pairs(run: Run, obj: object, items: Items, call: Call) -> None:
    assert isinstance(obj, Dictionary)
    for pair in items.exact if items.exact is not None else (items.any_element(),):
        parts = elements(run, pair, call.node, call.frame).exact
        key = sole(parts[0]) if parts and len(parts) == 2 else None
        if parts and isinstance(key, str | int):
            run.state.store(obj, Key(key), parts[1])
        else:
            value = parts[1] if parts and len(parts) == 2 else ANY
            run.state.store(obj, OTHER, join(obj.cells.get(OTHER, BOTTOM), value))


def _getattr(run: Run, call: Call) -> Value:
    owner, names = call.args.at(0) or ANY, call.args.at(1) or ANY
    there = has_attribute(run, sole(owner), sole(names))
    if there is False:
        default = call.args.at(2)
        if default is not None:
            return default
        throw(run, AttributeError)
    elif there:
        return run.attribute(owner, str(sole(names)), call.node, call.frame)
    found: Value = BOTTOM
    for name in constant_strings(names):
        found = join(found, run.attribute(owner, name, call.node, call.frame))
    if len(constant_strings(names)) < len(names):
        _any_method(run, owner, names)
        is_node = any(isinstance(atom, Instance) and atom.node is not None for atom in owner)
        found = join(found, unknown(OF_A_NODE if is_node else "an attribute whose name is made at run time"))
    default = call.args.at(2)
    return join(found, default) if default is not None else found


def _any_method(run: Run, owner: Value, names: Value) -> None:
    """``getattr(self, 'on_' + x)``: any method whose name fits may be meant."""
    prefixes = [text.pieces[0] if isinstance(text, Text) else "" for text in names]
    for atom in owner:
        if isinstance(atom, ModuleValue | ClassValue):
            for name, value in list(atom.cells.items()):
                if isinstance(name, str) and not name.startswith(("__", "[")):
                    run.escape_value(value, opened=False)
        if not (isinstance(atom, Instance) and isinstance(atom.cls, ClassValue)):
            continue
        for name, value in list(atom.cells.items()):
            if isinstance(name, str):
                run.escape_value(value, opened=False, objects=False)
        for base in linearized(atom.cls):
            for name, value in list(base.cells.items()) if isinstance(base, ClassValue) else ():
                for prefix in prefixes:
                    start = prefix if isinstance(prefix, str) else ""
                    if isinstance(name, str) and name.startswith(start) and not name.startswith("__"):
                        functions = [each for each in value if isinstance(each, FunctionValue)]
                        bound = tuple(BoundMethod(function, atom) for function in functions)
                        run.register_callback(bound, None)


def _setattr(run: Run, call: Call) -> Value:
    owner, names = call.args.at(0) or ANY, call.args.at(1) or ANY
    value = call.args.at(2) or ANY
    known = constant_strings(names)
    for name in known:
        if len(names) > 1:
            value = join(value, run.attribute(owner, name, call.node, call.frame))
        store_attribute(run, owner, name, value, call.node, call.frame)
    if len(known) < len(names):
        run.escape_value(value)
        for atom in owner:
            if isinstance(atom, Instance):
                for cell, old in list(atom.cells.items()):
                    run.state.write(atom.cells, cell, join(old, value))
            if isinstance(atom, ClassValue | ModuleValue | External):
                run.gap(call.node, call.frame, "an attribute whose name is made at run time is set")
    return NONE


def _hasattr(run: Run, call: Call) -> Value:
    outcome = has_attribute(run, sole(call.args.at(0)), sole(call.args.at(1)))
    return BOOLEAN if outcome is None else (outcome,)


def has_attribute(run: Run, owner: object, name: object) -> bool | None:
    """Whether the attribute is there. Once callbacks are registered, they may still set what is missing."""
    if not isinstance(name, str) or not isinstance(owner, Instance | ClassValue | ModuleValue):
        return None
    held = owner.cells.get(name)
    if held:
        return True if present(held) is held and not owner.summary else None
    if isinstance(owner, ModuleValue):
        return None
    cls = owner.cls if isinstance(owner, Instance) else owner
    if not isinstance(cls, ClassValue):
        return None
    order = linearized(cls)
    if any(isinstance(base, ClassValue) and base.cells.get(name) for base in order):
        return True
    plain = all(
        isinstance(base, ClassValue)
        and "__getattr__" not in base.cells
        and "__getattribute__" not in base.cells
        for base in order
    )
    known = (
        plain and not run.callbacks and not run.repeated and not owner.summary and not name.startswith("__")
    )
    return False if known else None


def _isinstance(run: Run, call: Call) -> Value:
    outcome = patterns.is_instance(call.args.at(0) or ANY, call.args.at(1) or ANY)
    return BOOLEAN if outcome is None else (outcome,)


def _type(run: Run, call: Call) -> Value:
    if len(call.args.positional) == 3:
        return _made_class(run, call)
    atom = sole(call.args.at(0))
    if isinstance(atom, Instance):
        return (atom.cls,)
    return ANY


def _made_class(run: Run, call: Call) -> Value:
    """``type(name, bases, attributes)``."""
    name, bases, space = (sole(value) for value in call.args.positional)
    listed = elements(run, (bases,), call.node, call.frame).exact
    if not isinstance(name, str) or listed is None or not isinstance(space, Dictionary) or space.is_open:
        run.gap(call.node, call.frame, "a class is made at run time (type)")
        run.escape(call.args)
        return unknown("a class made at run time")
    line, column = getattr(call.node, "lineno", 0), getattr(call.node, "col_offset", 0)
    node = ast.ClassDef(name, [], [], [], [], lineno=line, col_offset=column, end_lineno=line)
    key = call.frame.module
    cls = run.allocate(call.node, "type", lambda: ClassValue(node, name, key, tuple(sole(b) for b in listed)))
    assert isinstance(cls, ClassValue)
    for entry, value, _ in space.entries():
        run.state.store(cls, entry.constant, value)
    complete_class(run, cls, dict(call.args.keywords), call.node, call.frame)
    return (cls,)


def _format(run: Run, call: Call) -> Value:
    given = call.args.at(1) or ("",)
    spec = sole(given)
    value = special.spoken(run, call.args.at(0) or ANY, call.node, call.frame, given)
    return text_value(formatted(value, spec if isinstance(spec, str) else None))


def _repr(run: Run, call: Call) -> Value:
    atom = sole(call.args.at(0))
    own = special.call_special(run, atom, "__repr__", call.node, call.frame)
    if own:
        return own
    return (repr(atom),) if isinstance(atom, str | int | float) else unknown("repr()")


def _chosen(run: Run, call: Call) -> Value:
    """``min``, ``max``, ``next``, ``random.choice``: one of the elements."""
    if len(call.args.positional) > 1 and not call.args.more:
        result: Value = BOTTOM
        for value in call.args.positional:
            result = join(result, value)
        return join(result, argument_items(run, call).any_element()) or ANY
    return argument_items(run, call).any_element() or ANY


def _same_items(run: Run, call: Call) -> Value:
    return call.args.at(0) or ANY


def _dynamic_code(run: Run, call: Call) -> Value:
    run.gap(call.node, call.frame, "code made at run time (eval, exec) is not analysed")
    return unknown("the result of code made at run time")


def import_dynamic(run: Run, call: Call) -> Value:
    names = constant_strings(call.args.at(0) or ANY)
    if not names:
        run.gap(call.node, call.frame, "a module whose name is made at run time is not analysed")
        return unknown("a module whose name is made at run time")
    found: Value = BOTTOM
    for name in names:
        found = join(found, import_module(run, name, call.frame))
    return found


def _vars(run: Run, call: Call) -> Value:
    found = call.args.at(0)
    if found is None:
        return _globals(run, call) if call.frame.function is None else unknown("the local variables")
    if all(isinstance(atom, Instance | ClassValue | ModuleValue) for atom in found):
        return tuple(Variables(atom) for atom in found if isinstance(atom, HeapObject))
    return unknown("a dictionary of variables")


def _globals(run: Run, call: Call) -> Value:
    return (Variables(call.frame.module),)


def _locals(run: Run, call: Call) -> Value:
    if call.frame.function is None:
        return _globals(run, call)
    for value in list(call.frame.cells.values()):
        run.escape_value(value, opened=False, objects=False)
    return unknown("the local variables")


def _unknown_text(run: Run, call: Call) -> Value:
    return unknown("text that the user types")


def _any_all(run: Run, call: Call) -> Value:
    return BOOLEAN


def _object_new(run: Run, call: Call) -> Value:
    """``object.__new__(cls)``: an object whose constructor has not run."""
    made: list[object] = []
    for atom in call.args.at(0) or ANY:
        if isinstance(atom, ClassValue):
            for base in linearized(atom):
                if isinstance(base, ClassValue):
                    run.instantiated.setdefault(base.node)
            made.append(new_instance(run, atom, call))
        else:
            made.append(unknown("an object of a class that is not known")[0])
    return tuple(made)


def new_instance(run: Run, cls: ClassValue, call: Call) -> Instance:
    from nodl.infer.interpreter import instantiation

    return instantiation.new_instance(run, cls, call)


def _nothing(run: Run, call: Call) -> Value:
    return NONE


def _property(run: Run, call: Call) -> Value:
    given = [call.args.at(index, name) for index, name in enumerate(("fget", "fset", "fdel"))]
    getter, setter, deleter = (tuple(a for a in value or () if a is not None) for value in given)
    return (PropertyValue(getter, setter, deleter),)


def _object(run: Run, call: Call) -> Value:
    return ANY


FUNCTIONS: dict[str, Model] = {
    f"builtins.{name}": model
    for name, model in {
        "str": _str,
        "int": _int,
        "float": _float,
        "bool": _bool,
        "len": _len,
        "range": _range,
        "list": _sequence("list"),
        "tuple": _sequence("tuple"),
        "set": _set,
        "frozenset": _set,
        "iter": _same_items,
        "sorted": _sorted,
        "reversed": _reversed,
        "enumerate": _enumerate,
        "zip": _zip,
        "map": _map,
        "filter": _filter,
        "dict": _dict,
        "getattr": _getattr,
        "setattr": _setattr,
        "hasattr": _hasattr,
        "isinstance": _isinstance,
        "type": _type,
        "format": _format,
        "repr": _repr,
        "min": _chosen,
        "max": _chosen,
        "next": _chosen,
        "any": _any_all,
        "all": _any_all,
        "callable": _any_all,
        "eval": _dynamic_code,
        "exec": _dynamic_code,
        "compile": _dynamic_code,
        "__import__": import_dynamic,
        "vars": _vars,
        "globals": _globals,
        "locals": _locals,
        "input": _unknown_text,
        "object": _object,
        "object.__new__": _object_new,
        "object.__init_subclass__": _nothing,
        "property": _property,
    }.items()
}
