"""How loops run: turn by turn while that is decided, else to a fixpoint."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from enclave_addons.inference.cpp.reading.declarations import type_text
from enclave_addons.inference.cpp.reading.writes import writes_of, written_by
from enclave_addons.inference.cpp.running.callbacks import run_meanwhile
from enclave_addons.inference.cpp.running.contents import copied, iterated
from enclave_addons.inference.cpp.running.effects import only_changes_variables
from enclave_addons.inference.cpp.running.launch_values import decided
from enclave_addons.inference.cpp.running.machine import (
    CONTINUE,
    NEXT,
    RETURN,
    Frame,
    Loop,
    Machine,
    statement,
)
from enclave_addons.inference.cpp.running.memory import Changes
from enclave_addons.inference.cpp.running.references import forget, is_plain
from enclave_addons.inference.cpp.running.statements import bind_names, condition_of, in_a_block
from enclave_addons.inference.cpp.running.static_types import current_object, element_type, seen_type
from enclave_addons.inference.cpp.running.values import (
    BOTTOM,
    Group,
    Map,
    Obj,
    Seq,
    Text,
    Unknown,
    Value,
    has_text,
    in_any_order,
    join,
    lost,
    may_name,
    unknown,
)
from enclave_addons.inference.cpp.syntax import Node, children, field_of, text, walk, words_in

MAX_UNROLLED = 64
MAX_ENDLESS = 8
MAX_NAMELESS = 2
"""Turns of a loop in which nothing that may name something changed; the others are run to a fixpoint."""
MAX_ROUNDS = 3


@statement("for_range_loop")
@in_a_block
def for_range_loop(run: Machine, node: Node, frame: Frame) -> int:
    """Run one turn for each item; each may also be left out if the items are not exactly known."""
    right, body = field_of(node, "right"), field_of(node, "body")
    subject = run.evaluate(right, frame)
    if run.left:
        return RETURN
    items, exact = iterated(run, subject)
    declarator, written = field_of(node, "declarator"), type_text(node)
    parts = list(walk(declarator)) if declarator is not None else []
    names = [text(part) for part in parts if part.type == "identifier"]
    structured = any(part.type == "structured_binding_declarator" for part in parts)

    def bind(item: Value) -> None:
        if structured:
            bind_names(run, names, item, frame)
        elif names:
            by_value = not set("&*") & set(text(declarator)) and not _hold_pointers(run, right, frame)
            cls = run.held_class(run.type_of(written, frame), frame)
            own = copied(run, item, node, frame, cls) if by_value else item
            run.local(frame, names[0], own, written + ("" if by_value else "&"))
            frame.initial[names[0]] = right

    is_reference = "&" in text(declarator) and "const" not in text(node).split(":")[0]
    may_write = is_reference and body is not None and not writes_of(body).isdisjoint(names)
    held: Changes | None = {} if may_write else None
    outcome = _over(run, body, [partial(bind, item) for item in items], exact, frame, held)
    left = join(*(held.get((frame, name)) or BOTTOM for name in names)) if held else BOTTOM
    is_own = any(
        isinstance(atom, Obj) and atom.cls is not None for atom in subject
    )  # with a begin() of its own
    is_plain_one = is_plain(left) or (
        left != BOTTOM and (is_own or has_text(subject))
    )  # a letter is not known
    if right is not None and is_plain_one:
        forget(run, right, frame, "what a loop writes to the elements")
    return outcome


def _hold_pointers(run: Machine, right: Node | None, frame: Frame) -> bool:
    """Return whether the elements are pointers."""
    if right is not None and right.type == "initializer_list":
        return any(each.type == "pointer_expression" for each in children(right))
    return element_type(seen_type(run, right, frame)).pointer


def _over(
    run: Machine,
    body: Node | None,
    steps: list[Callable[[], None]],
    exact: bool,
    frame: Frame,
    held: Changes | None,
) -> int:
    """Run the body once for each step; in any order and number unless ``exact``.

    ``held`` gets what variables hold meanwhile that were there before a turn of the body.
    """
    if not steps and exact:
        run.kill(body, frame, "the loop runs over nothing")
        return NEXT
    if not exact and len(steps) > 1:
        _forget_counted(run, body, frame)
    loop = Loop(run.store.mark(), run.steps)
    returns, outer_path, outcome = 0, frame.path, NEXT
    for again in range(1 if exact else 2):
        for index, step in enumerate(steps if outcome & NEXT else ()):
            frame.path = (*outer_path, index)

            def once(step: Callable[[], None] = step) -> int:
                step()
                turn = partial(_iteration, run, body, frame, loop)
                if held is None:
                    return turn()
                outcome, found = run.store.held_during(turn)
                held.update(found)
                return outcome

            run.skips += not exact
            outcome = once() if exact else run.branches([once, lambda: NEXT])
            run.skips -= not exact
            returns |= outcome & RETURN
            if not outcome & NEXT:
                break
        if not exact and (not _forget_order(run, body, loop) or again):
            break
    frame.path = outer_path
    return returns | _after(run, loop, outcome)


def _forget_counted(run: Machine, body: Node | None, frame: Frame) -> None:
    """Make texts and numbers unknown that each turn of a loop changes for the next, where turns come in any order."""
    targets = (
        field_of(each, _CHANGED[each.type])
        for each in (walk(body) if body is not None else ())
        if each.type in _CHANGED
    )
    this = current_object(frame)
    for name in {text(target).removeprefix("this->") for target in targets}:
        owner = frame.owner_of(name) or this
        held = run.store.get((owner, name)) or BOTTOM if owner is not None else BOTTOM
        if any(isinstance(atom, Text | int) for atom in held):
            run.store.set((owner, name), lost(held, "a value that a loop in any order changes"))


_CHANGED = {"assignment_expression": "left", "update_expression": "argument"}


def _forget_order(run: Machine, body: Node | None, loop: Loop) -> bool:
    """Make what turns in an order that is not known have changed unknown, and lists have any order.

    Returns:
        Whether another turn may make something else of it.
    """
    found, kept = False, body is not None and run.subtree_matters(body)
    for cell, before, value in [*run.moved(loop.start, loop.steps)]:
        both = (*before, *value)
        if before != BOTTOM and any(isinstance(atom, Text | int) for atom in both):
            rest = tuple(atom for atom in both if not isinstance(atom, Text | int))
            run.store.set(cell, join(rest, unknown("a value that a loop in any order changes")))
            found = True
        elif before != BOTTOM and any(isinstance(atom, Seq | Map | Group) for atom in value):
            run.store.set(cell, in_any_order(value))
            kept = True
    return found and kept


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
    """Runs like ``while``, behind its initializer."""
    began = run.execute(field_of(node, "initializer"), frame)
    return _counted(run, node, frame) if began & NEXT else began


@statement("while_statement", "do_statement")
@in_a_block
def while_statement(run: Machine, node: Node, frame: Frame) -> int:
    """Run turn by turn while its condition is decided, else to a fixpoint; the first turn of ``do`` has none."""
    return _counted(run, node, frame)


def _counted(run: Machine, node: Node, frame: Frame) -> int:
    """Run as often as the condition is certainly true; after that any number of times."""
    condition, body, update = (field_of(node, name) for name in ("condition", "body", "update"))
    loop = Loop(run.store.mark(), run.steps)
    returns, outer_path = 0, frame.path
    alike_after, first = _alike_after(node), None
    tested: list[bool | None] = []

    def test() -> None:
        tested.append(decided(run, condition_of(run, condition, frame)))

    for index in range(MAX_UNROLLED):
        if run.spins_beside:
            run_meanwhile(run)
        holds: bool | None = True
        if condition is not None and (index > 0 or node.type != "do_statement"):
            seen = run.store.watched(test)
            holds, first = tested[-1], first or seen
            if run.left:
                frame.path = outer_path
                return returns | RETURN | _after(run, loop, 0)
        if holds is False:
            if index == 0:
                run.kill(body, frame, "the condition of the loop is never true")
            break
        if (
            holds is None
            or loop.breaks
            or (index == alike_after and (first is None or run.store.holds(first)))
            or (
                index == MAX_NAMELESS
                and not any(map(may_name, run.store.changes(loop.start).values()))
                and _computes(run, node)
            )
        ):
            returns |= _repeated(run, body, update, condition, frame, loop)
            _doubt_returned(frame, returns if holds else 0)
            break
        mark, frame.path = run.store.mark(), (*outer_path, index)
        outcome = _iteration(run, body, frame, loop)
        returns |= outcome & RETURN
        if not outcome & NEXT or (_is_endless(condition) and not run.store.changes(mark)):
            frame.path = outer_path
            return returns | _after(run, loop, 0)
        run.evaluate(update, frame)
    else:
        returns |= _repeated(run, body, update, condition, frame, loop)
        _doubt_returned(frame, returns)
    frame.path = outer_path
    return returns | _after(run, loop, NEXT)


def _doubt_returned(frame: Frame, returns: int) -> None:
    """Know nothing of the texts that a loop gives back whose turns are decided, and were not all followed."""
    if returns & RETURN:
        frame.returned = lost(frame.returned, "what a loop of many turns gives back")


def _computes(run: Machine, loop: Node) -> bool:
    """Return whether a loop makes no interface and does nothing but change variables."""
    return not run.subtree_matters(loop) and only_changes_variables(run, words_in(loop))


def _alike_after(loop: Node) -> int:
    """Return after how many turns a loop is run to a fixpoint, if its condition sees then what it saw at first.

    One if its text neither leaves it nor writes to what the condition names: others end it.
    """
    condition, body = field_of(loop, "condition"), field_of(loop, "body")
    if condition is None or body is None or _is_endless(condition):
        return MAX_ENDLESS
    waiting = [body]
    while waiting:
        each = waiting.pop()
        if each.type in _LEAVES:
            return MAX_ENDLESS
        waiting += each.named_children if each.type != "lambda_expression" else ()
    written = written_by(loop)
    return 1 if words_in(condition).isdisjoint(written.assigned | written.changed) else MAX_ENDLESS


_LEAVES = ("break_statement", "return_statement", "throw_statement", "goto_statement")


def _is_endless(condition: Node | None) -> bool:
    return text(condition).strip("()") in ("true", "1", "")


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
            if run.spins_beside:
                run_meanwhile(run)
            condition_of(run, condition, frame)
            return outcome

        run.skips += 1
        returns |= run.branches([once, lambda: NEXT]) & RETURN
        run.skips -= 1
        moved = [*run.moved(mark, loop.steps)]
        if not moved:
            break
        for cell, before, value in moved:
            if round_ >= MAX_ROUNDS - 1:
                run.store.set(cell, join(before, lost(value, _CHANGES), unknown(_CHANGES)))
            elif before != BOTTOM:
                run.store.set(cell, in_any_order(value))  # what grows has any number of elements
    else:
        if body is not None and any(
            may_name(value) and not _covers(before, value) for _, before, value in moved
        ):
            run.gap(body, frame, "a loop changes what names are made of for more rounds than are followed")
    return returns


_CHANGES = "a value that changes in a loop"


def _covers(known: Value, value: Value) -> bool:
    """Return whether something unknown, and what is known beside it, stands for all alternatives of ``value``."""
    is_open = any(isinstance(atom, Unknown) for atom in known)
    return is_open and set(lost(value, _CHANGES)) <= set(lost(known, _CHANGES))
