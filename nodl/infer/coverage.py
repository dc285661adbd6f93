"""After a run: was every place that could make an interface reached, and if not, why not?

Takes a finished ``Run``, gives a gap for each place in its modules whose fate is not known. A place is a mention
of something that makes nodes or interfaces (``create_publisher``, ``ActionClient`` ...), or a node class. It is
settled when

- the interpreter evaluated it and a model or a function of the program took the call;
- control certainly does not get there: a decided test, an empty loop, a statement behind a ``return``;
- it stands in a function or class that nothing refers to: not by name, not by a text with its name, not as an attribute
  of something unknown.

This is the net under the models: semantics that lose a function on its way to its caller show up here.
"""

from __future__ import annotations

import ast
import functools
import re
from bisect import bisect_left
from collections.abc import Iterable, Iterator

from enclave_launch.boundary.light import NamedTuple
from nodl.infer.analysis import is_node
from nodl.infer.interpreter.imports import absolute_name
from nodl.infer.interpreter.run import Run
from nodl.infer.models import ros
from nodl.infer.models.signatures import NODE_ENDPOINTS
from nodl.infer.program import Program, SourceModule
from nodl.infer.values import FunctionValue, ModuleValue
from nodl.node_interface import Gap
from nodl.source_ref import SourceRef

_LOST = "may be called from somewhere that the analysis did not follow, and would create interfaces"
Function = ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda
_CREATING_NAMES = frozenset(NODE_ENDPOINTS) | ros.CREATING_NAMES
_CREATING_TEXT = re.compile("|".join(sorted(map(re.escape, _CREATING_NAMES))))


_ELSEWHERE = re.compile(r"rclpy|\b(?:importlib|__import__|eval|exec|runpy|pickle)\b")


def may_make_interfaces(program: Program, main: SourceModule) -> bool:
    """Whether running this file could: it, or a file of the program that it imports, says so or runs other code.

    A file that cannot be parsed could do anything.
    """
    beside = main.path.rpartition("/")[0]
    found = {main.path: main}
    left = [main]
    while left:
        module = left.pop()
        if module.error or _CREATING_TEXT.search(module.text) or _ELSEWHERE.search(module.text):
            return True
        for name in dict.fromkeys(_imported(module)):
            path = program.find(name, beside) or program.find(name, module.path.rpartition("/")[0])
            if path is not None and path not in found:
                found[path] = program.load(path, name)
                left.append(found[path])
    return False


def _imported(module: SourceModule) -> Iterator[str]:
    """The modules that import statements may mean, with the packages around them."""
    for node in ast.walk(module.tree):
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            package = absolute_name(node, module)
            names = [package, *(f"{package}.{alias.name}" for alias in node.names)]
        for name in names:
            steps = name.split(".")
            yield from (".".join(steps[:count]) for count in range(1, len(steps) + 1))


def unsettled_places(
    run: Run, called: Iterable[ast.AST] = (), instantiated: Iterable[ast.AST] = ()
) -> list[Gap]:
    """A gap for each place whose fate is not known; ``called``, ``instantiated``: what other runs have followed."""
    modules = [module for module in run.modules.values() if _CREATING_TEXT.search(module.source.text)]
    if not modules:
        return []
    audit = _Audit(run, {*run.called, *called}, {*run.instantiated, *instantiated})
    for module in dict.fromkeys(modules):
        audit.module(module)
    return list(dict.fromkeys(audit.gaps))


class _Mentions:
    """What the executed code of all modules refers to."""

    def __init__(self) -> None:
        self.names: dict[str, set[str]] = {}  # by file
        self.imported: dict[str, set[str]] = {}  # names that a file imports
        self.texts: set[str] = set()

    def add(self, file: str, nodes: Iterable[ast.AST]) -> None:
        names, imported = self.names.setdefault(file, set()), self.imported.setdefault(file, set())
        for node in nodes:
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
                names.add(node.id)
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                self.texts.add(node.value)
            elif isinstance(node, ast.ImportFrom):
                imported.update(alias.name for alias in node.names)

    def name(self, name: str, file: str) -> bool:
        elsewhere = any(
            name in names and name in self.imported.get(other, ()) for other, names in self.names.items()
        )
        return name in self.names.get(file, ()) or elsewhere


class _Audit:
    def __init__(self, run: Run, called: set[ast.AST], instantiated: set[ast.AST]) -> None:
        self.gaps: list[Gap] = []
        self._run = run
        self._called = called
        self._instantiated = instantiated
        self._file = ""

    def module(self, module: ModuleValue) -> None:
        self._file = module.source.path
        for place in _places_of(module.source):
            self._place(place)
        for node, cls in self._run.classes.items():
            lost = cls.module is module and is_node(cls) and cls.node not in self._instantiated
            if lost and self._referred(cls.name):
                self._gap(node, f"class {cls.name} {_LOST}")

    def _place(self, place: _Place) -> None:
        """Follow what surrounds the place from outside in, to where control does not go on, or to the place."""
        cls: ast.ClassDef | None = None
        function: Function | None = None
        for around in place.around:
            if isinstance(around, ast.stmt) and around not in self._run.executed:
                if isinstance(function, ast.FunctionDef) and self._was_handed(function):
                    # A generator: whoever has it may run it.
                    self._gap(place.node, f"{function.name} {_LOST}")
                return  # control certainly does not get there
            if isinstance(around, ast.ClassDef):
                cls = around
            elif isinstance(around, Function):
                if around not in self._called:
                    if self._may_be_called(around, cls):
                        self._gap(place.node, f"{getattr(around, 'name', 'a lambda')} {_LOST}")
                    return
                cls, function = None, around
        node = place.node
        if isinstance(node, ast.Call) and node in self._run.evaluated and node not in self._run.understood:
            self._gap(node, f"{_last_name(node.func)}() is called on something that is not understood")

    def _was_handed(self, function: ast.FunctionDef) -> bool:
        """Whether others call the function and what it does was not seen: they get a generator."""
        # A bound method has its own.
        handed = (getattr(each, "function", each) for each in self._run.callbacks)
        is_handed = any(isinstance(each, FunctionValue) and each.node is function for each in handed)
        return is_handed and function.body[0] not in self._run.executed

    # --- code that was not reached ----------------------------------------------------------------------

    def _may_be_called(self, node: Function, cls: ast.ClassDef | None) -> bool:
        if isinstance(node, ast.Lambda):
            return True
        name = node.name
        if cls is None:
            return self._referred(name)
        if cls not in self._instantiated and not self._referred(cls.name):
            return False
        special = name.startswith("__") and name.endswith("__")
        return special or node in self._run.bound or name in self._run.asked or name in self._mentions.texts

    def _referred(self, name: str) -> bool:
        mentions = self._mentions
        return mentions.name(name, self._file) or name in mentions.texts or name in self._run.asked

    @functools.cached_property
    def _mentions(self) -> _Mentions:
        mentions = _Mentions()
        for module in self._run.modules.values():
            for statement in module.source.tree.body:
                if statement in self._run.executed and not _is_list_of_exports(statement):
                    mentions.add(module.source.path, _referring(statement, self._called))
        return mentions

    def _gap(self, node: ast.AST, why: str) -> None:
        self.gaps.append(Gap(SourceRef(self._file, getattr(node, "lineno", 0)), why))


def _last_name(function: ast.expr) -> str:
    if isinstance(function, ast.Attribute):
        return function.attr
    return function.id if isinstance(function, ast.Name) else ""


class _Place(NamedTuple):
    """A mention of what makes interfaces, with the statements, classes and functions around it from outside in."""

    node: ast.AST
    around: tuple[ast.AST, ...]


@functools.lru_cache(maxsize=256)
def _places_of(module: SourceModule) -> tuple[_Place, ...]:
    return tuple(_places_below(module.tree, (), module.lines_with(_CREATING_TEXT)))


def _mentioned(node: ast.Call | ast.Name | ast.Attribute) -> str:
    return _last_name(node.func if isinstance(node, ast.Call) else node)


def _places_below(node: ast.AST, around: tuple[ast.AST, ...], lines: list[int]) -> Iterator[_Place]:
    """The places in ``node``; what does not touch one of ``lines`` has none."""
    if isinstance(node, ast.stmt | ast.Lambda):
        around = (*around, node)
    if isinstance(node, ast.Call | ast.Name | ast.Attribute) and _mentioned(node) in _CREATING_NAMES:
        yield _Place(node, around)
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.stmt):
            inside = _touches(child, lines)
        else:
            inside = not isinstance(child, ast.expr_context | ast.Constant)
        if inside:
            yield from _places_below(child, around, lines)


def _touches(node: ast.stmt, lines: list[int]) -> bool:
    """Whether one of ``lines`` is in what ``node`` spans, its decorators included."""
    first = min([node.lineno, *(each.lineno for each in getattr(node, "decorator_list", ()))])
    index = bisect_left(lines, first)
    return index < len(lines) and lines[index] <= (node.end_lineno or node.lineno)


def _is_list_of_exports(statement: ast.stmt) -> bool:
    return isinstance(statement, ast.Assign) and any(
        _last_name(target) == "__all__" for target in statement.targets
    )


def _referring(node: ast.AST, called: set[ast.AST]) -> Iterator[ast.AST]:
    """What stands in ``node``, without types, the classes of ``isinstance``, and functions that were not called."""
    yield node
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
        yield from _referring_function(node, called)
        return
    if isinstance(node, ast.Call) and _last_name(node.func) in ("isinstance", "issubclass", "super"):
        children: Iterable[ast.AST] = node.args[:1] if _last_name(node.func) != "super" else ()
    elif isinstance(node, ast.ClassDef):
        children = (*node.decorator_list, *node.body)
    elif isinstance(node, ast.AnnAssign):
        children = () if node.value is None else (node.value,)
    elif isinstance(node, ast.ExceptHandler):
        children = node.body
    else:
        children = ast.iter_child_nodes(node)
    for child in children:
        yield from _referring(child, called)


def _referring_function(node: Function, called: set[ast.AST]) -> Iterator[ast.AST]:
    defaults = (*node.args.defaults, *(value for value in node.args.kw_defaults if value is not None))
    decorators = () if isinstance(node, ast.Lambda) else node.decorator_list
    body: Iterable[ast.AST] = ()
    if node in called:
        body = [node.body] if isinstance(node, ast.Lambda) else node.body
    for part in (*defaults, *decorators, *body):
        yield from _referring(part, called)
