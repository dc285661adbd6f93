"""Definitions: functions with their decorators, classes with their bodies, method resolution order."""

from __future__ import annotations

import ast

from nodl.infer.interpreter.run import Arguments, Frame, Run
from nodl.infer.values import (
    ClassMethod,
    ClassValue,
    External,
    FunctionValue,
    PropertyValue,
    Value,
    join,
    sole,
)

FunctionNode = ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda

# Decorators that leave the function what it is, as far as names are concerned.
_TRANSPARENT = frozenset(
    {
        "functools.lru_cache", "functools.cache", "functools.wraps", "abc.abstractmethod",
        "typing.override", "typing.overload", "typing_extensions.override", "typing.final",
        "pytest.fixture", "asyncio.coroutine",
    }
)  # fmt: skip
_PROPERTIES = frozenset({"builtins.property", "functools.cached_property", "abc.abstractproperty"})
_DATACLASSES = frozenset(
    {"dataclasses.dataclass", "attr.s", "attrs.define", "attr.dataclass", "attrs.frozen"}
)


def make_function(run: Run, node: FunctionNode, name: str, frame: Frame) -> FunctionValue:
    closure = frame.closure if frame.is_class else frame
    if not frame.is_class:
        frame.capture()
    owner = frame.cells.get("[class]") if frame.is_class else None
    owner_class = owner[0] if owner and isinstance(owner[0], ClassValue) else None
    key = (run.context, id(node), "function")
    known = run.functions.get(key)
    function = known or FunctionValue(node, name, frame.module, closure, owner_class)
    run.functions[key] = function
    arguments = node.args
    defaults = tuple(run.evaluate(default, frame) for default in arguments.defaults)
    kw_defaults = tuple(
        None if default is None else run.evaluate(default, frame) for default in arguments.kw_defaults
    )
    if known is not None and known.closure is closure:  # made again in a loop: one function for all
        defaults = tuple(join(a, b) for a, b in zip(known.defaults, defaults, strict=True))
        kw_defaults = tuple(
            None if a is None or b is None else join(a, b)
            for a, b in zip(known.kw_defaults, kw_defaults, strict=True)
        )
    function.closure = closure
    function.defaults = defaults
    function.kw_defaults = kw_defaults
    return function


def define_function(run: Run, node: ast.FunctionDef | ast.AsyncFunctionDef, frame: Frame) -> bool:
    function = make_function(run, node, node.name, frame)
    value: Value = (function,)
    for decorator in reversed(node.decorator_list):
        value = _decorated(run, value, function, decorator, frame)
    run.assign_name(node.name, value, frame)
    return True


def _decorated(run: Run, value: Value, function: FunctionValue, decorator: ast.expr, frame: Frame) -> Value:
    if isinstance(decorator, ast.Attribute) and decorator.attr in ("setter", "deleter", "getter"):
        return frame.cells.get(function.name, value)
    made_by_call = isinstance(decorator, ast.Call)
    callee = run.evaluate(decorator.func if isinstance(decorator, ast.Call) else decorator, frame)
    atom = sole(callee)
    path = atom.path if isinstance(atom, External) else ""
    if path in _PROPERTIES:
        return (PropertyValue(value),)
    if path in ("builtins.staticmethod", "builtins.classmethod"):
        return (ClassMethod(value, path == "builtins.staticmethod"),)
    if path in ("contextlib.contextmanager", "contextlib.asynccontextmanager"):
        function.context_manager = True
        return value
    if path in _TRANSPARENT:
        return value
    if isinstance(atom, External):
        run.register_callback(value, None)
        return value
    if made_by_call:
        callee = run.evaluate(decorator, frame)
    return run.call(callee, Arguments([value]), decorator, frame)


def define_class(run: Run, node: ast.ClassDef, frame: Frame) -> bool:
    bases = tuple(sole(run.evaluate(base, frame)) for base in node.bases if not isinstance(base, ast.Starred))
    for keyword in node.keywords:
        run.evaluate(keyword.value, frame)
    cls = run.allocate(node, "class", lambda: ClassValue(node, node.name, frame.module, bases))
    assert isinstance(cls, ClassValue)
    body = Frame(frame.module, cls.cells, frame.closure if frame.is_class else frame, frame.depth)
    if not frame.is_class:
        frame.capture()
    body.is_class = True
    body.cells["[class]"] = (cls,)
    body.function = frame.function
    run.execute(node.body, body)
    run.classes.setdefault(node, cls)
    for decorator in node.decorator_list:
        _decorate_class(run, cls, decorator, frame)
    if any(isinstance(base, External) and base.path == "typing.NamedTuple" for base in bases):
        cls.fields = _fields(run, cls, frame)
    run.assign_name(node.name, (cls,), frame)
    return True


def _decorate_class(run: Run, cls: ClassValue, decorator: ast.expr, frame: Frame) -> None:
    callee = decorator.func if isinstance(decorator, ast.Call) else decorator
    atom = sole(run.evaluate(callee, frame))
    if isinstance(atom, External) and atom.path in _DATACLASSES:
        cls.fields = _fields(run, cls, frame)


def _fields(run: Run, cls: ClassValue, frame: Frame) -> list[tuple[str, Value | None]]:
    """The fields of a dataclass in the order of its constructor, with their defaults."""
    fields: dict[str, Value | None] = {}
    for base in reversed(linearized(cls)[1:]):
        if isinstance(base, ClassValue) and base.fields:
            fields.update(base.fields)
    for statement in cls.node.body:
        if isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name):
            annotation = ast.dump(statement.annotation) if statement.annotation else ""
            if "ClassVar" in annotation:
                continue
            fields[statement.target.id] = _field_default(run, statement.value, frame, cls)
    return list(fields.items())


def _field_default(run: Run, default: ast.expr | None, frame: Frame, cls: ClassValue) -> Value | None:
    if default is None:
        return None
    if isinstance(default, ast.Call):
        atom = sole(run.evaluate(default.func, frame))
        if isinstance(atom, External) and atom.path in ("dataclasses.field", "attr.ib", "attrs.field"):
            for keyword in default.keywords:
                if keyword.arg == "default":
                    return run.evaluate(keyword.value, frame)
                if keyword.arg in ("default_factory", "factory"):
                    factory = run.evaluate(keyword.value, frame)
                    return run.call(factory, Arguments(), default, frame)
            return None
    return run.evaluate(default, frame)


def linearized(cls: ClassValue) -> tuple[object, ...]:
    """The method resolution order: C3 as in Python, ending in ``External`` or ``Unknown`` bases."""
    if cls.linear is None:
        cls.linear = (cls,)  # guards against a class among its own bases
        orders = [list(linearized(base)) if isinstance(base, ClassValue) else [base] for base in cls.bases]
        cls.linear = (cls, *_merge(orders, list(cls.bases)))
    return cls.linear


def _merge(orders: list[list[object]], bases: list[object]) -> list[object]:
    sequences = [list(order) for order in (*orders, bases) if order]
    result: list[object] = []
    while sequences:
        head = next(
            (
                order[0]
                for order in sequences
                if not any(order[0] in other[1:] for other in sequences if other is not order)
            ),
            sequences[0][0],
        )
        result.append(head)
        sequences = [[item for item in order if item is not head] for order in sequences]
        sequences = [order for order in sequences if order]
    return result


def foreign_bases(cls: ClassValue) -> list[object]:
    """The bases that are not analysed: ``External`` or ``Unknown``; ``object`` does not count."""
    return [
        base
        for base in linearized(cls)
        if not isinstance(base, ClassValue)
        and not (isinstance(base, External) and base.path in _HARMLESS_BASES)
    ]


_HARMLESS_BASES = frozenset({"builtins.object", "typing.Generic", "abc.ABC", "typing.Protocol"})
