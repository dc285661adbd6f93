"""What runs without a call that can be read: conversions, some operators and destructors.

Where they run is not followed, so what they change is a gap or no longer known.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from nodl.infer.cpp.reading.declarations import Class, Field, Function, Global, function_declarator
from nodl.infer.cpp.reading.writes import writes_of
from nodl.infer.cpp.running.effects import effects_of
from nodl.infer.cpp.running.machine import Frame, Machine
from nodl.infer.cpp.running.memory import Cell
from nodl.infer.cpp.running.plain_types import is_plain_type
from nodl.infer.cpp.running.values import unknown
from nodl.infer.cpp.syntax import Node, field_of, text, walk, words_in

_NOT_FOLLOWED = re.compile(r"operator (?!new|delete)\w.*|operator(?:,|&&|\|\||==|<=>)")
_WRITES = {"assignment_expression": "left", "update_expression": "argument"}


def check_implicit_calls(run: Machine, cls: Class, node: Node, frame: Frame) -> None:
    """Add a gap for functions that change something and that are called implicitly.

    Conversions, ``,``, comparisons, from which C++20 derives others, and destructors that write to what a member
    refers or points to.
    """
    ancestry = run.names.ancestry(cls)
    fields = {name: member for each in ancestry for name, member in each.fields.items()}
    behind_const = {name for name, each in fields.items() if each.pointer or "mutable" in text(each.node)}
    listed = [
        (name, f) for each in ancestry for name, found in run.names.methods[each].items() for f in found
    ]
    for name, method in listed:
        if name.startswith("~") and _writes_elsewhere(ancestry, method):
            run.gap(node, frame, f"{name} changes what others have: when it runs is not followed")
        if name.startswith("~"):
            _written_when_destroyed(run, method)
        kept = (behind_const if _only_reads(method) else fields.keys()) | run.names.globals.keys()
        if _NOT_FOLLOWED.fullmatch(name) and (run.makes_interfaces(method) or writes_of(method.node) & kept):
            why = f"{name} of {cls.name} changes something: where it runs is not followed"
            run.gap(node, frame, why)


def _written_when_destroyed(run: Machine, destructor: Function) -> None:
    """Know nothing of a plain global or static member that a destructor writes to: when it runs is not followed."""
    written = effects_of(run, destructor).written
    for name in sorted(written.assigned | written.changed):
        cells: list[tuple[Cell, Global | Field, Global | Class]] = [
            ((each, ""), each, each) for each in run.names.globals.get(name, ())
        ]
        cells += [((cls, name), cls.fields[name], cls) for cls in run.names.static_members.get(name, ())]
        for cell, declared, where in cells:
            kind = run.names.resolve(declared.type, where.scope, where.file)
            if is_plain_type(kind.name) and not declared.pointer:
                run.store.share_cell(cell, lambda _: unknown("what a destructor may have written"))


def _writes_elsewhere(ancestry: Sequence[Class], method: Function) -> bool:
    """Return whether a method writes to what a member of its object refers or points to."""
    fields = [field for each in ancestry for field in each.fields.values() if field.pointer]
    references = {each.name for each in fields if "&" in text(each.node)}
    pointers = {each.name for each in fields} - references
    for each in walk(method.node):
        target = field_of(each, _WRITES[each.type]) if each.type in _WRITES else None
        words = words_in(target) if target is not None else frozenset()
        behind = words & pointers and text(target).removeprefix("this->") not in pointers
        if words & references or behind:
            return True
    return False


def _only_reads(method: Function) -> bool:
    """Return whether a method is ``const``, and what it takes, too: it hands its members on to be read."""
    declarator = function_declarator(method.node)
    qualifiers = declarator.named_children if declarator is not None else []
    return (
        any(each.type == "type_qualifier" and text(each) == "const" for each in qualifiers)
        and "const_cast" not in method.words
        and not any(each.written_back for each in method.parameters)
    )
