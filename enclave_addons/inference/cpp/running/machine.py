"""One run of one program: the store, frames, branches, and what is found on the way.

Statements, expressions and calls register how they are run (``statement``, ``expression``); nothing here knows C++'s
libraries. A place that was run is noted; the ledger later asks about every other place.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from typing import TYPE_CHECKING, Protocol, TypeVar

from enclave_addons.inference.cpp.findings import AllocatedNode, Condition, Follows, PossibleEndpoint
from enclave_addons.inference.cpp.ledger import CREATES, without_interfaces
from enclave_addons.inference.cpp.reading.declarations import Class, FileIndex, Function, Scope
from enclave_addons.inference.cpp.reading.names import Names
from enclave_addons.inference.cpp.reading.type_names import Type
from enclave_addons.inference.cpp.reading.writes import VariableWrites
from enclave_addons.inference.cpp.running.memory import AbstractStore, Cell, Changes, Memory
from enclave_addons.inference.cpp.running.values import (
    BOTTOM,
    Atom,
    Bound,
    Lambda,
    Notes,
    Obj,
    Text,
    Value,
    concatenated,
    lost,
    plain,
    unknown,
    without_covered,
)
from enclave_addons.inference.cpp.syntax import Node, line_of, words_in
from enclave_addons.inference.start import Start
from nodl.dependence import ALWAYS, When
from nodl.name_template import UnknownPart
from nodl.node_interface import EndpointKind
from nodl.source_ref import SourceRef

if TYPE_CHECKING:
    from enclave_addons.inference.cpp.libraries import Call
    from enclave_addons.inference.cpp.running.effects import CallEffects, Owners
    from enclave_addons.inference.cpp.running.foreign import Leaving

NEXT, RETURN, BREAK, CONTINUE = 1, 2, 4, 8

MAX_DEPTH = 60
MAX_STEPS = 400_000

Key = TypeVar("Key")
Handler = TypeVar("Handler")
StatementHandler = Callable[["Machine", "Node", "Frame"], int]
ExpressionHandler = Callable[["Machine", "Node", "Frame"], Value]
STATEMENTS: dict[str, StatementHandler] = {}
EXPRESSIONS: dict[str, ExpressionHandler] = {}


class StepLimitExceeded(Exception):
    """The program is too much for the counted steps."""


def registered(table: dict[Key, Handler], names: Iterable[Key]) -> Callable[[Handler], Handler]:
    """Register the function under these names of ``table``."""

    def register(handler: Handler) -> Handler:
        table.update(dict.fromkeys(names, handler))
        return handler

    return register


def statement(*kinds: str) -> Callable[[StatementHandler], StatementHandler]:
    """Register a handler that runs statements of these tree-sitter types and returns which ways lead on."""
    return registered(STATEMENTS, kinds)


def expression(*kinds: str) -> Callable[[ExpressionHandler], ExpressionHandler]:
    """Register a handler that returns the value of expressions of these tree-sitter types."""
    return registered(EXPRESSIONS, kinds)


class Calls(Protocol):
    """How functions, closures and methods are called: ``invocation``, for what it stands on itself."""

    def call_values(
        self, run: Machine, callee: Value, values: Sequence[Value], node: Node, frame: Frame
    ) -> Value: ...

    def may_be_written(
        self, run: Machine, name: str, values: Sequence[Value], given: Sequence[Node], frame: Frame
    ) -> None: ...

    def pointed_to(self, run: Machine, value: Value, operator: str, node: Node, frame: Frame) -> Value: ...

    def call_lambda(
        self, run: Machine, atom: Lambda, values: Sequence[Value], node: Node, frame: Frame
    ) -> Value: ...

    def call_methods(
        self, run: Machine, methods: Sequence[Function], this_object: Obj | None, values: Sequence[Value], node: Node,
        frame: Frame, types: Sequence[Type],
    ) -> Value: ...  # fmt: skip


class Machine:
    """The state of one run and what it found: nodes, gaps, dead code, the parameters that decided.

    ``start``: ``None`` when there is no launch.
    """

    def __init__(self, names: Names, start: Start | None, calls: Calls):
        self.names, self.start, self.calls = names, start, calls
        self.store = AbstractStore(self.count)
        self.memory = Memory(self.store)
        self.size = Notes(self.store.log)  # how many nodes and classes the program has, so far
        self.nodes: dict[Obj, AllocatedNode] = {}
        self.gaps: dict[tuple[SourceRef, str], None] = {}
        self.initial: dict[Cell, Value] = {}  # what globals and static members held before main
        self.objects: dict[object, Obj] = {}
        self.frames: dict[object, Frame] = {}
        self.callbacks: dict[tuple[object, object], tuple[Atom, Frame]] = {}
        self.conditional: set[tuple[object, object]] = set()  # callbacks that a condition may leave out
        self.handled: dict[str, set[int]] = {}  # file -> first bytes of calls with a result
        self.resolved: dict[str, set[int]] = {}  # file -> first bytes of calls of what is not ours
        self.called: set[Function] = set()
        self.dead: dict[tuple[str, int, int], str] = {}
        self.global_arguments: list[tuple[str | None, ...]] = []  # that the program gives to rclcpp::init
        self.active: list[Function] = []
        self.closures: list[int] = []  # that run now, by their nodes
        self.left = False  # a call in the expression that runs has certainly thrown, or ended the program
        self.steps = 0
        self.repeated = 0  # how many of the elements being made stand for several each
        self.calls_back = False  # callbacks run: at the program's end, or where it spins and goes on
        self.spins_beside = False  # a thread runs callbacks while the program goes on
        self.undecided = 0  # how many conditions that are not known decide whether this runs
        self.skips = 0  # how many loops, and ways out before it, may leave this out
        self.consulted: dict[str, object] = {}  # parameters whose value decided what is made
        self.from_default: dict[str, None] = {}  # those of them that were decided without a launch
        self.unset: dict[tuple[str, int], tuple[SourceRef, str, str]] = {}  # calls on pointers to nothing
        self._used: set[str] = set()
        self._known: set[Class] = set()
        self.effects: dict[object, CallEffects] = {}
        self.passed: dict[Function, VariableWrites] = {}  # what functions write, with what they pass on
        self.leaving: dict[Function, Leaving] = {}
        self.taken: dict[tuple[str, int, int], int] = {}
        self.looked_at: dict[int, Owners] = {}
        self._leading: set[tuple[object, int]] = set()  # by how many classes were used
        # What makes no interface as long as none of these classes is used.
        self._harmless: dict[object, frozenset[str]] = {}

    # --- running ------------------------------------------------------------------------------------------

    def evaluate(self, node: Node | None, frame: Frame) -> Value:
        if node is None:
            return BOTTOM
        self.steps += 1
        if self.steps > MAX_STEPS:
            raise StepLimitExceeded
        if node.has_error and node.type != "assignment_expression" and any(c.is_error for c in node.children):
            return self._misread(node, frame)
        handler = EXPRESSIONS.get(node.type)
        if handler is None:
            return unknown(f"the C++ {node.type.replace('_', ' ')}")
        return handler(self, node, frame)

    def _misread(self, node: Node, frame: Frame) -> Value:
        """Run the parts of what the parser did not understand in an expression; its value is not known, and what it
        writes is a gap: ``(a = b, c)``."""
        if any(child.is_error and b"=" in (child.text or b"") for child in node.children):
            self.gap(node, frame, "this C++ could not be parsed, and writes something")
        for child in node.named_children:
            for each in child.named_children if child.is_error else [child]:
                self.evaluate(each, frame)
        return unknown("what the parser did not understand")

    def count(self, steps: int) -> None:
        """Raises ``StepLimitExceeded``."""
        self.steps += steps
        if self.steps > MAX_STEPS:
            raise StepLimitExceeded

    def execute(self, node: Node | None, frame: Frame) -> int:
        if node is None:
            return NEXT
        self.count(1)
        self.left = False
        handler = STATEMENTS.get(node.type)
        if handler is not None:
            outcome = handler(self, node, frame)
        else:
            self.evaluate(node, frame)
            outcome = RETURN if self.left else NEXT
        self.left = False
        return outcome

    def branches(
        self, alternatives: Sequence[Callable[[], int]], tested: bool = False, doubt: str = ""
    ) -> int:
        """Run each alternative from the present state; continue with any that goes on.

        ``tested``: a condition of the program decides; ``doubt``: see ``AbstractStore.merge``.
        """
        mark = self.store.mark()
        outcome = 0
        going: list[Changes] = []
        leaves = False
        self.undecided += tested
        for alternative in alternatives:
            self.left = False
            result = alternative()
            if self.left:
                result, leaves = result & ~NEXT, True
            outcome |= result
            if result & NEXT:
                going.append(self.store.changes(mark))
            self.store.undo(mark)
        self.undecided -= tested
        if going:
            self.store.merge(going, doubt)
        self.left = leaves and not going
        return outcome

    def begin(self, frame: Frame) -> None:
        """Begin a call: its variables are new."""
        frame.active, frame.mark, frame.started = True, self.store.mark(), self.steps

    def moved(self, mark: int, steps: int) -> Iterator[tuple[Cell, Value, Value]]:
        """Yield each variable that has another value than at ``mark``, with that value and the present one.

        Not those of calls that began after ``steps``, nor of blocks that have ended: each has new ones.
        """
        before = self.store.before(mark)
        for cell, value in self.store.changes(mark).items():
            owner, name = cell
            is_new = isinstance(owner, Frame) and (owner.started > steps or name not in owner.names)
            if not is_new and set(before[cell]) != set(value):
                yield cell, before[cell], value

    def settle(self, mark: int, alternatives: list[Changes], going: bool) -> None:
        """Join what left early with the present state, if that is reached at all."""
        if not alternatives:
            return
        every = [*alternatives, self.store.changes(mark)] if going else alternatives
        self.store.undo(mark)
        self.store.merge(every)

    # --- variables ----------------------------------------------------------------------------------------

    def local(self, frame: Frame, name: str, value: Value, written_type: str = "") -> None:
        if frame.blocks and name not in frame.blocks[-1]:
            before = self.store.get((frame, name)) or BOTTOM
            if frame.references and name in frame.names:  # one of them may lead to it
                before = lost(before, f"what is written to {name} while another one hides it")
            refers = name in frame.references
            frame.blocks[-1][name] = (name in frame.names, before, frame.types.get(name), refers)
        frame.references.discard(name)
        frame.names.add(name)
        if written_type:
            frame.types[name] = written_type
        self.store.set((frame, name), value)

    def type_of(self, written: str, frame: Frame) -> Type:
        return self.names.resolve(written, frame.scope, frame.file, frame.bindings)

    def class_of(self, kind: Type, where: Frame | Class) -> Class | None:
        """Return the class that a type means in code or in a class; ``None`` if its source is not in reach."""
        return self.names.class_of(kind, where.scope, where.file)

    def held_class(self, kind: Type | None, where: Frame | Class) -> Class | None:
        """Return the class of the object in a variable of this type; ``None`` if it is a pointer, or none in reach."""
        return None if kind is None or kind.pointer else self.class_of(kind, where)

    def methods_of(self, atom: object, name: str) -> Sequence[Function]:
        """Return the methods of that name of an object of a class in reach; none for anything else."""
        return self.names.find_methods(atom.cls, name) if isinstance(atom, Obj) else ()

    def obj(self, key: object, kind: Type, **values: object) -> Obj:
        found = self.objects.get(key)
        if found is None:
            found = self.objects[key] = Obj(kind, data=Notes(self.store.log))
            found.several = self.repeated > 0
            for name, value in values.items():
                setattr(found, name, value)
            self._uses(found.cls)
        return found

    def frame(self, key: object, fresh: Frame) -> Frame:
        """Return ``fresh``, or the frame that a lambda kept of the same call before: its closures are the same then."""
        known = self.frames.get(key)
        if known is None or known.active or not known.captured:
            self.frames[key] = fresh
            return fresh
        known.bindings, known.conditions, known.depth = fresh.bindings, fresh.conditions, fresh.depth
        known.returned, known.finished = BOTTOM, False
        known.exits, known.loops = [], []
        return known

    # --- what is found ------------------------------------------------------------------------------------

    def place(self, node: Node, frame: Frame) -> SourceRef:
        return SourceRef(frame.file.file, line_of(node))

    def gap(self, node: Node, frame: Frame, why: str, record: AllocatedNode | None = None) -> None:
        source = self.place(node, frame)
        if record is not None:
            record.gap(source, why)
        else:
            self.gap_at(source, why)

    def gap_at(self, source: SourceRef, why: str) -> None:
        self.gaps.setdefault((source, why))

    def handle(self, node: Node, frame: Frame) -> None:
        """Record that this place has its result: an interface, a gap, or a function that was followed."""
        self.handled.setdefault(frame.file.file, set()).add(node.start_byte)

    def resolve(self, node: Node, frame: Frame) -> None:
        """Note that this call ran, and that it calls none of the program's functions or has a gap of its own."""
        self.resolved.setdefault(frame.file.file, set()).add(node.start_byte)

    def kill(self, node: Node | None, frame: Frame, why: str) -> None:
        if node is not None:
            self.dead[(frame.file.file, node.start_byte, node.end_byte)] = why

    def conditions(self, node: Node, frame: Frame) -> tuple[Condition, ...]:
        line = line_of(node)
        here = [
            (frame.file.file, opened, symbol)
            for first, last, symbol, opened in frame.file.source.uncertain
            if first <= line <= last
        ]
        return (*frame.conditions, *here) if here else frame.conditions

    def endpoint(
        self, record: AllocatedNode, kind: EndpointKind, name: Value, type_name: str, call: Call,
        follows: Follows | None = None, when: When = ALWAYS,
    ) -> None:  # fmt: skip
        if self.left:
            return
        source = self.place(call.node, call.frame)
        conditions = self.conditions(call.node, call.frame)
        atoms = concatenated(name or unknown("a name that is never set"))
        if self.calls_back and self.undecided and sum(plain(atom) is not None for atom in atoms) > 1:
            atoms = unknown("which of several names goes with a condition that callbacks change")
        names = without_covered(atoms)
        certain = len(names) == 1 and not self.undecided and not self.skips
        for atom in names:
            parts = atom.parts if isinstance(atom, Text) else (UnknownPart(atom.why),)
            found = PossibleEndpoint(kind, Text(parts), type_name, source, follows=follows, when=when)
            record.endpoints.setdefault(found, []).append(conditions)
            if certain:
                record.unconditional.add(found)

    def later(self, values: Iterable[Value], frame: Frame) -> None:
        """Store closures that code outside of the program holds: they may be called at any time."""
        atoms = [*chain.from_iterable(values)]
        for atom in atoms:
            if isinstance(atom, Lambda):
                self._keep_callback((atom.node.id, atom.frame.path), atom, frame)
            elif isinstance(atom, Bound):
                for each in self._with_objects(atom, atoms):
                    self._keep_callback((each.function, each[1:]), each, frame)

    def _keep_callback(self, key: tuple[object, object], atom: Atom, frame: Frame) -> None:
        if not self.undecided and not self.skips:
            self.conditional.discard(key)
        elif key not in self.callbacks:
            self.conditional.add(key)
        self.callbacks.setdefault(key, (atom, frame))

    def _with_objects(self, atom: Bound, atoms: Sequence[Atom]) -> list[Bound]:
        """Bind a method that is handed over beside objects that have it to those."""
        if atom.this is not None or atom.function.static or not atom.function.owner:
            return [atom]
        name = atom.function.name
        owners = [each for each in atoms if atom.function in self.methods_of(each, name)]
        return [atom._replace(this=each) for each in owners] or [atom]

    def made_classes(self) -> set[Class]:
        return {each.cls for each in self.objects.values() if each.cls is not None}

    # --- who matters --------------------------------------------------------------------------------------

    def used_classes(self) -> set[str]:
        """Return the classes of all objects that were made, with their bases."""
        self.size.get("classes")
        return self._used

    def _uses(self, cls: Class | None) -> None:
        if cls is not None and cls not in self._known:
            self._known.add(cls)
            self._used |= {each.name for each in self.names.ancestry(cls)}
            self.size["classes"] = len(self._used)

    def makes_interfaces(self, function: Function) -> bool:
        """Return whether ``function``, or anything that it may call, may make an interface or a node."""
        return bool(CREATES.fullmatch(function.name)) or self._leads(function, function.words)

    def subtree_matters(self, node: Node) -> bool:
        """Return ``makes_interfaces`` of a closure or other part of a function."""
        return self._leads(node.id, words_in(node))

    def _leads(self, key: object, words: frozenset[str]) -> bool:
        used = self.used_classes()
        if key in self._harmless and self._harmless[key].isdisjoint(used):
            return False
        if (key, len(used)) in self._leading:
            return True
        reach = without_interfaces(self, words)
        if reach is None:
            self._leading.add((key, len(used)))
            return True
        self._harmless.update(
            dict.fromkeys((key, *reach.reached), frozenset(reach.idle))
        )  # nor does what it calls
        return False


@dataclass(eq=False)
class Loop:
    """``continue`` ends an iteration, begun at ``mark``; ``break`` the loop, begun at ``start``."""

    start: int
    steps: int  # at its begin
    mark: int = 0
    breaks: list[Changes] = field(default_factory=list)
    continues: list[Changes] = field(default_factory=list)


@dataclass(eq=False)
class Frame:
    """A call that runs. ``path`` distinguishes what is made at one place through different calls."""

    file: FileIndex
    scope: Scope
    function: Function | None = None
    this: Obj | None = None
    bindings: Mapping[str, Type] = field(default_factory=dict)
    outer: Frame | None = None  # of a lambda: where its captures live
    path: tuple[object, ...] = ()
    conditions: tuple[Condition, ...] = ()
    types: dict[str, str] = field(default_factory=dict)
    initial: dict[str, Node | None] = field(default_factory=dict)  # values that variables were declared with
    names: set[str] = field(default_factory=set)
    returned: Value = BOTTOM
    exits: list[Changes] = field(default_factory=list)
    mark: int = 0
    started: int = 0  # the step that it began at
    loops: list[Loop] = field(default_factory=list)
    blocks: list[dict[str, tuple[bool, Value, str | None, bool]]] = field(default_factory=list)
    """For each block that runs: what names that it declares stood for before."""
    # Of a lambda: what it captured of blocks that may have ended.
    kept: dict[str, Frame] = field(default_factory=dict)
    references: set[str] = field(default_factory=set)
    """Variables that are references or pointers through which another variable may be written."""
    depth: int = 0
    lasts: bool = False  # holds a static variable, from call to call
    finished: bool = False  # nobody can see its variables any more
    captured: bool = False  # a lambda can
    active: bool = False  # runs now

    def owner_of(self, name: str) -> Frame | None:
        """Return the frame whose variable ``name`` is."""
        frame: Frame | None = self
        while frame is not None:
            if name in frame.names:
                return frame
            if name in frame.kept:
                return frame.kept[name]
            frame = frame.outer
        return None
