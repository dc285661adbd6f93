"""Special methods of the program's own classes: operators, truth, text, containers, attributes (data model, 3.3)."""

from __future__ import annotations

import ast

from nodl.infer.interpreter.define import linearized
from nodl.infer.interpreter.frames import Arguments, Frame
from nodl.infer.interpreter.run import Run
from nodl.infer.methods import BoundMethod
from nodl.infer.values import (
    ANY,
    BOOLEAN,
    BOTTOM,
    ClassValue,
    External,
    FunctionValue,
    Instance,
    Sequence,
    Value,
    boolean,
    join,
    join_all,
)

OPERATORS: dict[type, str] = {
    ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul", ast.Div: "truediv", ast.FloorDiv: "floordiv", ast.Mod: "mod",
    ast.Pow: "pow", ast.LShift: "lshift", ast.RShift: "rshift", ast.BitOr: "or", ast.BitXor: "xor",
    ast.BitAnd: "and", ast.MatMult: "matmul",
}  # fmt: skip
COMPARISONS: dict[type, str] = {
    ast.Eq: "__eq__", ast.NotEq: "__ne__", ast.Lt: "__lt__", ast.LtE: "__le__", ast.Gt: "__gt__", ast.GtE: "__ge__",
}  # fmt: skip
_MIRRORED = {"__lt__": "__gt__", "__gt__": "__lt__", "__le__": "__ge__", "__ge__": "__le__"}


def method(obj: object, name: str) -> Value:
    """``type(obj).name`` bound to ``obj``, where an analysed class defines it; else nothing."""
    if not isinstance(obj, Instance) or not isinstance(obj.cls, ClassValue):
        return BOTTOM
    for base in linearized(obj.cls):
        value = base.cells.get(name) if isinstance(base, ClassValue) else None
        if value:
            return tuple(
                BoundMethod(atom, obj) if isinstance(atom, FunctionValue) else atom for atom in value
            )
    return BOTTOM


def has_own(value: Value) -> bool:
    """Whether ``value`` may be an object of one of the program's classes."""
    for atom in value:  # noqa: SIM110 - asked at every operator and test; a generator takes three times as long
        if type(atom) is Instance and type(atom.cls) is ClassValue:
            return True
    return False


def call_special(run: Run, obj: object, name: str, node: ast.AST, frame: Frame, *given: Value) -> Value:
    """The result of the special method, or nothing when the class has none."""
    found = method(obj, name)
    return run.call(found, Arguments(list(given)), node, frame) if found else BOTTOM


def _asked_each(run: Run, owners: Value, name: str, node: ast.AST, frame: Frame, given: Value) -> Value:
    return join_all(call_special(run, atom, name, node, frame, given) for atom in owners)


def binary(run: Run, left: Value, op: ast.operator, right: Value, node: ast.AST, frame: Frame) -> Value:
    """``left op right`` as far as a class of the program defines it; nothing: neither side does."""
    name = OPERATORS.get(type(op), "")
    result = _asked_each(run, left, f"__{name}__", node, frame, right)
    return result or _asked_each(run, right, f"__r{name}__", node, frame, left)


def in_place(run: Run, left: Value, op: ast.operator, right: Value, node: ast.AST, frame: Frame) -> Value:
    """``left op= right`` by ``__iadd__`` and the like; nothing where no class of ``left`` defines it."""
    return _asked_each(run, left, f"__i{OPERATORS.get(type(op), '')}__", node, frame, right)


def comparison(run: Run, op: ast.cmpop, left: Value, right: Value, node: ast.AST, frame: Frame) -> Value:
    """What the program's own method says; nothing: there is none."""
    if isinstance(op, ast.In | ast.NotIn):
        return _contained(run, op, left, right, node, frame)
    name = COMPARISONS.get(type(op))
    if name is None:
        return BOTTOM
    result = _asked_each(run, left, name, node, frame, right)
    result = result or _asked_each(run, right, _MIRRORED.get(name, name), node, frame, left)
    if not result and name == "__ne__":
        return _negated(run, comparison(run, ast.Eq(), left, right, node, frame), node, frame)
    return result


def _contained(run: Run, op: ast.cmpop, left: Value, right: Value, node: ast.AST, frame: Frame) -> Value:
    result = _asked_each(run, right, "__contains__", node, frame, left)
    if result:
        result = booleans(run, result, node, frame)
    return _negated(run, result, node, frame) if isinstance(op, ast.NotIn) else result


def _negated(run: Run, value: Value, node: ast.AST, frame: Frame) -> Value:
    return tuple(not atom for atom in booleans(run, value, node, frame)) if value else BOTTOM


def booleans(run: Run, value: Value, node: ast.AST, frame: Frame) -> Value:
    """``bool(value)``: ``(True,)``, ``(False,)`` or both."""
    from nodl.infer.interpreter.conditions import truth_of

    outcomes = (truth_of(atom) for atom in tested(run, value, node, frame))
    return join_all(map(boolean, outcomes)) or BOOLEAN


def tested(run: Run, value: Value, node: ast.AST, frame: Frame) -> Value:
    """``value`` with objects whose class defines truth replaced by what their method says."""
    if not has_own(value):
        return value
    return _replaced(run, value, ("__bool__", "__len__"), node, frame)


def spoken(run: Run, value: Value, node: ast.AST, frame: Frame, spec: Value | None = None) -> Value:
    """``value`` with objects whose class defines their text replaced by it (``format`` with ``spec``, else ``str``)."""
    if not has_own(value):
        return value
    return _replaced(run, value, ("__str__", "__repr__"), node, frame, spec)


def _replaced(
    run: Run, value: Value, names: tuple[str, ...], node: ast.AST, frame: Frame, spec: Value | None = None
) -> Value:
    """Each object as the first of its methods ``names`` says, before all ``__format__`` where there is a ``spec``."""
    result: Value = BOTTOM
    for atom in value:
        said = BOTTOM if spec is None else call_special(run, atom, "__format__", node, frame, spec)
        for name in names:
            said = said or call_special(run, atom, name, node, frame)
        result = join(result, said or (atom,))
    return result or ANY


def spoken_each(run: Run, args: Arguments, node: ast.AST, frame: Frame) -> Arguments:
    """The same for every argument of ``str.format``, with an empty format."""
    empty: Value = ("",)
    positional = [spoken(run, value, node, frame, empty) for value in args.positional]
    keywords = {name: spoken(run, value, node, frame, empty) for name, value in args.keywords.items()}
    return Arguments(positional, keywords, args.more, args.more_keywords)


def is_constant(atom: object) -> bool:
    """Whether ``atom`` is a constant that a dictionary can have as a key."""
    return isinstance(atom, str | int | float | bool | type(None))


def is_key(atom: object) -> bool:
    """Whether a dictionary finds ``atom`` by what it is: a constant, tuples of such, what equals itself only."""
    if isinstance(atom, External):
        return "(" not in atom.path  # else it stands for whatever a library gives
    if isinstance(atom, Sequence):
        exact = atom.items.exact if atom.kind == "tuple" else None
        return exact is not None and all(len(part) == 1 and type(part[0]) in (str, int) for part in exact)
    if isinstance(atom, Instance):
        return isinstance(atom.cls, ClassValue) and not atom.summary and _equals_itself_only(atom.cls)
    if isinstance(atom, FunctionValue):
        return not atom.shared
    return is_constant(atom) or (isinstance(atom, ClassValue) and not atom.summary)


_COMPARED_BY_IDENTITY = frozenset({"builtins.object", "enum.Enum", "enum.Flag", "abc.ABC", "rclpy.node.Node"})


def _equals_itself_only(cls: ClassValue) -> bool:
    return all(
        base.path in _COMPARED_BY_IDENTITY
        if isinstance(base, External)
        else isinstance(base, ClassValue) and base.fields is None and "__eq__" not in base.cells
        for base in linearized(cls)
    )
