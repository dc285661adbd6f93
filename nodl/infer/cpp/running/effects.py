"""What a function may do, with everything that it may call, by its text: more than it does, never less."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

from nodl.infer.cpp.ledger import CREATES, Reach, makes_by_words
from nodl.infer.cpp.libraries import LIBRARY_CLASSES
from nodl.infer.cpp.reading.declarations import Function
from nodl.infer.cpp.reading.names import Names
from nodl.infer.cpp.reading.writes import VariableWrites, written_by
from nodl.infer.cpp.running.foreign import Leaving, leaving
from nodl.infer.cpp.running.memory import Cell
from nodl.infer.cpp.running.values import Bound, Lambda
from nodl.infer.cpp.syntax import Node, callee_name, field_of, text, walk, words_in

if TYPE_CHECKING:
    from nodl.infer.cpp.running.machine import Machine

_BEYOND_VARIABLES = re.compile(
    r"\w*declare\w*|set_\w*parameter\w*|NodeOptions|arguments|thread|jthread|async|bind|spin\w*|"
    r"execute_\w+|handle_(?:message|request|response|loaned_message)|create_\w*timer|add_\w*callback\w*|\w+Listener|"
    r"const_cast|_?exit|quick_exit|_Exit|abort|terminate"
)
"""Words of code that does more than change variables: it declares parameters, keeps closures, runs callbacks, ends it
all or writes behind ``const``."""
_PLAIN = re.compile(
    r"string|vector|double|float|bool|int|size_t|char|msg::|Msg|Eigen|Time|Duration|unsigned|long|Point|Pose"
)
_AS_A_VALUE, _CHANGED, _REPLACED = 0, 1, 2


_PLAIN_VALUES = frozenset({"Parameter", "ParameterValue", "Node", "LifecycleNode"})
"""Classes of rclcpp whose name alone does nothing; whether a node is made is asked of ``leaving``."""


class CallEffects:
    """What one function or closure may do."""

    def __init__(self, run: Machine, of: Function | Lambda) -> None:
        self._run = run
        own, words = ([of], of.words) if isinstance(of, Function) else ([], words_in(of.node))
        self._of = of
        # The variable that mattered and was known the last time; whether it is assigned, and changed.
        self.kept_by: tuple[Cell, bool, bool] | None = None
        self.functions: frozenset[Function] = frozenset((*own, *Reach(run).from_words(words)))

    @cached_property
    def size(self) -> int:
        """Return the bytes of its source, with everything that it may call."""
        return sum(each.node.end_byte - each.node.start_byte for each in self.functions)

    @cached_property
    def words(self) -> frozenset[str]:
        own = frozenset() if isinstance(self._of, Function) else words_in(self._of.node)
        return own.union(*(each.words for each in self.functions))

    @cached_property
    def leaving(self) -> Leaving:
        """Return how it leaves the program, with everything that it may call."""
        every = [_leaving(self._run, each) for each in self.functions]
        if isinstance(self._of, Lambda):
            outer = self._of.frame.function
            every.append(
                leaving(self._run.names, outer, self._of.node)
                if outer is not None
                else Leaving(True, True, True)
            )
        return Leaving(*map(any, zip(*every, strict=True))) if every else Leaving()

    @cached_property
    def only_variables(self) -> bool:
        """Return True if all that it does is to change variables."""
        modelled = {name.rpartition("::")[2] for name in LIBRARY_CLASSES} - _PLAIN_VALUES
        modelled -= self._run.names.classes.keys()
        own = {each for each in self._run.names.functions_by_name if each.startswith("add_")}
        return (
            self.words.isdisjoint(modelled)
            and not any(map(_BEYOND_VARIABLES.fullmatch, self.words - own))
            and not self._may_init_ros
            and not any(self.leaving)
        )

    @property
    def _may_init_ros(self) -> bool:
        """Return True if ``init`` may be rclcpp's: unless the program has a function of this name."""
        return "init" in self.words and (
            "rclcpp" in self.words or "init" not in self._run.names.functions_by_name
        )

    @cached_property
    def written(self) -> VariableWrites:
        """Return what it does to variables, arguments of the program's own functions as these take them."""
        run, parts = self._run, [written_in(each) for each in self.functions]
        if isinstance(self._of, Lambda):
            parts.append(written_by(self._of.node))
        assigned = set[str]().union(*(each.assigned for each in parts))
        changed = set[str]().union(*(each.changed for each in parts))
        seen = set[str]().union(*(each.seen for each in parts))
        passed = {each for part in parts for each in part.passed}
        for callee, index, words in passed:
            how = _taken(run, callee, index)
            if how >= _CHANGED:
                changed |= words
            if how == _REPLACED:
                assigned |= words
        for name in (assigned | changed) & run.names.functions_by_name.keys():
            for each in run.names.functions_by_name[name]:
                behind = _referred_to(each)  # f() = x writes what f() gives
                changed |= behind
                assigned |= behind if name in assigned else set()
        lasting = frozenset[str]().union(*(each.lasting for each in parts))
        return VariableWrites(frozenset(assigned), frozenset(changed), frozenset(seen), (), lasting)


def effects_of(run: Machine, of: Function | Lambda | Bound) -> CallEffects:
    """Return what ``of`` may do with the classes that are used so far."""
    of = of.function if isinstance(of, Bound) else of
    key = (of if isinstance(of, Function) else of.node.id, len(run.used_classes()))
    if key not in run.effects:
        run.effects[key] = CallEffects(run, of)
    return run.effects[key]


def only_changes_variables(run: Machine, words: Iterable[str]) -> bool:
    """Return whether code with these words makes no interface and does nothing but change variables."""
    found = Reach(run).from_words(words)
    every = {*words, *(word for each in found for word in each.words)}
    return not any(map(_BEYOND_VARIABLES.fullmatch, every)) and "init" not in every


def written_in(function: Function) -> VariableWrites:
    """Return what a function does to variables itself."""
    if function.written is None:
        function.written = written_by(function.node)
    return function.written


def _leaving(run: Machine, function: Function) -> Leaving:
    if function not in run.leaving:
        run.leaving[function] = leaving(run.names, function)
    return run.leaving[function]


def _taken(run: Machine, callee: str, index: int) -> int:
    """Return how the functions of that name take the argument at ``index``: any other may change it."""
    key = (callee, index)
    if key not in run.taken:
        run.taken[key] = _CHANGED  # until it is known: functions may call each other
        found = run.names.functions_by_name.get(callee, ())
        run.taken[key] = max((_taken_by(run, each, index) for each in found), default=_CHANGED)
    return run.taken[key]


def _taken_by(run: Machine, function: Function, index: int) -> int:
    if index >= len(function.parameters):
        return _CHANGED  # somebody else's function of the same name
    parameter = function.parameters[index]
    if not parameter.written_back:
        return _AS_A_VALUE
    if _PLAIN.search(parameter.type):
        return _CHANGED
    written = written_in(function)
    if parameter.name in written.assigned:
        return _REPLACED
    further = (_taken(run, callee, at) for callee, at, words in written.passed if parameter.name in words)
    return max(further, default=_CHANGED) or _CHANGED


def _referred_to(function: Function) -> frozenset[str]:
    """Return the variables that a function gives references or pointers to."""
    declarator = field_of(function.node, "declarator")
    if declarator is None or declarator.type not in ("reference_declarator", "pointer_declarator"):
        return frozenset()
    returned = (each for each in walk(function.node) if each.type == "return_statement")
    return frozenset[str]().union(*map(words_in, returned))


# --- what leading functions look at --------------------------------------------------------------------------------


def looked_at(run: Machine) -> frozenset[str]:
    """Return the members and globals that functions which lead to interfaces mention."""
    used = run.used_classes()
    if len(used) not in run.looked_at:
        leading = (
            each
            for each in _may_lead(run.names)
            if (not each.owner or each.owner.rpartition("::")[2] in used) and run.makes_interfaces(each)
        )
        run.looked_at[len(used)] = frozenset[str]().union(*map(_not_local, leading))
    return run.looked_at[len(used)]


@lru_cache(maxsize=1)
def _may_lead(names: Names) -> frozenset[Function]:
    """Return the functions that mention what makes an interface, and those that mention one of these, and so on."""
    callers: dict[str, list[Function]] = {}
    waiting: list[Function] = []
    for each in (function for listed in names.functions_by_name.values() for function in listed):
        for word in names.spoken_of(each):
            callers.setdefault(word, []).append(each)
        if makes_by_words(each.words) or CREATES.fullmatch(each.name):
            waiting.append(each)
    found = set(waiting)
    while waiting:
        function = waiting.pop()
        for name in {function.name, function.owner.rpartition("::")[2]}:
            fresh = [each for each in callers.get(name, ()) if each not in found]
            found.update(fresh)
            waiting += fresh
    return frozenset(found)


def _not_local(function: Function) -> frozenset[str]:
    """Return the variables of others whose value a function may use: not its own, nor those that it only replaces."""
    own = {each.name for each in function.parameters}
    found: set[str] = set()
    members: set[str] = set()
    waiting = [function.node]
    while waiting:
        each = waiting.pop()
        if each.type in ("declaration", "for_range_loop", "parameter_declaration"):
            own |= _declared(each)
        if each.type == "field_identifier":
            members.add(text(each))
        elif each.type in _NAMES:
            found.add(text(each))
        callee = field_of(each, "function") if each.type == "call_expression" else None
        if callee is not None and _READS_ALONE.fullmatch(callee_name(callee)):
            continue
        replaced = _replaced(each)
        waiting += [field for field in each.named_children if replaced is None or field.id != replaced.id]
    return frozenset((found - own) | members)


_NAMES = ("identifier", "type_identifier", "namespace_identifier")
_READS_ALONE = re.compile(r"RCLCPP_\w+|RCUTILS_\w+|.*(?:\.|->)publish")


def _replaced(node: Node) -> Node | None:
    """Return the part of a node that names a variable whose earlier value does not count: ``x`` of ``x = 1``."""
    if node.type == "field_initializer":
        return node.named_children[0]
    if node.type == "assignment_expression" and text(field_of(node, "operator")) == "=":
        target = field_of(node, "left")
        return target if _is_variable(target) else None
    if node.type == "expression_statement" and node.named_children:
        call = node.named_children[0]
        callee = field_of(call, "function")
        empties = callee is not None and text(field_of(callee, "field")) in ("clear", "reset")
        return call if empties and _is_variable(field_of(callee, "argument")) else None
    return None


def _is_variable(target: Node | None) -> bool:
    """Return whether it is a variable or a member of the same object."""
    if target is not None and target.type == "field_expression":
        target = field_of(target, "argument")
        return target is not None and target.type == "this"
    return target is not None and target.type == "identifier"


def _declared(declaration: Node) -> set[str]:
    """Return the names that a declaration gives to variables."""
    found: set[str] = set()
    for declarator in declaration.children_by_field_name("declarator"):
        inner = declarator
        while inner.type in ("init_declarator", "reference_declarator", "pointer_declarator"):
            inner = field_of(inner, "declarator") or inner.named_children[-1]
        if inner.type == "identifier":
            found.add(text(inner))
    return found
