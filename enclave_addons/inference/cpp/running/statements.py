"""How statements run: blocks, branches, declarations."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import partial

from enclave_addons.inference.cpp.libraries import is_harmless_class
from enclave_addons.inference.cpp.reading.collect import declared_names
from enclave_addons.inference.cpp.reading.declarations import type_text
from enclave_addons.inference.cpp.reading.writes import writes_of
from enclave_addons.inference.cpp.running.constructors import (
    as_result,
    declared_value,
    fields_of,
    gives_pointer,
)
from enclave_addons.inference.cpp.running.contents import copied, elements_copied
from enclave_addons.inference.cpp.running.launch_values import decided, in_doubt, settled
from enclave_addons.inference.cpp.running.left_out import forget_writes
from enclave_addons.inference.cpp.running.machine import (
    BREAK,
    CONTINUE,
    NEXT,
    RETURN,
    Frame,
    Loop,
    Machine,
    StatementHandler,
    statement,
)
from enclave_addons.inference.cpp.running.memory import Changes
from enclave_addons.inference.cpp.running.references import bind_reference
from enclave_addons.inference.cpp.running.static_types import seen_type, tested
from enclave_addons.inference.cpp.running.values import (
    BOTTOM,
    Const,
    Group,
    Map,
    Obj,
    Seq,
    Text,
    Value,
    join,
    plain,
    unknown,
)
from enclave_addons.inference.cpp.running.variables import member
from enclave_addons.inference.cpp.syntax import (
    Node,
    children,
    field_of,
    last_name,
    parse_expression,
    text,
    unwrapped,
    walk,
)


def in_a_block(handler: StatementHandler) -> StatementHandler:
    """Names that the statement declares end with it; what they stood for before is back."""

    def run_block(run: Machine, node: Node, frame: Frame) -> int:
        loops = [(loop, len(loop.breaks), len(loop.continues)) for loop in frame.loops]
        bindings = frame.bindings
        frame.blocks.append({})
        outcome = handler(run, node, frame)
        frame.bindings = bindings
        for name, (existed, value, written, refers) in frame.blocks.pop().items():
            frame.references.discard(name)
            if refers:
                frame.references.add(name)
            if not existed:
                frame.names.discard(name)
                continue
            for loop, breaks, continues in loops:
                for changes in (*loop.breaks[breaks:], *loop.continues[continues:]):
                    if (frame, name) in changes:
                        changes[(frame, name)] = value
            run.store.set((frame, name), value)
            frame.types[name] = written or ""
        return outcome

    return run_block


@statement("compound_statement")
def braces(run: Machine, node: Node, frame: Frame) -> int:
    """Names declared inside end here; those in the body of a function stay in its frame."""
    parent = node.parent
    if parent is None or parent.type in ("function_definition", "lambda_expression"):
        jumps = _JUMP.search(text(node)) and next((n for n in walk(node) if n.type == "goto_statement"), None)
        return _not_followed(run, node, jumps, frame) if jumps else block(run, node, frame)
    return _inner_block(run, node, frame)


_JUMP = re.compile(r"\bgoto\b")


def _not_followed(run: Machine, body: Node, jump: Node, frame: Frame) -> int:
    """Leave a function out that uses ``goto``: a gap if it may make interfaces; what it may write is not known."""
    why = f"{text(jump).rstrip(';')}: what this function does is not followed"
    if run.subtree_matters(body):
        run.gap(jump, frame, why)
    if frame.function is not None:
        forget_writes(run, frame.function)
    for name in sorted(writes_of(body)):
        owner = frame.owner_of(name)
        run.store.lose((*run.store.named(name), *([(owner, name)] if owner else ())), why)
    frame.returned = unknown(why)
    return NEXT


@statement("declaration_list", "case_statement", "labeled_statement", "preproc_else", "else_clause")
def block(run: Machine, node: Node, frame: Frame) -> int:
    """Run the children in order, without a scope of their own."""
    return sequence(run, children(node), frame)


_inner_block = in_a_block(block)


def sequence(run: Machine, listed: list[Node], frame: Frame) -> int:
    """Runs statements until one certainly leaves; those behind it are dead. Gives every way out."""
    outcome, skips = NEXT, run.skips
    for index, child in enumerate(listed):
        result = run.execute(child, frame)
        outcome = (outcome & ~NEXT) | result
        if not result & NEXT:
            for rest in listed[index + 1 :]:
                run.kill(rest, frame, "it stands behind a return, break or throw")
            break
        run.skips += result != NEXT
    run.skips = skips
    return outcome


@statement("expression_statement")
def expression_statement(run: Machine, node: Node, frame: Frame) -> int:
    """Evaluates it; leaves like a return where a call certainly throws or ends the program."""
    if "=" in text(node) and any(child.is_error and text(child) == ")" for child in node.children):
        run.gap(node, frame, "this C++ could not be parsed, and writes something")  # ``f((a = b, c), d);``
    for child in children(node):
        run.evaluate(child, frame)
        if run.left or (child.type == "call_expression" and _ends_program(run, child, frame)):
            return RETURN
    return NEXT


def _ends_program(run: Machine, call: Node, frame: Frame) -> bool:
    return run.names.ends_program(f"{text(field_of(call, 'function'))}(", frame.function)


@statement("return_statement", "co_return_statement")
def return_statement(run: Machine, node: Node, frame: Frame) -> int:
    """Adds the value and what was written to the ways out of the call."""
    value = BOTTOM
    for child in children(node):
        value = as_result(run, child, frame)
        if frame.function is not None and type_text(frame.function.node) == "bool":
            value = tested(run, child, value, frame)
        value = _as_given_back(run, child, value, frame)
    if run.left:
        return RETURN
    frame.returned = join(frame.returned, value)
    frame.exits.append(run.store.changes(frame.mark))
    return RETURN


def _as_given_back(run: Machine, given: Node, value: Value, frame: Frame) -> Value:
    """Copy what a function gives back by value, unless it is a variable of its own or made for it."""
    around = given.parent
    while around is not None and around.type not in ("function_definition", "lambda_expression"):
        around = around.parent
    declarator = field_of(around, "declarator")
    behind = next((text(each) for each in children(declarator) if each.type == "trailing_return_type"), "")
    written = behind.removeprefix("->").strip() or (type_text(around) if around is not None else "")
    if (
        declarator is None
        or not declarator.type.endswith("function_declarator")
        or _is_made_here(run, given, frame)
    ):
        return value
    if written.endswith(("&", "*")) or "decltype" in written:
        return value
    by_auto = written in ("", "auto")
    kind = seen_type(run, given, frame) if by_auto else run.type_of(written, frame)
    if kind.pointer or (by_auto and gives_pointer(run, given)):
        return value
    cls = run.class_of(kind, frame) if kind.name else None
    if any(isinstance(atom, Seq | Map) for atom in value):
        return elements_copied(run, kind, value, given, frame)
    return copied(run, value, given, frame, cls) if cls is not None else value


def _is_made_here(run: Machine, given: Node, frame: Frame) -> bool:
    """Return whether it is a variable of the function itself, or an object that a call or braces make."""
    inner = unwrapped(given)
    if inner is None or inner.type == "identifier":
        name = text(inner)
        return name in frame.names and not frame.types.get(name, "").endswith(("&", "*"))
    if inner.type == "call_expression":
        name = last_name(field_of(inner, "function"))
        listed = run.names.functions_by_name.get(name, ())
        declarators = [field_of(each.node, "declarator") for each in listed]
        by_value = all(each is not None and each.type == "function_declarator" for each in declarators)
        return name in run.names.classes or (bool(listed) and by_value)
    return inner.type in ("compound_literal_expression", "initializer_list", "lambda_expression")


@statement("throw_statement")
def throw_statement(run: Machine, node: Node, frame: Frame) -> int:
    """Leave like a return, but add nothing to what the call gives back."""
    for child in children(node):
        run.evaluate(child, frame)
    return RETURN


@statement("break_statement")
def break_statement(run: Machine, node: Node, frame: Frame) -> int:
    """Keeps what was written for the end of the innermost loop or switch."""
    if frame.loops:
        frame.loops[-1].breaks.append(run.store.changes(frame.loops[-1].start))
    return BREAK


@statement("continue_statement")
def continue_statement(run: Machine, node: Node, frame: Frame) -> int:
    """Keeps what was written for the end of this turn of the innermost loop, past any switch."""
    loops = [loop for loop in frame.loops if not isinstance(loop, _Switch)]
    if loops:
        loops[-1].continues.append(run.store.changes(loops[-1].mark))
    return CONTINUE


class _Switch(Loop):
    pass


@statement("if_statement")
@in_a_block
def if_statement(run: Machine, node: Node, frame: Frame) -> int:
    """Run the side that the condition chooses, the other one dead; both, joined, if that is not decided."""
    condition = field_of(node, "condition")
    for child in children(condition):
        for inner in children(child) if child.type == "init_statement" else ():
            run.execute(inner, frame)
    subject = condition_of(run, condition, frame)
    if run.left:
        return RETURN
    value = decided(run, subject)
    then, other = field_of(node, "consequence"), field_of(node, "alternative")
    if value is None:
        sides = [partial(run.execute, side, frame) for side in (then, other)]
        return run.branches(sides, tested=True, doubt=in_doubt(subject))
    always = "always" if value else "never"
    run.kill(other if value else then, frame, f"the condition {text(condition)[:60]} is {always} true")
    return run.execute(then if value else other, frame)


def condition_of(run: Machine, condition: Node | None, frame: Frame) -> Value:
    """Run a condition and return what is tested: of one that declares, its variable."""
    inner = (
        field_of(condition, "value")
        if condition is not None and condition.type == "condition_clause"
        else condition
    )
    if inner is not None and inner.type == "declaration":
        run.execute(inner, frame)
        declared = field_of(inner, "declarator") or inner
        named = [each for each in walk(declared) if each.type == "identifier"]
        held = (run.store.get((frame, text(named[0]))) or BOTTOM) if named else BOTTOM
        return tested(run, named[0], held, frame) if named else BOTTOM
    return tested(run, inner, run.evaluate(inner, frame), frame)


@statement("preproc_if", "preproc_ifdef", "preproc_elif")
def preprocessor_branches(run: Machine, node: Node, frame: Frame) -> int:
    """Run a conditional that only the build decides: either side, or neither."""
    alternative = field_of(node, "alternative")
    head = (field_of(node, "condition"), field_of(node, "name"), alternative)
    own = [child for child in children(node) if child not in head]
    return run.branches([partial(sequence, run, own, frame), partial(run.execute, alternative, frame)])


@statement("switch_statement")
@in_a_block
def switch_statement(run: Machine, node: Node, frame: Frame) -> int:
    """Run the case that is chosen and those it falls through to; any of the cases if that is not decided."""
    condition = field_of(node, "condition")
    subject = settled(run, run.evaluate(field_of(condition, "value") or unwrapped(condition), frame))
    if run.left:
        return RETURN
    cases = [c for c in children(field_of(node, "body")) if c.type == "case_statement"]
    chosen = _chosen_case(run, node, cases, subject, frame)
    loop = _Switch(run.store.mark(), run.steps)
    frame.loops.append(loop)
    starts = range(len(cases)) if chosen is None else chosen
    certain = chosen is not None
    sides: list[Callable[[], int]] = [partial(_falling, run, cases[at:], certain, frame) for at in starts]
    if not sides or (chosen is None and all(field_of(case, "value") is not None for case in cases)):
        sides.append(lambda: NEXT)
    outcome = run.branches(sides, tested=len(sides) > 1)
    frame.loops.pop()
    run.settle(loop.start, loop.breaks, bool(outcome & NEXT))
    if outcome & BREAK:
        outcome = (outcome & ~BREAK) | NEXT
    for case in cases[: min(chosen, default=0)] if chosen is not None else ():
        run.kill(case, frame, "the switch never takes this case")
    return outcome


def _chosen_case(
    run: Machine, switch: Node, cases: list[Node], subject: Value, frame: Frame
) -> list[int] | None:
    """Return the case of this enumerator or number, none if there is none; ``None`` if that is not decided."""
    listed = [each for each in walk(switch) if each.type == "case_statement"]
    default = [index for index, case in enumerate(cases) if field_of(case, "value") is None]
    labels = [run.evaluate(field_of(case, "value"), frame) for case in cases]
    known = [subject, *(label for index, label in enumerate(labels) if index not in default)]
    if len(listed) != len(cases) or not all(len(v) == 1 and _is_label(v[0]) for v in known):
        return None
    if len({type(value[0]) for value in known}) > 1:
        return None
    return ([index for index, label in enumerate(labels) if label == subject] or default)[:1]


def _is_label(atom: object) -> bool:
    """Return whether it is an enumerator, a number or a letter."""
    return isinstance(atom, Const | int) or (isinstance(atom, Text) and plain(atom) is not None)


def _falling(run: Machine, cases: list[Node], certain: bool, frame: Frame) -> int:
    outcome = NEXT
    for index, case in enumerate(cases):
        value = field_of(case, "value")
        result = sequence(run, [child for child in children(case) if child != value], frame)
        outcome = (outcome & ~NEXT) | result
        if not result & NEXT:
            for rest in cases[index + 1 :] if certain else ():
                run.kill(rest, frame, "the switch never takes this case")
            break
    return outcome


@statement("try_statement")
def try_statement(run: Machine, node: Node, frame: Frame) -> int:
    """Runs the body, and after it none or any one of the catch clauses, which may find it half done."""
    outcome, held = run.store.held_during(partial(run.execute, field_of(node, "body"), frame))
    catches = [child for child in children(node) if child.type == "catch_clause"]
    after: list[Callable[[], int]] = [lambda: outcome]
    doubt = "" if outcome & NEXT else "what is left where an exception was thrown"
    caught = (partial(_caught, run, clause, held, doubt, frame) for clause in catches)
    return run.branches([*after, *caught], tested=True)


def _caught(run: Machine, clause: Node, held: Changes, doubt: str, frame: Frame) -> int:
    run.store.merge([{}, held], doubt)
    return _catch_clause(run, clause, frame)


@in_a_block
def _catch_clause(run: Machine, clause: Node, frame: Frame) -> int:
    for each in (n for n in walk(clause) if n.type == "parameter_declaration"):
        declared = field_of(each, "declarator")
        if declared is not None:
            run.local(frame, text(declared).lstrip("&* "), unknown("an exception"))
    return run.execute(field_of(clause, "body"), frame)


# --- declarations ---------------------------------------------------------------------------------------------


@statement("declaration")
def declaration(run: Machine, node: Node, frame: Frame) -> int:
    """Set the variables, also static ones, structured bindings and ``Foo f(a);`` read as a function."""
    declarators = node.children_by_field_name("declarator")
    functions = [declarator for declarator in declarators if declarator.type == "function_declarator"]
    for declarator in functions:
        _vexing(run, node, declarator, frame)
    structured = _structured(declarators)
    if structured is not None:
        names = [text(each) for each in children(structured[0]) if each.type == "identifier"]
        bind_names(run, names, run.evaluate(structured[1], frame), frame)
        kind = text(node).partition("[")[0].strip()
        for name in names:
            frame.initial[name], frame.types[name] = structured[1], kind
            bind_reference(run, name, kind, structured[1], frame)
        return RETURN if run.left else NEXT
    path = frame.path
    for name, value, pointer, written in declared_names(node):
        if any(text(each).startswith(name) for each in functions):
            continue
        fixed = not pointer and any(text(each) in ("const", "constexpr") for each in children(node))
        kind = ("const " if fixed else "") + written + (_marks(node) if pointer else "")
        initial = partial(declared_value, run, node, written, value, pointer, frame)
        if _is_static(node):
            _static_local(run, node, name, kind, initial, frame)
        else:
            # Each variable is an object of its own.
            frame.path = (*path, name) if len(declarators) > 1 else path
            run.local(frame, name, initial(), kind)
            frame.path, frame.initial[name] = path, value
            bind_reference(run, name, kind, value, frame)
    return RETURN if run.left else NEXT


def _structured(declarators: Sequence[Node]) -> tuple[Node, Node | None] | None:
    """Return the names of ``auto & [a, b] = value`` and the value."""
    for declarator in declarators:
        inner: Node | None = declarator
        if declarator.type == "init_declarator":
            inner = field_of(declarator, "declarator")
        while inner is not None and inner.type == "reference_declarator":
            inner = children(inner)[-1]
        if inner is not None and inner.type == "structured_binding_declarator":
            return inner, field_of(declarator, "value")
    return None


def _marks(node: Node) -> str:
    """Return ``*``, ``&`` or, for a reference to a pointer, ``*&``."""
    found = [each for each in walk(node) if each.type in ("pointer_declarator", "reference_declarator")]
    pointers = [each for each in found if each.type == "pointer_declarator"]
    inner = field_of(pointers[0], "declarator") if pointers else None
    if inner is not None and inner.type == "reference_declarator":
        return "*&"
    return "*" if pointers else "&"


def _is_static(node: Node) -> bool:
    return any(
        text(child) == "static" for child in node.named_children if child.type == "storage_class_specifier"
    )


def _static_local(
    run: Machine, node: Node, name: str, kind: str, initial: Callable[[], Value], frame: Frame
) -> None:
    """Make a variable once; it keeps its value from call to call."""
    key = ("static", frame.file.file, node.start_byte, name, str(sorted(frame.bindings.items())))
    kept = run.frames.setdefault(key, Frame(frame.file, frame.scope, lasts=True))
    if run.store.get((kept, name)) is None:
        run.local(kept, name, initial(), kind)
    frame.names.discard(name)
    frame.kept[name] = kept


def _vexing(run: Machine, node: Node, declarator: Node, frame: Frame) -> None:
    """Handle ``Listener l(buffer, this);``, which reads as the declaration of a function."""
    arguments = parse_expression(f"f{text(field_of(declarator, 'parameters'))}")
    given = field_of(arguments, "arguments")
    if arguments is not None and arguments.type == "call_expression" and children(given):
        written, name = type_text(node), text(field_of(declarator, "declarator"))
        initial = partial(declared_value, run, node, written, given, False, frame)
        if _is_static(node):
            _static_local(run, node, name, written, initial, frame)
            return
        path = frame.path
        if len(node.children_by_field_name("declarator")) > 1:
            frame.path = (*path, name)  # each variable is an object of its own
        found = initial()
        frame.path = path
        if any(
            isinstance(each, Obj) and each.cls is None and not is_harmless_class(each.type.name)
            for each in found
        ):
            run.calls.may_be_written(run, f"the constructor of {written}", [], children(given), frame)
        run.local(frame, name, found, written)
        frame.initial[name] = given
        bind_reference(run, name, written, given, frame)


@statement("using_declaration", "alias_declaration", "type_definition", "static_assert_declaration", "comment",
           "class_specifier", "struct_specifier", "enum_specifier", "namespace_alias_definition", "preproc_call",
           "preproc_def", "preproc_include", "template_declaration", "function_definition")  # fmt: skip
def nothing(run: Machine, node: Node, frame: Frame) -> int:
    """Runs nothing; ``using``, aliases and typedefs change what names of types mean from here on."""
    if node.type in ("using_declaration", "alias_declaration", "type_definition"):
        _local_alias(run, node, frame)
    if node.type == "enum_specifier":
        for each in children(field_of(node, "body")):
            name = text(field_of(each, "name"))
            run.local(frame, name, (Const(f"{name} in line {node.start_point[0] + 1}"),))
    return NEXT


def _local_alias(run: Machine, node: Node, frame: Frame) -> None:
    inner = children(node)
    if node.type == "using_declaration":
        target = text(inner[-1]) if inner else ""
        if "namespace" in text(node).split():  # counts for the whole file (``FileIndex.using``)
            return
        bound = {target.rpartition("::")[2]: run.type_of(target, frame)}
    elif node.type == "type_definition":
        bound = {text(inner[-1]): run.type_of(text(field_of(node, "type")), frame)}
    else:
        bound = {text(inner[0]): run.type_of(text(inner[-1]), frame)} if len(inner) > 1 else {}
    frame.bindings = {**frame.bindings, **bound}


def bind_names(run: Machine, names: list[str], value: Value, frame: Frame) -> None:
    """Bind the names of a structured binding."""
    for index, name in enumerate(names):
        parts = [part for atom in value for part in _bound_part(run, atom, index)]
        run.local(frame, name, join(*parts) if parts else unknown(f"the value of {name}"))


def _bound_part(run: Machine, atom: object, index: int) -> list[Value]:
    """Return what the name at ``index`` is bound to: an element, or a member of a structure."""
    if isinstance(atom, Group | Seq):
        exact = not (isinstance(atom, Seq) and atom.open) and index < len(atom.items)
        return [atom.items[index]] if exact else list(atom.items)
    if isinstance(atom, Obj) and atom.cls is not None:
        fields = fields_of(atom.cls)
        found = member(run, atom, fields[index], atom.cls) if index < len(fields) else None
        return [found] if found is not None else []
    return []
