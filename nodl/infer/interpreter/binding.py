"""Arguments of a call bound to the parameters of the function."""

from __future__ import annotations

import ast

from nodl.infer.interpreter.frames import Arguments, Call
from nodl.infer.interpreter.run import Run
from nodl.infer.values import (
    OTHER,
    Dictionary,
    FunctionValue,
    Items,
    Key,
    LocalCells,
    Value,
    join,
    unknown,
)

MISSING = unknown("an argument that the caller does not give")


def bind(run: Run, function: FunctionValue, call: Call) -> LocalCells:
    """The parameters' values; what the caller does not give takes its default."""
    given, parameters = call.args, function.node.args
    names = [parameter.arg for parameter in (*parameters.posonlyargs, *parameters.args)]
    cells = LocalCells()
    first_default = len(names) - len(function.defaults)
    used: set[str] = set()
    for index, name in enumerate(names):
        default = function.defaults[index - first_default] if index >= first_default else None
        if index < len(given.positional):
            cells[name] = given.positional[index]
        else:
            cells[name] = _named(name, given, default, join(given.more, given.more_keywords))
            used.add(name)
    for parameter, default in zip(parameters.kwonlyargs, function.kw_defaults, strict=True):
        cells[parameter.arg] = _named(parameter.arg, given, default, given.more_keywords)
        used.add(parameter.arg)
    if parameters.vararg:
        rest = tuple(given.positional[len(names) :])
        items = Items(None, join(given.more, Items(rest).any_element())) if given.more else Items(rest)
        cells[parameters.vararg.arg] = run.sequence(parameters.vararg, "tuple", items)
    if parameters.kwarg:
        cells[parameters.kwarg.arg] = _keywords(run, parameters.kwarg, given, used)
    return cells


def _named(name: str, given: Arguments, default: Value | None, more: Value) -> Value:
    if name in given.keywords:
        return given.keywords[name]
    if default is not None:
        return join(default, more)
    return more or MISSING


def _keywords(run: Run, node: ast.AST, given: Arguments, used: set[str]) -> Value:
    obj = run.allocate(node, "dict", Dictionary)
    for name, value in given.keywords.items():
        if name not in used:
            run.state.store(obj, Key(name), value)
    if given.more_keywords:
        run.state.store(obj, OTHER, given.more_keywords)
    return (obj,)
