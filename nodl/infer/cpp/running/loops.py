"""How loops run: turn by turn while that is decided, else to a fixpoint."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from nodl.infer.cpp.reading.declarations import type_text
from nodl.infer.cpp.running.assignments import assign
from nodl.infer.cpp.running.contents import copied, iterated
from nodl.infer.cpp.running.machine import CONTINUE, NEXT, RETURN, Frame, Loop, Machine, statement
from nodl.infer.cpp.running.references import elements_written
from nodl.infer.cpp.running.statements import bind_names, condition_value, in_a_block
from nodl.infer.cpp.running.static_types import element_type, seen_type
from nodl.infer.cpp.running.values import Value, join, unknown
from nodl.infer.cpp.syntax import Node, children, field_of, text, unwrapped, walk

MAX_UNROLLED = 64
MAX_ROUNDS = 3


@statement("for_range_loop")
@in_a_block
def for_range_loop(run: Machine, node: Node, frame: Frame) -> int:
    """Run one turn for each item; each may also be left out if the items are not exactly known."""
    right, body = field_of(node, "right"), field_of(node, "body")
    subject = run.evaluate(right, frame)
    items, exact = iterated(run, subject)
    declarator, written = field_of(node, "declarator"), type_text(node)
    parts = list(walk(declarator)) if declarator is not None else []
    names = [text(part) for part in parts if part.type == "identifier"]
    structured = any(part.type == "structured_binding_declarator" for part in parts)

    def bind(item: Value) -> None:
        if structured:
            bind_names(run, names, item, frame)
        elif names:
            by_value = not set("&*") & set(text(declarator)) and not _points(run, right, frame)
            cls = run.held_class(run.type_of(written, frame), frame)
            own = copied(run, item, node, frame, cls) if by_value else item
            run.local(frame, names[0], own, written)

    outcome = _over(run, body, [partial(bind, item) for item in items], exact, frame)
    is_reference = "&" in text(declarator) and "const" not in text(node).split(":")[0]
    if (
        is_reference
        and right is not None
        and right.type in _VARIABLES
        and elements_written(run, body, names, subject, frame)
    ):
        assign(run, right, unknown("what a loop writes to the elements"), frame)
    return outcome


_VARIABLES = ("identifier", "field_expression", "subscript_expression", "pointer_expression")


def _points(run: Machine, right: Node | None, frame: Frame) -> bool:
    """Return whether the elements are pointers."""
    if right is not None and right.type == "initializer_list":
        return any(each.type == "pointer_expression" for each in children(right))
    return element_type(seen_type(run, right, frame)).pointer


def _over(run: Machine, body: Node | None, steps: list[Callable[[], None]], exact: bool, frame: Frame) -> int:
    """Run the body once for each step; any number of times each unless ``exact``."""
    if not steps and exact:
        run.kill(body, frame, "the loop runs over nothing")
        return NEXT
    loop = Loop(run.store.mark())
    returns, outer_path = 0, frame.path
    for index, step in enumerate(steps):
        frame.path = (*outer_path, index)

        def once(step: Callable[[], None] = step) -> int:
            step()
            return _iteration(run, body, frame, loop)

        outcome = once() if exact else run.branches([once, lambda: NEXT])
        returns |= outcome & RETURN
        if not outcome & NEXT:
            break
    else:
        outcome = NEXT
    frame.path = outer_path
    return returns | _after(run, loop, outcome)


def _after(run: Machine, loop: Loop, outcome: int) -> int:
    """Join what left the loop early with what came to its end; return whether anything goes on behind it."""
    run.settle(loop.start, loop.breaks, bool(outcome & NEXT))
    return NEXT if loop.breaks else outcome & NEXT


def _iteration(run: Machine, body: Node | None, frame: Frame, loop: Loop) -> int:
    loop.mark, loop.continues = run.store.mark(), []
    frame.loops.append(loop)
    outcome = run.execute(body, frame)
    frame.loops.pop()
    run.settle(loop.mark, loop.continues, bool(outcome & NEXT))
    if outcome & CONTINUE:
        outcome |= NEXT
    return outcome & (NEXT | RETURN)


@statement("for_statement")
@in_a_block
def for_statement(run: Machine, node: Node, frame: Frame) -> int:
    """Runs like ``while``; with an iterator up to ``end()``, one turn for each element of the container."""
    iterator = _iterator(node)
    if iterator is not None:
        return _over_iterator(run, node, *iterator, frame)
    run.execute(field_of(node, "initializer"), frame)
    return _counted(run, node, frame)


def _iterator(node: Node) -> tuple[str, Node] | None:
    """Return variable and container of ``for (auto it = c.begin(); it != c.end(); ++it)``."""
    condition = unwrapped(field_of(node, "condition"))
    left, right = field_of(condition, "left"), field_of(condition, "right")
    if (
        condition is None
        or condition.type != "binary_expression"
        or left is None
        or left.type != "identifier"
    ):
        return None
    callee = field_of(right, "function")  # of a call
    container = field_of(callee, "argument")
    return (
        (text(left), container)
        if container is not None and text(field_of(callee, "field")) in _ENDINGS
        else None
    )


_ENDINGS = frozenset({"end", "cend", "rend", "crend"})


def _over_iterator(run: Machine, node: Node, name: str, container: Node, frame: Frame) -> int:
    """Run the loop with the iterator standing for the element that it points to."""
    items, exact = iterated(run, run.evaluate(container, frame))
    exact = exact and field_of(node, "update") is not None
    body = field_of(node, "body")
    return _over(run, body, [partial(run.local, frame, name, item) for item in items], exact, frame)


@statement("while_statement")
@in_a_block
def while_statement(run: Machine, node: Node, frame: Frame) -> int:
    """Turn by turn while its condition is decided; else, as for ``while (true)``, to a fixpoint."""
    return _counted(run, node, frame)


def _counted(run: Machine, node: Node, frame: Frame) -> int:
    """Run as often as the condition is certainly true; after that any number of times."""
    condition, body, update = (field_of(node, name) for name in ("condition", "body", "update"))
    loop = Loop(run.store.mark())
    returns, outer_path = 0, frame.path
    for index in range(MAX_UNROLLED):
        holds = condition_value(run, condition, frame)
        if holds is False:
            if index == 0:
                run.kill(body, frame, "the condition of the loop is never true")
            break
        if holds is None or text(condition) in ("true", "1", "(true)", "(1)"):
            returns |= _repeated(run, body, update, condition, frame, loop)
            break
        frame.path = (*outer_path, index)
        outcome = _iteration(run, body, frame, loop)
        returns |= outcome & RETURN
        if not outcome & NEXT:
            frame.path = outer_path
            return returns | _after(run, loop, 0)
        run.evaluate(update, frame)
    else:
        returns |= _repeated(run, body, update, condition, frame, loop)
    frame.path = outer_path
    return returns | _after(run, loop, NEXT)


def _repeated(
    run: Machine, body: Node | None, update: Node | None, condition: Node | None, frame: Frame, loop: Loop
) -> int:
    """Run until nothing changes; what still does after some rounds is not known."""
    returns = 0
    for round_ in range(MAX_ROUNDS + 2):
        mark = run.store.mark()

        def once() -> int:
            outcome = _iteration(run, body, frame, loop)
            if outcome & NEXT:
                run.evaluate(update, frame)
            condition_value(run, condition, frame)
            return outcome

        returns |= run.branches([once, lambda: NEXT]) & RETURN
        before = run.store.before(mark)
        changes = run.store.changes(mark).items()
        moved = {cell: value for cell, value in changes if set(before[cell]) != set(value)}
        if not moved:
            break
        if round_ >= MAX_ROUNDS - 1:
            for cell, value in moved.items():
                run.store.set(cell, join(before[cell], unknown("a value that changes in a loop")) or value)
    return returns


@statement("do_statement")
def do_statement(run: Machine, node: Node, frame: Frame) -> int:
    """Run the body once, then any number of times unless it left or the condition is certainly false."""
    body, condition = field_of(node, "body"), unwrapped(field_of(node, "condition"))
    loop = Loop(run.store.mark())
    outcome = _iteration(run, body, frame, loop)
    if outcome & NEXT and condition_value(run, condition, frame) is not False:
        outcome |= _repeated(run, body, None, condition, frame, loop)
    return (outcome & RETURN) | _after(run, loop, outcome)
