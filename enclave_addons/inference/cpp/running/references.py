"""References, pointers and iterators to texts, numbers and containers: who writes through one changes another variable.

Objects are the same ones wherever they are seen; plain values lie in the cells of their variables. What is written
through a reference or pointer makes what it may lead to unknown; where that cannot be said it is a gap.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import partial

from enclave_addons.inference.cpp.reading.declarations import Class
from enclave_addons.inference.cpp.running.effects import effects_of, referred_to
from enclave_addons.inference.cpp.running.machine import Frame, Machine
from enclave_addons.inference.cpp.running.memory import Cell
from enclave_addons.inference.cpp.running.static_types import current_object, is_address
from enclave_addons.inference.cpp.running.values import (
    BOTTOM,
    Const,
    Group,
    Map,
    Obj,
    Param,
    ReferredTo,
    Seq,
    Text,
    Unknown,
    Value,
    join,
    lost,
)
from enclave_addons.inference.cpp.syntax import Node, children, field_of, last_name, text, unwrapped, words_in


def is_plain(value: Value) -> bool:
    """Return whether a text, number or container is among the alternatives."""
    return any(isinstance(atom, Text | Seq | Map | Group | Param | Const | int) for atom in value)


REFERRED_TO = ReferredTo("what a reference or pointer stands for")


def as_referred_to(value: Value) -> Value:
    """Return what a member or element that is a reference or pointer holds: objects; a plain value may change."""
    return tuple(REFERRED_TO if is_plain((atom,)) else atom for atom in value)


def bind_reference(run: Machine, name: str, kind: str, initial: Node | None, frame: Frame) -> None:
    """Bind ``T & name = initial`` or ``T * name = &initial``, which was declared and has its value.

    What a view, an iterator, a reference or a pointer shows is not known if the function changes what is behind it.
    """
    target, value = unwrapped(initial), run.store.get((frame, name)) or BOTTOM
    refers = kind.endswith(("&", "*"))
    if target is None:
        return
    if is_plain(value) or any(isinstance(atom, Unknown) for atom in value):
        shows = refers or leads_into(initial) or _VIEW.search(kind)
        if shows and _changes_behind(run, initial, frame):
            run.store.set((frame, name), lost(value, f"what {name} shows later"))
    elif not (kind.endswith("&") and is_address(run, target, frame)):
        return
    if refers and "const" not in _written_type(initial):
        frame.references.add(name)


_VIEW = re.compile(r"\b(?:string_view|span)\b")
_INTO = re.compile(
    r"(?:^std::|[.>])(?:ranges::)?(?:c?r?(?:begin|end)|find\w*|(?:lower|upper|equal)_\w+|(?:min|max)_element|next|prev|data|"
    r"emplace|insert\w*|try_emplace|tie|forward_as_tuple)$"
)


def leads_into(value: Node | None) -> bool:
    """Return whether it is ``&x``, ``x.find(...)`` or ``std::find_if(...)``: something itself, seen from elsewhere."""
    if value is None or value.type != "call_expression":
        return text(value).startswith("&")
    return _INTO.search(text(field_of(value, "function"))) is not None


def _written_type(initial: Node | None) -> str:
    return text(initial.parent.parent if initial is not None and initial.parent else None).split("=")[0]


def _changes_behind(run: Machine, initial: Node | None, frame: Frame) -> bool:
    """Return whether the function, or one that it calls, changes what ``initial`` is a part of."""
    callee = field_of(initial, "function")
    is_made = text(callee).startswith("std::") and not leads_into(initial)  # ``std::make_pair(...)``
    if frame.function is None or initial is None or is_made:
        return False
    behind = words_in(field_of(callee, "argument") or initial)
    named = run.names.functions_by_name.get(last_name(callee), ()) if callee is not None else ()
    behind = behind.union(*map(referred_to, named))
    return not behind.isdisjoint(effects_of(run, frame.function).touched)


def forget(
    run: Machine, what: Node, frame: Frame, why: str = "", written: Value = BOTTOM, told: bool = True
) -> None:
    """Make the variables unknown that ``what`` may refer to: they, or parts of them, are written.

    Args:
        written: What is written: objects among it may be elements afterwards.
        told: Whether to add a gap if ``what`` refers to no known variable.
    """
    why = why or f"what is written to {text(what)[:40]}"
    cells = dict.fromkeys(_behind(run, what, frame, set()))
    members = [
        (atom, field)
        for cell in cells
        for atom in run.store.get(cell) or BOTTOM
        if isinstance(atom, Obj) and atom.node is None
        for cls in run.names.ancestry(atom.cls)
        for field in cls.fields
    ]
    iterators = 0
    for cell in (*cells, *members):
        held = run.store.get(cell) or BOTTOM
        iterators += any(isinstance(atom, Seq) and atom.place for atom in held)
        if is_plain(held):
            run.store.set(cell, lost(held, why, written))
    if (told and not cells) or (iterators and iterators == len(cells)):
        through(run, what, frame)


def set_through(run: Machine, what: Node, value: Value, frame: Frame) -> None:
    """Run ``reference = value``: what the reference may stand for is not known then, a pointer may show the objects."""
    objects = tuple(atom for atom in value if isinstance(atom, Obj))
    for cell in dict.fromkeys(_behind(run, what, frame, set())) if objects else ():
        run.store.set(cell, join(run.store.get(cell) or BOTTOM, objects))
    forget(run, what, frame, written=value)


def keep_reference(run: Machine, what: Node, frame: Frame) -> None:
    """Make the variable ``what`` unknown from now on: a reference to it is stored, and may be written through."""
    why = f"what is written through a reference to {text(what)[:40]}"
    run.store.share(partial(forget, run, what, frame, why, told=False), partial(lost, why=why))


def through(run: Machine, what: Node, frame: Frame) -> None:
    """Add a gap: a plain value is written through ``what``, and it is not known which: so none is any more."""
    run.gap(what, frame, f"what {text(what)[:40]} refers to is written: which variable that is is not known")
    forget_everything(run, f"what is written through {text(what)[:40]}")


def forget_everything(run: Machine, why: str) -> None:
    """Make every text, number and container unknown that a variable holds which is not constant."""
    cells = [cell for cell in run.store.everything() if not _is_constant(cell)]
    run.store.lose([cell for cell in cells if is_plain(run.store.get(cell) or BOTTOM)], why)


def _is_constant(cell: Cell) -> bool:
    """Return whether a variable was declared ``const``."""
    owner, name = cell
    if isinstance(owner, Frame):
        written = owner.types.get(name, "")
    elif isinstance(owner, Obj):
        return False
    else:
        declared = owner.fields[name] if isinstance(owner, Class) else owner
        written = text(getattr(declared, "node", None)).partition("=")[0]
    return re.search(r"\bconst(?:expr)?\b", written) is not None


def _behind(run: Machine, what: Node | None, frame: Frame, seen: set[object]) -> Iterator[Cell]:
    """Yield the variables that an expression names, and those that references and iterators among them lead to."""
    if what is None or (what.id, frame) in seen or what.type == "lambda_expression":
        return
    seen.add((what.id, frame))
    if what.type in ("identifier", "field_identifier", "qualified_identifier"):
        yield from _of_name(run, what, frame, seen)
        return
    inner: list[Node | None] = [*what.named_children]
    if what.type == "call_expression":
        callee = field_of(what, "function") or what
        inner = [field_of(callee, "argument"), *children(field_of(what, "arguments"))]
        for function in run.names.functions_by_name.get(last_name(callee), ()):
            for word in referred_to(function):
                yield from run.store.named(word)
    elif what.type == "field_expression":
        yield from run.store.named(text(field_of(what, "field")))
        inner = [field_of(what, "argument")]
    for each in inner:
        yield from _behind(run, each, frame, seen)


def _of_name(run: Machine, name: Node, frame: Frame, seen: set[object]) -> Iterator[Cell]:
    written = text(name)
    owner, this = frame.owner_of(written), current_object(frame)
    if owner is not None:
        yield owner, written
        initial = owner.initial.get(written)
        if owner.types.get(written, "").endswith(("&", "*")) or leads_into(initial):
            yield from _behind(run, initial, owner, seen)
    elif this is not None and run.store.get((this, written)) is not None:
        yield this, written
    else:
        yield from run.store.named(written.rpartition("::")[2])
