"""What a function may do, with everything that it may call, by its text: more than it does, never less."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, TypeAlias

from enclave_addons.inference.cpp.ledger import CREATES, Reach, makes_by_words
from enclave_addons.inference.cpp.libraries import LIBRARY_CLASSES
from enclave_addons.inference.cpp.reading.declarations import Function, type_text
from enclave_addons.inference.cpp.reading.names import Names
from enclave_addons.inference.cpp.reading.writes import FILLS, VariableWrites, declared_in, written_by
from enclave_addons.inference.cpp.running.foreign import Leaving, leaving
from enclave_addons.inference.cpp.running.memory import Cell, name_of
from enclave_addons.inference.cpp.running.values import BOTTOM, Atom, Bound, Lambda, Obj, functions_in
from enclave_addons.inference.cpp.syntax import Node, callee_name, field_of, text, walk, words_in

if TYPE_CHECKING:
    from enclave_addons.inference.cpp.running.machine import Machine

_BEYOND_VARIABLES = re.compile(
    r"\w*declare\w*|set_\w*parameter\w*|NodeOptions|arguments|thread|jthread|async|bind|spin\w*|"
    r"execute_\w*[a-z]|handle_(?:message|request|response|loaned_message)|create_\w*timer|add_\w*callback\w*|"
    r"\w+Listener|const_cast"
)
"""Words of code that does more than change variables: it declares parameters, keeps closures, runs callbacks or writes
behind ``const``."""
_PLAIN = re.compile(
    r"string|vector|double|float|bool|int|size_t|char|msg::|Msg|Eigen|Time|Duration|unsigned|long|Point|Pose"
)
_AS_A_VALUE, _CHANGED, _REPLACED = 0, 1, 2


_PLAIN_VALUES = frozenset({"Parameter", "ParameterValue", "Node", "LifecycleNode"})
"""Classes of rclcpp whose name alone does nothing; whether a node is made is asked of ``leaving``."""


_ANY = ""
Owners: TypeAlias = Mapping[str, frozenset[str]]
"""Names of variables, each with the classes whose members it may mean: ``_ANY``, those of any."""


class CallEffects:
    """What one function or closure may do."""

    def __init__(self, run: Machine, of: Function | Lambda) -> None:
        self._run = run
        self._of = of
        # The variable that mattered and was known the last time; whether it is assigned, and changed.
        self.kept_by: tuple[Cell, bool, bool] | None = None
        reach = Reach(run, operators=True)
        self.functions = frozenset(reach.from_code(of if isinstance(of, Function) else of.node))
        self.idle = frozenset(reach.idle)  # once one of these classes is used, it may do more

    @property
    def may_hide_writes(self) -> bool:
        """Return True if it may write to what no name tells: by a pointer to a member, or to a static variable of a
        function that has not run.
        """
        return self._writes_by_member or not self._keeping <= self._run.called

    @cached_property
    def _writes_by_member(self) -> bool:
        return any(map(self._run.names.has_member_pointers, self.functions))

    @cached_property
    def _keeping(self) -> frozenset[Function]:
        return frozenset(filter(self._run.names.has_static_variables, self.functions))

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
            and not any(map(self._run.names.may_end_program, self.functions))
            and (
                isinstance(self._of, Function)
                or not self._run.names.ends_program(text(self._of.node), self._of.frame.function)
            )
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
        parts, behind = [part for _, part in self._parts], self._behind
        return VariableWrites(
            frozenset[str]().union(*(each.assigned for each in (*parts, behind))),
            frozenset[str]().union(*(each.changed for each in (*parts, behind))),
            frozenset[str]().union(*(each.seen for each in parts)),
            (),
            frozenset[str]().union(*(each.lasting for each in parts)),
        )

    @cached_property
    def _behind(self) -> VariableWrites:
        """Return what is written through functions that give references: ``f() = x``."""
        own = self._run.names.functions_by_name
        assigned = frozenset[str]().union(*(part.assigned for _, part in self._parts)) & own.keys()
        changed = frozenset[str]().union(*(part.changed for _, part in self._parts)) & own.keys()
        return VariableWrites(
            frozenset[str]().union(*(referred_to(each) for name in assigned for each in own[name])),
            frozenset[str]().union(*(referred_to(each) for name in assigned | changed for each in own[name])),
        )

    @cached_property
    def owners(self) -> Owners:
        """Return whose variables the names are that it writes."""
        found: dict[str, set[str]] = {name: {_ANY} for name in self._behind.changed}
        for function, part in self._parts:
            owner = _ANY if function is None else _class_of(self._run, function)
            for name in part.assigned | part.changed | part.seen:
                found.setdefault(name, set()).update([owner] if owner is not None else [])
            for name, held, types in part.of_others:
                classes = self._run.names.classes_held(function, held, types) if function else ()
                found.setdefault(name, set()).update(classes or [_ANY])
        return {name: frozenset(classes) for name, classes in found.items()}

    @cached_property
    def _parts(self) -> list[tuple[Function | None, VariableWrites]]:
        """Return what each function does to variables, with what it passes to the program's own."""
        found: list[tuple[Function | None, VariableWrites]] = [
            (each, _with_all_passed(self._run, each)) for each in self.functions
        ]
        if isinstance(self._of, Lambda):
            written = written_by(self._of.node)
            others = frozenset((name, "", frozenset[str]()) for name, *_ in written.of_others)
            own = _with_passed(self._run, written._replace(of_others=others))
            found.append((self._of.frame.function, own))
        return found

    @cached_property
    def touched(self) -> frozenset[str]:
        """Return the names that it writes, or passes on to anything but what makes an interface."""
        return frozenset[str]().union(*map(_touched, self.functions))


@lru_cache(maxsize=50_000)
def _touched(function: Function) -> frozenset[str]:
    written = written_in(function)
    given = (words for callee, *_, words in written.passed if not CREATES.fullmatch(callee))
    return (written.assigned | written.changed).union(*given)


def _with_all_passed(run: Machine, function: Function) -> VariableWrites:
    if function not in run.passed:
        run.passed[function] = _with_passed(run, written_in(function))
    return run.passed[function]


def _with_passed(run: Machine, part: VariableWrites) -> VariableWrites:
    assigned, changed = set(part.assigned), set(part.changed)
    for callee, given, index, words in part.passed:
        how = _taken(run, callee, given, index)
        changed |= words if how >= _CHANGED else set()
        assigned |= words if how == _REPLACED else set()
    return part._replace(assigned=frozenset(assigned), changed=frozenset(changed))


def _class_of(run: Machine, function: Function) -> str | None:
    """Return the class whose members a function means by their names alone; ``None``: those of no class."""
    owner = function.owner.rpartition("::")[2]
    return None if not function.owner else owner if owner in run.names.classes else _ANY


def may_mean(run: Machine, owners: Owners, cell: Cell) -> bool:
    """Return whether code that writes or mentions the names ``owners`` may mean this variable."""
    owner, classes = cell[0], owners.get(name_of(cell))
    if classes is None or _ANY in classes or not isinstance(owner, Obj) or owner.cls is None:
        return classes is not None
    every = run.names.ancestry(owner.cls)
    return any(each.name in classes for each in every) or any(
        base is None and any(name in written for name in classes)
        for each in every
        for written, base in run.names.bases(each)
    )


def effects_of(run: Machine, of: Function | Lambda | Bound) -> CallEffects:
    """Return what ``of`` may do with the classes that are used so far."""
    of = of.function if isinstance(of, Bound) else of
    key, used = of if isinstance(of, Function) else of.node.id, run.used_classes()
    if key not in run.effects or not run.effects[key].idle.isdisjoint(used):
        run.effects[key] = CallEffects(run, of)
    return run.effects[key]


def with_held(run: Machine, atom: Atom) -> Iterator[Lambda | Bound]:
    """Yield a callback, then the functions in variables that it mentions, and those that these mention."""
    waiting = [atom] if isinstance(atom, Lambda | Bound) else []
    code: set[object] = set()  # of what was found
    names: set[str] = set()  # of variables that were looked into
    while waiting:
        each = waiting.pop()
        yield each
        mentioned = (run.store.callables.keys() & effects_of(run, each).words) - names
        names |= mentioned
        for cell in (cell for name in sorted(mentioned) for cell in list(run.store.callables[name])):
            for other in functions_in(run.store.get(cell) or BOTTOM):
                key = other.node.id if isinstance(other, Lambda) else other.function
                if key not in code:
                    code.add(key)
                    waiting.append(other)


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


def _taken(run: Machine, callee: str, given: int, index: int) -> int:
    """Return how the functions of that name with so many arguments take one; any other may change it."""
    key = (callee, given, index)
    if key not in run.taken:
        run.taken[key] = _CHANGED  # until it is known: functions may call each other
        found = run.names.functions_by_name.get(callee, ())
        own = [each for each in found if given <= len(each.parameters)]
        run.taken[key] = max((_taken_by(run, each, index) for each in own), default=_CHANGED)
    return run.taken[key]


def _taken_by(run: Machine, function: Function, index: int) -> int:
    parameter = function.parameters[index]
    if not parameter.written_back:
        return _AS_A_VALUE
    if _PLAIN.search(parameter.type):
        return _CHANGED
    written = written_in(function)
    if parameter.name in written.assigned:
        return _REPLACED
    further = (
        _taken(run, callee, given, at)
        for callee, given, at, words in written.passed
        if parameter.name in words
    )
    return max(further, default=_CHANGED) or _CHANGED


_PROXY = re.compile(r"auto|iterator|span|view|ref")


def referred_to(function: Function) -> frozenset[str]:
    """Return the variables that a function gives references or pointers to."""
    declarator = field_of(function.node, "declarator")
    refers = declarator is not None and declarator.type in ("reference_declarator", "pointer_declarator")
    if not refers and not _PROXY.search(type_text(function.node)):
        return frozenset()
    returned = (each for each in walk(function.node) if each.type == "return_statement")
    return frozenset[str]().union(*map(words_in, returned))


# --- what leading functions look at --------------------------------------------------------------------------------


def looked_at(run: Machine) -> Owners:
    """Return the members and globals that functions which lead to interfaces mention."""
    used = run.used_classes()
    if len(used) not in run.looked_at:
        found: dict[str, set[str]] = {}
        for each in _may_lead(run.names):
            owner = each.owner.rpartition("::")[2]
            if (not owner or owner in used) and run.makes_interfaces(each):
                own, of_others = _not_local(each)
                for name in own:
                    found.setdefault(name, set()).add(owner)
                for name in of_others:
                    found.setdefault(name, set()).add(_ANY)
        run.looked_at[len(used)] = {name: frozenset(classes) for name, classes in found.items()}
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


@lru_cache(maxsize=50_000)
def _not_local(function: Function) -> tuple[set[str], set[str]]:
    """Return the variables whose value a function may use, not its own, nor those that it only replaces; and members of
    other objects.
    """
    own = {each.name for each in function.parameters}
    found: set[str] = set()
    members: set[str] = set()
    waiting = [function.node]
    while waiting:
        each = waiting.pop()
        own |= declared_in(each)
        if each.type == "field_identifier":
            members.add(text(each))
        elif each.type in _NAMES:
            found.add(text(each))
        callee = field_of(each, "function") if each.type == "call_expression" else None
        if callee is not None and _READS_ALONE.fullmatch(callee_name(callee)):
            continue
        replaced = _replaced(each)
        waiting += [field for field in each.named_children if replaced is None or field.id != replaced.id]
    return found - own, members


_NAMES = ("identifier", "type_identifier", "namespace_identifier")
_READS_ALONE = re.compile(r"RCLCPP_\w+|RCUTILS_\w+|.*(?:\.|->)publish")


def _replaced(node: Node) -> Node | None:
    """Return the part of a node that names a variable whose value does not count there: ``x`` of ``x = 1`` or
    ``x.push_back(1);``.
    """
    if node.type == "field_initializer":
        return node.named_children[0]
    target = None
    if node.type == "assignment_expression" and text(field_of(node, "operator")) == "=":
        target = field_of(node, "left")
    elif node.type == "field_expression" and text(field_of(node, "field")) in _ONLY_FILL:
        call = node.parent
        is_statement = (
            call is not None and call.parent is not None and call.parent.type == "expression_statement"
        )
        target = field_of(node, "argument") if is_statement else None
    return target if _is_variable(target) else None


_ONLY_FILL = FILLS | {"reserve", "clear", "reset"}


def _is_variable(target: Node | None) -> bool:
    """Return whether it is a variable or a member of the same object."""
    if target is not None and target.type == "field_expression":
        target = field_of(target, "argument")
        return target is not None and target.type == "this"
    return target is not None and target.type == "identifier"
