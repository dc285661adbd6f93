"""One run of one program: how code is dispatched, how alternatives are joined, and what is found on the way.

Models of libraries reach the run through ``endpoint``, ``gap``, ``later``, ``object`` and ``store``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cached_property, partial
from itertools import chain
from typing import TYPE_CHECKING, Protocol, TypeVar

from enclave_addons.inference.cpp.engine.frames import NEXT, Frame
from enclave_addons.inference.cpp.engine.sites import Leading
from enclave_addons.inference.cpp.engine.store import AbstractStore, Changes
from enclave_addons.inference.cpp.engine.values import (
    BOTTOM,
    Bound,
    Lambda,
    Obj,
    Text,
    Value,
    concatenated,
    functions_in,
    join,
    unknown,
    without_covered,
)
from enclave_addons.inference.cpp.findings import AllocatedNode, Follows, PossibleEndpoint
from enclave_addons.inference.cpp.reading.declarations import Class, Function, Global
from enclave_addons.inference.cpp.reading.names import Names
from enclave_addons.inference.cpp.reading.type_names import Type
from enclave_addons.inference.cpp.syntax import Node, line_of, words_in
from enclave_addons.inference.start import Start
from enclave_common.source_location import SourceLocation
from nodl.dependence import ALWAYS, When
from nodl.name_template import UnknownPart
from nodl.node_interface import EndpointKind

if TYPE_CHECKING:
    from enclave_addons.inference.cpp.libraries import Call

MAX_STEPS = 250_000
MAX_DEPTH = 48
ALLOWANCE = 6_000
"""Steps that calls of one function get that leads to no interface, all together."""

Key = TypeVar("Key")
Handler = TypeVar("Handler")
StatementHandler = Callable[["Machine", "Node", "Frame"], int]
ExpressionHandler = Callable[["Machine", "Node", "Frame"], Value]
STATEMENTS: dict[str, StatementHandler] = {}
EXPRESSIONS: dict[str, ExpressionHandler] = {}


class StepLimitExceeded(Exception):
    """The program is too much for the counted steps."""


class AllowanceExceeded(Exception):
    """A function that leads to no interface takes too many steps."""


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
    """How functions are called and variables get their first values: for modules that these stand on themselves."""

    def invoke(
        self, run: Machine, function: Function, this: Obj | None, values: Sequence[Value], node: Node, frame: Frame,
        types: Sequence[Type] = (), given: Sequence[Node] = (),
    ) -> Value: ...  # fmt: skip

    def initial_value(self, run: Machine, variable: Global, frame: Frame) -> Value: ...


class Machine:
    """The state of one run and what it found: nodes, gaps, dead code, the parameters that decided.

    ``start`` is ``None`` when there is no launch.
    """

    def __init__(self, names: Names, start: Start | None, calls: Calls):
        self.names, self.start, self.calls = names, start, calls
        self.store = AbstractStore()
        self.nodes: dict[Obj, AllocatedNode] = {}
        self.gaps: dict[tuple[SourceLocation, str], None] = {}
        self.objects: dict[object, Obj] = {}
        self.callbacks: dict[Lambda | Bound, bool] = {}  # with whether a condition may leave it out
        self.handled: dict[str, set[int]] = {}  # file -> first bytes of calls with a result
        self.called: set[Function] = set()
        self.closures: dict[int, int] = {}  # how often each ran, by their nodes
        self.dead: dict[tuple[str, int, int], str] = {}
        self.unresolved: dict[str, SourceLocation] = {}  # words of calls not followed, with the first place
        self.global_arguments: list[tuple[str | None, ...]] = []  # that the program gives to rclcpp::init
        self.active: list[object] = []
        self.steps = 0
        self.limit = MAX_STEPS
        self.undecided = 0  # how many conditions that are not known decide whether this runs
        self.skips = 0  # how many ways out before it may leave this out
        self.repeated = 0  # how many loops that are not counted run
        self.consulted: dict[str, object] = {}  # parameters whose value decided what is made
        self.from_default: dict[str, None] = {}  # those of them that were decided without a launch
        # Calls on pointers to nothing.
        self.unset: dict[tuple[str, int], tuple[SourceLocation, str, str]] = {}
        self.histories: dict[Function, object] = {}  # their earlier calls
        self._paths: dict[object, int] = {}

    # --- running ------------------------------------------------------------------------------------------

    def evaluate(self, node: Node | None, frame: Frame) -> Value:
        if node is None:
            return BOTTOM
        self._count()
        handler = EXPRESSIONS.get(node.type)
        if handler is not None:
            return handler(self, node, frame)
        for child in node.named_children:
            self.evaluate(child, frame)
        return unknown(f"the C++ {node.type.replace('_', ' ')}")

    def execute(self, node: Node | None, frame: Frame) -> int:
        if node is None:
            return NEXT
        self._count()
        handler = STATEMENTS.get(node.type)
        if handler is not None:
            return handler(self, node, frame)
        self.evaluate(node, frame)
        return NEXT

    def _count(self) -> None:
        self.steps += 1
        if self.steps > self.limit:
            raise StepLimitExceeded if self.limit == MAX_STEPS else AllowanceExceeded

    def branches(self, alternatives: Sequence[Callable[[], int]]) -> int:
        """Run each alternative from the present state; go on with any that does."""
        mark = self.store.mark()
        outcome = 0
        going: list[Changes] = []
        self.undecided += 1
        try:
            for alternative in alternatives:
                result = alternative()
                outcome |= result
                if result & NEXT:
                    going.append(self.store.changes(mark))
                self.store.undo(mark)
        finally:
            self.undecided -= 1
        if going:
            self.store.merge(going)
            self.skips += bool(outcome & ~NEXT)
        return outcome

    def each_way(self, way: Callable[[Key], Value], over: Sequence[Key]) -> Value:
        """Return what one of several ways gives, not known which; all of them run."""
        if len(over) == 1:
            return way(over[0])
        results: list[Value] = []

        def one(each: Key) -> int:
            results.append(way(each))
            return NEXT

        self.branches([partial(one, each) for each in over])
        return join(*results)

    def path(self, *key: object) -> int:
        """Return a number for a way to some code: of the call around it, its place, the element of a loop."""
        return self._paths.setdefault(key, len(self._paths) + 1)

    def type_of(self, written: str, frame: Frame) -> Type:
        return self.names.resolve(written, frame.scope, frame.file, frame.bindings)

    def class_of(self, kind: Type, frame: Frame) -> Class | None:
        """Return the class that a type means; ``None`` if its source is not in reach."""
        return self.names.class_of(kind, frame.scope, frame.file)

    def object(self, key: object, kind: Type, cls: Class | None = None, *, heap: bool = False) -> Obj:
        """Return the object that is made at a place, the same one each time that the place is run."""
        found = self.objects.get(key)
        if found is None:
            found = self.objects[key] = Obj(kind, cls, heap=heap, several=self.repeated > 0)
        return found

    # --- what is found ------------------------------------------------------------------------------------

    def place(self, node: Node, frame: Frame) -> SourceLocation:
        return SourceLocation(frame.file.file, line_of(node))

    def gap(self, node: Node, frame: Frame, why: str, record: AllocatedNode | None = None) -> None:
        """Say that something is not known, of a node or of the program."""
        source = self.place(node, frame)
        if record is not None:
            record.gap(source, why)
        else:
            self.gap_at(source, why)

    def gap_at(self, source: SourceLocation, why: str) -> None:
        self.gaps.setdefault((source, why))

    def handle(self, node: Node, frame: Frame) -> None:
        """Note that this place has its result: an interface, a gap, or a function that was followed."""
        self.handled.setdefault(frame.file.file, set()).add(node.start_byte)

    def kill(self, node: Node | None, frame: Frame, why: str) -> None:
        """Note that code does not run, and why."""
        if node is not None:
            self.dead[(frame.file.file, node.start_byte, node.end_byte)] = why

    def lost(self, node: Node, frame: Frame) -> None:
        """Note that who is called here is not known: any function of these names may be."""
        for word in words_in(node):
            self.unresolved.setdefault(word, self.place(node, frame))

    def is_conditional(self, node: Node, frame: Frame) -> bool:
        """Return whether the preprocessor decides elsewhere if this code is there: it is on both sides, then."""
        line = line_of(node)
        uncertain = frame.file.source.uncertain
        return frame.conditional or any(first <= line <= last for first, last, _, _ in uncertain)

    def endpoint(
        self, record: AllocatedNode, kind: EndpointKind, name: Value, type_name: str, call: Call,
        follows: Follows | None = None, when: When = ALWAYS,
    ) -> None:  # fmt: skip
        """Add an interface to a node, once for each name that it may have."""
        source = self.place(call.node, call.frame)
        certain = not self.undecided and not self.skips and not self.is_conditional(call.node, call.frame)
        names = without_covered(concatenated(name or unknown("a name that is never set")))
        for atom in names:
            parts = atom.parts if isinstance(atom, Text) else (UnknownPart(atom.why),)
            found = PossibleEndpoint(kind, Text(parts), type_name, source, follows=follows, when=when)
            record.endpoints.setdefault(found)
            if len(names) == 1 and certain:
                record.unconditional.add(found)

    def later(self, values: Iterable[Value]) -> None:
        """Keep functions and closures that code outside of the program holds: they may be called at any time."""
        atoms = [*chain.from_iterable(values)]
        for atom in functions_in(tuple(atoms)):
            for each in self._with_objects(atom, tuple(atoms)) if isinstance(atom, Bound) else [atom]:
                certain = not self.undecided and not self.skips
                if certain or each not in self.callbacks:
                    self.callbacks[each] = not certain

    def _with_objects(self, atom: Bound, atoms: Value) -> list[Bound]:
        """Bind a method that is handed over beside objects that have it to those."""
        if atom.this is not None or atom.function.static or not atom.function.owner:
            return [atom]
        owners = [
            each
            for each in atoms
            if isinstance(each, Obj)
            and atom.function in self.names.find_methods(each.cls, atom.function.name)
        ]
        return [atom._replace(this=each) for each in owners] or [atom]

    def made_classes(self) -> set[Class]:
        return {each.cls for each in self.objects.values() if each.cls is not None}

    @cached_property
    def leading(self) -> Leading:
        """Return what leads to interfaces, by the words in the program."""
        return Leading(self.names)
