"""The check from the text alone: did every place in reachable code that makes an interface end as one?

A place is a call of something that makes nodes or interfaces. In a function that was entered each place was called, is
dead for a constant reason, or is a gap. A function that live text names and that nothing entered is a gap as a whole.
The check knows nothing of values, and so it finds what a run lost without a word.
"""

from __future__ import annotations

import ast
import functools
import re
from collections.abc import Iterator
from typing import NamedTuple

from enclave_addons.inference.python.objects import FUNCTION_NODES
from enclave_addons.inference.python.program import Program, SourceModule
from enclave_addons.inference.python.rclpy_models import CREATING_NAMES
from enclave_addons.inference.python.run import Run
from enclave_addons.inference.python.statements import absolute_name
from enclave_common.source_location import SourceLocation
from nodl.node_interface import Gap

_CREATING_TEXT = re.compile("|".join(sorted(map(re.escape, CREATING_NAMES))))
_ELSEWHERE = re.compile(r"rclpy|\b(?:importlib|__import__|eval|exec|runpy)\b")
_LOST = "may be called from somewhere that was not followed, and makes interfaces"


def may_make_interfaces(program: Program, main: SourceModule) -> bool:
    """Return whether running this file could: the text of it, or of a file that it imports, says so."""
    beside = main.path.rpartition("/")[0]
    found, left = {main.path}, [main]
    while left:
        module = left.pop()
        if module.error or _CREATING_TEXT.search(module.text) or _ELSEWHERE.search(module.text):
            return True
        for name in imported(module):
            path = program.find(name, beside) or program.find(name, module.path.rpartition("/")[0])
            if path is not None and path not in found:
                found.add(path)
                left.append(program.load(path, name))
    return False


def imported(module: SourceModule) -> Iterator[str]:
    """Return the modules that import statements may mean, with the packages around them."""
    for node in ast.walk(module.tree):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        if isinstance(node, ast.ImportFrom):
            package = absolute_name(node, module)
            names = [package, *(f"{package}.{alias.name}" for alias in node.names)]
        for name in names:
            steps = name.split(".")
            yield from (".".join(steps[:count]) for count in range(1, len(steps) + 1))


class _Scope(NamedTuple):
    """The text of one function without those in it, or of a module with its class bodies."""

    node: ast.AST | None
    cls: ast.ClassDef | None
    calls: list[ast.Call]
    names: list[ast.AST]  # that are read, but for what is called


@functools.lru_cache(maxsize=256)
def _scopes(module: SourceModule) -> list[_Scope]:
    scopes: list[_Scope] = []

    def read(node: ast.AST, scope: _Scope, cls: ast.ClassDef | None) -> None:
        if isinstance(node, FUNCTION_NODES):
            inner = _Scope(node, cls, [], [])
            scopes.append(inner)
            body: list[ast.AST] = [node.body] if isinstance(node, ast.Lambda) else [*node.body]
            for each in body:
                read(each, inner, None)
            outside: list[ast.AST] = [*node.args.defaults, *getattr(node, "decorator_list", ())]
            for each in outside:
                read(each, scope, cls)
            return
        if isinstance(node, ast.Call):
            scope.calls.append(node)
            called = node.func.value if isinstance(node.func, ast.Attribute) else node.func
            parts: list[ast.AST] = [*node.args, *node.keywords]
            for each in parts if isinstance(node.func, ast.Name) else [called, *parts]:
                read(each, scope, cls)
            return
        read_name = isinstance(node, (ast.Name, ast.Attribute)) and isinstance(node.ctx, ast.Load)
        if read_name or (isinstance(node, ast.Constant) and str(node.value).isidentifier()):
            scope.names.append(node)
        if isinstance(node, (ast.AnnAssign, ast.arg)):
            for part in (getattr(node, "target", None), getattr(node, "value", None)):
                if part is not None:
                    read(part, scope, cls)
            return
        for child in ast.iter_child_nodes(node):
            read(child, scope, node if isinstance(node, ast.ClassDef) else cls)

    top = _Scope(None, None, [], [])
    scopes.append(top)
    for statement in module.tree.body:
        read(statement, top, None)
    return scopes


def _last_name(node: ast.AST) -> str:
    if isinstance(node, ast.Constant):
        return str(node.value)
    return node.attr if isinstance(node, ast.Attribute) else node.id if isinstance(node, ast.Name) else ""


def unsettled_places(run: Run, entered: set[ast.AST]) -> list[Gap]:
    """Return a gap for each place that was lost. ``entered``: what any of the analysed programs entered."""
    if run.given_up:  # which says it of all places
        return []
    dead = {node for statement in run.dead for node in ast.walk(statement)}
    sources = [module.source for module in run.modules.values()]
    scopes = [(source, scope) for source in sources for scope in _scopes(source)]
    gaps: list[Gap] = []
    live = [(source, scope) for source, scope in scopes if scope.node is None or scope.node in run.entered]
    for source, scope in live:
        for call in scope.calls:
            name = _last_name(call.func)
            if name in CREATING_NAMES and call not in run.settled and call not in dead:
                why = (
                    f"{name}() was not followed here" if call in run.visited else f"{name}() was not reached"
                )
                place = SourceLocation(source.path, call.lineno)
                gaps.append(Gap(place, f"{why}; what it makes is not listed"))
    return [*gaps, *_never_entered(run, entered, scopes, live, dead)]


def _never_entered(
    run: Run,
    entered: set[ast.AST],
    scopes: list[tuple[SourceModule, _Scope]],
    live: list[tuple[SourceModule, _Scope]],
    dead: set[ast.AST],
) -> list[Gap]:
    left = [
        (source, scope)
        for source, scope in scopes
        if scope.node is not None
        and scope.node not in entered
        and not isinstance(scope.node, ast.Lambda)
        and any(_last_name(call.func) in CREATING_NAMES for call in scope.calls)
        and (scope.cls is None or scope.cls in entered)
    ]
    if not left:
        return []
    names = {_last_name(node) for _, scope in live for node in scope.names if node not in dead}
    names |= {
        _last_name(call.func)
        for _, scope in live
        for call in scope.calls
        if call not in dead and call not in run.visited
    }
    return [
        Gap(
            SourceLocation(source.path, getattr(scope.node, "lineno", 0)),
            f"{getattr(scope.node, 'name', '')}() {_LOST}",
        )
        for source, scope in left
        if getattr(scope.node, "name", "") in names
    ]
