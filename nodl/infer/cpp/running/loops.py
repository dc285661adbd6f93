"""How loops run: turn by turn while that is decided, else to a fixpoint."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from nodl.infer.cpp.reading.declarations import type_text
from nodl.infer.cpp.running.assignments import assign
from nodl.infer.cpp.running.contents import copied, iterated
from nodl.infer.cpp.running.hiding import element_type, seen_type
from nodl.infer.cpp.running.machine import CONTINUE, NEXT, RETURN, Frame, Loop, Machine, statement
from nodl.infer.cpp.running.memory import Changes
from nodl.infer.cpp.running.references import elements_written
from nodl.infer.cpp.running.statements import bind_names, condition_value, in_a_block
from nodl.infer.cpp.running.values import Value, join, unknown
from nodl.infer.cpp.syntax import Node, children, field_of, text, unwrapped, walk

MAX_UNROLLED = 64
MAX_ROUNDS = 3


@statement("for_range_loop")
@in_a_block
def for_range_loop(run: Machine, node: Node, frame: Frame) -> int:
    """One turn for each item; each turn may also be left out where the items are not exactly known."""
    right = field_of(node, "right")
    subject = run.evaluate(right, frame)
    items, exact = iterated(run, subject, node, frame)
    body = field_of(node, "body")
    declarator = field_of(node, "declarator")
    written = type_text(node)

    def bind(item: Value) -> None:
        names = [n for n in walk(declarator) if n.type == "identifier"] if declarator is not None else []
        if declarator is not None and any(
            n.type == "structured_binding_declarator" for n in walk(declarator)
        ):
            bind_names(run, [text(name) for name in names], item, frame)
        elif names:
            by_value = not set("&*") & set(text(declarator)) and not _points(run, right, frame)
            kind = run.type_of(written, frame)
            cls = run.held_class(kind, frame)
            own = copied(run, item, node, frame, cls) if by_value else item
            run.local(frame, text(names[0]), own, written)

    outcome = _over(run, body, [partial(bind, item) for item in items], exact, frame)
    is_reference = (
        declarator is not None and "&" in text(declarator) and "const" not in text(node).split(":")[0]
    )
    if is_reference and right is not None and _is_variable(right):
        names = (
            [text(n) for n in walk(declarator) if n.type == "identifier"] if declarator is not None else []
        )
        if body is not None and elements_written(run, body, names, frame):
            assign(run, right, unknown("what a loop writes to the elements"), frame)
    return outcome


def _points(run: Machine, right: Node | None, frame: Frame) -> bool:
    """Whether the elements are pointers."""
    if right is not None and right.type == "initializer_list":
        return any(each.type == "pointer_expression" for each in children(right))
    return element_type(seen_type(run, right, frame)).pointer


def _is_variable(node: Node) -> bool:
    return node.type in ("identifier", "field_expression", "subscript_expression", "pointer_expression")


def _over(run: Machine, body: Node | None, steps: list[Callable[[], None]], exact: bool, frame: Frame) -> int:
    """The body once for each step; any number of times each unless ``exact``."""
    if body is None:
        return NEXT
    if not steps and exact:
        run.kill(body, frame, "the loop runs over nothing")
        return NEXT
    start = run.store.mark()
    breaks: list[Changes] = []
    returns = 0
    outer_path = frame.path
    for index, step in enumerate(steps):
        frame.path = (*outer_path, index)

        def once(step: Callable[[], None] = step) -> int:
            step()
            return _iteration(run, body, frame, start, breaks)

        outcome = once() if exact else run.branches([once, lambda: NEXT])
        returns |= outcome & RETURN
        if not outcome & NEXT:
            break
    else:
        outcome = NEXT
    frame.path = outer_path
    run.settle(start, breaks, bool(outcome & NEXT))
    return returns | (NEXT if breaks or outcome & NEXT else 0)


def _iteration(run: Machine, body: Node, frame: Frame, start: int, breaks: list[Changes]) -> int:
    loop = Loop(run.store.mark(), start, breaks)
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
    initializer = field_of(node, "initializer")
    iterator = _iterator(node)
    if iterator is not None:
        return _over_iterator(run, node, *iterator, frame)
    if initializer is not None:
        run.execute(initializer, frame)
    return _counted(run, node, frame, field_of(node, "condition"), field_of(node, "update"))


def _iterator(node: Node) -> tuple[str, Node] | None:
    """Variable and container of ``for (auto it = c.begin(); it != c.end(); ++it)``."""
    condition = unwrapped(field_of(node, "condition"))
    if condition is None or condition.type != "binary_expression":
        return None
    right = field_of(condition, "right")
    callee = field_of(right, "function") if right is not None and right.type == "call_expression" else None
    if callee is None or callee.type != "field_expression" or text(field_of(callee, "field")) not in _ENDINGS:
        return None
    container = field_of(callee, "argument")
    left = field_of(condition, "left")
    return (
        (text(left), container)
        if container is not None and left is not None and left.type == "identifier"
        else None
    )


_ENDINGS = frozenset({"end", "cend", "rend", "crend"})


def _over_iterator(run: Machine, node: Node, name: str, container: Node, frame: Frame) -> int:
    """The iterator stands for the element that it points to."""
    items, exact = iterated(run, run.evaluate(container, frame), node, frame)
    exact = exact and field_of(node, "update") is not None
    body = field_of(node, "body")
    return _over(run, body, [partial(run.local, frame, name, item) for item in items], exact, frame)


@statement("while_statement")
@in_a_block
def while_statement(run: Machine, node: Node, frame: Frame) -> int:
    """Turn by turn while its condition is decided; else, as for ``while (true)``, to a fixpoint."""
    return _counted(run, node, frame, field_of(node, "condition"), None)


def _counted(run: Machine, node: Node, frame: Frame, condition: Node | None, update: Node | None) -> int:
    """As often as the condition is certainly true; after that any number of times."""
    body = field_of(node, "body")
    if body is None:
        return NEXT
    start = run.store.mark()
    breaks: list[Changes] = []
    returns = 0
    outer_path = frame.path
    for index in range(MAX_UNROLLED):
        holds = condition_value(run, condition, frame) if condition is not None else None
        if holds is False:
            if index == 0:
                run.kill(body, frame, "the condition of the loop is never true")
            break
        if holds is None or text(condition) in ("true", "1", "(true)", "(1)"):
            returns |= _repeated(run, body, update, condition, frame, start, breaks)
            break
        frame.path = (*outer_path, index)
        outcome = _iteration(run, body, frame, start, breaks)
        returns |= outcome & RETURN
        if not outcome & NEXT:
            frame.path = outer_path
            run.settle(start, breaks, False)
            return returns | (NEXT if breaks else 0)
        if update is not None:
            run.evaluate(update, frame)
    else:
        returns |= _repeated(run, body, update, condition, frame, start, breaks)
    frame.path = outer_path
    run.settle(start, breaks, True)
    return returns | NEXT


def _repeated(
    run: Machine,
    body: Node,
    update: Node | None,
    condition: Node | None,
    frame: Frame,
    start: int,
    breaks: list[Changes],
) -> int:
    """Until nothing changes; what still does after some rounds is not known."""
    returns = 0
    for round_ in range(MAX_ROUNDS + 2):
        mark = run.store.mark()

        def once() -> int:
            outcome = _iteration(run, body, frame, start, breaks)
            if outcome & NEXT and update is not None:
                run.evaluate(update, frame)
            if condition is not None:
                condition_value(run, condition, frame)
            return outcome

        outcome = run.branches([once, lambda: NEXT])
        returns |= outcome & RETURN
        changes = run.store.changes(mark)
        before = run.store.before(mark)
        moved = {cell: value for cell, value in changes.items() if set(before[cell]) != set(value)}
        if not moved:
            break
        if round_ >= MAX_ROUNDS - 1:
            for cell, value in moved.items():
                run.store.set(cell, join(before[cell], unknown("a value that changes in a loop")) or value)
    return returns


@statement("do_statement")
def do_statement(run: Machine, node: Node, frame: Frame) -> int:
    """The body once, then any number of times unless it left or the condition is certainly false."""
    body = field_of(node, "body")
    start = run.store.mark()
    breaks: list[Changes] = []
    if body is None:
        return NEXT
    outcome = _iteration(run, body, frame, start, breaks)
    condition = field_of(node, "condition")
    if outcome & NEXT and condition_value(run, unwrapped(condition), frame) is not False:
        outcome |= _repeated(run, body, None, unwrapped(condition), frame, start, breaks)
    run.settle(start, breaks, bool(outcome & NEXT))
    return (outcome & RETURN) | (NEXT if breaks or outcome & NEXT else 0)
