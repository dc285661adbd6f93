"""The net under the analysis: was every call that reaches an interface evaluated, from each of its callers?

Takes a finished ``Run``, gives a gap for what was lost. It reads the text alone and knows nothing of values. A *place*
is a call of something that makes nodes or interfaces (``create_publisher``, ``ActionClient`` ...), or of a function or
class of the program whose text reaches one, by its name. For every function that live text refers to, and for every
call that entered it, each place in it must have been evaluated, unless the text says that control does not get there:
a test of a literal, of ``__name__`` or of a parameter that is a literal in this call, or a statement behind ``return``
or ``raise``. A function that something live refers to and that nothing entered is a gap as a whole.

So a mistake of the analysis that skips a branch, ends a path too early, loses a caller, a callback or a module shows up
here. What it cannot see: a wrong value, and creation behind names that do not stand in the text.
"""

from __future__ import annotations

import ast
import functools
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

from enclave_addons.inference.interpreter.imports import absolute_name
from enclave_addons.inference.interpreter.run import Run
from enclave_addons.inference.models import ros
from enclave_addons.inference.models.signatures import NODE_ENDPOINTS
from enclave_addons.inference.program import Program, SourceModule
from enclave_addons.inference.values import FunctionEntry
from nodl.node_interface import Gap
from nodl.source_ref import SourceRef

Function = ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda
_NAMED = (ast.FunctionDef, ast.AsyncFunctionDef)
Import = ast.Import | ast.ImportFrom
CREATING_NAMES = frozenset(NODE_ENDPOINTS) | ros.CREATING_NAMES
_CREATING_TEXT = re.compile("|".join(sorted(map(re.escape, CREATING_NAMES))))
_ELSEWHERE = re.compile(r"rclpy|\b(?:importlib|__import__|eval|exec|runpy|pickle)\b")
_LOST = "may be called from somewhere that the analysis did not follow, and would create interfaces"


def may_make_interfaces(program: Program, main: SourceModule) -> bool:
    """Return True if running this file could: it, or a file of the program that it imports, says so or runs other code.

    A file that cannot be parsed could do anything.
    """
    beside = main.path.rpartition("/")[0]
    found = {main.path: main}
    left = [main]
    while left:
        module = left.pop()
        if module.error or _CREATING_TEXT.search(module.text) or _ELSEWHERE.search(module.text):
            return True
        for name in dict.fromkeys(n for node in ast.walk(module.tree) for n in _imported(node, module)):
            path = program.find(name, beside) or program.find(name, module.path.rpartition("/")[0])
            if path is not None and path not in found:
                found[path] = program.load(path, name)
                left.append(found[path])
    return False


def _imported(node: ast.AST, module: SourceModule) -> Iterator[str]:
    """Return the modules that an import statement may mean, with the packages around them."""
    names: list[str] = []
    if isinstance(node, ast.Import):
        names = [alias.name for alias in node.names]
    elif isinstance(node, ast.ImportFrom):
        package = absolute_name(node, module)
        names = [package, *(f"{package}.{alias.name}" for alias in node.names)]
    for name in names:
        steps = name.split(".")
        yield from (".".join(steps[:count]) for count in range(1, len(steps) + 1))


# --- what stands in the text --------------------------------------------------------------------------------


Outcome = tuple[ast.expr | None, bool]
"""A test, and what it must have given for control to come to a place; ``None``: what only values decide."""
Outcomes = tuple[Outcome, ...]
_UNDECIDED: Outcome = (None, True)


class CallPlace(NamedTuple):
    """A call by name, with the tests around it inside of its function.

    ``certain``: each run of the function gets there.
    """

    node: ast.Call
    name: str
    around: Outcomes
    certain: bool

    @property
    def is_bare(self) -> bool:
        """Return True if it calls a name alone, which cannot be a method."""
        return isinstance(self.node.func, ast.Name)


class FunctionText:
    """The text of one function without the functions in it; ``node`` is ``None`` for a module with its class bodies."""

    def __init__(self, node: Function | None, cls: ast.ClassDef | None, path: str) -> None:
        self.node = node
        self.cls = cls
        self.path = path
        self.calls: list[CallPlace] = []
        self.names: set[str] = set()  # that are read, and not just called
        self.attributes: set[str] = set()  # the same, with identifiers in texts
        self.inner: list[FunctionText] = []  # lambdas and decorated functions, whose use needs no name
        self.stored: set[str] = set()  # variables
        self.set: set[str] = set()  # attributes, which may be properties
        self.may_leave = False  # before what is read next
        self.imports: list[Import] = []

    @property
    def name(self) -> str:
        return "" if self.node is None else getattr(self.node, "name", "a lambda")

    @functools.cached_property
    def bare(self) -> frozenset[str]:
        """Return what the function reads or calls by a name alone."""
        return frozenset({*self.names, *(place.name for place in self.calls if place.is_bare)})

    @functools.cached_property
    def dotted(self) -> frozenset[str]:
        """Return what it reads or calls of something, by last names, and what a text may name."""
        return frozenset({*self.attributes, *(place.name for place in self.calls if not place.is_bare)})


def _with_inner(scope: FunctionText) -> Iterator[FunctionText]:
    yield scope
    for inner in scope.inner:
        yield from _with_inner(inner)


class _Text(NamedTuple):
    scopes: list[FunctionText]
    classes: dict[str, list[ast.ClassDef]]
    imported: set[str]  # names that come from other modules


@functools.lru_cache(maxsize=256)
def _text_of(module: SourceModule) -> _Text:
    reader = _Reader(module)
    top = FunctionText(None, None, module.path)
    reader.scopes.append(top)
    reader.block(module.tree.body, top, ())
    return _Text(reader.scopes, reader.classes, reader.imported)


@functools.lru_cache(maxsize=256)
def words_read(module: SourceModule) -> dict[ast.AST | None, frozenset[str]]:
    """Return what each function of a module reads or calls, by the last names in its text."""
    return {scope.node: scope.bare | scope.dotted for scope in _text_of(module).scopes}


class _Reader:
    """Walks a module's tree once."""

    def __init__(self, module: SourceModule) -> None:
        self.module = module
        self.scopes: list[FunctionText] = []
        self.classes: dict[str, list[ast.ClassDef]] = {}
        self.imported: set[str] = set()
        self._class: ast.ClassDef | None = None  # whose body is read, outside of its methods

    def block(self, body: list[ast.stmt], scope: FunctionText, around: Outcomes) -> None:
        """Read statements in order, up to one that control cannot pass."""
        for index, statement in enumerate(body):
            self.visit(statement, scope, around)
            if isinstance(statement, ast.If) and not statement.orelse and _leaves(statement.body):
                self.block(body[index + 1 :], scope, (*around, (statement.test, False)))
                return
            if isinstance(statement, _LEAVING):
                scope.may_leave = True
                return

    def visit(self, node: ast.AST, scope: FunctionText, around: Outcomes) -> None:
        _VISITORS.get(type(node), _Reader.inside)(self, node, scope, around)

    def inside(self, node: ast.AST, scope: FunctionText, around: Outcomes) -> None:
        """Read what ``node`` consists of."""
        if isinstance(node, _CONDITIONAL):
            around = (*around, _UNDECIDED)
        for field in node._fields:
            value = getattr(node, field, None)
            if isinstance(value, list) and value and isinstance(value[0], ast.stmt):
                self.block(value, scope, around)
            elif isinstance(value, list):
                self._each([each for each in value if isinstance(each, ast.AST)], scope, around)
            elif isinstance(value, ast.AST) and value._fields:
                self.visit(value, scope, around)

    def name(self, node: ast.Name, scope: FunctionText, around: Outcomes) -> None:
        if isinstance(node.ctx, ast.Load):
            scope.names.add(node.id)
        else:
            scope.stored.add(node.id)

    def attribute(self, node: ast.Attribute, scope: FunctionText, around: Outcomes) -> None:
        (scope.attributes if isinstance(node.ctx, ast.Load) else scope.set).add(node.attr)
        self.visit(node.value, scope, around)

    def constant(self, node: ast.Constant, scope: FunctionText, around: Outcomes) -> None:
        if isinstance(node.value, str) and node.value.isidentifier():
            scope.attributes.add(node.value)

    def imports(self, node: Import, scope: FunctionText, around: Outcomes) -> None:
        scope.imports.append(node)
        if isinstance(node, ast.ImportFrom):
            scope.attributes.update(alias.name for alias in node.names if alias.asname)
            self.imported.update(alias.name for alias in node.names)

    def call(self, node: ast.Call, scope: FunctionText, around: Outcomes) -> None:
        name = last_name(node.func)
        scope.calls.append(CallPlace(node, name, around, not scope.may_leave and not around))
        scope.may_leave = scope.may_leave or name in _ENDS
        if name in ("isinstance", "issubclass"):
            self._each(node.args[:1], scope, around)
            return
        if not isinstance(node.func, ast.Name):
            self.visit(node.func.value if isinstance(node.func, ast.Attribute) else node.func, scope, around)
        self._each(node.args, scope, around)
        self._each(node.keywords, scope, around)

    def global_names(self, node: ast.Global, scope: FunctionText, around: Outcomes) -> None:
        scope.set.update(node.names)

    def outer_names(self, node: ast.Nonlocal, scope: FunctionText, around: Outcomes) -> None:
        for each in self.scopes:  # one of them is meant
            each.stored.update(node.names)

    def assignment(self, node: ast.Assign, scope: FunctionText, around: Outcomes) -> None:
        if not any(last_name(each) == "__all__" for each in node.targets):
            self.inside(node, scope, around)

    def addition(self, node: ast.AugAssign, scope: FunctionText, around: Outcomes) -> None:
        scope.attributes.add(last_name(node.target))
        self.inside(node, scope, around)

    def annotated(self, node: ast.AnnAssign, scope: FunctionText, around: Outcomes) -> None:
        self._each([node.target, *([node.value] if node.value else [])], scope, around)

    def branches(self, node: ast.If | ast.IfExp | ast.While, scope: FunctionText, around: Outcomes) -> None:
        if last_name(node.test) != "TYPE_CHECKING":
            self.visit(node.test, scope, (*around, _UNDECIDED))
            self._side(node.body, scope, (*around, (node.test, True)))
        otherwise = _UNDECIDED if isinstance(node, ast.While) else (node.test, False)
        self._side(node.orelse, scope, (*around, otherwise))

    def _side(self, side: ast.expr | list[ast.stmt], scope: FunctionText, around: Outcomes) -> None:
        if isinstance(side, list):
            self.block(side, scope, around)
        else:
            self.visit(side, scope, around)

    def connection(self, node: ast.BoolOp, scope: FunctionText, around: Outcomes) -> None:
        around = (*around, _UNDECIDED)
        for value in node.values:
            self.visit(value, scope, around)
            around = (*around, (value, isinstance(node.op, ast.And)))

    def _each(self, nodes: Iterable[ast.AST], scope: FunctionText, around: Outcomes) -> None:
        for node in nodes:
            self.visit(node, scope, around)

    def function(self, node: Function, scope: FunctionText, around: Outcomes) -> None:
        cls, self._class = self._class, None
        inner = FunctionText(node, cls, self.module.path)
        self.scopes.append(inner)
        defaults = [*node.args.defaults, *(each for each in node.args.kw_defaults if each is not None)]
        if isinstance(node, ast.Lambda):
            scope.inner.append(inner)
            self._each(defaults, scope, around)
            self.visit(node.body, inner, ())
            self._class = cls
            return
        self._each([*defaults, *node.decorator_list], scope, around)
        if any(last_name(each) not in _PLAIN_DECORATORS for each in node.decorator_list):
            scope.inner.append(inner)
        self.block(node.body, inner, ())
        self._class = cls

    def class_body(self, node: ast.ClassDef, scope: FunctionText, around: Outcomes) -> None:
        self.classes.setdefault(node.name, []).append(node)
        self._each(node.decorator_list, scope, around)
        outer, self._class = self._class, node
        self.block(node.body, scope, around)
        self._class = outer


_VISITORS: dict[type, Callable[[_Reader, Any, FunctionText, Outcomes], None]] = {
    ast.Name: _Reader.name,
    ast.Attribute: _Reader.attribute,
    ast.Constant: _Reader.constant,
    ast.Call: _Reader.call,
    **dict.fromkeys((ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda), _Reader.function),
    ast.ClassDef: _Reader.class_body,
    **dict.fromkeys((ast.Import, ast.ImportFrom), _Reader.imports),
    ast.Global: _Reader.global_names,
    ast.Nonlocal: _Reader.outer_names,
    ast.Assign: _Reader.assignment,
    ast.AugAssign: _Reader.addition,
    ast.AnnAssign: _Reader.annotated,
    **dict.fromkeys((ast.If, ast.IfExp, ast.While), _Reader.branches),
    ast.BoolOp: _Reader.connection,
}

_LEAVING = (ast.Return, ast.Raise, ast.Continue, ast.Break)


def _leaves(body: list[ast.stmt]) -> bool:
    """Return whether control certainly goes elsewhere at the end of ``body``."""
    return bool(body) and isinstance(body[-1], _LEAVING)


_CONDITIONAL = (
    ast.For, ast.AsyncFor, ast.Try, ast.Match, ast.comprehension, ast.Assert, ast.ListComp, ast.SetComp, ast.DictComp,
    ast.GeneratorExp,
)  # fmt: skip
_ENDS = frozenset({"exit", "_exit", "quit"})
_PLAIN_DECORATORS = frozenset({
    "property", "cached_property", "staticmethod", "classmethod", "abstractmethod", "override", "overload", "setter",
    "getter", "deleter", "lru_cache", "cache", "contextmanager", "asynccontextmanager", "final", "wraps", "fixture",
})  # fmt: skip


def last_name(node: ast.AST) -> str:
    """Return ``c`` of ``a.b.c``, ``c`` or ``a.b.c(...)``; nothing for the rest."""
    if isinstance(node, ast.Attribute):
        return node.attr
    if isinstance(node, ast.Call):
        return last_name(node.func)
    return node.id if isinstance(node, ast.Name) else ""


# --- what the run made of it --------------------------------------------------------------------------------


def unsettled_places(
    run: Run, called: Iterable[ast.AST] = (), instantiated: Iterable[ast.AST] = ()
) -> list[Gap]:
    """Return a gap for each place whose fate is not known; ``called``, ``instantiated``: what other runs have
    followed.
    """
    modules = list(dict.fromkeys(module.source for module in run.modules.values()))
    if run.gave_up or not any(_CREATING_TEXT.search(module.text) for module in modules):
        return []
    net = _Net(run, modules, {*called}, {*instantiated})
    net.settle()
    return list(dict.fromkeys(net.gaps))


class _Net:
    def __init__(
        self, run: Run, modules: list[SourceModule], called: set[ast.AST], instantiated: set[ast.AST]
    ) -> None:
        self.gaps: list[Gap] = []
        self._run = run
        self._elsewhere = called
        self._instantiated = instantiated | set(run.instantiated)
        self._modules = {module.path: module for module in modules}
        self._names = {module.source.path: name for name, module in reversed(run.modules.items())}
        self._texts = {module.path: _text_of(module) for module in modules}
        self._scopes = [scope for text in self._texts.values() for scope in text.scopes]
        self._classes: dict[str, list[ast.ClassDef]] = {}
        for text in self._texts.values():
            for name, nodes in text.classes.items():
                self._classes.setdefault(name, []).extend(nodes)
        self._callers = {place.node: scope for scope in self._scopes for place in scope.calls}
        self._find_makers()

    def settle(self) -> None:
        """Look at every place in what is live."""
        for scope in self._live():
            places = [place for place in scope.calls if self._makes(place, scope)]
            if scope.node is None:
                self._entered(scope, None, places)
            elif scope.node in self._run.entries:
                for entry in self._run.entries[scope.node]:
                    self._entered(scope, entry, places)
            elif places and scope.node not in self._elsewhere:
                self._gap(scope, places[0].node, f"{scope.name} {_LOST}")
        for path, text in self._texts.items():
            for name in sorted(self._node_classes & text.classes.keys()):
                lost = [node for node in text.classes[name] if node not in self._instantiated]
                if lost and self._is_meant(name, path):
                    self.gaps.append(Gap(SourceRef(path, lost[0].lineno), f"class {name} {_LOST}"))

    # --- which names reach an interface ---------------------------------------------------------------------

    def _find_makers(self) -> None:
        """Find the names of functions and classes whose text reaches an interface, by names."""
        self._node_classes = frozenset(self._class_makers(set()))
        self._makers = {*CREATING_NAMES, *self._node_classes}
        self._bare_makers = set(self._makers)  # what a name alone can mean: no methods
        functions = [scope for scope in self._scopes if isinstance(scope.node, _NAMED)]
        while True:
            known = len(self._makers), len(self._bare_makers)
            found = [scope for scope in functions if any(map(self._mentions_maker, _with_inner(scope)))]
            constructed = {
                scope.cls.name for scope in found if scope.cls is not None and scope.name in _CONSTRUCTORS
            }
            classes = self._class_makers(constructed)
            self._makers.update(classes, (scope.name for scope in found if scope.name not in _CONSTRUCTORS))
            self._bare_makers.update(classes, (scope.name for scope in found if scope.cls is None))
            if known == (len(self._makers), len(self._bare_makers)):
                return

    def _mentions_maker(self, scope: FunctionText) -> bool:
        return not (self._bare_makers.isdisjoint(scope.bare) and self._makers.isdisjoint(scope.dotted))

    def _class_makers(self, known: set[str]) -> set[str]:
        """Return classes with a base, near or far, that makes a node, or is among ``known``."""
        found = set(known)
        while True:
            more = {
                name
                for name, nodes in self._classes.items()
                if name not in found
                if any(last_name(base) in found | CREATING_NAMES for node in nodes for base in node.bases)
            }
            if not more:
                return found
            found |= more

    def _makes(self, place: CallPlace, scope: FunctionText) -> bool:
        if place.name == "__init__":  # of a base class, which makes the node
            return scope.cls is not None and scope.cls.name in self._makers
        return place.name in (self._bare_makers if place.is_bare else self._makers)

    # --- what is live ---------------------------------------------------------------------------------------

    def _live(self) -> list[FunctionText]:
        """Return modules, what their text refers to, what that refers to, and so on."""
        self._meant: set[tuple[str, str]] = set()  # names by file, or for any file ("")
        live = [scope for scope in self._scopes if scope.node is None]
        waiting = [scope for scope in self._scopes if scope.node is not None]
        seen = 0
        while True:
            for scope in live[seen:]:
                self._refer(scope)
                self._imports(scope)
            inner = {each for scope in live[seen:] for each in scope.inner}
            seen = len(live)
            more = [scope for scope in waiting if scope in inner or self._is_live(scope)]
            if not more:
                return live
            live.extend(more)
            waiting = [scope for scope in waiting if scope not in more]

    def _refer(self, scope: FunctionText) -> None:
        """Note what the text refers to, and calls that were not evaluated, or on something that is not known."""
        self._meant.update(("", name) for name in scope.attributes | scope.set)
        names = set(scope.names)
        for place in scope.calls:
            entries = self._run.entries.get(scope.node) if scope.node is not None else None
            seen = place.node in self._evaluated or all(
                self._is_dead(place, scope, entry) for entry in entries or (None,)
            )
            if not seen or place.node in self._run.doubtful:
                if isinstance(place.node.func, ast.Name):
                    names.add(place.name)
                else:
                    self._meant.add(("", place.name))
        self._meant.update((scope.path, name) for name in names)
        self._meant.update(("", name) for name in names & self._texts[scope.path].imported)

    @functools.cached_property
    def _evaluated(self) -> set[ast.AST]:
        return {node for node, _ in self._run.evaluated}

    @functools.cached_property
    def _evaluated_from(self) -> set[tuple[ast.AST, ast.AST | None]]:
        """Calls that were evaluated, with the call that entered their function."""
        return {(node, entry and entry.call) for node, entry in self._run.evaluated}

    def _is_meant(self, name: str, path: str) -> bool:
        return ("", name) in self._meant or (path, name) in self._meant

    def _is_live(self, scope: FunctionText) -> bool:
        if scope.node in self._run.entries:
            return True
        if isinstance(scope.node, ast.Lambda):
            return False
        name, cls = scope.name, scope.cls
        if cls is None:
            return self._is_meant(name, scope.path)
        used = cls in self._instantiated or self._is_meant(cls.name, scope.path)
        special = name.startswith("__") and name.endswith("__")
        return used and (special or self._is_meant(name, scope.path))

    def _imports(self, scope: FunctionText) -> None:
        """Add a gap for a module of the program that live text imports, makes interfaces and was not followed."""
        if scope.node is not None and scope.node not in self._run.entries:
            return
        module = self._modules[scope.path]
        for node in scope.imports:
            for name in _imported(node, module):
                path = self._run.program.find(name, self._run.beside)
                if path is None or path in self._modules:
                    continue
                if _CREATING_TEXT.search(self._run.program.load(path, name).text):
                    self._gap(scope, node, f"the module {name} was not followed, and would create interfaces")

    # --- one function, entered by one call ------------------------------------------------------------------

    def _entered(self, scope: FunctionText, entry: FunctionEntry | None, places: list[CallPlace]) -> None:
        for place in places:
            if (
                (place.node, entry) in self._run.evaluated
                if place.certain
                else (place.node, entry and entry.call) in self._evaluated_from
            ):
                if place.node not in self._run.understood:
                    self._gap(
                        scope, place.node, f"{place.name}() is called on something that is not understood"
                    )
            elif not self._is_dead(place, scope, entry):
                self._gap(scope, place.node, self._skipped(scope, place, entry))

    def _skipped(self, scope: FunctionText, place: CallPlace, entry: FunctionEntry | None) -> str:
        caller = self._callers.get(entry.call) if entry and isinstance(entry.call, ast.Call) else None
        line = getattr(entry and entry.call, "lineno", 0)
        where = f" where {scope.name} is called at {caller.path.rpartition('/')[2]}:{line}" if caller else ""
        return f"{place.name}() was not reached{where}; what it would make there is not listed"

    def _is_dead(self, place: CallPlace, scope: FunctionText, entry: FunctionEntry | None) -> bool:
        return is_dead(place.around, self._names[scope.path], _literals(scope, entry and entry.call))

    def _gap(self, scope: FunctionText, node: ast.AST, why: str) -> None:
        self.gaps.append(Gap(SourceRef(scope.path, getattr(node, "lineno", 0)), why))


_CONSTRUCTORS = frozenset({"__init__", "__new__", "__post_init__"})


# --- literals in the text -----------------------------------------------------------------------------------

Literals = Mapping[str, object]  # by parameter


def is_dead(around: Outcomes, module: str, literals: Literals = MappingProxyType({})) -> bool:
    """Return True if a test of literals, or of the ``module``'s name, does not have the outcome that it must have."""
    return any(
        test is not None and _decided(test, module, literals) is (not outcome) for test, outcome in around
    )


def _decided(test: ast.expr, module: str, literals: Literals) -> bool | None:
    """Return the truth of a literal, or of a test of ``__name__``, ``TYPE_CHECKING`` or a parameter that is one;
    ``None`` for all others."""
    if isinstance(test, ast.Constant):
        return bool(test.value)
    if isinstance(test, ast.Name) and test.id in literals:
        return bool(literals[test.id])
    if isinstance(test, (ast.Name, ast.Attribute)) and last_name(test) == "TYPE_CHECKING":
        return False
    if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
        outcome = _decided(test.operand, module, literals)
        return None if outcome is None else not outcome
    if isinstance(test, ast.Compare) and isinstance(test.left, ast.Name) and len(test.ops) == 1:
        known = {**literals, "__name__": module}
        other, op = test.comparators[0], test.ops[0]
        if test.left.id in known and isinstance(other, ast.Constant):
            equal = known[test.left.id] == other.value
            if isinstance(op, (ast.Eq, ast.NotEq)) or other.value is None:
                return equal is isinstance(op, (ast.Eq, ast.Is))
    return None


def _literals(scope: FunctionText, entry: ast.AST | None) -> Literals:
    """Return the parameters for which the call ``entry`` of this function has a literal, or leaves the default, one."""
    node = scope.node
    if isinstance(node, ast.Lambda) or node is None or node.decorator_list or not isinstance(entry, ast.Call):
        return {}
    called = last_name(entry.func)
    constructs = scope.name == "__init__" and scope.cls is not None and called == scope.cls.name
    if not (constructs or called == scope.name) or any(each.arg is None for each in entry.keywords):
        return {}
    arguments = [*node.args.posonlyargs, *node.args.args]
    defaults = dict(
        zip(reversed([each.arg for each in arguments]), reversed(node.args.defaults), strict=False)
    )
    bound = scope.cls is not None or isinstance(entry.func, ast.Attribute)  # with self, or perhaps
    given = len(entry.args) + bound
    if any(isinstance(each, ast.Starred) for each in entry.args):
        given = len(arguments)
    values: dict[str, ast.expr | None] = {each.arg: defaults.get(each.arg) for each in arguments[given:]}
    values.update(
        (each.arg, default) for each, default in zip(node.args.kwonlyargs, node.args.kw_defaults, strict=True)
    )
    values.update((each.arg, each.value) for each in entry.keywords if each.arg is not None)
    return {
        name: value.value
        for name, value in values.items()
        if isinstance(value, ast.Constant) and name not in scope.stored
    }
