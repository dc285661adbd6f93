"""Expressions: names, literals, calls, operators, subscripts, functions made in passing."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable
from functools import partial

from enclave_addons.inference.interpreter.conditions import (
    compare,
    decide,
    is_of_launch,
    narrowed,
    sides_of,
    truth,
    truth_of,
)
from enclave_addons.inference.interpreter.define import make_function
from enclave_addons.inference.interpreter.elements import (
    assign,
    copy_dictionary,
    elements,
    store_item,
    subscript,
)
from enclave_addons.inference.interpreter.formatting import as_texts, f_string, percent
from enclave_addons.inference.interpreter.loops import comprehension, dict_comprehension
from enclave_addons.inference.interpreter.run import Arguments, Evaluator, Run
from enclave_addons.inference.text import (
    Text,
    TextAtom,
    concatenate,
    concatenations,
)
from enclave_addons.inference.values import (
    ABSENT,
    ANY,
    BOTTOM,
    BUILTINS,
    OF_LAUNCH,
    OTHER,
    ClassValue,
    Dictionary,
    External,
    Frame,
    Instance,
    Items,
    Sequence,
    SuperProxy,
    Unknown,
    Value,
    boolean,
    external,
    join,
    join_all,
    present,
    unknown,
)

_ARITHMETIC: dict[type, Callable[[object, object], object]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Mod: operator.mod,
    ast.FloorDiv: operator.floordiv,
}
_DIVIDING = (ast.Mod, ast.FloorDiv)
_COMBINING = (ast.BitOr, ast.BitAnd, ast.BitXor, ast.Sub)
_NUMBERS = (int, float)
_LARGE = 1 << 40


def binary(run: Run, node: ast.BinOp, frame: Frame) -> Value:
    """Evaluate both sides, the left one first, and apply the operator."""
    left = run.evaluate(node.left, frame)
    right = run.evaluate(node.right, frame)
    return binary_operation(run, node, left, node.op, right, frame)


def binary_operation(
    run: Run, node: ast.AST, left: Value, op: ast.operator, right: Value, frame: Frame
) -> Value:
    """Evaluate ``left op right``; ``ANY`` if nothing is known."""
    if _has_own(left) or _has_own(right):
        return ANY  # by a special method, which is called from outside
    if isinstance(op, ast.Add):
        return _add(run, node, left, right)
    if isinstance(op, ast.Mod) and any(isinstance(atom, (str, Text)) for atom in left):
        return percent(left, right)
    if type(op) in _COMBINING and any(isinstance(atom, (Sequence, Dictionary)) for atom in (*left, *right)):
        run.escape_value((*left, *right))  # dictionaries or sets: what is in them may be called
        return ANY
    if type(op) in _ARITHMETIC and len(left) * len(right) <= 16:
        return _arithmetic(run, node, left, op, right)
    return ANY


def _has_own(value: Value) -> bool:
    """Return True if ``value`` may be an object of one of the program's classes."""
    for atom in value:  # noqa: SIM110 - evaluated at every operator; a generator takes three times as long
        if type(atom) is Instance and type(atom.cls) is ClassValue:
            return True
    return False


def _arithmetic(run: Run, node: ast.AST, left: Value, op: ast.operator, right: Value) -> Value:
    result: Value = BOTTOM
    for a in left:
        for b in right:
            result = join(result, _arithmetic_atoms(run, node, a, op, b))
    return result or ANY


def _arithmetic_atoms(run: Run, node: ast.AST, a: object, op: ast.operator, b: object) -> Value:
    if isinstance(op, ast.Mult) and isinstance(a, Sequence):
        return run.sequence(node, a.kind, Items(None, a.items.any_element()))
    if isinstance(op, _DIVIDING) and not b:
        return ANY
    if isinstance(a, _NUMBERS) and isinstance(b, _NUMBERS) and max(abs(a), abs(b)) < _LARGE:
        result = _ARITHMETIC[type(op)](a, b)
        return (result,) if isinstance(result, _NUMBERS) else ANY
    return (b,) if isinstance(b, Unknown) else (a,) if isinstance(a, Unknown) else ANY


def _add(run: Run, node: ast.AST, left: Value, right: Value) -> Value:
    if len(left) == 1 and len(right) == 1 and type(left[0]) is str and type(right[0]) is str:
        return (concatenate(left[0], right[0]),)
    texts_left = [atom for atom in left if isinstance(atom, (str, Text))]
    texts_right = [atom for atom in right if isinstance(atom, (str, Text))]
    sequences = [atom for atom in (*left, *right) if isinstance(atom, Sequence)]
    if sequences:
        return _added_sequences(run, node, left, right, sequences)
    if not texts_left and not texts_right:
        return _arithmetic(run, node, left, ast.Add(), right) if len(left) * len(right) <= 16 else ANY
    if any(type(atom) in _NUMBERS for atom in (*left, *right)):
        return _arithmetic(run, node, left, ast.Add(), right)
    # One side is a text, so the sum is only defined where the other one is too.
    return tuple(concatenations([_text_side(left), _text_side(right)]))


def _text_side(value: Value) -> list[TextAtom]:
    found: list[TextAtom] = []
    for atom in value:
        if isinstance(atom, (str, Text)):
            found.append(atom)
        elif isinstance(atom, (Unknown, External)):
            found += as_texts((atom,))
    return found or as_texts(value)


def _added_sequences(run: Run, node: ast.AST, left: Value, right: Value, sequences: list[Sequence]) -> Value:
    if len(left) == len(right) == 1 and len(sequences) == 2:
        first, second = (sequence.items.exact for sequence in sequences)
        if first is not None and second is not None:
            return run.sequence(node, sequences[0].kind, Items((*first, *second)))
    element = join_all(sequence.items.any_element() for sequence in sequences)
    if any(not isinstance(atom, Sequence) for atom in (*left, *right)):
        element = join(element, ANY)
    return run.sequence(node, sequences[0].kind, Items(None, element))


def _constant(run: Run, node: ast.Constant, frame: Frame) -> Value:
    return ANY if node.value is ... else (node.value,)


def _name(run: Run, node: ast.Name, frame: Frame) -> Value:
    name = node.id
    value = frame.cells.get(name)
    if value:
        certain = not frame.is_class or ABSENT[0] not in value
        return value if certain else join(present(value), _outer_name(frame, name))
    return _outer_name(frame, name)


def _outer_name(frame: Frame, name: str) -> Value:
    outer = frame.closure
    while outer is not None:
        value = outer.cells.get(name)
        if value:
            return value
        outer = outer.closure
    module = frame.module
    value = module.cells.get(name)
    if value:
        return value
    if name in BUILTINS:
        return external("builtins." + name)
    if module.stars:
        return join_all(external(f"{star}.{name}") for star in module.stars)
    return unknown(f"the name {name}, which nothing analysed defines")


def _attribute(run: Run, node: ast.Attribute, frame: Frame) -> Value:
    return run.attribute(run.evaluate(node.value, frame), node.attr, node, frame)


_RUNS_COROUTINES = frozenset({"run", "run_until_complete"})  # of asyncio and its event loops


def _call(run: Run, node: ast.Call, frame: Frame) -> Value:
    function = node.func
    if type(function) is ast.Name and function.id == "super" and "super" not in frame.module.cells:
        return _super(run, node, frame)
    run.evaluated.add((node, frame.entry))
    callee = run.evaluate(function, frame)
    if type(function) is ast.Attribute and function.attr in _RUNS_COROUTINES:
        run.awaited.update(node.args)
    if Unknown in map(type, callee):
        run.doubtful.add(node)
    args = arguments_of(run, node, frame)
    run.at = node, frame
    made = run.findings.made
    result = run.call(callee, args, node, frame)
    if OF_LAUNCH[0] in callee and run.findings.made > made:
        run.gap(node, frame, "which function is called here only a launch decides")
    if node in run.answers:
        run.answers[node] = result
    return result


def arguments_of(run: Run, node: ast.Call, frame: Frame) -> Arguments:
    """Return the evaluated arguments of a call; ``*`` and ``**`` are expanded as far as their contents are known."""
    args = Arguments([], {})
    for argument in node.args:
        if isinstance(argument, ast.Starred):
            items = elements(run, run.evaluate(argument.value, frame), argument, frame)
            if items.exact is not None and not args.more:
                args.positional.extend(items.exact)
            else:
                args.more = join(args.more, items.any_element())
        elif args.more:
            args.more = join(args.more, run.evaluate(argument, frame))
        else:
            args.positional.append(run.evaluate(argument, frame))
    for keyword in node.keywords:
        value = run.evaluate(keyword.value, frame)
        if keyword.arg is not None:
            args.keywords[keyword.arg] = value
        else:
            _add_keywords(run, args, value)
    return args


def _add_keywords(run: Run, args: Arguments, value: Value) -> None:
    for atom in value:
        if isinstance(atom, Dictionary):
            for cell, held, _ in atom.entries():
                if isinstance(cell.constant, str):
                    args.keywords[cell.constant] = join(held, ANY) if atom.escaped else held
            if atom.is_open:
                args.more_keywords = join(args.more_keywords, present(atom.cells.get(OTHER, ANY)))
        else:
            run.escape_value((atom,))  # ``keys`` of an object is called
            args.more_keywords = join(args.more_keywords, (atom,) if isinstance(atom, Unknown) else ANY)


def _super(run: Run, node: ast.Call, frame: Frame) -> Value:
    if len(node.args) == 2:
        owner = run.evaluate(node.args[0], frame)
        receiver = run.evaluate(node.args[1], frame)
        classes = [atom for atom in owner if isinstance(atom, ClassValue)]
    else:
        classes, receiver = _implicit_super(frame)
    objects = [atom for atom in receiver if isinstance(atom, (Instance, ClassValue))]
    result = join_all((SuperProxy(cls, atom),) for cls in classes for atom in objects)
    return result or unknown("super() outside of an analysed object")


def _implicit_super(frame: Frame) -> tuple[list[ClassValue], Value]:
    outer: Frame | None = frame
    while outer is not None:
        function = outer.function
        if function is not None and function.owner is not None:
            node = function.node
            parameters = [*node.args.posonlyargs, *node.args.args]
            if parameters and parameters[0].arg in outer.cells:
                return [function.owner], outer.cells[parameters[0].arg]
        outer = outer.closure
    return [], BOTTOM


def _literal_sequence(kind: str) -> Evaluator:
    def build(run: Run, node: ast.List | ast.Tuple | ast.Set, frame: Frame) -> Value:
        exact: list[Value] = []
        rest: Value | None = None
        for element in node.elts:
            if isinstance(element, ast.Starred):
                items = elements(run, run.evaluate(element.value, frame), element, frame)
                if items.exact is not None:
                    exact.extend(items.exact)
                else:
                    rest = join(rest or BOTTOM, items.any_element())
            else:
                exact.append(run.evaluate(element, frame))
        found = Items(tuple(exact))
        if rest is not None or len(exact) > 512:
            found = Items(None, join(found.any_element(), rest or BOTTOM))
        return run.sequence(node, kind, found)

    return build


def _dict(run: Run, node: ast.Dict, frame: Frame) -> Value:
    obj = run.allocate(node, "dict", Dictionary)
    for key, value in zip(node.keys, node.values, strict=True):
        held = run.evaluate(value, frame)
        if key is not None:
            store_item(run, obj, run.evaluate(key, frame), held)
        else:
            copy_dictionary(run, obj, held)
    return (obj,)


def _conditional(run: Run, node: ast.IfExp, frame: Frame) -> Value:
    outcome = decide(run, node.test, frame)
    if outcome is not None:
        return run.evaluate(node.body if outcome else node.orelse, frame)

    def side(holds: bool) -> Value:
        return run.evaluate(node.body if holds else node.orelse, frame)

    joined, sides = sides_of(run, node.test, frame, side)
    body, orelse = run.state.each(sides)
    return (joined or join)(body, orelse)


def _boolean(run: Run, node: ast.BoolOp, frame: Frame) -> Value:
    """Evaluate ``a or b``: the left side unless it may be false (``and``: true); then the right one as well."""
    stops_at = isinstance(node.op, ast.Or)
    result: Value = BOTTOM
    for index, operand in enumerate(node.values):
        before = (
            node.values[:index] if type(operand) is not ast.Constant else []
        )  # which narrow what they test
        evaluate = partial(_after, run, operand, before, not stops_at, frame)
        value = run.state.perhaps(evaluate) if before else evaluate()
        if index == len(node.values) - 1 or truth(value) is stops_at:
            return join(result, value)
        if any(map(is_of_launch, value)):
            run.asks_launch = True
            result = join(result, OF_LAUNCH)
        result = join(result, tuple(atom for atom in value if truth_of(atom) in (stops_at, None)))
    return result


def _after(run: Run, operand: ast.expr, before: list[ast.expr], held: bool, frame: Frame) -> Value:
    """Return what ``operand`` gives where those ``before`` it were all true, or (unless ``held``) all false."""
    for test in before:
        narrowed(run, test, held, frame)
    return run.evaluate(operand, frame)


def _unary(run: Run, node: ast.UnaryOp, frame: Frame) -> Value:
    value = run.evaluate(node.operand, frame)
    if isinstance(node.op, ast.Not):
        outcome = truth(value)
        return boolean(None if outcome is None else not outcome)
    if isinstance(node.op, ast.USub) and len(value) == 1 and isinstance(value[0], (int, float)):
        return (-value[0],)
    return ANY


def _lambda(run: Run, node: ast.Lambda, frame: Frame) -> Value:
    return (make_function(run, node, "<lambda>", frame),)


def _walrus(run: Run, node: ast.NamedExpr, frame: Frame) -> Value:
    value = run.evaluate(node.value, frame)
    owner = frame
    while owner.is_comprehension and owner.closure is not None:
        owner = owner.closure
    assign(run, node.target, value, owner)
    return value


def _inner(run: Run, node: ast.Await | ast.Starred, frame: Frame) -> Value:
    run.awaited.add(node.value)
    return run.evaluate(node.value, frame)


def _yield(run: Run, node: ast.Yield | ast.YieldFrom, frame: Frame) -> Value:
    """Hand a value to whoever iterates, which is not followed."""
    if node.value is not None:
        run.escape_value(run.evaluate(node.value, frame))
    return ANY


EXPRESSIONS: dict[type, Evaluator] = {
    ast.Constant: _constant,
    ast.Name: _name,
    ast.Attribute: _attribute,
    ast.Call: _call,
    ast.BinOp: binary,
    ast.BoolOp: _boolean,
    ast.UnaryOp: _unary,
    ast.Compare: compare,
    ast.IfExp: _conditional,
    ast.JoinedStr: f_string,
    ast.List: _literal_sequence("list"),
    ast.Tuple: _literal_sequence("tuple"),
    ast.Set: _literal_sequence("set"),
    ast.Dict: _dict,
    ast.Subscript: subscript,
    ast.Lambda: _lambda,
    ast.ListComp: comprehension,
    ast.SetComp: comprehension,
    ast.GeneratorExp: comprehension,
    ast.DictComp: dict_comprehension,
    ast.NamedExpr: _walrus,
    ast.Await: _inner,
    ast.Yield: _yield,
    ast.YieldFrom: _yield,
    ast.Starred: _inner,
}
