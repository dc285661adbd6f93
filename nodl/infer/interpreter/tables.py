"""Puts the handlers of all concerns together and makes runs of them."""

from __future__ import annotations

from nodl.infer.interpreter.attributes import ATTRIBUTES
from nodl.infer.interpreter.callables import CALLABLES
from nodl.infer.interpreter.expressions import EXPRESSIONS
from nodl.infer.interpreter.run import Run, Tables
from nodl.infer.interpreter.statements import STATEMENTS
from nodl.infer.models.foreign import creates, keeps_off, lets_through
from nodl.infer.program import Program, SourceModule

TABLES = Tables(EXPRESSIONS, STATEMENTS, CALLABLES, ATTRIBUTES, keeps_off, lets_through, creates)


def new_run(program: Program, main: SourceModule) -> Run:
    """A run of ``main`` with the handlers of all concerns; nothing is executed yet."""
    return Run(program, TABLES, main)
