"""A function, method or closure that runs: its frame, its template arguments, what it gives and writes back."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import zip_longest

from enclave_addons.inference.cpp.libraries import IN_PLACE_OF_SOURCE, Call
from enclave_addons.inference.cpp.reading.declarations import (
    Function,
    FunctionParameter,
    parameters_of,
    type_text,
)
from enclave_addons.inference.cpp.reading.type_names import Type
from enclave_addons.inference.cpp.reading.writes import writes_of
from enclave_addons.inference.cpp.running.arithmetic import as_type
from enclave_addons.inference.cpp.running.assignments import assign
from enclave_addons.inference.cpp.running.constructors import as_parameter, bind_parameters
from enclave_addons.inference.cpp.running.contents import copied, handed_over
from enclave_addons.inference.cpp.running.effects import effects_of, looked_at
from enclave_addons.inference.cpp.running.implicit_calls import called_unseen
from enclave_addons.inference.cpp.running.left_out import forget_writes, leave_out
from enclave_addons.inference.cpp.running.machine import MAX_DEPTH, NEXT, Frame, Machine
from enclave_addons.inference.cpp.running.memory import MEMORY_DEPTH, CallOutcome, Changes
from enclave_addons.inference.cpp.running.overloads import candidates, chosen
from enclave_addons.inference.cpp.running.references import forget, forget_everything, is_plain, through
from enclave_addons.inference.cpp.running.static_types import given_to, kinds_of
from enclave_addons.inference.cpp.running.unknown_calls import may_be_written as may_be_written
from enclave_addons.inference.cpp.running.unknown_calls import unknown_call
from enclave_addons.inference.cpp.running.values import (
    BOTTOM,
    Atom,
    Bound,
    Lambda,
    Obj,
    Seq,
    Value,
    join,
    join_in_doubt,
    lost,
    unknown,
)
from enclave_addons.inference.cpp.syntax import (
    Node,
    addressed,
    children,
    field_of,
    template_arguments,
    text,
    words_in,
)


@dataclass(eq=False)
class CallSite:
    """A call as it is written. Its arguments run once, when somebody asks for their values."""

    run: Machine
    node: Node
    callee: Node
    frame: Frame
    _given: list[Node] | None = None
    _values: list[Value] | None = None

    @property
    def receiver(self) -> Node:
        """Return what stands before the name of a method."""
        return field_of(self.callee, "argument") or self.callee

    @property
    def given(self) -> list[Node]:
        if self._given is None:
            self._given = children(field_of(self.node, "arguments"))
        return self._given

    @property
    def values(self) -> list[Value]:
        if self._values is None:
            self._values = [self.run.evaluate(each, self.frame) for each in self.given]
        return self._values

    @property
    def types(self) -> list[Type]:
        """Return the template arguments that are written out."""
        return [self.run.type_of(text(each), self.frame) for each in template_arguments(self.callee)]

    def call(self, receiver: Obj | None = None) -> Call:
        return Call(self.node, self.frame, self.values, self.types, self.given, receiver)

    def call_value(self, callee: Value) -> Value:
        return call_values(self.run, callee, self.values, self.node, self.frame)

    def call_methods(
        self,
        methods: Sequence[Function],
        this: Obj | None,
        *,
        exactly: bool = False,
        bindings: dict[str, Type] | None = None,
    ) -> Value:
        return call_methods(
            self.run, methods, this, self.values, self.node, self.frame, self.types, exactly=exactly, bindings=bindings
        )  # fmt: skip


def call_values(run: Machine, callee: Value, values: Sequence[Value], node: Node, frame: Frame) -> Value:
    """Call whatever ``callee`` holds: of several functions any one."""
    found: list[Value] = []
    if len(callee) > 1:

        def one(atom: Atom) -> int:
            found.append(call_values(run, (atom,), values, node, frame))
            return NEXT

        run.branches([partial(one, atom) for atom in callee], tested=True)
        return join(*found)
    for atom in callee:
        if isinstance(atom, Lambda):
            found.append(call_lambda(run, atom, values, node, frame))
        elif isinstance(atom, Bound):
            found += [
                invoke(run, atom.function, this, given, node, frame, ())
                for this, given in _bound(atom, atom.fixed or values)
            ]
        elif isinstance(atom, Obj) and (own := run.methods_of(atom, "operator()")):
            found.append(call_methods(run, own, atom, values, node, frame, ()))
        else:
            name = text(field_of(node, "function"))[:60]
            if "*" in name and ("->*" in name or ".*" in name):
                run.gap(node, frame, f"which method {name} is is not known; it may make interfaces")
                forget_everything(run, f"what {name} may have written")
            called_unseen(run, [(atom,)], once=True)
            handed_over(run, f"{name}()", values, node, frame)
            found.append(unknown(f"the result of {name}()"))
    run.left = run.left and len(found) == 1
    return join(*found) if found else unknown("the result of a call")


def _bound(atom: Bound, values: Sequence[Value]) -> list[tuple[Obj | None, Sequence[Value]]]:
    """Return the object and arguments of a call; a method without its object gets that as its first argument."""
    function = atom.function
    objects = [each for each in values[0] if isinstance(each, Obj)] if values else []
    if atom.this is None and function.owner and objects and len(values) == len(function.parameters) + 1:
        return [(each, values[1:]) for each in objects]
    return [(atom.this, values)]


def call_lambda(run: Machine, atom: Lambda, values: Sequence[Value], node: Node, frame: Frame) -> Value:
    """Runs the body where the lambda was made and gives what it returns; unknown when calls nest too deep."""
    if frame.depth > MAX_DEPTH or atom.node.id in run.closures:
        if run.subtree_matters(atom.node):
            run.gap(
                node,
                frame,
                "a closure calls itself, or is called deeper than is followed; it may make interfaces",
            )
        return _too_deep(run, atom, values, node, frame)
    outer = atom.frame
    inner = Frame(
        outer.file, outer.scope, outer.function, None, outer.bindings, outer,
        (*frame.path[-24:], (outer.file.file, node.start_byte)), (*outer.conditions, *run.conditions(node, frame)),
        depth=frame.depth + 1,
    )  # fmt: skip
    inner = run.frame((atom, inner.path), inner)
    run.begin(inner)
    declarator = field_of(atom.node, "declarator")
    given = parameters_of(declarator) if declarator is not None else []
    values = _seen_once(run, atom, None, given, values, node, frame)
    for index, parameter in enumerate(given):
        value = values[index] if index < len(values) else unknown(f"the argument {parameter.name}")
        run.local(
            inner, parameter.name, as_parameter(run, parameter, value, atom.node, inner), parameter.type
        )
    body = field_of(atom.node, "body")
    run.closures.append(atom.node.id)
    outcome = run.execute(body, inner) if body is not None else NEXT
    run.closures.pop()
    run.settle(inner.mark, inner.exits, bool(outcome & NEXT))
    run.left = not outcome & NEXT and not inner.exits
    inner.active = False
    left = {p.name: run.store.get((inner, p.name)) for p in given if p.written_back}
    if left and len(children(field_of(node, "arguments"))) == len(values):
        write_back(run, given, left, node, frame)
    return inner.returned


def _too_deep(
    run: Machine, of: Function | Lambda, values: Sequence[Value], node: Node, frame: Frame
) -> Value:
    """Know nothing of what a call that is not followed any deeper gives back, or may write."""
    if forget_writes(run, of) is None:
        forget_everything(run, "what a recursion may have written")
    called_unseen(run, values)
    may_be_written(run, "a recursion", [], children(field_of(node, "arguments")), frame)
    return unknown("a recursion")


def call_functions(
    run: Machine,
    functions: Sequence[Function],
    values: Sequence[Value],
    node: Node,
    frame: Frame,
    types: Sequence[Type],
) -> Value:
    """Return what the overloads that fit best may return; ``unknown_call`` decides if none fits."""
    return call_methods(run, functions, None, values, node, frame, types)


MAX_OVERLOADS = 3


def _one_of_many(run: Machine, functions: Sequence[Function], node: Node, frame: Frame) -> Value:
    """Return an unknown for one of many overloads; a gap if they change what matters, or may make interfaces."""
    run.handle(node, frame)
    run.called.update(functions)
    name, given = functions[0].name, given_to(node, frame)
    changed: set[str] = set()
    for each in functions:
        written = effects_of(run, each).written
        changed |= (written.assigned | written.changed | written.seen) - {p.name for p in each.parameters}
        back = (at for at, p in zip(given, each.parameters, strict=False) if p.written_back)
        changed.update(*map(words_in, back))
    if (
        not changed.isdisjoint(looked_at(run))
        or not all(effects_of(run, each).only_variables for each in functions)
        or any(map(run.makes_interfaces, functions))
    ):
        which = "specialisation of" if any(each.specialises for each in functions) else "function"
        run.gap(node, frame, f"which {which} {name} is called is not known")
    may_be_written(run, f"{name}()", [], given, frame)
    return unknown(f"the result of {name}()")


def _in_place(
    run: Machine, function: Function, this: Obj | None, values: Sequence[Value], node: Node, frame: Frame,
    types: Sequence[Type],
) -> Value | None:  # fmt: skip
    """Return what the model of a function gives that runs in place of its source; ``None`` if it has none."""
    whole = (function.owner,) if function.owner else function.scope
    model = IN_PLACE_OF_SOURCE.get("::".join((*whole, function.name)))
    if model is None:
        return None
    found = model(run, Call(node, frame, list(values), list(types), [], this))
    if found is not None:
        run.handle(node, frame)
        run.called.add(function)
    return found


def _one_of_special(run: Machine, functions: Sequence[Function], node: Node, frame: Frame) -> Value | None:
    """Return an unknown for a template with explicit specialisations: which is meant is not followed.

    ``None`` for any other, also behind a gap: where one of them may make interfaces.
    """
    if all(each.specialises is None for each in functions):
        return None
    if any(map(run.makes_interfaces, functions)):
        run.gap(node, frame, f"which specialisation of {functions[0].name} is called is not known")
        return None
    return _one_of_many(run, functions, node, frame)


def _any_of(
    run: Machine, functions: Sequence[Function], call: Callable[[Function], Value], node: Node, frame: Frame
) -> Value:
    """Call one of several overloads, which of them is not known; a gap if they do not make the same."""
    if len(functions) == 1:
        return call(functions[0])
    found: list[Value] = []
    made: list[Counter[object]] = []
    doubt = f"which of {len(functions)} functions {functions[0].name}() is called is not known"

    def once(function: Function) -> int:
        before = _count(run)
        found.append(call(function))
        made.append(_count(run) - before)
        return NEXT

    run.branches([partial(once, each) for each in functions], tested=True, doubt=doubt)
    if any(each.keys() != made[0].keys() for each in made):
        run.gap(node, frame, doubt)
    return join_in_doubt(found, doubt)


def _count(run: Machine) -> Counter[object]:
    """Count how often each interface was made so far, and the nodes."""
    made = Counter[object](run.nodes.values())
    for record in run.nodes.values():
        for each, times in record.endpoints.items():
            made[record, each.kind, each.name, each.type] += len(times)
    return made


def call_methods(
    run: Machine,
    methods: Sequence[Function],
    this_object: Obj | None,
    values: Sequence[Value],
    node: Node,
    frame: Frame,
    types: Sequence[Type],
    *,
    exactly: bool = False,
    bindings: dict[str, Type] | None = None,
) -> Value:
    """Call as ``call_functions``; ``exactly``: of this class, whatever the object is."""
    known = _in_place(run, methods[0], this_object, values, node, frame, types)
    if known is not None:
        return known
    special = _one_of_special(run, methods, node, frame)
    if special is not None:
        return special
    kinds = kinds_of(run, given_to(node, frame), frame) if len(methods) > 1 else ()
    fitting = candidates(methods, values, kinds)
    if not fitting:
        name = "::".join(filter(None, (methods[0].owner, methods[0].name)))
        return unknown_call(run, name, values, node, [], frame)
    is_among = not set(run.active).isdisjoint(fitting)  # each of them runs all others, which run all others
    if len(fitting) > MAX_OVERLOADS and (is_among or not any(map(run.makes_interfaces, fitting))):
        return _one_of_many(run, fitting, node, frame)
    left_out = fitting[0].parameters[len(values) :] if fitting[0].virtual and not exactly else ()
    if left_out:  # those of the class that the object is seen as ([dcl.fct.default]/10)
        why = f"the default arguments of {fitting[0].name}(), which is virtual"
        values = [*values, *(unknown(why) for _ in left_out)]

    def call(each: Function) -> Value:
        return invoke(run, each, this_object, values, node, frame, types, bindings)

    return _any_of(run, fitting, call, node, frame)


def invoke(
    run: Machine, function: Function, this_object: Obj | None, values: Sequence[Value], node: Node, frame: Frame,
    types: Sequence[Type], bindings: dict[str, Type] | None = None,
) -> Value:  # fmt: skip
    """Run the body of ``function``."""
    if run.left:
        run.kill(node, frame, "an argument of this call throws, or ends the program")
        return BOTTOM
    run.handle(node, frame)
    run.called.add(function)
    if function in run.active or frame.depth > MAX_DEPTH:
        if run.makes_interfaces(function):
            run.gap(node, frame, f"{function} calls itself, or is called deeper than is followed")
        return _too_deep(run, function, values, node, frame)
    if leave_out(run, function, values, node, frame):
        return unknown(f"the result of {function.name}()")
    values = _seen_once(run, function, this_object, function.parameters, values, node, frame)
    inner = Frame(
        function.file, function.scope, function, this_object, bindings or {},
        path=(*frame.path[-24:], (frame.file.file, node.start_byte, node.end_byte)),
        conditions=run.conditions(node, frame), depth=frame.depth + 1,
    )  # fmt: skip
    inner = run.frame((function, this_object, inner.path), inner)
    if this_object is not None:
        inner.bindings = {**_class_bindings(function, this_object), **(bindings or {})}
    inner.bindings = {**inner.bindings, **dict(zip(function.templates, types, strict=False))}
    given = (tuple(values), inner.bindings, inner.conditions, len(run.nodes))
    key = (function, this_object, inner.path)
    outcome = _outcome(run, key, given, inner.depth, lambda: _run_body(run, function, values, inner))
    write_back(run, function.parameters, outcome.meanwhile, node, frame)
    write_back(run, function.parameters, outcome.parameters, node, frame)
    run.left = outcome.ends
    return outcome.returned


def _seen_once(
    run: Machine,
    of: Function | Lambda,
    this: Obj | None,
    parameters: Sequence[FunctionParameter],
    values: Sequence[Value],
    node: Node,
    frame: Frame,
) -> Sequence[Value]:
    """Return the arguments; nothing is known of a text or number that the code sees under two names, and writes."""
    given = [_aliased(addressed(each), frame) for each in children(field_of(node, "arguments"))]
    named = {
        at: name
        for at, (parameter, argument, value) in enumerate(zip(parameters, given, values, strict=False))
        if parameter.type.rstrip().endswith(("&", "*")) and is_plain(value) and (name := _variable(argument))
    }
    found = list(values)
    # What an object of its own class has under the same name is another variable.
    own = run.names.members(this.cls) if this is not None and this is not frame.this else frozenset()
    for at, name in named.items():
        parameter = parameters[at]
        alike = [each for each, other in named.items() if _is_part(name, other) or _is_part(other, name)]
        twice = len(alike) > 1 and any(parameters[each].written_back for each in alike)
        last = re.split(r"\W+", name)[-1]
        is_seen = isinstance(of, Lambda) or (frame.owner_of(name) is None and last not in own)
        if twice or (is_seen and last != parameter.name and _touches(of, last, parameter.written_back)):
            why = f"what {name} holds, which a function that writes to it has under two names"
            found[at] = lost(values[at], why)
            if parameter.written_back:
                forget(run, given[at] or node, frame, why, told=False)
    return found


def _aliased(argument: Node | None, frame: Frame) -> Node | None:
    """Return the variable that an argument is, or what it was made a reference to."""
    is_reference = text(argument) in frame.references
    return addressed(frame.initial.get(text(argument))) if is_reference else argument


_ELEMENT = re.compile(r"\[|[.>](?:at|front|back|data|begin)\(")


def _variable(argument: Node | None) -> str:
    """Return the variable that an argument is, or is an element of; empty for anything else."""
    found = _ELEMENT.split(text(argument))[0].removeprefix("this->").rstrip("-")
    return found if re.fullmatch(r"\w+(?:(?:\.|->|::)\w+)*", found) else ""


def _is_part(whole: str, part: str) -> bool:
    return part == whole or part.startswith((f"{whole}.", f"{whole}->"))


def _touches(of: Function | Lambda, name: str, reads: bool) -> bool:
    """Return whether code itself writes to the variable ``name`` of its caller, or reads it where ``reads``."""
    return name in writes_of(of.node) or (reads and name in words_in(of.node))


def _outcome(
    run: Machine, key: object, given: object, depth: int, action: Callable[[], CallOutcome]
) -> CallOutcome:
    """Return the outcome of ``action``, or of the same call before.

    Its steps count again: a budget means the same in every round.
    """
    if depth > MEMORY_DEPTH:
        return action()
    known = run.memory.find(key, given)
    if known is not None:
        run.count(known[1])
        return known[0]

    def counted() -> tuple[CallOutcome, int]:
        before = run.steps
        return action(), run.steps - before

    return run.memory.keep(key, given, counted)


def _run_body(run: Machine, function: Function, values: Sequence[Value], inner: Frame) -> CallOutcome:
    run.begin(inner)
    run.active.append(function)
    bind_parameters(run, function, values, inner)
    written = [p.name for p in function.parameters if p.written_back]
    held: Changes = {}
    outcome = NEXT
    if function.body is not None and written:
        outcome, held = run.store.held_during(partial(run.execute, function.body, inner))
    elif function.body is not None:
        outcome = run.execute(function.body, inner)
    run.settle(inner.mark, inner.exits, bool(outcome & NEXT))
    run.active.pop()
    left = {name: run.store.get((inner, name)) for name in written}
    meanwhile = {name: held[inner, name] for name in written if (inner, name) in held}
    ends = not outcome & NEXT and not inner.exits
    inner.active, inner.finished = False, not inner.captured
    return CallOutcome(_as_returned(run, function, inner), left, meanwhile, ends)


def _as_returned(run: Machine, function: Function, inner: Frame) -> Value:
    """Return what a function gives back; of an object of a derived class what the type it returns has of it."""
    declarator = field_of(function.node, "declarator")
    if declarator is None or declarator.type != "function_declarator":
        return inner.returned  # a reference or pointer
    if any(isinstance(atom, int) for atom in inner.returned):
        return as_type(run.type_of(type_text(function.node), inner).name, inner.returned)
    if not any(isinstance(atom, Obj) and atom.cls is not None and atom.cls.bases for atom in inner.returned):
        return inner.returned
    kind = run.type_of(type_text(function.node), inner)
    cls = run.held_class(kind, inner)
    if cls is None or all(not isinstance(atom, Obj) or atom.cls is cls for atom in inner.returned):
        return inner.returned  # made in place, or copied where it is given back
    return copied(run, inner.returned, function.node, inner, cls)


# Transitions of a lifecycle node (rclcpp_lifecycle/node_interfaces/lifecycle_node_interface.hpp).
HOOKS = ("on_configure", "on_activate", "on_deactivate", "on_cleanup", "on_shutdown", "on_error")


def _class_bindings(function: Function, this_object: Obj) -> dict[str, Type]:
    for cls, bound in this_object.bindings.items():
        if (
            cls.qualified == function.owner
            or cls.qualified.endswith("::" + function.owner)
            or cls.scope == function.scope
        ):
            return bound
    return {}


_WRITTEN_BACK = frozenset({
    "identifier", "field_expression", "subscript_expression", "call_expression", "pointer_expression",
})  # fmt: skip


def _is_element(call: Node) -> bool:
    """Return whether it is ``x.at(i)``: an element given by reference, whose evaluation changes nothing."""
    callee = field_of(call, "function")
    name = text(field_of(callee, "field"))
    return name in ("at", "front", "back", "begin", "rbegin", "data", "value")


def write_back(
    run: Machine,
    parameters: Sequence[FunctionParameter],
    left: Mapping[str, Value | None],
    node: Node,
    frame: Frame,
) -> None:
    """Write what a function does to its reference parameters to the caller's variables."""
    given = children(field_of(node, "arguments"))[: len(parameters)]
    for parameter, argument in zip_longest(parameters, given):
        if not parameter.written_back:
            continue
        target = addressed(argument or parameter.default)
        value = left.get(parameter.name)
        if target is None or value is None:
            continue
        if target.type not in _WRITTEN_BACK or (target.type == "call_expression" and not _is_element(target)):
            if not all(isinstance(atom, Obj) for atom in value):
                forget(run, target, frame, told=False)
        elif value != run.evaluate(target, frame) or text(target) in frame.references:
            if "**" in parameter.type.replace(" ", "") and is_plain(value):
                through(run, target, frame)  # it points elsewhere now
            assign(run, target, value, frame)


# --- operators of the program's own classes -----------------------------------------------------------------------


def pointed_to(run: Machine, value: Value, operator: str, node: Node, frame: Frame) -> Value:
    """Return what ``x->`` or ``*x`` gives: by the operator of its class if it has one, else ``x`` itself."""
    found: list[Value] = []
    for atom in value:
        if isinstance(atom, Seq) and atom.place:
            found.append(unknown("what an iterator shows"))
            continue
        own = run.methods_of(atom, operator)
        found.append(
            call_methods(run, own, atom, [], node, frame, ()) if own and isinstance(atom, Obj) else (atom,)
        )
    return join(*found)


def by_operator(
    run: Machine, sign: str, left: Value, right: Sequence[Value], node: Node, frame: Frame
) -> Value | None:
    """Return what an operator that the program defines gives; ``None`` if it defines none for these operands."""
    if not any(isinstance(a, Obj) and a.cls is not None for value in (left, *right) for a in value):
        return None
    name, this = f"operator{sign}", left[0] if len(left) == 1 else None
    if isinstance(this, Obj) and (own := chosen(run.methods_of(this, name), right)):
        return call_methods(run, [own], this, right, node, frame, ())
    free = run.names.find_functions(name, frame.scope, frame.file)
    if not chosen(free, [left, *right]):
        return None
    return call_functions(run, free, [left, *right], node, frame, ())
