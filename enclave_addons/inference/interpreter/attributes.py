"""Attribute access: instances and their classes, modules, foreign names, methods of built-in values."""

from __future__ import annotations

import ast
import re
from functools import partial

from enclave_addons.inference.interpreter import imports
from enclave_addons.inference.interpreter.define import (
    enumeration_member,
    is_enumeration,
    linearized,
    program_classes,
)
from enclave_addons.inference.interpreter.elements import note_private
from enclave_addons.inference.interpreter.run import Arguments, AttributeReader, Run
from enclave_addons.inference.models import foreign
from enclave_addons.inference.models.signatures import NODE_PRIVATE
from enclave_addons.inference.text import Text
from enclave_addons.inference.values import (
    ABSENT,
    ANY,
    BOTTOM,
    MODULES,
    RESULT,
    BoundMethod,
    ClassMethod,
    ClassValue,
    Dictionary,
    External,
    ForeignMethod,
    Frame,
    FunctionValue,
    HeapObject,
    Instance,
    ModuleValue,
    NativeMethod,
    Partial,
    PropertyValue,
    Sequence,
    SuperProxy,
    Unknown,
    Value,
    external,
    join,
    present,
    unknown,
)

MAX_DOTS = 8


def _of_instance(run: Run, obj: Instance, name: str, node: ast.AST, frame: Frame) -> Value:
    if name in NODE_PRIVATE:
        note_private(run, obj, name, node, frame)
    held = obj.cells.get(name)
    if name == "__dict__":
        return run.variables_of(node, frame)
    if isinstance(obj.cls, External):
        HeapObject.looked_into.add(id(obj.cells))
        return present(foreign.instance_attribute(run, obj, obj.cls.path, name) if held is None else held)
    if held is None:
        held = BOTTOM
    elif not obj.summary and ABSENT[0] not in held:
        return held
    held = present(held)
    if name == "__class__":
        return held or (obj.cls,)
    order = linearized(obj.cls)
    hook = next(
        (c.cells["__getattr__"] for c in program_classes(obj.cls) if "__getattr__" in c.cells), BOTTOM
    )
    ask = partial(run.call, hook, Arguments([(obj,), (name,)]), node, frame)
    if hook:  # asked after a property that raises
        look = partial(_class_attribute, run, obj, order, name, node, frame)
        in_class = run.swallowed(lambda: look() or BOTTOM, ask) or None
    else:
        in_class = _class_attribute(run, obj, order, name, node, frame)
    if in_class is not None:
        if held and any(map(_is_of_a_node, in_class)) and name not in foreign.NODE_METHODS:
            return held  # rclpy's node has no attribute of this name: read too early, it is an error
        return join(held, in_class)
    if hook:
        return join(held, ask())
    return held or unknown(f"attribute {name}, which nothing analysed sets")


def _is_of_a_node(atom: object) -> bool:
    return isinstance(atom, ForeignMethod) and foreign.is_node_class(atom.path)


def _class_attribute(
    run: Run, obj: Instance, order: tuple[object, ...], name: str, node: ast.AST, frame: Frame
) -> Value | None:
    """Return what the classes in ``order`` hold under ``name``, bound to ``obj``; ``None``: nothing."""
    for index, base in enumerate(order):
        if isinstance(base, ClassValue):
            value = base.cells.get(name)
            if value:
                bound = _bound(run, obj, present(value), node, frame)
                if ABSENT[0] in value:
                    bound = join(
                        bound, _class_attribute(run, obj, order[index + 1 :], name, node, frame) or ANY
                    )
                return bound
        elif isinstance(base, External):
            found = foreign.inherited(obj, base.path, name)
            if found is None:
                continue
            behind = (each.cells.get(name) for each in order[index + 1 :] if isinstance(each, ClassValue))
            mixed_in = next(filter(None, behind), BOTTOM)
            if not mixed_in or name in foreign.NODE_METHODS:
                return found
            bound = _bound(run, obj, mixed_in, node, frame)  # which names a library's class has is not known
            return bound if foreign.is_node_class(base.path) else join(bound, found)
        else:
            return (ForeignMethod("", obj, name),)
    return None


def _bound(run: Run, obj: Instance, value: Value, node: ast.AST, frame: Frame) -> Value:
    if len(value) == 1 and type(value[0]) is FunctionValue:
        return (BoundMethod(value[0], obj),)
    result: Value = BOTTOM
    for atom in value:
        if isinstance(atom, FunctionValue):
            result = join(result, (BoundMethod(atom, obj),))
        elif isinstance(atom, PropertyValue):
            result = join(result, run.call(atom.getter, Arguments([(obj,)]), node, frame))
        elif isinstance(atom, ClassMethod):
            result = join(result, _bound_class_method(atom, obj.cls))
        else:
            result = join(result, (atom,))
    return result


def _bound_class_method(method: ClassMethod, cls: object) -> Value:
    if method.static:
        return method.function
    return tuple(
        BoundMethod(atom, cls) if isinstance(atom, FunctionValue) else atom for atom in method.function
    )


def _of_class(run: Run, cls: ClassValue, name: str, node: ast.AST, frame: Frame) -> Value:
    if name in ("__name__", "__qualname__"):
        return (cls.name,) if name == "__name__" and name not in cls.cells else ANY
    if name == "__dict__":
        return run.variables_of(node, frame)
    if name == "__module__":
        return cls.module.cells.get("__name__", ANY)
    if name in ("__subclasses__", "__bases__", "__base__", "__mro__", "mro"):
        run.gap(node, frame, f"classes are found through {name}, which is not followed")
        return unknown(f"{name} of class {cls.name}")
    result: Value = BOTTOM
    for base in linearized(cls):
        if isinstance(base, ClassValue):
            value = base.cells.get(name)
            if value is None:
                continue
            if is_enumeration(cls) and not isinstance(
                present(value)[0], (FunctionValue, ClassMethod, PropertyValue)
            ):
                return (enumeration_member(run, base, name),)
            for atom in present(value):
                found: Value = (atom,)
                if isinstance(atom, ClassMethod):
                    found = _bound_class_method(atom, cls)
                result = join(result, found)
            if ABSENT[0] not in value:
                return result or ANY
        if isinstance(base, External) and base.path not in ("builtins.object", "abc.ABC", "typing.Generic"):
            return join(result, external(f"{base.path}.{name}"))
    return result or unknown(f"attribute {name} of class {cls.name}")


def _of_module(run: Run, module: ModuleValue, name: str, node: ast.AST, frame: Frame) -> Value:
    if name == "__dict__":
        return run.variables_of(node, frame)
    return imports.member(run, (module,), module.source.name, name, frame)


def _of_external(run: Run, atom: External, name: str, node: ast.AST, frame: Frame) -> Value:
    if name == "__name__":
        # ``numpy.float_`` is called float64; interface types are called what they are imported as
        of_type = re.fullmatch(r"\w+\.(?:msg|srv|action)\.(\w+)", atom.path)
        return (of_type[1],) if of_type else unknown(f"the name of {atom.path}")
    if name == "__dict__" and foreign.is_node_class(atom.path):
        return run.variables_of(node, frame)
    if atom.path.endswith(RESULT) and not foreign.is_asked_of(name):
        return (atom,)
    known = run.foreign_attributes.get((atom.path, name))
    if known is not None:
        return known
    if atom.path.count(".") > MAX_DOTS:
        return unknown(f"an attribute of {atom.path}")  # ``x = x.next`` in a loop would go on without end
    path = f"{atom.path}.{name}"
    if path == "sys.modules":
        return MODULES
    module = run.modules.get(path)  # imported from a folder without __init__.py
    if module is not None:
        return (module,)
    found = run.foreign_attributes[atom.path, name] = foreign.constant(path) or external(path)
    return found


def _of_super(run: Run, proxy: SuperProxy, name: str, node: ast.AST, frame: Frame) -> Value:
    receiver = proxy.receiver
    cls = receiver.cls if isinstance(receiver, Instance) else receiver
    if not isinstance(cls, ClassValue):
        return ANY
    order = linearized(cls)
    position = order.index(proxy.owner) + 1 if proxy.owner in order else 1
    rest = order[position:]
    if isinstance(receiver, Instance):
        for index, base in enumerate(rest):
            if isinstance(base, External) and name == "__init__" and base.path != "builtins.object":
                return (ForeignMethod(base.path, receiver, name),)
            if isinstance(base, ClassValue) and base.fields is not None and name == "__init__":
                break
            found = _class_attribute(run, receiver, rest[index:], name, node, frame)
            if found is not None:
                return found
        return (ForeignMethod("builtins.object", receiver, name),)
    if name in ("__new__", "__init_subclass__"):
        return external(f"builtins.object.{name}")
    return unknown(f"{name} of a base class that is not analysed")


def _of_native(run: Run, atom: object, name: str, node: ast.AST, frame: Frame) -> Value:
    return (NativeMethod(atom, name),)


def _of_function(run: Run, atom: FunctionValue, name: str, node: ast.AST, frame: Frame) -> Value:
    if name == "__name__":
        return (atom.name,) if atom.name else unknown("the name of a function that is wrapped or renamed")
    run.escape_value((atom,))  # ``__call__``, ``__get__`` and their like lead to it
    return unknown(f"attribute {name} of a function")


def _of_unknown(run: Run, atom: Unknown, name: str, node: ast.AST, frame: Frame) -> Value:
    return (NativeMethod(atom, name),) if name in foreign.NODE_METHODS else (atom,)


def _of_partial(run: Run, atom: Partial, name: str, node: ast.AST, frame: Frame) -> Value:
    if name == "func":
        return atom.function
    if name == "args":
        return run.tuple_of(atom.positional)
    run.escape_value((atom,))
    if name == "keywords":
        run.gap(
            node, frame, "keywords of a functools.partial are read, perhaps changed, which is not followed"
        )
    return unknown(f"attribute {name} of a functools.partial")


ATTRIBUTES: dict[type, AttributeReader] = {
    Partial: _of_partial,
    Instance: _of_instance,
    ClassValue: _of_class,
    ModuleValue: _of_module,
    External: _of_external,
    SuperProxy: _of_super,
    FunctionValue: _of_function,
    Unknown: _of_unknown,
    str: _of_native,
    Text: _of_native,
    bytes: _of_native,
    Sequence: _of_native,
    Dictionary: _of_native,
}
