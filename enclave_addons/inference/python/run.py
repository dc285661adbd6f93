"""A run of one Python program: how its tree is walked, what names, attributes and calls mean.

Handlers register themselves in tables by the type of syntax or of what is called, so that this module knows none of
them.
"""

from __future__ import annotations

import ast
import builtins
import functools
import os
import re
from bisect import bisect_left
from collections.abc import Callable, Sequence
from typing import Any

from enclave_addons.inference.kernel.findings import FoundEndpoint, FoundNode
from enclave_addons.inference.kernel.machine import NEXT, Jumps, Machine
from enclave_addons.inference.kernel.texts import Input, OwnName, Text
from enclave_addons.inference.kernel.values import (
    ABSENT,
    ANY,
    BOTTOM,
    ITEMS,
    External,
    Items,
    Obj,
    Unknown,
    Value,
    external,
    join,
    join_all,
    present,
    unknown,
)
from enclave_addons.inference.python.objects import (
    Arguments,
    Bound,
    Call,
    Class,
    ForeignMethod,
    Frame,
    Function,
    Method,
    Module,
    Property,
    Super,
    Wrapped,
)
from enclave_addons.inference.python.program import Program, SourceModule
from enclave_addons.inference.start import NO_LAUNCH, ProgramLaunch
from enclave_common.source_location import SourceLocation

BUILTINS = frozenset(dir(builtins))
COMMAND_LINE = "command line arguments"
OF_PROCESS = (COMMAND_LINE, "an argument that is not given", "an argument that nothing analysed gives")

Model = Callable[["Run", Call], Value]
EXPRESSIONS: dict[type, Callable[[Run, Any, Frame], Value]] = {}
STATEMENTS: dict[type, Callable[[Run, Any, Frame], int]] = {}
CALLS: dict[type, Callable[[Run, Any, Call], Value]] = {}
CONSTANTS: dict[str, Value] = {}  # of libraries, by path
FOREIGN_FIELDS: dict[str, Callable[[Run, Obj, str], Value | None]] = {}  # of objects that a model made
MAX_EXACT = 64


class Run(Machine):
    """One run."""

    def __init__(self, program: Program, main: SourceModule, launch: ProgramLaunch = NO_LAUNCH) -> None:
        super().__init__()
        self.program = program
        self.main = main
        self.beside = os.path.dirname(main.path)
        self.launch = launch
        self.modules: dict[str, Module] = {}
        self.classes: dict[Class, None] = {}
        self.given_up = False
        self.entered: set[ast.AST] = set()  # functions, and classes of which objects were made
        self.settled: set[ast.AST] = set()  # calls that made an interface, or that make none
        self.visited: set[ast.AST] = set()  # calls that were made
        self.dead: set[ast.AST] = set()  # statements and expressions left out for a constant reason
        self.latest: dict[ast.AST, Value] = {}
        self.handed: set[Obj] = set()  # objects that code of others got
        self.interfaces: dict[Obj, list[tuple[FoundNode, FoundEndpoint]]] = {}
        self.undeclared: set[str] = set()
        self.environment: dict[object, Value] = {}
        self.dependencies: frozenset[str] = frozenset()
        self.refusing: set[FoundNode] = set()  # nodes with a callback that may refuse parameters
        words = launch.words
        self.launched_words = None if words is None else (main.path, *words)
        self._functions: dict[object, Any] = {}
        self._tuples: dict[object, Obj] = {}
        self.joined: dict[Function, dict[str, Value]] = {}  # arguments of functions that take too many steps
        self.captured: dict[object, Any] = {}

    # --- walking --------------------------------------------------------------------------------------------

    def evaluate(self, node: ast.expr, frame: Frame) -> Value:
        self.step()
        handler = EXPRESSIONS.get(type(node))
        value = handler(self, node, frame) if handler else unknown(f"the result of {type(node).__name__}")
        self.latest[node] = value
        return value

    def execute(self, body: Sequence[ast.stmt], frame: Frame) -> int:
        ways = NEXT
        for index, statement in enumerate(body):
            self.step()
            self.ended = False
            taken = STATEMENTS[type(statement)](self, statement, frame)
            if self.ended:
                taken &= ~NEXT
            self.ended = False
            ways = (ways & ~NEXT) | taken
            if not taken & NEXT:
                self.dead.update(body[index + 1 :])
                break
        return ways

    def creates(self, source: SourceModule, node: ast.AST) -> bool:
        """Return whether the text of ``node`` has a word that makes an interface."""
        first, last = getattr(node, "lineno", 0), getattr(node, "end_lineno", 0)
        lines = creating_lines(source)
        index = bisect_left(lines, first)
        return index < len(lines) and lines[index] <= last

    def at(self, node: ast.AST, frame: Frame) -> SourceLocation:
        return SourceLocation(frame.module.source.path, getattr(node, "lineno", 0))

    def not_followed(self, node: ast.AST, frame: Frame, why: str) -> None:
        self.gap(self.at(node, frame), why)

    def unsettled(self) -> None:
        self.gap(SourceLocation(self.main.path), "the callbacks do not settle; names may be missing")

    # --- names ----------------------------------------------------------------------------------------------

    def assign(self, name: str, value: Value, frame: Frame, outward: bool = False) -> None:
        """Assign to a variable; ``outward``: out of the comprehensions around it, as ``:=`` does."""
        target = frame
        while outward and target.is_comprehension and target.closure is not None:
            target = target.closure
        cells = target.cells
        if name in target.elsewhere:
            scope = target.closure
            while scope is not None and (scope.cls is not None or name not in scope.cells):
                scope = scope.closure
            cells = frame.module.cells if scope is None else scope.cells
        self.store.write(cells, name, value)

    def look_up(self, name: str, frame: Frame) -> Value:
        found: Value = BOTTOM
        scope: Frame | None = frame
        while scope is not None:
            if name in scope.cells and (scope is frame or scope.cls is None) and name not in scope.elsewhere:
                own = scope is frame and scope.cells is not frame.module.cells
                held = scope.cells[name] if own else self.store.read(scope.cells, name)
                found = join(found, present(held))
                if held and (ABSENT[0] not in held or scope.cells is frame.module.cells):
                    return found
            scope = scope.closure
        held = self.store.read(frame.module.cells, name)
        if present(held):
            return join(found, present(held))
        if found:
            return found
        if name in BUILTINS:
            return external(f"builtins.{name}")
        if len(frame.module.stars) >= 1:
            return external(f"{frame.module.stars[0]}.{name}")
        return unknown(f"the name {name}")

    # --- objects --------------------------------------------------------------------------------------------

    def remembered(self, place: object, tag: str, make: Callable[[], Any]) -> Any:
        """Return the one thing that is made at ``place`` in this context."""
        key = (self.context, place, tag)
        if key not in self._functions:
            self._functions[key] = make()
        return self._functions[key]

    def tuple_of(self, *parts: Value) -> Value:
        """Return a tuple. It never changes, so that equal ones are one object."""
        found = self._tuples.get(parts)
        if found is None:
            found = self._tuples[parts] = Obj("tuple")
            found.cells[ITEMS] = (Items(parts),)
        return (found,)

    def sequence(self, node: ast.AST, kind: str, items: Items, tag: str = "") -> Value:
        """Return a list, set or iterator made at ``node``."""
        if items.exact is not None and (kind == "tuple" or kind == "lazy"):
            return self.tuple_of(*items.exact)
        obj = self.allocate(node, kind, tag=tag)
        if ITEMS in obj.cells:
            self.store.store(obj, ITEMS, (items,))
        else:
            self.store.write(obj.cells, ITEMS, (items,))
        return (obj,)

    def items_of(self, obj: Obj) -> Items:
        held = self.store.read(obj.cells, ITEMS)
        items = [each for each in held if isinstance(each, Items)]
        if not items:
            return Items(())
        return items[0] if ABSENT[0] not in held else Items(None, items[0].any_element())

    def library_object(self, call: Call, path: str, tag: str = "") -> Obj:
        """Return an object of the class ``path`` of a library that a model made."""
        return self.allocate(call.node, "instance", External(path), tag or path)

    # --- attributes -----------------------------------------------------------------------------------------

    def attribute(self, value: Value, name: str, node: ast.AST, frame: Frame, called: bool = False) -> Value:
        """Return what an attribute may be; ``called``: a method is asked for, also of something unknown."""
        atoms = [atom for atom in value if atom is not None] or list(value)
        return (
            join_all(
                (Method(atom, name),)
                if called and isinstance(atom, Unknown)
                else self._attribute(atom, name, node, frame)
                for atom in atoms
            )
            or ANY
        )

    def _attribute(self, atom: object, name: str, node: ast.AST, frame: Frame) -> Value:
        if isinstance(atom, Class):
            if name == "__name__":
                return (atom.name,)
            return self._unwrapped(self.class_attribute(atom, name), atom, node, frame, of_class=True)
        if isinstance(atom, Module):
            return self.member(atom, name, frame)
        if isinstance(atom, Obj) and atom.kind == "instance":
            return self._field(atom, name, node, frame)
        if isinstance(atom, External):
            path = f"{atom.path}.{name}"
            if path in self.modules:  # the folder of a module, without __init__.py
                return (self.modules[path],)
            return CONSTANTS.get(path) or external(path)
        if isinstance(atom, Super):
            return self._of_super(atom, name, node, frame)
        if isinstance(atom, Function) and name in ("__name__", "__qualname__"):
            return (atom.name,)
        if isinstance(atom, Bound) and name == "__name__":
            return (atom.function.name,)
        if isinstance(atom, Property) and name == "setter":
            return (Method(atom, "setter"),)
        if isinstance(atom, (Obj, str, Text)):
            return (Method(atom, name),)
        if isinstance(atom, Unknown):
            return (atom,)
        return unknown(f"the attribute {name} of {atom!r}" if atom is None else f"the attribute {name}")

    def _field(self, obj: Obj, name: str, node: ast.AST, frame: Frame) -> Value:
        held = self.store.read(obj.cells, name, ABSENT)
        found = present(held)
        if found and ABSENT[0] not in held:
            return found
        if isinstance(obj.cls, External):
            if found:
                return found  # where it is not set, an error ended the path
            model = FOREIGN_FIELDS.get(obj.cls.path)
            special = model(self, obj, name) if model else None
            return special if special is not None else (ForeignMethod(obj.cls.path, obj, name),)
        assert isinstance(obj.cls, Class)
        if name == "__class__":
            return (obj.cls,)
        if name == "__dict__":
            return unknown("the attributes of an object as a mapping")
        inherited = self.class_attribute(obj.cls, name, libraries=not found)
        if found and not inherited:
            return found  # else an error ends the path
        return join(found, self._unwrapped(inherited, obj, node, frame))

    def class_attribute(
        self, cls: Class, name: str, after: Class | None = None, libraries: bool = True
    ) -> Value:
        """Return what ``cls`` has or inherits under ``name``; a library's base class is the last that is asked."""
        found: Value = BOTTOM
        order = cls.order[cls.order.index(after) + 1 :] if after in cls.order else cls.order
        for base in order:
            if isinstance(base, Class):
                held = self.store.read(base.cells, name, ABSENT)
                found = join(found, present(held))
                if held and ABSENT[0] not in held:
                    return found
        for base in order if libraries else ():
            if isinstance(base, External) and inherits(base.path, name, order):
                return join(found, (ForeignMethod(base.path, None, name),))
        return found

    def _unwrapped(
        self, value: Value, receiver: object, node: ast.AST, frame: Frame, of_class: bool = False
    ) -> Value:
        """Bind functions to ``receiver`` and read properties."""
        result: Value = BOTTOM
        for atom in value:
            if isinstance(atom, Function) and not of_class:
                result = join(result, (Bound(atom, receiver),))
            elif isinstance(atom, Wrapped):
                cls = receiver if of_class else getattr(receiver, "cls", None)
                for function in atom.function:
                    bind = isinstance(function, Function) and not atom.static
                    result = join(result, (Bound(function, cls) if bind else function,))  # type: ignore[arg-type]
            elif isinstance(atom, Property) and not of_class:
                result = join(result, self.call(atom.getter, Arguments([(receiver,)]), node, frame))
            elif isinstance(atom, ForeignMethod) and atom.receiver is None:
                found = (
                    external(f"{atom.path}.{atom.name}") if of_class else (atom._replace(receiver=receiver),)
                )
                result = join(result, found)
            else:
                result = join(result, (atom,))
        if result:
            return result
        getter = receiver.cls if isinstance(receiver, Obj) and isinstance(receiver.cls, Class) else None
        if getter is not None and self.class_attribute(getter, "__getattr__"):
            return unknown("an attribute that __getattr__ gives")
        return unknown("an attribute that is not set here")

    def _of_super(self, proxy: Super, name: str, node: ast.AST, frame: Frame) -> Value:
        cls = proxy.receiver if isinstance(proxy.receiver, Class) else getattr(proxy.receiver, "cls", None)
        if not isinstance(cls, Class):
            cls = proxy.owner
        found = self.class_attribute(cls, name, after=proxy.owner)
        if not found:
            return (ForeignMethod("builtins.object", proxy.receiver, name),)
        if isinstance(proxy.receiver, Class):
            return self._unwrapped(found, proxy.receiver, node, frame, of_class=name != "__init_subclass__")
        return self._unwrapped(found, proxy.receiver, node, frame)

    def set_attribute(self, owner: Value, name: str, value: Value, node: ast.AST, frame: Frame) -> None:
        for atom in owner:
            if not isinstance(atom, Obj) or atom.kind not in ("instance", "class", "module"):
                continue
            held = self.class_attribute(atom.cls, name) if isinstance(atom.cls, Class) else BOTTOM
            setter = join_all(each.setter for each in held if isinstance(each, Property))
            if setter:
                self.call(setter, Arguments([(atom,), value]), node, frame)
            elif len(owner) > 1:
                self.store.store(atom, name, join(self.store.read(atom.cells, name, ABSENT), value))
            else:
                self.store.store(atom, name, value)

    # --- modules --------------------------------------------------------------------------------------------

    def member(self, module: Module, name: str, frame: Frame) -> Value:
        """Return what a module holds under ``name``, or its submodule."""
        held = present(self.store.read(module.cells, name))
        if held:
            return held
        found = self.load(f"{module.source.name}.{name}", frame)
        if found is not None:
            return (found,)
        return external(f"{module.stars[0] if module.stars else module.source.name}.{name}")

    def import_module(self, name: str, frame: Frame) -> Value:
        found = self.load(name, frame)
        return external(name) if found is None else (found,)

    def load(self, name: str, frame: Frame) -> Module | None:
        """Return an analysed module, executed if it is new; ``None`` for one of a library."""
        if name in self.modules:
            return self.modules[name]
        package, _, last = name.rpartition(".")
        path = self.program.find(name, self.beside)
        source = frame.module.source
        if path is None and package and source.package() == package and not source.is_package:
            path = self.program.find(last, os.path.dirname(source.path))  # no __init__.py beside it
        if path is None:
            return None
        parent = self.load(package, frame) if package else None
        module = self.execute_module(self.program.load(path, name), name)
        if parent is not None:
            self.store.write(parent.cells, last, (module,))
        return module

    def execute_module(self, source: SourceModule, name: str) -> Module:
        module = self.modules[name] = Module(source)
        module.cells["__name__"] = (name,)
        module.cells["__file__"] = (source.path,)
        if source.error:
            self.gap(SourceLocation(source.path, source.error_line), f"the file {source.error}")
            return module
        frame = Frame(module, module.cells, None, Jumps(self.store.mark()))
        outer, self.context = self.context, ("module", name)
        reads, self.store.reads = self.store.reads, None
        self.execute(source.tree.body, frame)
        self.store.reads = reads
        self.context = outer
        self.ended = False
        return module

    # --- calls ----------------------------------------------------------------------------------------------

    def call(self, callee: Value, args: Arguments, node: ast.AST, frame: Frame) -> Value:
        """Call each of what may be meant, as sides of a branch where there are several."""
        call = Call(args, node, frame)
        atoms = [atom for atom in callee if atom is not None]
        if len(atoms) == 1:
            return self.call_atom(atoms[0], call)
        results: list[Value] = []

        def side(atom: object) -> int:
            results.append(self.call_atom(atom, call))
            ended, self.ended = self.ended, False
            return 0 if ended else NEXT

        if atoms and not self.branch([lambda atom=atom: side(atom) for atom in atoms]) & NEXT:  # type: ignore[misc]
            self.ended = True
        return join_all(results) if atoms else unknown("the result of something that is not set")

    def call_atom(self, atom: object, call: Call) -> Value:
        self.step()
        if type(atom) is not Unknown:
            self.settled.add(call.node)
        handler = CALLS.get(type(atom))
        return handler(self, atom, call) if handler else ANY

    def call_later(self, callee: Value, args: Arguments, call: Call) -> None:
        """Have a callback called with ``args`` at any time from now on."""
        for atom in callee:
            if isinstance(atom, (str, Text, int, float, Unknown, External)) or atom is None:
                continue
            if type(atom) not in CALLS:
                continue
            key = (atom, tuple(args.positional), tuple(args.keywords), args.more)
            self.later(key, lambda atom=atom: self.from_outside(atom, args, call))  # type: ignore[misc]

    def from_outside(self, atom: object, args: Arguments, call: Call) -> Value:
        """Call something that no statement of the program calls."""
        outer, self.context = self.context, ("callback",)
        value = self.call_atom(atom, Call(args, call.node, call.frame))
        self.context = outer
        self.ended = False
        return value

    # --- what stays open until a launch ---------------------------------------------------------------------

    def of_launch(self, piece: Input | OwnName) -> Value:
        self.has_inputs = True
        self.asks_launch = self.asks_launch or (isinstance(piece, Input) and piece.item is not None)
        return (Text((piece,)),)


CREATING = re.compile(
    r"create_(?:publisher|subscription|service|client|node|lifecycle_publisher)|ActionClient|ActionServer|Subscriber\("
    r"|Broadcaster\(|TransformListener\(|Node\(|Node\.__init__|ParameterClient\(|wait_for_message|Updater\("
)


@functools.lru_cache(maxsize=256)
def creating_lines(source: SourceModule) -> list[int]:
    """Return the numbers of the lines that may make an interface, in order."""
    return source.lines_with(CREATING)


def inherits(path: str, name: str, order: Sequence[object]) -> bool:
    """Return whether an object may have ``name`` from the class ``path`` of a library."""
    if path == "builtins.object":
        return name.startswith("__")
    return not path.startswith(("typing.", "abc.", "enum.")) or name.startswith("__") or len(order) < 2
