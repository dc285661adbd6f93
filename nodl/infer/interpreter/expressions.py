"""Expressions: names, literals, calls, subscripts, functions made in passing."""

from __future__ import annotations

import ast
import builtins

from nodl.infer.interpreter import comprehensions, special
from nodl.infer.interpreter.assign import assign
from nodl.infer.interpreter.conditions import compare, decide, forked, narrowed, truth, truth_of
from nodl.infer.interpreter.define import make_function
from nodl.infer.interpreter.frames import Arguments, Call, Frame
from nodl.infer.interpreter.iterate import elements, values_of
from nodl.infer.interpreter.operators import binary, f_string
from nodl.infer.interpreter.raising import throw
from nodl.infer.interpreter.run import Evaluator, Run
from nodl.infer.methods import NativeMethod, SuperProxy, Variables
from nodl.infer.text import Input, Text, make_text
from nodl.infer.values import (
    ABSENT,
    ANY,
    BOOLEAN,
    BOTTOM,
    NONE,
    OTHER,
    OTHER_KEYS,
    RESULT,
    ClassValue,
    Dictionary,
    External,
    Instance,
    Items,
    Key,
    NativeObject,
    Sequence,
    Unknown,
    Value,
    external,
    join,
    present,
    unknown,
)

_BUILTINS = frozenset(dir(builtins))


def _constant(run: Run, node: ast.Constant, frame: Frame) -> Value:
    return ANY if node.value is ... else (node.value,)


def _name(run: Run, node: ast.Name, frame: Frame) -> Value:
    name = node.id
    value = frame.cells.get(name)
    if value:
        return value
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
    if name in _BUILTINS:
        return external("builtins." + name)
    if module.stars:
        found: Value = BOTTOM
        for star in module.stars:
            found = join(found, external(f"{star}.{name}"))
        return found
    return unknown(f"the name {name}, which nothing analysed defines")


def _attribute(run: Run, node: ast.Attribute, frame: Frame) -> Value:
    return run.attribute(run.evaluate(node.value, frame), node.attr, node, frame)


def _call(run: Run, node: ast.Call, frame: Frame) -> Value:
    function = node.func
    if type(function) is ast.Name and function.id == "super" and "super" not in frame.module.cells:
        return _super(run, node, frame)
    run.evaluated.add(node)
    callee = run.evaluate(function, frame)
    args = arguments_of(run, node, frame)
    run.at = node, frame
    return run.call(callee, args, node, frame)


def arguments_of(run: Run, node: ast.Call, frame: Frame) -> Arguments:
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
            _add_keywords(args, value)
    return args


def _add_keywords(args: Arguments, value: Value) -> None:
    for atom in value:
        if isinstance(atom, Dictionary):
            for cell, held, _ in atom.entries():
                if isinstance(cell.constant, str):
                    args.keywords[cell.constant] = held
            if atom.is_open:
                args.more_keywords = join(args.more_keywords, present(atom.cells.get(OTHER, ANY)))
        elif isinstance(atom, Unknown):
            args.more_keywords = join(args.more_keywords, (atom,))


def _super(run: Run, node: ast.Call, frame: Frame) -> Value:
    if len(node.args) == 2:
        owner = run.evaluate(node.args[0], frame)
        receiver = run.evaluate(node.args[1], frame)
        classes: list[object] = [atom for atom in owner if isinstance(atom, ClassValue)]
    else:
        classes, receiver = _implicit_super(frame)
    result: Value = BOTTOM
    for cls in classes:
        for atom in receiver:
            if isinstance(cls, ClassValue) and isinstance(atom, Instance | ClassValue):
                result = join(result, (SuperProxy(cls, atom),))
    return result or unknown("super() outside of an analysed object")


def _implicit_super(frame: Frame) -> tuple[list[object], Value]:
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
    assert isinstance(obj, Dictionary)
    for key, value in zip(node.keys, node.values, strict=True):
        held = run.evaluate(value, frame)
        if key is not None:
            comprehensions.store_item(run, obj, run.evaluate(key, frame), held)
        else:
            copy_dictionary(run, obj, held)
    return (obj,)


def copy_dictionary(run: Run, target: Dictionary, source: Value) -> None:
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


def _subscript(run: Run, node: ast.Subscript, frame: Frame) -> Value:
    owner = run.evaluate(node.value, frame)
    key = run.evaluate(node.slice, frame) if not isinstance(node.slice, ast.Slice) else ANY
    if isinstance(node.slice, ast.Slice) and not all(isinstance(a, str | Sequence) for a in owner):
        for bound in (node.slice.lower, node.slice.upper, node.slice.step):
            if bound is not None:
                run.evaluate(bound, frame)
    result: Value = BOTTOM
    for atom in owner:
        if atom is None:
            continue
        result = join(result, _element(run, atom, key, node, frame))
    return result or ANY


def _element(run: Run, atom: object, key: Value, node: ast.Subscript, frame: Frame) -> Value:
    if isinstance(atom, Dictionary):
        return dictionary_item(run, atom, key, node, frame)
    if isinstance(atom, Sequence):
        if isinstance(node.slice, ast.Slice):
            return _sliced(run, atom, node, frame)
        return _sequence_item(run, atom, key)
    if isinstance(atom, str):
        return _character(run, atom, key, node, frame)
    if isinstance(atom, Text):
        piece = atom.pieces[0]
        index = key[0] if len(key) == 1 else None
        if len(atom.pieces) == 1 and isinstance(piece, Input) and piece.item is None and type(index) is int:
            return (make_text((Input(piece.name, piece.owner, index, piece.edits),)),)
        return unknown("a part of a text that is not known")
    if isinstance(atom, NativeObject):
        call = Call(Arguments([key]), node, frame)
        return run.call_atom(NativeMethod(atom, "__getitem__"), call)
    if isinstance(atom, Variables):
        return variable(run, atom, key, node, frame)
    if isinstance(atom, Instance):
        getter = run.attribute((atom,), "__getitem__", node, frame)
        return run.call(getter, Arguments([key]), node, frame)
    if isinstance(atom, ClassValue):
        return _class_item(run, atom, key, node, frame)
    if isinstance(atom, External) and atom.path == "os.environ":
        return run.call(external("os.environ.get"), Arguments([key]), node, frame)
    if isinstance(atom, External):
        if atom.path.startswith(("typing.", "builtins.")) or atom.path.endswith(("[]", RESULT)):
            return (atom,)
        return external(f"{atom.path}[]")
    return (atom,) if isinstance(atom, Unknown) else ANY


def variable(run: Run, atom: Variables, key: Value, node: ast.AST, frame: Frame) -> Value:
    """``globals()[key]``, ``vars(x)[key]``."""
    result: Value = BOTTOM
    for name in key:
        if isinstance(name, str):
            result = join(result, present(atom.owner.cells.get(name, BOTTOM)))
            continue
        for value in atom.named().values():
            run.escape_value(value, opened=False)
        result = join(result, unknown("a variable whose name is made at run time"))
    return result or unknown("a variable that nothing analysed sets")


def _class_item(run: Run, cls: ClassValue, key: Value, node: ast.AST, frame: Frame) -> Value:
    names = [atom for atom in key if isinstance(atom, str)]
    if names and all(name in cls.cells for name in names):  # Enum["MEMBER"]
        result: Value = BOTTOM
        for name in names:
            result = join(result, run.attribute((cls,), name, node, frame))
        return result
    return (cls,)  # Generic[T]


def dictionary_item(run: Run, obj: Dictionary, key: Value, node: ast.AST, frame: Frame) -> Value:
    result: Value = BOTTOM
    everything = False
    everywhere = not obj.escaped
    for atom in key:
        if isinstance(atom, str | int | float | bool | type(None)):
            held, certain = obj.held(atom)
            result = join(result, held)
            everywhere = everywhere and certain
        else:
            everything = True
    if everything:
        run.spend(len(obj.cells))
        result = join(result, values_of(obj).any_element())
        everywhere = False
    result = join(result, present(obj.cells.get(OTHER, BOTTOM)))
    if obj.default and not everywhere:
        made = run.call(obj.default, Arguments(), node, frame)
        for atom in key:
            if isinstance(atom, str | int):
                old = obj.held(atom)[0]
                run.state.write(obj.cells, Key(atom), join(old, made))
        result = join(result, made)
    if not result and not everything and not obj.is_open and is_settled(run):
        throw(run, KeyError)
    if obj.escaped or not result:
        result = join(result, unknown("an element of a dictionary that is filled elsewhere"))
    return result


def is_settled(run: Run) -> bool:
    """Whether nothing else can have changed what is seen: no callback is waiting, nothing is repeated."""
    return not run.callbacks and not run.repeated


def _sequence_item(run: Run, sequence: Sequence, key: Value) -> Value:
    items = sequence.items
    if items.exact is None or sequence.escaped:
        return join(items.any_element(), ANY) if sequence.escaped else items.any_element() or ANY
    if all(type(index) is int for index in key):
        length = len(items.exact)
        result: Value = BOTTOM
        for index in key:
            if isinstance(index, int) and -length <= index < length:
                result = join(result, items.exact[index])
        if not result and is_settled(run):
            throw(run, IndexError)
        return result or ANY
    return items.any_element() or ANY


def _sliced(run: Run, sequence: Sequence, node: ast.Subscript, frame: Frame) -> Value:
    items = sequence.items
    bounds = slice_of(run, node.slice, frame)
    if items.exact is not None and bounds is not None and not sequence.escaped:
        return run.sequence(node, sequence.kind, Items(items.exact[bounds]))
    return run.sequence(node, sequence.kind, Items(None, items.any_element()))


def slice_of(run: Run, node: ast.expr, frame: Frame) -> slice | None:
    """The slice if its bounds are known."""
    assert isinstance(node, ast.Slice)
    bounds: list[int | None] = []
    for bound in (node.lower, node.upper, node.step):
        value = NONE if bound is None else run.evaluate(bound, frame)
        if len(value) != 1 or not isinstance(value[0], int | None):
            return None
        bounds.append(value[0])
    return slice(*bounds) if bounds[2] != 0 else None


def _character(run: Run, text: str, key: Value, node: ast.Subscript, frame: Frame) -> Value:
    if isinstance(node.slice, ast.Slice):
        bounds = slice_of(run, node.slice, frame)
        return (text[bounds],) if bounds is not None else unknown("a part of a text")
    index = key[0] if len(key) == 1 else None
    if type(index) is int and -len(text) <= index < len(text):
        return (text[index],)
    return unknown("a part of a text")


def _conditional(run: Run, node: ast.IfExp, frame: Frame) -> Value:
    outcome = decide(run, node.test, frame)
    if outcome is None:
        outcome = forked(run, node.test, frame)
    if outcome is not None:
        return run.evaluate(node.body if outcome else node.orelse, frame)
    results: list[Value] = []

    def side(expression: ast.expr, holds: bool) -> bool:
        narrowed(run, node.test, holds, frame)
        results.append(run.evaluate(expression, frame))
        return True

    run.state.branches((lambda: side(node.body, True), lambda: side(node.orelse, False)))
    return join(*results)


def _boolean(run: Run, node: ast.BoolOp, frame: Frame) -> Value:
    """``a or b``: the left side unless it may be false (``and``: true); then the right one as well."""
    stops_at = isinstance(node.op, ast.Or)
    result: Value = BOTTOM
    for index, operand in enumerate(node.values):
        value = run.evaluate(operand, frame) if index == 0 else _perhaps(run, operand, frame)
        if index == len(node.values) - 1:
            return join(result, value)
        tested = special.tested(run, value, operand, frame)
        outcome = truth(tested)
        if outcome is stops_at:
            return join(result, value)
        if tested is not value:
            result = join(result, value if outcome is None else BOTTOM)
            continue
        result = join(result, tuple(atom for atom in value if truth_of(atom) in (stops_at, None)))
    return result


def _perhaps(run: Run, operand: ast.expr, frame: Frame) -> Value:
    if isinstance(operand, ast.Constant | ast.Name):
        return run.evaluate(operand, frame)
    results: list[Value] = []

    def evaluate() -> bool:
        results.append(run.evaluate(operand, frame))
        return True

    run.state.maybe(evaluate)
    return results[0]


def _unary(run: Run, node: ast.UnaryOp, frame: Frame) -> Value:
    value = run.evaluate(node.operand, frame)
    if isinstance(node.op, ast.Not):
        outcome = truth(special.tested(run, value, node, frame))
        return BOOLEAN if outcome is None else (not outcome,)
    if special.has_own(value):
        name = {ast.USub: "__neg__", ast.UAdd: "__pos__", ast.Invert: "__invert__"}[type(node.op)]
        return special.call_special(run, value[0], name, node, frame) or ANY
    if isinstance(node.op, ast.USub) and len(value) == 1 and isinstance(value[0], int | float):
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


def _await(run: Run, node: ast.Await, frame: Frame) -> Value:
    return run.evaluate(node.value, frame)


def _yield(run: Run, node: ast.Yield, frame: Frame) -> Value:
    value = NONE if node.value is None else run.evaluate(node.value, frame)
    frame.yielded = join(frame.yielded or BOTTOM, value)
    return join(NONE, ANY)


def _yield_from(run: Run, node: ast.YieldFrom, frame: Frame) -> Value:
    items = elements(run, run.evaluate(node.value, frame), node, frame)
    frame.yielded = join(frame.yielded or BOTTOM, items.any_element())
    return ANY


def _starred(run: Run, node: ast.Starred, frame: Frame) -> Value:
    return run.evaluate(node.value, frame)


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
    ast.Subscript: _subscript,
    ast.Lambda: _lambda,
    ast.ListComp: comprehensions.comprehension,
    ast.SetComp: comprehensions.comprehension,
    ast.GeneratorExp: comprehensions.comprehension,
    ast.DictComp: comprehensions.dict_comprehension,
    ast.NamedExpr: _walrus,
    ast.Await: _await,
    ast.Yield: _yield,
    ast.YieldFrom: _yield_from,
    ast.Starred: _starred,
}
