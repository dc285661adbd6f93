"""What happens when a value is called, by its kind; the handlers of all concerns together, and runs made of them."""

from __future__ import annotations

import ast

from nodl.infer.interpreter.attributes import ATTRIBUTES
from nodl.infer.interpreter.calls import call_bound, call_function
from nodl.infer.interpreter.expressions import EXPRESSIONS
from nodl.infer.interpreter.frames import Call
from nodl.infer.interpreter.instantiation import instantiate
from nodl.infer.interpreter.run import Caller, Run, Tables
from nodl.infer.interpreter.statements import STATEMENTS
from nodl.infer.models import foreign
from nodl.infer.program import Program, SourceModule
from nodl.infer.values import (
    ANY,
    COMMAND_LINE,
    OF_A_NODE,
    TOO_MANY,
    BoundMethod,
    ClassMethod,
    ClassValue,
    External,
    ForeignMethod,
    FunctionValue,
    Instance,
    NativeMethod,
    Partial,
    Unknown,
    Value,
)

_OF_EXECUTORS = frozenset({"add_node", "remove_node", "wake"})  # of rclpy, whichever object it is
_CHANGES = frozenset({"append", "extend", "insert", "remove", "pop", "clear"})


def _call_partial(run: Run, partial: Partial, call: Call) -> Value:
    args = call.args.preceded(*partial.positional)
    args.keywords = {**dict(partial.keywords), **args.keywords}
    return run.call(partial.function, args, call.node, call.frame)


def _call_instance(run: Run, instance: Instance, call: Call) -> Value:
    if isinstance(instance.cls, External):
        run.escape(call.args)
        return ANY
    method = run.attribute((instance,), "__call__", call.node, call.frame)
    return run.call(method, call.args, call.node, call.frame)


def _call_unknown(run: Run, atom: Unknown, call: Call) -> Value:
    if atom.why == TOO_MANY:
        run.gap(call.node, call.frame, "one of too many functions is called here")
    function = call.node.func if isinstance(call.node, ast.Call) else None
    if atom.why == COMMAND_LINE and isinstance(function, ast.Attribute) and function.attr in _CHANGES:
        run.gap(call.node, call.frame, "the command line is changed in code")
    if isinstance(function, ast.Attribute) and function.attr in _OF_EXECUTORS:
        return (atom,)
    if atom.why == OF_A_NODE:
        run.gap(call.node, call.frame, "a method of the node whose name is made at run time is called here")
    run.escape(call.args)
    return (atom,)


CALLABLES: dict[type, Caller] = {
    FunctionValue: call_function,
    BoundMethod: call_bound,
    Partial: _call_partial,
    Instance: _call_instance,
    ClassMethod: lambda run, method, call: run.call(method.function, call.args, call.node, call.frame),
    ClassValue: instantiate,
    Unknown: _call_unknown,
    External: foreign.call_external,
    ForeignMethod: foreign.call_foreign_method,
    NativeMethod: foreign.call_native,
}

TABLES = Tables(
    EXPRESSIONS, STATEMENTS, CALLABLES, ATTRIBUTES, foreign.keeps_off, foreign.lets_through, foreign.creates
)


def new_run(program: Program, main: SourceModule) -> Run:
    """Return a run of ``main`` with the handlers of all concerns; nothing is executed yet."""
    return Run(program, TABLES, main)
