"""How statements run: blocks, branches, loops, declarations."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from nodl.infer.cpp.declarations import declared_names, type_text
from nodl.infer.cpp.machine import (
    BREAK,
    CONTINUE,
    NEXT,
    RETURN,
    Frame,
    Loop,
    Machine,
    is_reference,
    statement,
)
from nodl.infer.cpp.objects import copied, declared_value, iterated
from nodl.infer.cpp.store import Changes
from nodl.infer.cpp.syntax import children, parse_expression, text, unwrapped, walk
from nodl.infer.cpp.values import BOTTOM, Group, Value, join, truth, unknown

if TYPE_CHECKING:
    from tree_sitter import Node

MAX_UNROLLED = 64
MAX_ROUNDS = 3


@statement(
    "compound_statement",
    "declaration_list",
    "case_statement",
    "labeled_statement",
    "preproc_else",
    "else_clause",
)
def block(run: Machine, node: Node, frame: Frame) -> int:
    return sequence(run, children(node), frame)


def sequence(run: Machine, listed: list[Node], frame: Frame) -> int:
    outcome = 0
    for index, child in enumerate(listed):
        result = run.execute(child, frame)
        outcome |= result & ~NEXT
        if not result & NEXT:
            for rest in listed[index + 1 :]:
                run.kill(rest, frame, "it stands behind a return, break or throw")
            return outcome
    return outcome | NEXT


@statement("expression_statement")
def expression_statement(run: Machine, node: Node, frame: Frame) -> int:
    for child in children(node):
        run.evaluate(child, frame)
        if child.type == "call_expression" and text(child.child_by_field_name("function")) in _ENDS:
            return RETURN
    return NEXT


_ENDS = frozenset({"exit", "std::exit", "abort", "std::abort", "_exit", "std::terminate", "std::quick_exit"})


@statement("return_statement", "co_return_statement")
def return_statement(run: Machine, node: Node, frame: Frame) -> int:
    value = BOTTOM
    for child in children(node):
        value = run.evaluate(child, frame)
    frame.returned = join(frame.returned, value)
    frame.exit_values.append(value)
    frame.exits.append(run.store.changes(frame.mark))
    return RETURN


@statement("throw_statement")
def throw_statement(run: Machine, node: Node, frame: Frame) -> int:
    for child in children(node):
        run.evaluate(child, frame)
    return RETURN


@statement("break_statement")
def break_statement(run: Machine, node: Node, frame: Frame) -> int:
    if frame.loops:
        frame.loops[-1].breaks.append(run.store.changes(frame.loops[-1].start))
    return BREAK


@statement("continue_statement")
def continue_statement(run: Machine, node: Node, frame: Frame) -> int:
    loops = [loop for loop in frame.loops if not isinstance(loop, _Switch)]
    if loops:
        loops[-1].continues.append(run.store.changes(loops[-1].mark))
    return CONTINUE


class _Switch(Loop):
    pass


@statement("if_statement")
def if_statement(run: Machine, node: Node, frame: Frame) -> int:
    condition = node.child_by_field_name("condition")
    for child in children(condition):
        if child.type in ("init_statement", "declaration"):
            for inner in children(child) if child.type == "init_statement" else [child]:
                run.execute(inner, frame)
    value = condition_value(run, condition, frame)
    then, other = node.child_by_field_name("consequence"), node.child_by_field_name("alternative")
    if value is True and other is not None:
        run.kill(other, frame, f"the condition {text(condition)[:60]} is always true")
    if value is False and then is not None:
        run.kill(then, frame, f"the condition {text(condition)[:60]} is never true")
    sides = [side for side, dead in ((then, value is False), (other, value is True)) if not dead]
    if value is not None:
        return run.execute(sides[0], frame) if sides and sides[0] is not None else NEXT
    return run.branches([_running(run, side, frame) for side in sides])


def condition_value(run: Machine, condition: Node | None, frame: Frame) -> bool | None:
    inner = condition
    if condition is not None and condition.type == "condition_clause":
        inner = condition.child_by_field_name("value")
    if inner is None or inner.type == "declaration":
        return None
    return truth(run.evaluate(inner, frame))


def _running(run: Machine, node: Node | None, frame: Frame) -> Callable[[], int]:
    return lambda: run.execute(node, frame) if node is not None else NEXT


@statement("preproc_if", "preproc_ifdef", "preproc_elif")
def preprocessor_branches(run: Machine, node: Node, frame: Frame) -> int:
    """A conditional that only the build decides: either side, or neither."""
    alternative = node.child_by_field_name("alternative")
    head = (node.child_by_field_name("condition"), node.child_by_field_name("name"), alternative)
    own = [child for child in children(node) if child not in head]
    sides: list[Callable[[], int]] = [lambda: sequence(run, own, frame)]
    sides.append(_running(run, alternative, frame))
    return run.branches(sides)


@statement("switch_statement")
def switch_statement(run: Machine, node: Node, frame: Frame) -> int:
    subject = condition_atoms(run, node.child_by_field_name("condition"), frame)
    cases = [c for c in children(node.child_by_field_name("body")) if c.type == "case_statement"]
    chosen, certain = _chosen_cases(run, cases, subject, frame)
    mark = run.store.mark()
    loop = _Switch(mark, mark)
    frame.loops.append(loop)
    sides: list[Callable[[], int]] = [_falling(run, cases[index:], frame) for index in chosen]
    if not certain:
        sides.append(lambda: NEXT)
    outcome = run.branches(sides or [lambda: NEXT])
    frame.loops.pop()
    run.settle(loop.mark, loop.breaks, bool(outcome & NEXT))
    if outcome & BREAK:
        outcome = (outcome & ~BREAK) | NEXT
    for index, case in enumerate(cases):
        if certain and chosen and index < min(chosen):
            run.kill(case, frame, "the switch never takes this case")
    return outcome


def condition_atoms(run: Machine, condition: Node | None, frame: Frame) -> Value:
    inner = condition.child_by_field_name("value") if condition is not None else None
    return run.evaluate(inner if inner is not None else unwrapped(condition), frame)


def _chosen_cases(run: Machine, cases: list[Node], subject: Value, frame: Frame) -> tuple[list[int], bool]:
    from nodl.infer.cpp.values import Const

    known = len(subject) == 1 and isinstance(subject[0], Const | int)
    default = [index for index, case in enumerate(cases) if case.child_by_field_name("value") is None]
    if not known:
        return list(range(len(cases))), bool(default)
    labels = [run.evaluate(case.child_by_field_name("value"), frame) for case in cases]
    if any(
        len(label) != 1 or not isinstance(label[0], Const | int)
        for i, label in enumerate(labels)
        if i not in default
    ):
        return list(range(len(cases))), bool(default)
    matching = [index for index, label in enumerate(labels) if label == subject]
    return (matching or default)[:1], True


def _falling(run: Machine, cases: list[Node], frame: Frame) -> Callable[[], int]:
    def go() -> int:
        outcome = NEXT
        for case in cases:
            value = case.child_by_field_name("value")
            result = sequence(run, [child for child in children(case) if child != value], frame)
            outcome = (outcome & ~NEXT) | result
            if not result & NEXT:
                break
        return outcome

    return go


@statement("try_statement")
def try_statement(run: Machine, node: Node, frame: Frame) -> int:
    body = node.child_by_field_name("body")
    outcome = run.execute(body, frame) if body is not None else NEXT
    catches = [child for child in children(node) if child.type == "catch_clause"]

    def caught(clause: Node) -> Callable[[], int]:
        def go() -> int:
            for name in (n for n in walk(clause) if n.type == "parameter_declaration"):
                declared = name.child_by_field_name("declarator")
                if declared is not None:
                    run.local(frame, text(declared).lstrip("&* "), unknown("an exception"))
            inner = clause.child_by_field_name("body")
            return run.execute(inner, frame) if inner is not None else NEXT

        return go

    after: list[Callable[[], int]] = [lambda: outcome]
    return run.branches([*after, *(caught(clause) for clause in catches)])


# --- loops ----------------------------------------------------------------------------------------------------


@statement("for_range_loop")
def for_range_loop(run: Machine, node: Node, frame: Frame) -> int:
    right = node.child_by_field_name("right")
    subject = run.evaluate(right, frame)
    items, exact = iterated(run, subject, node, frame)
    body = node.child_by_field_name("body")
    declarator = node.child_by_field_name("declarator")
    written = type_text(node)

    def bind(item: Value) -> None:
        names = [n for n in walk(declarator) if n.type == "identifier"] if declarator is not None else []
        if declarator is not None and any(
            n.type == "structured_binding_declarator" for n in walk(declarator)
        ):
            bind_names(run, [text(name) for name in names], item, frame)
        elif names:
            by_value = "&" not in text(declarator)
            run.local(frame, text(names[0]), copied(run, item, node, frame) if by_value else item, written)

    return _over(run, body, [partial(bind, item) for item in items], exact, frame)


def bind_names(run: Machine, names: list[str], value: Value, frame: Frame) -> None:
    """A structured binding."""
    for index, name in enumerate(names):
        parts = [a.items[index] for a in value if isinstance(a, Group) and index < len(a.items)]
        run.local(frame, name, join(*parts) if parts else unknown(f"the value of {name}"))


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
def for_statement(run: Machine, node: Node, frame: Frame) -> int:
    initializer = node.child_by_field_name("initializer")
    iterator = _iterator(node)
    if iterator is not None:
        return _over_iterator(run, node, *iterator, frame)
    if initializer is not None:
        run.execute(initializer, frame)
    return _counted(
        run, node, frame, node.child_by_field_name("condition"), node.child_by_field_name("update")
    )


def _iterator(node: Node) -> tuple[str, Node] | None:
    """Variable and container of ``for (auto it = c.begin(); it != c.end(); ++it)``."""
    condition = unwrapped(node.child_by_field_name("condition"))
    if condition is None or condition.type != "binary_expression":
        return None
    right = condition.child_by_field_name("right")
    callee = (
        right.child_by_field_name("function")
        if right is not None and right.type == "call_expression"
        else None
    )
    if (
        callee is None
        or callee.type != "field_expression"
        or text(callee.child_by_field_name("field")) not in _ENDINGS
    ):
        return None
    container = callee.child_by_field_name("argument")
    left = condition.child_by_field_name("left")
    return (
        (text(left), container)
        if container is not None and left is not None and left.type == "identifier"
        else None
    )


_ENDINGS = frozenset({"end", "cend", "rend", "crend"})


def _over_iterator(run: Machine, node: Node, name: str, container: Node, frame: Frame) -> int:
    """The iterator stands for the element that it points to."""
    items, exact = iterated(run, run.evaluate(container, frame), node, frame)
    exact = exact and node.child_by_field_name("update") is not None
    body = node.child_by_field_name("body")
    return _over(run, body, [partial(run.local, frame, name, item) for item in items], exact, frame)


@statement("while_statement")
def while_statement(run: Machine, node: Node, frame: Frame) -> int:
    return _counted(run, node, frame, node.child_by_field_name("condition"), None)


def _counted(run: Machine, node: Node, frame: Frame, condition: Node | None, update: Node | None) -> int:
    """As often as the condition is certainly true; after that any number of times."""
    body = node.child_by_field_name("body")
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
        before = {cell: run.store.before(cell, mark) for cell in changes}
        moved = {cell: value for cell, value in changes.items() if set(before[cell]) != set(value)}
        if not moved:
            break
        if round_ >= MAX_ROUNDS - 1:
            for cell, value in moved.items():
                run.store.set(cell, join(before[cell], unknown("a value that changes in a loop")) or value)
    return returns


@statement("do_statement")
def do_statement(run: Machine, node: Node, frame: Frame) -> int:
    body = node.child_by_field_name("body")
    start = run.store.mark()
    breaks: list[Changes] = []
    if body is None:
        return NEXT
    outcome = _iteration(run, body, frame, start, breaks)
    condition = node.child_by_field_name("condition")
    if outcome & NEXT and condition_value(run, unwrapped(condition), frame) is not False:
        outcome |= _repeated(run, body, None, unwrapped(condition), frame, start, breaks)
    run.settle(start, breaks, bool(outcome & NEXT))
    return (outcome & RETURN) | (NEXT if breaks or outcome & NEXT else 0)


# --- declarations ---------------------------------------------------------------------------------------------


@statement("declaration")
def declaration(run: Machine, node: Node, frame: Frame) -> int:
    written = type_text(node)
    for declarator in node.children_by_field_name("declarator"):
        if declarator.type == "function_declarator":
            _vexing(run, node, declarator, written, frame)
    for name, value, pointer in declared_names(node):
        if any(
            d.type == "function_declarator" and text(d).startswith(name)
            for d in node.children_by_field_name("declarator")
        ):
            continue
        structured = next((n for n in walk(node) if n.type == "structured_binding_declarator"), None)
        if structured is not None:
            names = [text(n) for n in structured.named_children if n.type == "identifier"]
            bind_names(run, names, run.evaluate(value, frame), frame)
            break
        kind = written + ("&" if pointer else "")
        found = declared_value(run, node, written, value, pointer, frame)
        run.local(frame, name, found, kind)
    structured = next((n for n in node.named_children if n.type == "init_declarator"
                       and any(c.type == "structured_binding_declarator" for c in walk(n))), None)  # fmt: skip
    if structured is not None:
        names = [text(n) for n in walk(structured) if n.type == "identifier" and n.parent is not None
                 and n.parent.type == "structured_binding_declarator"]  # fmt: skip
        bind_names(run, names, run.evaluate(structured.child_by_field_name("value"), frame), frame)
    return NEXT


def _vexing(run: Machine, node: Node, declarator: Node, written: str, frame: Frame) -> None:
    """``Listener l(buffer, this);`` reads as the declaration of a function."""
    name = text(declarator.child_by_field_name("declarator"))
    listed = text(declarator.child_by_field_name("parameters"))
    arguments = parse_expression(f"f{listed}")
    if arguments is None or arguments.type != "call_expression":
        return
    given = arguments.child_by_field_name("arguments")
    if not children(given):
        return
    found = declared_value(run, node, written, given, False, frame)
    run.local(frame, name, found, written)


@statement("using_declaration", "alias_declaration", "type_definition", "static_assert_declaration", "comment",
           "class_specifier", "struct_specifier", "enum_specifier", "namespace_alias_definition", "preproc_call",
           "preproc_def", "preproc_include", "template_declaration", "function_definition")  # fmt: skip
def nothing(run: Machine, node: Node, frame: Frame) -> int:
    if node.type in ("using_declaration", "alias_declaration", "type_definition"):
        _local_alias(run, node, frame)
    return NEXT


def _local_alias(run: Machine, node: Node, frame: Frame) -> None:
    inner = children(node)
    if node.type == "using_declaration":
        target = text(inner[-1]) if inner else ""
        if "namespace" in text(node).split():
            if target.lstrip(":") not in frame.file.using:
                frame.file.using.append(target.lstrip(":"))
            return
        bound = {target.rpartition("::")[2]: run.type_of(target, frame)}
    elif node.type == "type_definition":
        bound = {text(inner[-1]): run.type_of(text(node.child_by_field_name("type")), frame)}
    else:
        bound = {text(inner[0]): run.type_of(text(inner[-1]), frame)} if len(inner) > 1 else {}
    frame.bindings = {**frame.bindings, **bound}


__all__ = ["BOTTOM", "is_reference"]
