"""Classes: their bodies, objects, dataclasses, enumerations, and ``super()``."""

from __future__ import annotations

import ast

from enclave_addons.inference.kernel.machine import Jumps
from enclave_addons.inference.kernel.values import (
    ANY,
    BOTTOM,
    External,
    Obj,
    Unknown,
    Value,
    join,
    present,
    sole,
    unknown,
)
from enclave_addons.inference.models.rclpy import LIFECYCLE_HOOKS
from enclave_addons.inference.python.functions import overrides
from enclave_addons.inference.python.objects import (
    Arguments,
    Bound,
    Call,
    Class,
    ForeignMethod,
    Frame,
    Function,
    Super,
)
from enclave_addons.inference.python.rclpy_models import is_lifecycle, is_node_class
from enclave_addons.inference.python.run import CALLS, Run

_HOOKS = {"threading.Thread": {"run"}, "multiprocessing.Process": {"run"}}
_NO_HOOKS = (
    "builtins.",
    "enum.",
    "typing.",
    "abc.",
    "rclpy.",
    "collections.",
    "json.",
    "argparse.",
    "logging.",
)


_RECORDS = ("dataclass", "define", "frozen", "attrs", "pydantic")


def define_class(run: Run, node: ast.ClassDef, frame: Frame) -> Class:
    """Run the body of a class."""
    bases: list[object] = []
    for written in node.bases:
        bases.extend(run.evaluate(written.value if isinstance(written, ast.Starred) else written, frame))
    cls: Class = run.remembered(node, "class", lambda: Class(node, frame.module))
    cls.bases = [each if isinstance(each, (Class, External)) else External("") for each in bases]
    cls.order = _order(cls)
    named = [ast.dump(each) for each in node.decorator_list]
    cls.is_dataclass = any(word in each for each in named for word in _RECORDS[:4]) or any(
        path.startswith(_RECORDS[4]) or path.endswith(".NamedTuple") for path in cls.foreign()
    )
    run.classes[cls] = None
    inner = Frame(
        frame.module,
        cls.cells,
        frame if frame.cells is not frame.module.cells else None,
        Jumps(run.store.mark()),
    )
    inner.cls = cls
    run.execute(node.body, inner)
    run.ended = False
    if is_enumeration(cls):
        _make_members(run, cls)
    for base in cls.classes()[1:]:
        hooks = [each for each in base.cells.get("__init_subclass__", ()) if isinstance(each, Function)]
        for hook in hooks:
            run.call((Bound(hook, cls),), Arguments(), node, frame)
    return cls


def _order(cls: Class) -> list[object]:
    """Return the method resolution order: depth first, each class behind all that derive from it."""
    listed: list[object] = [cls]
    for base in cls.bases:
        listed += base.order if isinstance(base, Class) else [base]
    keys = [each.path if isinstance(each, External) else each for each in listed]
    return [each for index, each in enumerate(listed) if keys[index] not in keys[index + 1 :]]


def is_enumeration(cls: Class) -> bool:
    """Return whether the objects of ``cls`` are its members."""
    return any(path.startswith("enum.") for path in cls.foreign())


def _make_members(run: Run, cls: Class) -> None:
    number = 0
    for name, value in list(cls.cells.items()):
        atom = sole(value)
        if (
            not isinstance(name, str)
            or name.startswith("_")
            or isinstance(atom, (Function, Class))
            or callable(atom)
        ):
            continue
        if type(atom).__name__ in ("Property", "Wrapped"):
            continue
        number += 1
        if isinstance(atom, External) and atom.path.startswith("enum.auto"):
            text = any("Str" in path for path in cls.foreign())
            value = (name.lower() if text else number,)
        member = run.allocate((cls.node, name), "instance", cls)
        member.summary = False
        member.cells.update({"name": (name,), "value": value, "_value_": value})
        run.store.write(cls.cells, name, (member,))


def super_of(run: Run, node: ast.Call, frame: Frame) -> Value:
    """Return ``super()``: by the function that runs, or by its arguments."""
    scope: Frame | None = frame
    while scope is not None and (scope.function is None or scope.function.owner is None):
        scope = scope.closure
    run.visited.add(node)
    if node.args:
        owner = run.evaluate(node.args[0], frame)
        receivers = run.evaluate(node.args[1], frame) if len(node.args) > 1 else BOTTOM
        return tuple(Super(cls, each) for cls in owner if isinstance(cls, Class) for each in receivers) or ANY
    if scope is None or scope.function is None or scope.function.owner is None:
        return unknown("super() outside of a class")
    arguments = scope.function.node.args
    first = next((each.arg for each in (*arguments.posonlyargs, *arguments.args)), "")
    return tuple(Super(scope.function.owner, each) for each in present(scope.cells.get(first, BOTTOM))) or ANY


def instantiate(run: Run, cls: Class, call: Call) -> Value:
    """Make an object of ``cls`` and run its constructor."""
    run.entered.update(each.node for each in cls.classes())
    if is_enumeration(cls):
        return _member_by_value(run, cls, call)
    if overrides(run, cls, "__new__"):
        made = run.call(
            run.class_attribute(cls, "__new__"), call.args.preceded((cls,)), call.node, call.frame
        )
        for atom in made:
            if isinstance(atom, Obj) and atom.cls is cls:
                _initialise(run, cls, atom, call)
        return made
    obj = new_instance(run, cls, call)
    _initialise(run, cls, obj, call)
    return (obj,)


def new_instance(run: Run, cls: Class, call: Call) -> Obj:
    """Return an object whose constructor has not run."""
    run.entered.update(each.node for each in cls.classes())
    obj = run.allocate(call.node, "instance", cls, f"object of {id(cls)}")
    foreign = [path for path in cls.foreign() if path]
    unknown_base = "" in cls.foreign()
    expect_hooks(run, obj, cls, foreign, unknown_base, call)
    return obj


def hooks_of(foreign: list[str], unknown_base: bool, name: str) -> bool:
    """Return whether the library of a base class may call the method ``name`` of its own accord."""
    if name == "__init__" or (not foreign and not unknown_base):
        return False
    if name in LIFECYCLE_HOOKS and any(is_lifecycle(path) for path in foreign):
        return True
    if any(name in _HOOKS.get(path, ()) for path in foreign):
        return True
    others = [path for path in foreign if path not in _HOOKS and not path.startswith(_NO_HOOKS)]
    return (
        bool(others or unknown_base)
        and not name.startswith("__")
        and not any(is_node_class(path) for path in others)
    )


def expect_hooks(run: Run, obj: Obj, cls: Class, foreign: list[str], unknown_base: bool, call: Call) -> None:
    """Expect that the library of a base class calls the methods that the class overrides."""
    for base in cls.classes():
        for name, value in list(base.cells.items()):
            if isinstance(name, str) and (hooks_of(foreign, unknown_base, name)):
                for atom in value:
                    if isinstance(atom, Function):
                        run.call_later((Bound(atom, obj),), Arguments(more=ANY), call)


def _initialise(run: Run, cls: Class, obj: Obj, call: Call) -> None:
    if cls.is_dataclass and not overrides(run, cls, "__init__"):
        _fill_fields(run, cls, obj, call)
        return
    constructor = run.class_attribute(cls, "__init__")
    bound: Value = BOTTOM
    for atom in constructor:
        if isinstance(atom, Function):
            bound = join(bound, (Bound(atom, obj),))
        elif isinstance(atom, ForeignMethod):
            bound = join(bound, (atom._replace(receiver=obj),))
    if bound:
        run.call(bound, call.args, call.node, call.frame)


def _fill_fields(run: Run, cls: Class, obj: Obj, call: Call) -> None:
    position = 0
    for base in reversed(cls.classes()):
        frame = Frame(base.module, base.cells, None, Jumps(run.store.mark()))
        for statement in base.node.body:
            if not isinstance(statement, ast.AnnAssign) or not isinstance(statement.target, ast.Name):
                continue
            if "ClassVar" in ast.dump(statement.annotation):
                continue
            name = statement.target.id
            given = call.at(position, name)
            position += 1
            if given is None:
                given = _field_default(run, statement, frame, call)
            run.store.store(obj, name, given)
    if overrides(run, cls, "__post_init__"):
        run.call(
            run.attribute((obj,), "__post_init__", call.node, call.frame), Arguments(), call.node, call.frame
        )


def _field_default(run: Run, statement: ast.AnnAssign, frame: Frame, call: Call) -> Value:
    default = statement.value
    if default is None:
        return unknown("a field that is not given")
    if isinstance(default, ast.Call) and ast.unparse(default.func).endswith(
        ("field", "Field", "Factory", "ib")
    ):
        for keyword in default.keywords:
            if keyword.arg in ("default_factory", "factory"):
                return run.call(run.evaluate(keyword.value, frame), Arguments(), call.node, call.frame)
            if keyword.arg == "default":
                return run.evaluate(keyword.value, frame)
        return run.evaluate(default.args[0], frame) if default.args else unknown("a field that is not given")
    return run.evaluate(default, frame)


def _member_by_value(run: Run, cls: Class, call: Call) -> Value:
    wanted = sole(call.at(0))
    members = [
        member for member in map(sole, cls.cells.values()) if isinstance(member, Obj) and member.cls is cls
    ]
    for member in members:
        if sole(member.cells.get("value")) == wanted and not isinstance(wanted, Unknown):
            return (member,)
    return tuple(members) or ANY


CALLS[Class] = instantiate
