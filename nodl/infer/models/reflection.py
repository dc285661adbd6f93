"""Built-in functions about attributes, classes and modules: ``getattr``, ``type``, ``vars``, imports by name."""

from __future__ import annotations

import ast

from nodl.infer.interpreter import patterns
from nodl.infer.interpreter.assign import store_attribute
from nodl.infer.interpreter.define import complete_class, linearized, program_classes
from nodl.infer.interpreter.frames import Call
from nodl.infer.interpreter.imports import import_module
from nodl.infer.interpreter.iterate import elements
from nodl.infer.interpreter.raising import throw
from nodl.infer.interpreter.run import Run
from nodl.infer.interpreter.subscripts import is_settled
from nodl.infer.methods import BoundMethod, PropertyValue, Variables
from nodl.infer.text import Text
from nodl.infer.values import (
    ANY,
    NONE,
    OF_A_NODE,
    ClassValue,
    Dictionary,
    External,
    FunctionValue,
    HeapObject,
    Instance,
    ModuleValue,
    Value,
    boolean,
    constant_strings,
    join,
    join_all,
    present,
    sole,
    unknown,
)


def call_getattr(run: Run, call: Call) -> Value:
    """``getattr``: the attribute, the default or either; throws ``AttributeError`` where that is certain."""
    owner, names = call.args.at(0) or ANY, call.args.at(1) or ANY
    there = has_attribute(run, sole(owner), sole(names))
    if there is False:
        default = call.args.at(2)
        if default is not None:
            return default
        throw(run, AttributeError)
    elif there:
        return run.attribute(owner, str(sole(names)), call.node, call.frame)
    known = constant_strings(names)
    found = join_all(run.attribute(owner, name, call.node, call.frame) for name in known)
    if len(known) < len(names):
        _any_method(run, owner, names)
        is_node = any(isinstance(atom, Instance) and atom.node is not None for atom in owner)
        found = join(found, unknown(OF_A_NODE if is_node else "an attribute whose name is made at run time"))
    default = call.args.at(2)
    return join(found, default) if default is not None else found


def _any_method(run: Run, owner: Value, names: Value) -> None:
    """``getattr(self, 'on_' + x)``: any method whose name fits may be meant."""
    run.state.reflected = True
    starts = (text.pieces[0] if isinstance(text, Text) else "" for text in names)
    prefixes = tuple(start if isinstance(start, str) else "" for start in starts)
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
        for base in program_classes(atom.cls):
            for name, value in list(base.cells.items()):
                if isinstance(name, str) and name.startswith(prefixes) and not name.startswith("__"):
                    functions = [each for each in value if isinstance(each, FunctionValue)]
                    run.register_callback(tuple(BoundMethod(each, atom) for each in functions), None)


def call_setattr(run: Run, call: Call) -> Value:
    """``setattr``: an unknown name may be any attribute of an object; on a class or module it is a gap."""
    owner, names = call.args.at(0) or ANY, call.args.at(1) or ANY
    value = call.args.at(2) or ANY
    known = constant_strings(names)
    for name in known:
        if len(names) > 1:
            value = join(value, run.attribute(owner, name, call.node, call.frame))
        store_attribute(run, owner, name, value, call.node, call.frame)
    if len(known) < len(names):
        run.escape_value(value)
        run.state.reflected = True
        for atom in owner:
            if isinstance(atom, Instance):
                for cell, old in list(atom.cells.items()):
                    run.state.write(atom.cells, cell, join(old, value))
            if isinstance(atom, ClassValue | ModuleValue | External):
                run.gap(call.node, call.frame, "an attribute whose name is made at run time is set")
    return NONE


def call_hasattr(run: Run, call: Call) -> Value:
    """``hasattr``: true, false, or either where that is not decided."""
    return boolean(has_attribute(run, sole(call.args.at(0)), sole(call.args.at(1))))


def has_attribute(run: Run, owner: object, name: object) -> bool | None:
    """Whether the attribute is there. Once callbacks are registered, they may still set what is missing."""
    if not isinstance(name, str) or not isinstance(owner, Instance | ClassValue | ModuleValue):
        return None
    run.state.reads.attributes.add(name)
    held = owner.cells.get(name)
    if held:
        return True if present(held) is held and not owner.summary else None
    if isinstance(owner, ModuleValue):
        return None
    cls = owner.cls if isinstance(owner, Instance) else owner
    if not isinstance(cls, ClassValue):
        return None
    classes = program_classes(cls)
    if any(base.cells.get(name) for base in classes):
        return True
    hooked = any(hook in base.cells for base in classes for hook in ("__getattr__", "__getattribute__"))
    if hooked or len(classes) < len(linearized(cls)) or owner.summary or name.startswith("__"):
        return None
    return False if is_settled(run) else None


def call_isinstance(run: Run, call: Call) -> Value:
    """``isinstance``: true, false, or either where that is not decided."""
    return boolean(patterns.is_instance(call.args.at(0) or ANY, call.args.at(1) or ANY))


def call_type(run: Run, call: Call) -> Value:
    """``type(x)``: the class of an object, else unknown; with three arguments, a new class or a gap."""
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
    for entry, value, _ in space.entries():
        run.state.store(cls, entry.constant, value)
    complete_class(run, cls, dict(call.args.keywords), call.node, call.frame)
    return (cls,)


def dynamic_code(run: Run, call: Call) -> Value:
    """``eval``, ``exec`` and ``compile``: a gap, and an unknown result."""
    run.gap(call.node, call.frame, "code made at run time (eval, exec) is not analysed")
    return unknown("the result of code made at run time")


def import_dynamic(run: Run, call: Call) -> Value:
    """``import_module(name)`` and ``__import__``: the modules it may be; a gap when no name is known."""
    names = constant_strings(call.args.at(0) or ANY)
    if not names:
        run.gap(call.node, call.frame, "a module whose name is made at run time is not analysed")
        return unknown("a module whose name is made at run time")
    return join_all(import_module(run, name, call.frame) for name in names)


def call_vars(run: Run, call: Call) -> Value:
    """``vars``: the variables of an object, class or module; unknown in a function without argument."""
    found = call.args.at(0)
    if found is None:
        return call_globals(run, call) if call.frame.function is None else unknown("the local variables")
    if all(isinstance(atom, Instance | ClassValue | ModuleValue) for atom in found):
        run.state.reflected = True
        return tuple(Variables(atom) for atom in found if isinstance(atom, HeapObject))
    return unknown("a dictionary of variables")


def call_globals(run: Run, call: Call) -> Value:
    """``globals``: the variables of the module that calls it."""
    return (Variables(call.frame.module),)


def call_locals(run: Run, call: Call) -> Value:
    """``locals``: as ``globals`` outside of functions; inside unknown, and local functions may be called."""
    if call.frame.function is None:
        return call_globals(run, call)
    for value in list(call.frame.cells.values()):
        run.escape_value(value, opened=False, objects=False)
    return unknown("the local variables")


def object_new(run: Run, call: Call) -> Value:
    """``object.__new__(cls)``: an object whose constructor has not run."""
    from nodl.infer.interpreter.instantiation import new_instance

    made: list[object] = []
    for atom in call.args.at(0) or ANY:
        if isinstance(atom, ClassValue):
            for base in program_classes(atom):
                run.instantiated.setdefault(base.node)
            made.append(new_instance(run, atom, call))
        else:
            made.append(unknown("an object of a class that is not known")[0])
    return tuple(made)


def call_property(run: Run, call: Call) -> Value:
    """``property(fget, fset, fdel)``: what is left out, or ``None``, stays empty."""
    given = [call.args.at(index, name) for index, name in enumerate(("fget", "fset", "fdel"))]
    getter, setter, deleter = (tuple(a for a in value or () if a is not None) for value in given)
    return (PropertyValue(getter, setter, deleter),)
