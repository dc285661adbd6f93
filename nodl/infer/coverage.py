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
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from nodl.infer.interpreter.define import linearized
from nodl.infer.interpreter.run import Run
from nodl.infer.models import ros
from nodl.infer.models.foreign import is_node_class
from nodl.infer.models.signatures import NODE_ENDPOINTS
from nodl.infer.values import ClassValue, External, ModuleValue
from nodl.node_interface import Gap
from nodl.source_ref import SourceRef

_LOST = "may be called from somewhere that the analysis did not follow, and would create interfaces"
Function = ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda
_CREATING_NAMES = frozenset(NODE_ENDPOINTS) | ros.CREATING_NAMES
_CREATING_TEXT = re.compile("|".join(sorted(map(re.escape, _CREATING_NAMES))))


def unsettled_places(run: Run, called: Iterable[ast.AST] = ()) -> list[Gap]:
    """A gap for each place whose fate is not known; ``called``: functions that other runs have followed."""
    modules = [module for module in run.modules.values() if _CREATING_TEXT.search(module.source.text)]
    if not modules:
        return []
    audit = _Audit(run, {*run.called, *called})
    for module in dict.fromkeys(modules):
        audit.module(module)
    return list(dict.fromkeys(audit.gaps))


@dataclass
class _Mentions:
    """What the executed code of all modules refers to."""

    names: dict[str, set[str]] = field(default_factory=dict)  # by file
    imported: dict[str, set[str]] = field(default_factory=dict)  # names that a file imports
    texts: set[str] = field(default_factory=set)

    def name(self, name: str, file: str) -> bool:
        elsewhere = any(
            name in names and name in self.imported.get(other, ()) for other, names in self.names.items()
        )
        return name in self.names.get(file, ()) or elsewhere


class _Audit:
    def __init__(self, run: Run, called: set[ast.AST]) -> None:
        self.gaps: list[Gap] = []
        self._run = run
        self._called = called
        self._file = ""
        self._mentions: _Mentions | None = None

    def module(self, module: ModuleValue) -> None:
        self._file = module.source.path
        self._body(module.source.tree.body, None)

    # --- reached code -----------------------------------------------------------------------------------

    def _body(self, body: list[ast.stmt], cls: ast.ClassDef | None) -> None:
        for statement in body:
            if statement in self._run.executed:
                self._statement(statement, cls)

    def _statement(self, node: ast.stmt, cls: ast.ClassDef | None) -> None:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            self._function(node, cls)
            return
        if isinstance(node, ast.ClassDef):
            self._class(node)
            self._body(node.body, node)
            return
        for _, value in ast.iter_fields(node):
            for part in value if isinstance(value, list) else (value,):
                if isinstance(part, ast.stmt):
                    self._body([part], cls)
                elif isinstance(part, ast.ExceptHandler | ast.match_case):
                    self._body(part.body, cls)
                elif isinstance(part, ast.withitem):
                    self._expression(part.context_expr)
                elif isinstance(part, ast.expr):
                    self._expression(part)

    def _expression(self, node: ast.expr) -> None:
        """Places in an expression that was evaluated; parts that may be skipped are passed over."""
        if isinstance(node, ast.Lambda):
            self._function(node, None)
            return
        if isinstance(node, ast.Call) and _last_name(node.func) in _CREATING_NAMES:
            if node not in self._run.evaluated:
                return  # skipped by ``and``, ``or``, a conditional expression or an empty loop
            if node not in self._run.understood:
                self._gap(node, f"{_last_name(node.func)}() is called on something that is not understood")
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.expr):
                self._expression(child)
            elif isinstance(child, ast.keyword):
                self._expression(child.value)
            elif isinstance(child, ast.comprehension):
                self._expression(child.iter)

    def _function(self, node: Function, cls: ast.ClassDef | None) -> None:
        if node in self._called:
            if isinstance(node, ast.Lambda):
                self._expression(node.body)
            else:
                self._body(node.body, None)
            return
        place = next(_places(node), None)
        if place is not None and self._may_be_called(node, cls):
            name = getattr(node, "name", "a lambda")
            self._gap(place, f"{name} {_LOST}")

    def _class(self, node: ast.ClassDef) -> None:
        cls = self._run.classes.get(node)
        if cls is None or not _is_node(cls) or self._is_made(node):
            return
        if self._referred(node.name):
            self._gap(node, f"class {node.name} {_LOST}")

    # --- code that was not reached ----------------------------------------------------------------------

    def _may_be_called(self, node: Function, cls: ast.ClassDef | None) -> bool:
        if isinstance(node, ast.Lambda):
            return True
        name = node.name
        if cls is None:
            return self._referred(name)
        if not self._is_made(cls) and not self._referred(cls.name):
            return False
        special = name.startswith("__") and name.endswith("__")
        return special or node in self._run.bound or name in self._run.asked or name in self._found().texts

    def _is_made(self, node: ast.ClassDef) -> bool:
        return node in self._run.instantiated

    def _referred(self, name: str) -> bool:
        mentions = self._found()
        return mentions.name(name, self._file) or name in mentions.texts or name in self._run.asked

    def _found(self) -> _Mentions:
        if self._mentions is None:
            self._mentions = _Mentions()
            for module in self._run.modules.values():
                path = module.source.path
                names = self._mentions.names.setdefault(path, set())
                imported = self._mentions.imported.setdefault(path, set())
                self._collect(module.source.tree.body, names, imported)
        return self._mentions

    def _collect(self, body: list[ast.stmt], names: set[str], imported: set[str]) -> None:
        assert self._mentions is not None
        for statement in body:
            if statement in self._run.executed and not _is_list_of_exports(statement):
                for node in _referring(statement, self._called):
                    if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
                        names.add(node.id)
                    elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                        self._mentions.texts.add(node.value)
                    elif isinstance(node, ast.ImportFrom):
                        imported.update(alias.name for alias in node.names)

    def _gap(self, node: ast.AST, why: str) -> None:
        self.gaps.append(Gap(SourceRef(self._file, getattr(node, "lineno", 0)), why))


def _is_node(cls: ClassValue) -> bool:
    return any(isinstance(base, External) and is_node_class(base.path) for base in linearized(cls))


def _last_name(function: ast.expr) -> str:
    if isinstance(function, ast.Attribute):
        return function.attr
    return function.id if isinstance(function, ast.Name) else ""


def _places(node: ast.AST) -> Iterator[ast.AST]:
    """Mentions of what makes interfaces, anywhere below ``node``."""
    for part in ast.walk(node):
        if isinstance(part, ast.Name | ast.Attribute) and _last_name(part) in _CREATING_NAMES:
            yield part


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
