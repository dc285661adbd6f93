"""How statements run: declarations, conditions, loops, jumps."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence

from enclave_addons.inference.cpp.engine.frames import BREAK, CONTINUE, NEXT, RETURN, Frame, Loop, Variable
from enclave_addons.inference.cpp.engine.launch_values import decided, parameter_items, settled
from enclave_addons.inference.cpp.engine.machine import Machine, statement
from enclave_addons.inference.cpp.engine.objects import declare
from enclave_addons.inference.cpp.engine.places import begin, local, places_of
from enclave_addons.inference.cpp.engine.values import (
    Const,
    Group,
    Map,
    Obj,
    Param,
    Place,
    Pointer,
    Seq,
    Text,
    Unknown,
    Value,
    join,
    only,
    unknown,
)
from enclave_addons.inference.cpp.reading.collect import declared_names
from enclave_addons.inference.cpp.reading.declarations import function_declarator, type_text
from enclave_addons.inference.cpp.syntax import Node, children, field_of, parse_expression, text, unwrapped

MAX_TURNS = 64
"""Turns of a counted loop that run one by one."""


@statement("compound_statement", "declaration_list")
def _block(run: Machine, node: Node, frame: Frame) -> int:
    before = dict(frame.variables)
    outcome = sequence(run, children(node), frame)
    frame.variables = before
    return outcome


def sequence(run: Machine, nodes: Sequence[Node], frame: Frame) -> int:
    """Run statements one after another, as far as they go on."""
    outcome = NEXT
    for index, child in enumerate(nodes):
        outcome = (outcome & ~NEXT) | run.execute(child, frame)
        if not outcome & NEXT:
            for rest in nodes[index + 1 :]:
                run.kill(rest, frame, "what stands before it is always left")
            break
    return outcome


@statement("expression_statement")
def _expression(run: Machine, node: Node, frame: Frame) -> int:
    for child in children(node):
        run.evaluate(child, frame)
    return NEXT


@statement("attributed_statement", "labeled_statement", "else_clause", "linkage_specification", "ERROR")
def _inner(run: Machine, node: Node, frame: Frame) -> int:
    return sequence(run, [child for child in children(node) if child.type != "statement_identifier"], frame)


@statement("preproc_if", "preproc_ifdef", "preproc_elif", "preproc_else")
def _conditional_text(run: Machine, node: Node, frame: Frame) -> int:
    """Run both sides of what the preprocessor decides elsewhere."""
    other = field_of(node, "alternative")
    skipped = [field_of(node, "condition"), field_of(node, "name"), other]
    own = [child for child in children(node) if child not in skipped]
    if other is None:
        return run.branches([lambda: sequence(run, own, frame), lambda: NEXT])
    return run.branches([lambda: sequence(run, own, frame), lambda: run.execute(other, frame)])


@statement("static_assert_declaration", "namespace_alias_definition", "type_definition", "empty_statement",
           "class_specifier", "struct_specifier", "enum_specifier", "preproc_call", "preproc_def", "comment",
           "template_declaration", "friend_declaration", "preproc_include")  # fmt: skip
def _nothing(run: Machine, node: Node, frame: Frame) -> int:
    return NEXT


@statement("alias_declaration")
def _alias(run: Machine, node: Node, frame: Frame) -> int:
    name, target = text(field_of(node, "name")), text(field_of(node, "type"))
    frame.bindings = {**frame.bindings, name: run.type_of(target, frame)}
    return NEXT


@statement("using_declaration")
def _using(run: Machine, node: Node, frame: Frame) -> int:
    target = text(node.named_children[-1]) if node.named_children else ""
    if "namespace" not in text(node) and "::" in target:
        frame.bindings = {**frame.bindings, target.rpartition("::")[2]: run.type_of(target, frame)}
    return NEXT


@statement("declaration")
def _declaration(run: Machine, node: Node, frame: Frame) -> int:
    declarator = function_declarator(node)
    if declarator is not None:
        _object_like_a_function(run, node, declarator, frame)
        return NEXT
    first = field_of(node, "declarator")
    bound = _structured(first)
    if bound is not None and first is not None:
        _bind(run, bound, field_of(first, "value"), frame)
        return NEXT
    static = any(
        text(child) == "static" for child in node.named_children if child.type == "storage_class_specifier"
    )
    for name, value, pointer, written in declared_names(node):
        at = next((d for d in node.children_by_field_name("declarator") if _declares(d, name)), node)
        if "&" in text(at).partition("=")[0].partition(name)[0] and value is not None and not static:
            places = places_of(run, value, frame)
            if len(places) == 1:
                frame.variables[name] = Variable(places[0], written)
                continue
        if static:
            _static(run, name, written, pointer, value, at, frame)
            continue
        is_pointer = pointer and "*" in text(at).partition("=")[0]
        declare(run, name, written, is_pointer or pointer, value, at, frame)
    return NEXT


def _declares(declarator: Node, name: str) -> bool:
    return re.search(rf"\b{re.escape(name)}\b", text(declarator)[:200]) is not None


def _static(
    run: Machine, name: str, written: str, pointer: bool, value: Node | None, node: Node, frame: Frame
) -> None:
    """Declare a static variable: it has its first value only once."""
    place = Place(("static", f"{frame.file.file}:{node.start_byte}"))
    if place.cell not in run.store:
        inner = declare(run, name, written, pointer, value, node, frame)
        begin(run, place, run.store.get(inner.cell))
    frame.variables[name] = Variable(place, written)


def _structured(node: Node | None) -> list[str] | None:
    """Return the names of a structured binding."""
    while node is not None and node.type in ("init_declarator", "reference_declarator"):
        node = field_of(node, "declarator") or next(iter(children(node)), None)
    if node is None or node.type != "structured_binding_declarator":
        return None
    return [text(child) for child in children(node)]


def _bind(run: Machine, bound: list[str], value: Node | None, frame: Frame) -> None:
    given = run.evaluate(value, frame)
    _bind_value(run, bound, given, value, frame)


def _bind_value(run: Machine, bound: list[str], value: Value, node: Node | None, frame: Frame) -> None:
    for index, name in enumerate(bound):
        found: list[Value] = []
        for atom in value:
            if isinstance(atom, Group | Seq) and index < len(atom.items):
                found.append(atom.items[index])
            elif isinstance(atom, Obj) and atom.cls is not None:
                fields = [f for f, member in atom.cls.fields.items() if not member.static]
                found.append(
                    run.store.get((atom, fields[index])) if index < len(fields) else unknown("a part")
                )
            else:
                found.append(unknown("a part of something that is not known"))
        if node is not None:
            local(run, frame, name, node, join(*found))


def _object_like_a_function(run: Machine, node: Node, declarator: Node, frame: Frame) -> None:
    """Declare ``Foo foo(bar);``, which reads as a function."""
    name = text(field_of(declarator, "declarator"))
    written = text(field_of(declarator, "parameters"))
    call = parse_expression(f"f{written}")
    if not name or call is None:
        return
    run.handle(declarator, frame)
    declare(run, name, type_text(node), False, field_of(call, "arguments"), node, frame)


# --- conditions ---------------------------------------------------------------------------------------------------


def condition_of(run: Machine, node: Node | None, frame: Frame) -> Value:
    """Return the value of a condition, which may declare a variable."""
    if node is None:
        return (True,)
    if node.type == "condition_clause":
        initial = field_of(node, "initializer")
        if initial is not None:
            run.execute(initial, frame)
        node = field_of(node, "value") or next(reversed(children(node)), None)
    if node is not None and node.type == "declaration":
        run.execute(node, frame)
        names = declared_names(node)
        return run.store.get(frame.variables[names[0].name].place.cell) if names else unknown("a condition")
    value = run.evaluate(unwrapped(node), frame)
    return value


@statement("if_statement")
def _if(run: Machine, node: Node, frame: Frame) -> int:
    before = dict(frame.variables)
    test = decided(run, condition_of(run, field_of(node, "condition"), frame))
    yes, no = field_of(node, "consequence"), field_of(node, "alternative")
    why = f"the condition {_shown(field_of(node, 'condition'))} is always {'true' if test else 'false'}"
    if test is not None:
        run.kill(no if test else yes, frame, why)
        outcome = run.execute(yes if test else no, frame)
    else:
        outcome = run.branches([lambda: run.execute(yes, frame), lambda: run.execute(no, frame)])
    frame.variables = before
    return outcome


def _shown(node: Node | None) -> str:
    return " ".join(text(node).split())[:60]


@statement("switch_statement")
def _switch(run: Machine, node: Node, frame: Frame) -> int:
    value = settled(run, condition_of(run, field_of(node, "condition"), frame))
    cases = [child for child in children(field_of(node, "body")) if child.type == "case_statement"]
    chosen = only(value)
    if chosen is not None and not isinstance(chosen, Unknown | Param | Text):
        labels = [
            only(run.evaluate(field_of(case, "value"), frame)) if field_of(case, "value") else None
            for case in cases
        ]
        if all(isinstance(label, int | Const) or label is None for label in labels) and isinstance(
            chosen, int | Const
        ):
            start = (
                labels.index(chosen)
                if chosen in labels
                else labels.index(None)
                if None in labels
                else len(cases)
            )
            for case in cases[:start]:
                run.kill(case, frame, "the switch goes to another case")
            return _in_loop(run, frame, lambda: _from_case(run, cases[start:], frame))
    ways = [lambda index=index: _from_case(run, cases[index:], frame) for index in range(len(cases))]
    has_default = any(field_of(case, "value") is None for case in cases)
    more: list[Callable[[], int]] = [] if has_default else [lambda: NEXT]
    return _in_loop(run, frame, lambda: run.branches([*ways, *more]))


def _from_case(run: Machine, cases: Sequence[Node], frame: Frame) -> int:
    before = dict(frame.variables)
    listed = [s for case in cases for s in children(case) if s != field_of(case, "value")]
    outcome = NEXT
    for each in listed:
        outcome = (outcome & ~NEXT) | run.execute(each, frame)
        if not outcome & NEXT:
            break
    frame.variables = before
    return outcome


@statement("try_statement")
def _try(run: Machine, node: Node, frame: Frame) -> int:
    body = field_of(node, "body") or next((c for c in children(node) if c.type == "compound_statement"), None)
    clauses = [child for child in children(node) if child.type == "catch_clause"]
    mark = run.store.mark()
    outcome = run.execute(body, frame)
    going = [lambda: NEXT] if outcome & NEXT else []

    def caught(clause: Node) -> int:
        run.store.blur(mark)
        return run.execute(field_of(clause, "body"), frame)

    return (outcome & ~NEXT) | run.branches([*going, *(lambda each=each: caught(each) for each in clauses)])


@statement("throw_statement", "co_return_statement")
def _throw(run: Machine, node: Node, frame: Frame) -> int:
    for child in children(node):
        run.evaluate(child, frame)
    return 0


@statement("return_statement")
def _return(run: Machine, node: Node, frame: Frame) -> int:
    given = children(node)
    if given:
        frame.returned = join(frame.returned, run.evaluate(given[0], frame))
    frame.exits.append(run.store.changes(frame.mark))
    return RETURN


@statement("break_statement")
def _break(run: Machine, node: Node, frame: Frame) -> int:
    if frame.loops:
        frame.loops[-1].breaks.append(run.store.changes(frame.loops[-1].mark))
    return BREAK


@statement("continue_statement")
def _continue(run: Machine, node: Node, frame: Frame) -> int:
    for loop in reversed(frame.loops):
        loop.continues.append(run.store.changes(loop.mark))
        break
    return CONTINUE


@statement("goto_statement")
def _goto(run: Machine, node: Node, frame: Frame) -> int:
    run.gap(node, frame, "a function with goto is not followed")
    return NEXT


# --- loops --------------------------------------------------------------------------------------------------------


def _in_loop(run: Machine, frame: Frame, body: Callable[[], int]) -> int:
    """Run what ``break`` leaves: the state behind it is that of any way out."""
    loop = Loop(run.store.mark())
    frame.loops.append(loop)
    outcome = body()
    frame.loops.pop()
    run.store.settle(loop.mark, [*loop.breaks, *loop.continues], bool(outcome & NEXT))
    left = outcome & (BREAK | CONTINUE | NEXT)
    return (outcome & RETURN) | (NEXT if left else 0)


def _turn(
    run: Machine, node: Node, frame: Frame, key: object, begin: Callable[[], None], body: Node | None
) -> int:
    """Run one turn of a loop; return how it ended, ``BREAK`` only where it certainly did."""
    path, before = frame.path, dict(frame.variables)
    frame.path = run.path(path, node.start_byte, key)
    loop = Loop(run.store.mark())
    frame.loops.append(loop)
    begin()
    outcome = run.execute(body, frame)
    frame.loops.pop()
    going = bool(outcome & NEXT)
    if loop.continues:
        run.store.settle(loop.mark, loop.continues, going)
        outcome = (outcome & ~CONTINUE) | NEXT
        going = True
    if loop.breaks:
        run.store.settle(loop.mark, loop.breaks, going)
        outcome = (outcome & ~BREAK) | (NEXT if going else BREAK)
    frame.path, frame.variables = path, before
    return outcome


def repeated(run: Machine, node: Node, frame: Frame, begin: Callable[[], None], body: Node | None) -> int:
    """Run a loop of which it is not known how often: until nothing changes, then with what changes not known."""
    returns = 0
    run.repeated += 1
    for round_ in range(4):
        mark = run.store.mark()
        gone = run.branches([lambda: _turn(run, node, frame, "any", begin, body), lambda: NEXT])
        returns |= gone & RETURN
        moved = run.store.moved(mark)
        if not moved:
            break
        if round_ == 2:
            for cell in moved:
                run.store.set(cell, loosened(run.store.get(cell), "a value that a loop changes"))
    run.repeated -= 1
    return returns | NEXT


def loosened(value: Value, why: str) -> Value:
    """Return a value that goes on changing: its texts and numbers are not known, its lists have no order."""
    lost = (unknown(why) if isinstance(a, Text | int | float | Param) else (_opened(a, why),) for a in value)
    return join(*lost)


def _opened(atom: object, why: str) -> object:
    if isinstance(atom, Seq):
        return Seq(tuple(dict.fromkeys(loosened(item, why) for item in atom.items)), True)
    return atom._replace(open=True) if isinstance(atom, Map) else atom


@statement("for_range_loop")
def _for_each(run: Machine, node: Node, frame: Frame) -> int:
    before = dict(frame.variables)
    initial = field_of(node, "initializer")
    if initial is not None:
        run.execute(initial, frame)
    declared, right = field_of(node, "declarator"), field_of(node, "right")
    subject = run.evaluate(right, frame)
    bound = _structured(declared)
    refers = "&" in text(declared) and "const" not in text(node).partition(":")[0]
    places = places_of(run, right, frame) if refers and bound is None else []
    name = re.findall(r"\w+", text(declared))[-1:] if bound is None else []
    written = type_text(node)

    def begin(item: Value, step: object) -> Callable[[], None]:
        def bind() -> None:
            if bound is not None:
                _bind_value(run, bound, item, declared, frame)
            elif name and len(places) == 1 and not any(isinstance(a, Param | Obj) for a in subject):
                frame.variables[name[0]] = Variable(
                    places[0]._replace(steps=(*places[0].steps, step)), written
                )
            elif name and declared is not None:
                local(run, frame, name[0], declared, item, written if written != "auto" else "")

        return bind

    items, exact = iterated(run, subject)
    body = field_of(node, "body")
    outcome = _over(run, node, frame, items, exact, begin, body)
    frame.variables = before
    return outcome


def _over(
    run: Machine, node: Node, frame: Frame, items: Sequence[tuple[object, Value]], exact: bool,
    begin_turn: Callable[[Value, object], Callable[[], None]], body: Node | None,
) -> int:  # fmt: skip
    """Run a turn for each of the elements of a list, in their order if that is known."""
    if exact and len(items) <= MAX_TURNS * 2:
        if not items:
            run.kill(body, frame, "the list that the loop runs over is empty")
        returns = 0
        for index, (step, item) in enumerate(items):
            outcome = _turn(run, node, frame, index, begin_turn(item, step), body)
            returns |= outcome & RETURN
            if not outcome & NEXT:
                return returns | (NEXT if outcome & BREAK else 0)
        return returns | NEXT
    returns = 0
    whole = items or [("any", unknown("an element of something that is not known"))]
    for step, item in whole[:MAX_TURNS]:
        returns |= repeated(run, node, frame, begin_turn(item, step), body)
    return returns | NEXT


def iterated(run: Machine, subject: Value) -> tuple[list[tuple[object, Value]], bool]:
    """Return what a loop over ``subject`` goes through, with the steps there, and whether that is exactly known."""
    found: list[tuple[object, Value]] = []
    exact = len(subject) == 1
    for atom in subject:
        if isinstance(atom, Seq | Group):
            is_exact = not getattr(atom, "open", False)
            found += [(index if is_exact else "any", item) for index, item in enumerate(atom.items)]
            if not is_exact and not atom.items:
                found.append(("any", unknown("an element of a list")))
            exact = exact and is_exact
        elif isinstance(atom, Map):
            found += [(key, (Group((key, value)),)) for key, value in atom.entries]
            exact = exact and not atom.open
        elif isinstance(atom, Param):
            items, is_exact = parameter_items(run, atom)
            found += list(enumerate(items))
            exact = exact and is_exact
        else:
            why = atom.why if isinstance(atom, Unknown) else "an element of something that is not known"
            found.append(("any", unknown(why)))
            exact = False
    return found, exact


@statement("for_statement")
def _for(run: Machine, node: Node, frame: Frame) -> int:
    before = dict(frame.variables)
    over = _iterators(run, node, frame)
    if over is not None:
        outcome = _over(run, node, frame, *over, field_of(node, "body"))
        frame.variables = before
        return outcome
    initial = field_of(node, "initializer")
    if initial is not None:
        run.execute(initial, frame)
    outcome = _counted(
        run, node, frame, field_of(node, "condition"), field_of(node, "update"), field_of(node, "body")
    )
    frame.variables = before
    return outcome


_ITERATOR = re.compile(r"(\w+)\s*=\s*(?:std::)?(?:(.+?)(?:\.|->)c?r?begin\(\)|c?begin\((.+?)\))\s*$")


def _iterators(
    run: Machine, node: Node, frame: Frame
) -> tuple[list[tuple[object, Value]], bool, Callable[[Value, object], Callable[[], None]]] | None:
    """Return the elements of ``for (auto it = x.begin(); ...; ++it)``: the iterator stands for its element."""
    initial = field_of(node, "initializer")
    matched = _ITERATOR.search(text(initial).rstrip("; \n")) if initial is not None else None
    if matched is None or "end()" not in text(field_of(node, "condition")):
        return None
    written = matched[2] or matched[3]
    call = parse_expression(written)
    if call is None or initial is None:
        return None
    place = next((n for n in _all_calls(initial) if text(n) == written), None)
    subject = run.evaluate(place if place is not None else call, frame)
    places = places_of(run, place, frame) if place is not None else []
    name = matched[1]

    def begin(item: Value, step: object) -> Callable[[], None]:
        def bind() -> None:
            if len(places) == 1 and not any(isinstance(a, Map | Param) for a in subject):
                at = places[0]._replace(steps=(*places[0].steps, step))
                if not any(isinstance(atom, Obj) for atom in item):
                    local(run, frame, name, initial, (Pointer(at),))
                    return
            local(run, frame, name, initial, item)

        return bind

    items, exact = iterated(run, subject)
    return items, exact, begin


def _all_calls(node: Node) -> list[Node]:
    found, waiting = [], [node]
    while waiting:
        each = waiting.pop()
        found.append(each)
        waiting += each.named_children
    return found


def _counted(
    run: Machine, node: Node, frame: Frame, test: Node | None, update: Node | None, body: Node | None
) -> int:
    """Run a loop turn by turn while its condition is known, else as often as it may run."""
    returns = 0
    for turn in range(MAX_TURNS):
        value = decided(run, condition_of(run, test, frame)) if test is not None else True
        if value is False:
            if turn == 0:
                run.kill(body, frame, f"the condition {_shown(test)} does not hold")
            return returns | NEXT
        if value is None or (test is None and turn) or _is_endless(test):
            break
        outcome = _turn(run, node, frame, turn, lambda: None, body)
        returns |= outcome & RETURN
        if not outcome & NEXT:
            return returns | (NEXT if outcome & BREAK else 0)
        if update is not None:
            run.evaluate(update, frame)
    changed = _changed_by(update)
    for name in changed:
        variable = frame.variables.get(name)
        if variable is not None:
            run.store.set(variable.place.cell, unknown("a number that a loop counts"))

    def begin() -> None:
        if test is not None:
            condition_of(run, test, frame)

    return returns | repeated(run, node, frame, begin, body)


def _is_endless(test: Node | None) -> bool:
    return text(unwrapped(test)) in ("true", "1")


def _changed_by(update: Node | None) -> list[str]:
    return re.findall(r"[A-Za-z_]\w*", text(update)) if update is not None else []


@statement("while_statement")
def _while(run: Machine, node: Node, frame: Frame) -> int:
    before = dict(frame.variables)
    outcome = _counted(run, node, frame, field_of(node, "condition"), None, field_of(node, "body"))
    frame.variables = before
    return outcome


@statement("do_statement")
def _do(run: Machine, node: Node, frame: Frame) -> int:
    outcome = _turn(run, node, frame, "first", lambda: None, field_of(node, "body"))
    if not outcome & NEXT:
        return (outcome & RETURN) | (NEXT if outcome & BREAK else 0)
    return (outcome & RETURN) | _counted(
        run, node, frame, field_of(node, "condition"), None, field_of(node, "body")
    )
