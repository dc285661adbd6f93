"""The interpreter's core: frames, calls, dispatch, budgets. One ``Run`` analyses one program start.

Expressions give values, statements tell whether control can pass them; who handles which kind of syntax
or callable stands in the tables handed in (``Tables``), so that each concern has a module of its own.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable
from functools import cached_property, partial
from typing import Any, NamedTuple

from enclave_addons.inference.findings import Findings, OptionDefaults
from enclave_addons.inference.packages import find_package, manifest_places
from enclave_addons.inference.program import Program, SourceModule
from enclave_addons.inference.start import NO_LAUNCH
from enclave_addons.inference.state import Allocations, ProgramState, Written
from enclave_addons.inference.text import Guard, Input, NodePart, Text
from enclave_addons.inference.values import (
    ANY,
    BOTTOM,
    ITEMS,
    OTHER,
    OTHER_KEYS,
    Absent,
    BoundMethod,
    ClassMethod,
    ClassValue,
    ContentCells,
    Dictionary,
    External,
    FixedCells,
    ForeignMethod,
    Frame,
    FunctionEntry,
    FunctionValue,
    HeapObject,
    Instance,
    Items,
    LocalCells,
    ModuleValue,
    Partial,
    Sequence,
    SuperProxy,
    Unknown,
    Value,
    join,
    join_all,
    unknown,
)
from nodl.source_ref import SourceRef


class Arguments:
    """The arguments of a call. ``more``: further positional ones of unknown number."""

    __slots__ = ("keywords", "more", "more_keywords", "positional")

    def __init__(
        self,
        positional: list[Value] | None = None,
        keywords: dict[str, Value] | None = None,
        more: Value = BOTTOM,
        more_keywords: Value = BOTTOM,
    ) -> None:
        self.positional = [] if positional is None else positional
        self.keywords = {} if keywords is None else keywords
        self.more = more
        self.more_keywords = more_keywords

    def at(self, index: int, name: str | None = None) -> Value | None:
        """Return the argument at ``index`` or called ``name``; ``None`` when it is not given."""
        if 0 <= index < len(self.positional):
            return self.positional[index]
        if name is not None and name in self.keywords:
            return self.keywords[name]
        found = join(self.more if index >= 0 else BOTTOM, self.more_keywords)
        return found or None

    def shifted(self) -> Arguments:
        return Arguments(self.positional[1:], self.keywords, self.more, self.more_keywords)

    def preceded(self, *first: Value) -> Arguments:
        return Arguments([*first, *self.positional], self.keywords, self.more, self.more_keywords)

    def all_values(self) -> Iterable[Value]:
        return (*self.positional, *self.keywords.values(), self.more, self.more_keywords)


class Call:  # its fields are read so often that those of a named tuple would cost a launch of 50 nodes half a percent
    """A call as the models of libraries see it."""

    __slots__ = ("args", "frame", "node")

    def __init__(self, args: Arguments, node: ast.AST, frame: Frame) -> None:
        self.args = args
        self.node = node
        self.frame = frame

    @property
    def source(self) -> SourceRef:
        return SourceRef(self.frame.module.source.path, getattr(self.node, "lineno", 0))


class Called(NamedTuple):
    """A call of a callback: the stamp of the state before it, what ran in it, the containers it looked into, and what
    it wrote.
    """

    stamp: int
    functions: set[FunctionValue]
    containers: set[int]
    written: list[Written]


# What one run may cost, counted and not timed so that it ends at the same statement on every machine: expressions
# evaluated, values and elements looked at, cells joined after branches. One takes 2 to 6 microseconds.
MAX_STEPS = 1_000_000
MAX_STEPS_IN_VAIN = 300_000  # for a program of which something stays unknown, whatever else is found
MAX_DEPTH = 120  # analysed calls inside calls


# Others can do nothing with these.
_INERT = frozenset({str, int, float, bool, bytes, type(None), Text, Unknown})
_FUNCTIONS = frozenset({FunctionValue, BoundMethod, Partial})


def _has_call(atom: object) -> bool:
    """Return True for an object of a class of the program that has ``__call__``."""
    classes = (isinstance(atom, Instance) and isinstance(atom.cls, ClassValue) and atom.cls.linear) or ()
    return any(isinstance(base, ClassValue) and "__call__" in base.cells for base in classes)


class BudgetExceeded(Exception):
    """The run was given up; what it found so far is kept, with a gap that says so."""


Evaluator = Callable[["Run", Any, Frame], Value]
Executor = Callable[["Run", Any, Frame], bool]
Caller = Callable[["Run", Any, Call], Value]
Model = Callable[["Run", Call], Value]  # what a function of a library does
AttributeReader = Callable[["Run", Any, str, ast.AST, Frame], Value]


class Tables(NamedTuple):
    """The handler of each kind of syntax, callable and attribute owner, and what is asked about libraries."""

    expressions: dict[type, Evaluator]
    statements: dict[type, Executor]
    callables: dict[type, Caller]
    attributes: dict[type, AttributeReader]
    keeps_off: Callable[[str], bool]  # whether a library leaves the program's classes and objects alone
    lets_through: Callable[[str], bool]  # whether exceptions pass the library's context managers
    creates: Callable[[object], bool]  # whether calling this function of a library makes an interface


class Run(Allocations):
    """One analysis from one entry point: state, findings and what is still to be called."""

    def __init__(self, program: Program, tables: Tables, main: SourceModule):
        self.program = program
        self.main = main
        self.beside = main.path.rpartition("/")[0]
        self.tables = tables
        self._expressions = tables.expressions
        self._statements = tables.statements
        super().__init__(ProgramState())
        self.findings = Findings()
        self.modules: dict[str, ModuleValue] = {}
        self.foreign_attributes: dict[tuple[str, str], Value] = {}  # of libraries, by path and name
        self.at: tuple[ast.AST, Frame] | None = None  # the latest call of the program
        # Handed to code that is not analysed, with the mark of the state then.
        self.escaped: dict[ClassValue | Instance, int] = {}
        self.handed: dict[Instance, SourceRef] = {}  # objects that code which is not analysed got, and where
        self.callbacks: dict[object, int | None] = {}  # callable -> number of arguments, if known
        # Those that do not wait for a spin, with the mark of the state then.
        self.at_any_time: dict[object, int] = {}
        # What code that runs at any time was found to change: variables by name, containers by where they are made.
        self.meanwhile: set[str | int] = set()
        self.called: dict[ast.AST, None] = {}  # functions analysed so far
        self.instantiated: dict[ast.AST, None] = {}  # classes of which an object was made
        self.with_metaclass: set[ast.AST] = set()
        self.has_setters = False  # a class has a property that can be set
        # For the net: calls with the call that entered their function, what entered each function, and calls of
        # what is not known.
        self.evaluated: set[tuple[ast.AST, FunctionEntry | None]] = set()
        self.entries: dict[ast.AST, dict[FunctionEntry, None]] = {}
        self.doubtful: set[ast.AST] = set()
        # Calls that made an interface, or ran a function of the program.
        self.understood: set[ast.AST] = set()
        self.stack: list[ast.AST] = []
        self.classes: dict[ast.AST, ClassValue] = {}
        self.functions: dict[tuple[object, ...], FunctionValue] = {}
        self.members: dict[tuple[ClassValue, str], Instance] = {}  # of enumerations
        self.copied_from: dict[HeapObject, HeapObject] = {}  # copies, with what was copied first
        self.recursive: set[ast.AST] = set()  # functions that called themselves in the running call
        self.options = OptionDefaults()
        self.launch = NO_LAUNCH  # with its values inputs do not stay open
        self.has_inputs = False  # a value may be of the launch
        self.asks_launch = False  # the value of a parameter decides more than conditions on names can say
        self.settle: Callable[[Run], None] = lambda run: None  # runs the callbacks; set by who drives the run
        self.guards: tuple[Guard, ...] = ()  # of parameters, that hold at the current point
        self.guards_at_end: tuple[Guard, ...] = ()  # of the latest block
        self.answers: dict[ast.expr, Value] = {}  # what the calls in tests gave the last time
        self.environment = ContentCells()  # variables that the program sets itself
        self.unrolled = 1  # turns of the unrolled loops around, multiplied
        self.awaited: set[ast.AST] = set()  # calls whose coroutine runs where it is called
        self.repeated = 0  # inside a loop or callback: one allocation may stand for many objects
        self.steps = 0
        self.limit = min(MAX_STEPS, MAX_STEPS_IN_VAIN)
        self.gave_up = False
        self.raised = False  # a ``raise`` ran, see ``swallowed``
        self.called_back: dict[tuple[object, int | None], Called] = {}
        self.running: set[FunctionValue] = set()  # functions that ran since the latest callback began

    @cached_property
    def dependencies(self) -> frozenset[str]:
        """Return what the program's package.xml says that it depends on."""
        for manifest in manifest_places(self.main.path):
            self.program.ask("file", str(manifest))
        package = find_package(self.main.path)
        return package.dependencies if package else frozenset()

    def swallowed(self, action: Callable[[], Value], otherwise: Callable[[], Value] | None = None) -> Value:
        """Return what ``action`` gives, for a caller that goes on after an exception: state may be as it was then.

        ``otherwise``: what the caller then does. ``try`` and ``with`` look at this by themselves; everywhere else an
        exception ends the program.
        """
        mark, outside = self.state.mark(), self.raised
        self.raised = False
        given = action()
        if self.raised:
            self.state.join_seen(mark, mixed=True)
            given = join(given, self.state.perhaps(otherwise)) if otherwise is not None else given
        self.raised = outside
        return given

    # --- syntax -----------------------------------------------------------------------------------------

    def evaluate(self, node: ast.expr, frame: Frame) -> Value:
        self.steps += 1
        handler = self._expressions.get(type(node))
        return handler(self, node, frame) if handler else ANY

    def execute(self, body: list[ast.stmt], frame: Frame) -> bool:
        """Run statements in order. False: control cannot reach the end of ``body``."""
        self.spend(len(body))
        statements, guards = self._statements, self.guards
        passes = True
        for statement in body:
            handler = statements.get(type(statement))
            if handler is not None and not handler(self, statement, frame):
                passes = False
                break
        self.guards_at_end, self.guards = self.guards, guards
        return passes

    def spend(self, count: int) -> None:
        """Count ``count`` units of work. Raises ``BudgetExceeded`` when there were too many."""
        self.steps += count
        if self.steps + (self.state.work >> 2) > self.limit:
            if self.limit == MAX_STEPS or self.findings.is_open:
                raise BudgetExceeded(f"more than {self.limit} steps")
            self.limit = MAX_STEPS

    # --- variables --------------------------------------------------------------------------------------

    def assign_name(self, name: str, value: Value, frame: Frame) -> None:
        cells = frame.cells
        if name in frame.globals:
            self.state.write(frame.module.cells, name, value)
        elif name in frame.nonlocals:
            self._assign_nonlocal(name, value, frame)
        elif type(cells) is not LocalCells:
            self.state.write(cells, name, value)
        elif frame.captured:
            if frame.again:
                value = join(cells.get(name, BOTTOM), value)
            self.state.write(cells, name, value)
        elif self.state.depth == frame.depth:
            cells[name] = value  # no branch to undo: nobody else will ask
        else:
            self.state.write(cells, name, value, True)

    def _assign_nonlocal(self, name: str, value: Value, frame: Frame) -> None:
        outer = frame.closure
        while outer is not None and name not in outer.cells:
            outer = outer.closure
        self.state.write((outer or frame).cells, name, value)

    # --- calls and attributes ---------------------------------------------------------------------------

    def call(self, callee: Value, args: Arguments, node: ast.AST, frame: Frame) -> Value:
        """Call every callable that ``callee`` may be; the results are joined."""
        call = Call(args, node, frame)
        self.steps += len(callee)
        if len(callee) == 1:
            return self.call_atom(callee[0], call)
        results = self.state.each(partial(self.call_atom, atom, call) for atom in callee if atom is not None)
        return join_all(results) or ANY

    def call_atom(self, atom: object, call: Call) -> Value:
        handler = self.tables.callables.get(type(atom))
        if handler is None:
            return ANY
        return handler(self, atom, call)

    def library_object(self, call: Call, path: str, kind: str = "") -> Instance:
        """Return the object of the library class ``path`` that ``call`` makes; ``kind`` as in ``allocate``."""
        return self.allocate(call.node, kind or path, lambda: Instance(External(path)))

    def fixed_object(self, call: Call, path: str, kind: str) -> Instance:
        """Return such an object whose attributes no program sets."""

        def make() -> Instance:
            made = Instance(External(path))
            made.cells = FixedCells()
            return made

        return self.allocate(call.node, kind, make)

    def attribute(self, owner: Value, name: str, node: ast.AST, frame: Frame) -> Value:
        readers = self.tables.attributes
        if len(owner) == 1:
            reader = readers.get(type(owner[0]))
            result = reader(self, owner[0], name, node, frame) if reader else self._unread(owner[0])
            self.steps += len(result)
            return result or ANY
        result = BOTTOM
        for atom in owner:
            if atom is None:
                continue  # an attribute of None is an error, not a value
            reader = readers.get(type(atom))
            result = join(result, reader(self, atom, name, node, frame) if reader else self._unread(atom))
            self.steps += len(result)
        return result or ANY

    def _unread(self, atom: object) -> Value:
        """Return the attribute of what has none that is followed: through it, a function may be called."""
        if isinstance(atom, tuple):
            self.escape_value((atom, *getattr(atom, "getter", ()), *getattr(atom, "setter", ())))
        return ANY

    # --- the world outside ------------------------------------------------------------------------------

    def register_callback(self, value: Value, arity: int | None, since: int | None = None) -> None:
        """Register ``value``: code that is not analysed may call it, with ``arity`` arguments (``None``: any).

        ``since``: it does so at any time since this mark of the state, and not only where the program waits.
        """
        self.asks_launch = self.asks_launch or bool(self.guards)  # which its interfaces do not have
        for atom in value:
            if isinstance(atom, (FunctionValue, BoundMethod, Partial, ClassMethod)) or _has_call(atom):
                if since is not None:
                    self.at_any_time.setdefault(atom, since)
                if atom not in self.callbacks:
                    self.callbacks[atom] = arity
                elif self.callbacks[atom] != arity:
                    self.callbacks[atom] = None

    def changes_at_any_time(self, seen: Written, certainly: bool = False) -> None:
        """Note the variables and containers that code which runs at any time changes.

        A variable that never holds anything else is known, unless ``certainly``: other code will change it.
        """
        for cells, key, held in seen.values():
            if type(cells) is FixedCells:
                continue
            if certainly or isinstance(held[0], Items) or sum(type(atom) is not Absent for atom in held) > 1:
                variable = isinstance(key, str) and key not in (ITEMS, OTHER, OTHER_KEYS)
                self.meanwhile |= {str(key)} if variable else self.made_at(cells)

    def escape(self, args: Arguments, opened: bool = True, objects: bool = True) -> None:
        """Hand all of ``args`` to code that is not analysed: it may call callables and fill containers.

        ``opened`` is false for libraries that are known to leave containers alone, ``objects`` for those that neither
        make objects of classes they are given nor call methods of objects.
        """
        for value in args.all_values():
            if len(value) != 1 or type(value[0]) not in _INERT:
                self.escape_value(value, opened, objects)

    def escape_value(self, value: Value, opened: bool = True, objects: bool = True, depth: int = 0) -> None:
        self.steps += len(value)
        for atom in value:
            kind = type(atom)
            if kind in _INERT:
                continue
            if isinstance(atom, (Sequence, Dictionary)):
                self._escape_container(atom, opened, objects, depth)
            elif kind in _FUNCTIONS:
                self.register_callback((atom,), None, self.state.mark())
            elif isinstance(atom, (ClassValue, Instance)):
                if objects:
                    self.escape_object(atom, trusted=not opened)
                elif _has_call(atom):
                    self.register_callback((atom,), None, self.state.mark())
            elif kind is ForeignMethod or kind is External:
                if self.tables.creates(atom):
                    self.callbacks.setdefault(atom, None)
            elif isinstance(atom, SuperProxy) and objects:
                self.escape_value((atom.receiver,), opened, objects, depth + 1)

    def escape_object(self, atom: ClassValue | Instance, trusted: bool = False) -> None:
        """Hand the class or object to code that is not analysed: it may make objects and call methods.

        A node in such hands is a gap, unless they are ``trusted`` to know nothing of ROS, as Python's own library
        does. Objects of libraries are theirs already.
        """
        of_program = isinstance(atom, ClassValue) or isinstance(atom.cls, ClassValue)
        if isinstance(atom, Instance) and self.at is not None and not trusted:
            node, frame = self.at
            source = SourceRef(frame.module.source.path, getattr(node, "lineno", 0))
            self.handed.setdefault(atom, source)  # it may be a node, or become one
        if isinstance(atom, Instance) and not (of_program and (atom not in self.findings.node_of or trusted)):
            return
        if atom not in self.escaped:
            self.escaped[atom] = self.state.mark()

    def _escape_container(self, obj: Sequence | Dictionary, opened: bool, objects: bool, depth: int) -> None:
        if opened and not obj.escaped and not (isinstance(obj, Sequence) and obj.kind == "tuple"):
            self.state.open(obj)
        if depth < 3 and len(obj.cells) < 64:
            HeapObject.looked_into.add(id(obj.cells))
            for value in list(obj.cells.values()):
                if value and type(value[0]) is Items:
                    value = value[0].any_element()
                if len(value) != 1 or type(value[0]) not in _INERT:
                    self.escape_value(value, opened, objects, depth + 1)

    def gap(self, node: ast.AST, frame: Frame, why: str) -> None:
        self.findings.gap(SourceRef(frame.module.source.path, getattr(node, "lineno", 0)), why)

    def of_launch(self, piece: Input | NodePart) -> Value:
        """Return the text of an input or of the node's name, on which tests may depend from now on."""
        self.has_inputs = True
        return (Text((piece,)),)

    def variables_of(self, node: ast.AST, frame: Frame) -> Value:
        """Evaluate ``vars(x)``, ``x.__dict__``, ``globals()``: a gap, for what is done with this dictionary is not
        followed.
        """
        self.gap(node, frame, "variables are used as a dictionary, which is not analysed")
        return unknown("a dictionary of variables")
