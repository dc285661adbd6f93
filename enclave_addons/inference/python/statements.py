"""Statements: what each kind of syntax does, and the ways on which it is left."""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable
from typing import Any

from enclave_addons.inference.kernel.machine import BREAK, CONTINUE, NEXT, RETURN, Jumps
from enclave_addons.inference.kernel.store import Written
from enclave_addons.inference.kernel.values import (
    ABSENT,
    ANY,
    External,
    Items,
    Obj,
    Value,
    external,
    join,
    join_all,
    present,
    sole,
)
from enclave_addons.inference.python.arithmetic import binary
from enclave_addons.inference.python.classes import define_class
from enclave_addons.inference.python.conditions import compare, guard_of, narrow, read_truth
from enclave_addons.inference.python.containers import delete_item, elements, extend, store_item
from enclave_addons.inference.python.functions import new_function
from enclave_addons.inference.python.objects import (
    Arguments,
    Call,
    Frame,
    Function,
    Property,
    Wrapped,
)
from enclave_addons.inference.python.program import SourceModule
from enclave_addons.inference.python.run import MAX_EXACT, STATEMENTS, Run

MAX_TURNS = 64  # of a while whose test is known each time
MAX_TURNS_INSIDE = 256  # of known loops inside each other that make no interface
_KEEP_FUNCTION = frozenset({
    "wraps", "lru_cache", "cache", "contextmanager", "asynccontextmanager", "override", "overload", "abstractmethod",
    "final", "no_type_check", "singledispatch", "jit", "njit", "beartype", "dataclass", "total_ordering", "unique",
})  # fmt: skip


def assign_target(run: Run, target: ast.expr, value: Value, frame: Frame) -> None:
    """Assign to a name, attribute, element, or to several at once."""
    if isinstance(target, ast.Name):
        run.assign(target.id, value, frame)
    elif isinstance(target, ast.Attribute):
        run.set_attribute(run.evaluate(target.value, frame), target.attr, value, target, frame)
    elif isinstance(target, ast.Subscript):
        store_item(run, run.evaluate(target.value, frame), run.evaluate(target.slice, frame), value)
    elif isinstance(target, ast.Starred):
        assign_target(run, target.value, run.sequence(target, "list", elements(run, value)), frame)
    elif isinstance(target, (ast.Tuple, ast.List)):
        _unpack(run, target, value, frame)


def _unpack(run: Run, target: ast.Tuple | ast.List, value: Value, frame: Frame) -> None:
    items = elements(run, value)
    starred = next((i for i, each in enumerate(target.elts) if isinstance(each, ast.Starred)), None)
    if items.exact is not None and starred is not None:
        behind = len(target.elts) - starred - 1
        middle = items.exact[starred : len(items.exact) - behind]
        listed = run.sequence(target, "list", Items(middle), "rest")
        parts = [*items.exact[:starred], listed, *items.exact[len(items.exact) - behind :]]
    elif items.exact is not None and len(items.exact) == len(target.elts):
        parts = list(items.exact)
    else:
        parts = [items.any_element() or ANY] * len(target.elts)
    for each, part in zip(target.elts, parts, strict=False):
        assign_target(run, each.value if isinstance(each, ast.Starred) else each, part, frame)


def _expression(run: Run, node: ast.Expr, frame: Frame) -> int:
    run.evaluate(node.value, frame)
    return NEXT


def _assign(run: Run, node: ast.Assign, frame: Frame) -> int:
    value = run.evaluate(node.value, frame)
    for target in node.targets:
        assign_target(run, target, value, frame)
    return NEXT


def _annotated(run: Run, node: ast.AnnAssign, frame: Frame) -> int:
    if node.value is not None:
        assign_target(run, node.target, run.evaluate(node.value, frame), frame)
    return NEXT


def _augmented(run: Run, node: ast.AugAssign, frame: Frame) -> int:
    target = node.target
    left = run.evaluate(_reading(target), frame)
    right = run.evaluate(node.value, frame)
    if (
        isinstance(node.op, ast.Add)
        and isinstance(sole(left), Obj)
        and getattr(sole(left), "kind", "") == "list"
    ):
        extend(run, sole(left), right)  # type: ignore[arg-type]
        return NEXT
    assign_target(run, target, binary(run, node.op, left, right, node), frame)
    return NEXT


def _reading(target: ast.expr) -> ast.expr:
    if isinstance(target, ast.Name):
        return ast.copy_location(ast.Name(target.id, ast.Load()), target)
    return target


def _delete(run: Run, node: ast.Delete, frame: Frame) -> int:
    for target in node.targets:
        if isinstance(target, ast.Name) and target.id in frame.cells:
            run.store.write(frame.cells, target.id, ABSENT)
        elif isinstance(target, ast.Attribute):
            run.set_attribute(run.evaluate(target.value, frame), target.attr, ABSENT, target, frame)
        elif isinstance(target, ast.Subscript):
            delete_item(run, run.evaluate(target.value, frame), run.evaluate(target.slice, frame))
    return NEXT


def _return(run: Run, node: ast.Return, frame: Frame) -> int:
    value = run.evaluate(node.value, frame) if node.value else (None,)
    if run.ended:
        return 0
    frame.returned = join(frame.returned, value)
    run.jump(frame.jumps)
    return RETURN


def _break(run: Run, node: ast.Break, frame: Frame) -> int:
    if frame.loops:
        run.jump(frame.loops[-1])
    return BREAK


def _continue(run: Run, node: ast.Continue, frame: Frame) -> int:
    if frame.loops:
        run.next_turn(frame.loops[-1])
    return CONTINUE


def _raise(run: Run, node: ast.Raise, frame: Frame) -> int:
    if node.exc is not None:
        run.evaluate(node.exc, frame)
    return 0


def _assert(run: Run, node: ast.Assert, frame: Frame) -> int:
    outcome = read_truth(run, run.evaluate(node.test, frame))
    if outcome is None:
        narrow(run, node.test, True, frame)
    return NEXT


def _if(run: Run, node: ast.If, frame: Frame) -> int:
    outcome = read_truth(run, run.evaluate(node.test, frame))
    if outcome is not None:
        run.dead.update(node.orelse if outcome else node.body)
        return run.execute(node.body if outcome else node.orelse, frame)

    def side(body: list[ast.stmt], holds: bool) -> int:
        narrow(run, node.test, holds, frame)
        with run.under(guard_of(run, node.test, holds)):
            return run.execute(body, frame)

    taken: list[int] = []

    def noted(body: list[ast.stmt], holds: bool) -> int:
        taken.append(side(body, holds))
        return taken[-1]

    ways = run.branch([lambda: noted(node.body, True), lambda: noted(node.orelse, False)])
    if ways & NEXT and not (taken[0] & taken[1] & NEXT):  # the rest runs where the other side went on
        guard = guard_of(run, node.test, bool(taken[0] & NEXT))
        run.guards = (*run.guards, guard) if guard is not None else run.guards
    return ways


def _for(run: Run, node: ast.For | ast.AsyncFor, frame: Frame) -> int:
    items = elements(run, run.evaluate(node.iter, frame))
    jumps = Jumps(run.store.mark())
    frame.loops.append(jumps)

    def body(element: Value) -> int:
        assign_target(run, node.target, element, frame)
        return run.execute(node.body, frame)

    exact = items.exact
    if exact is not None and _is_followed(run, len(exact), node, frame):
        if not exact:
            run.dead.update(node.body)
        ways = run.each_element(len(exact), jumps, lambda index: body(exact[index]))
    else:
        ways = run.repeat(jumps, lambda: body(items.any_element() or ANY))
    return _after_loop(run, node, frame, jumps, ways)


def _is_followed(run: Run, count: int, node: ast.stmt, frame: Frame) -> bool:
    """Return whether a known loop is run turn by turn: not one deep in others that only computes something."""
    few = count * run.turns <= MAX_TURNS_INSIDE or run.creates(frame.module.source, node)
    return count <= MAX_EXACT and few


def _after_loop(
    run: Run, node: ast.For | ast.AsyncFor | ast.While, frame: Frame, jumps: Jumps, ways: int
) -> int:
    frame.loops.pop()
    if node.orelse and ways & NEXT:
        ways = (ways & ~NEXT) | run.execute(node.orelse, frame)
    run.land(jumps.mark, jumps.exits, bool(ways & NEXT))
    if jumps.exits:
        ways |= NEXT
    return ways & ~(BREAK | CONTINUE)


def _while(run: Run, node: ast.While, frame: Frame) -> int:
    jumps = Jumps(run.store.mark())
    frame.loops.append(jumps)
    endless = isinstance(node.test, ast.Constant) and bool(node.test.value)
    ways = 0
    for _ in range(MAX_TURNS if _is_followed(run, MAX_TURNS, node, frame) else 0):
        outcome = read_truth(run, run.evaluate(node.test, frame))
        if outcome is None or endless:
            break
        if outcome is False:
            if not ways:
                run.dead.update(node.body)
            return _after_loop(run, node, frame, jumps, ways | NEXT)
        before = run.store.mark()
        run.turns *= MAX_TURNS
        taken = run.turn(jumps, lambda: run.execute(node.body, frame))
        run.turns //= MAX_TURNS
        ways |= taken & ~NEXT
        if not taken & NEXT:
            return _after_loop(run, node, frame, jumps, ways)
        if not run.store.written(before):
            break  # it waits for somebody else

    def turn() -> int:
        outcome = None if endless else read_truth(run, run.evaluate(node.test, frame))
        if outcome is None and not endless:
            narrow(run, node.test, True, frame)
        return run.execute(node.body, frame)

    ways |= run.repeat(jumps, turn)
    if endless:
        ways &= ~NEXT
    else:
        narrow(run, node.test, False, frame)
    return _after_loop(run, node, frame, jumps, ways)


def _try(run: Run, node: ast.Try, frame: Frame) -> int:
    """Run the body; each handler starts where any of the body may have happened."""
    mark = run.store.mark()
    ways = run.execute(node.body, frame)
    outcomes: list[Written] = []
    if ways & NEXT and node.orelse:
        ways = (ways & ~NEXT) | run.execute(node.orelse, frame)
    if ways & NEXT:
        outcomes.append(run.store.written(mark))
    seen = run.store.seen(mark)
    run.store.undo(mark)
    run.forks += 1
    handlers = [] if _only_imports(run, node.body) else node.handlers
    if not handlers:
        run.dead.update(node.handlers)
    for handler in handlers:
        start = run.store.mark()
        for cells, key, value in seen.values():
            run.store.write(cells, key, value)
        if handler.name:
            run.assign(handler.name, external("builtins.Exception()"), frame)
        taken = run.execute(handler.body, frame)
        ways |= taken
        if taken & NEXT:
            outcomes.append(run.store.written(start))
        run.store.undo(start)
    run.forks -= 1
    run.store.merge(outcomes)
    if not outcomes:
        run.store.keep(seen)
    if node.finalbody:
        last = run.execute(node.finalbody, frame)
        ways = ways if last & NEXT else last
    return ways


def _only_imports(run: Run, body: list[ast.stmt]) -> bool:
    """Return whether ``body`` only imports modules that are certainly there."""
    names: list[str] = []
    for statement in body:
        if isinstance(statement, ast.Import):
            names += [alias.name for alias in statement.names]
        elif not (isinstance(statement, ast.Assign) and isinstance(statement.value, ast.Constant)):
            return False
    return all(name.partition(".")[0] in sys.stdlib_module_names or name in run.modules for name in names)


def _with(run: Run, node: ast.With | ast.AsyncWith, frame: Frame) -> int:
    suppresses = False
    managers: list[tuple[Value, ast.expr]] = []
    for item in node.items:
        value = run.evaluate(item.context_expr, frame)
        suppresses = suppresses or any(
            isinstance(atom, External) and "suppress" in atom.path for atom in value
        )
        entered = join_all(_entered(run, atom, item.context_expr, frame) for atom in value)
        managers.append((value, item.context_expr))
        if item.optional_vars is not None:
            assign_target(run, item.optional_vars, entered or ANY, frame)
    mark = run.store.mark()
    ways = run.execute(node.body, frame)
    if suppresses:
        run.store.join_seen(mark)
        ways |= NEXT
    for value, expression in managers:
        for atom in value:
            if _is_own(run, atom, "__exit__"):
                exits = run.attribute((atom,), "__exit__", expression, frame)
                run.call(exits, Arguments([ANY, ANY, ANY]), expression, frame)
    return ways


def _is_own(run: Run, atom: object, name: str) -> bool:
    cls = getattr(atom, "cls", None) if isinstance(atom, Obj) and atom.kind == "instance" else None
    return isinstance(cls, Obj) and any(isinstance(each, Function) for each in run.class_attribute(cls, name))  # type: ignore[arg-type]


def _entered(run: Run, atom: object, node: ast.expr, frame: Frame) -> Value:
    if _is_own(run, atom, "__enter__"):
        return run.call(run.attribute((atom,), "__enter__", node, frame), Arguments(), node, frame)
    if isinstance(atom, Obj) and atom.kind == "lazy":
        return run.items_of(atom).any_element()  # what a @contextmanager yields
    return (atom,)


def _function(run: Run, node: ast.FunctionDef | ast.AsyncFunctionDef, frame: Frame) -> int:
    value: Value = (new_function(run, node, frame),)
    for decorator in reversed(node.decorator_list):
        value = _decorated(run, decorator, value, node, frame)
    run.assign(node.name, value, frame)
    return NEXT


def _decorated(run: Run, decorator: ast.expr, value: Value, node: ast.stmt, frame: Frame) -> Value:
    function = run.evaluate(decorator, frame)
    atom = sole(function)
    path = atom.path if isinstance(atom, External) else ""
    name = path.partition("(")[0].rpartition(".")[2]
    if name in ("staticmethod", "classmethod"):
        return (Wrapped(value, name == "staticmethod"),)
    if name in ("property", "cached_property", "abstractproperty"):
        return (Property(value),)
    if isinstance(decorator, ast.Attribute) and decorator.attr == "setter":
        getter = (
            sole(present(run.look_up(decorator.value.id, frame)))
            if isinstance(decorator.value, ast.Name)
            else None
        )
        return (Property(getter.getter, value),) if isinstance(getter, Property) else value
    if isinstance(atom, (External,)) or (
        not isinstance(atom, (Function, Obj)) and type(atom).__name__ == "Unknown"
    ):
        if name not in _KEEP_FUNCTION:
            run.call_later(value, Arguments(more=ANY), Call(Arguments(), node, frame))
        return value
    return run.call(function, Arguments([value]), decorator, frame)


def _class(run: Run, node: ast.ClassDef, frame: Frame) -> int:
    value: Value = (define_class(run, node, frame),)
    for decorator in reversed(node.decorator_list):
        function = run.evaluate(decorator, frame)
        if isinstance(sole(function), (Function,)):
            made = run.call(function, Arguments([value]), decorator, frame)
            value = made if any(isinstance(atom, (Obj, Function)) for atom in made) else value
    run.assign(node.name, value, frame)
    return NEXT


def _global(run: Run, node: ast.Global | ast.Nonlocal, frame: Frame) -> int:
    frame.elsewhere.update(node.names)
    return NEXT


def _import(run: Run, node: ast.Import, frame: Frame) -> int:
    for alias in node.names:
        whole = run.import_module(alias.name, frame)
        top = alias.name.partition(".")[0]
        run.assign(alias.asname or top, whole if alias.asname else run.import_module(top, frame), frame)
    return NEXT


def _import_from(run: Run, node: ast.ImportFrom, frame: Frame) -> int:
    base = absolute_name(node, frame.module.source)
    atom = run.import_module(base, frame)[0] if base else External("")
    for alias in node.names:
        if alias.name == "*":
            _import_star(run, atom, base, node, frame)
            continue
        if isinstance(atom, External):
            inner = f"{base}.{alias.name}" if base else alias.name
            value = run.import_module(inner, frame)
        else:
            value = run.attribute((atom,), alias.name, node, frame)
        run.assign(alias.asname or alias.name, value, frame)
    return NEXT


def absolute_name(node: ast.ImportFrom, source: SourceModule) -> str:
    """Return the absolute name of the module that ``from ... import`` names."""
    if not node.level:
        return node.module or ""
    package = source.package()
    for _ in range(node.level - 1):
        package = package.rpartition(".")[0]
    return ".".join(part for part in (package, node.module) if part)


def _import_star(run: Run, atom: object, base: str, node: ast.stmt, frame: Frame) -> None:
    if isinstance(atom, External):
        frame.module.stars += [base] if base not in frame.module.stars else []
        return
    assert isinstance(atom, Obj)
    if "__all__" in atom.cells:
        listed = elements(run, atom.cells["__all__"])
        for element in listed.exact or ():
            name = sole(element)
            if isinstance(name, str):
                run.assign(name, run.attribute((atom,), name, node, frame), frame)
        if listed.exact is not None:
            return
        run.not_followed(
            node, frame, f"which names {base} gives is not known: its __all__ is made at run time"
        )
    for key, value in list(atom.cells.items()):
        if isinstance(key, str) and not key.startswith("_"):
            run.assign(key, value, frame)
    frame.module.stars += getattr(atom, "stars", [])


def _match(run: Run, node: ast.Match, frame: Frame) -> int:
    subject = run.evaluate(node.subject, frame)
    sides: list[Callable[[], int]] = []
    complete = False
    for case in node.cases:
        outcome = _matches(run, case.pattern, subject, frame)
        if case.guard is not None and outcome:
            outcome = None
        if outcome is False:
            run.dead.update(case.body)
            continue

        def side(case: ast.match_case = case) -> int:
            _bind_pattern(run, case.pattern, subject, frame)
            if case.guard is not None:
                run.evaluate(case.guard, frame)
            return run.execute(case.body, frame)

        sides.append(side)
        if outcome:
            complete = True
            later = node.cases[node.cases.index(case) + 1 :]
            run.dead.update(statement for each in later for statement in each.body)
            break
    if not complete:
        sides.append(lambda: NEXT)
    return sides[0]() if len(sides) == 1 else run.branch(sides)


def _matches(run: Run, pattern: ast.pattern, subject: Value, frame: Frame) -> bool | None:
    if isinstance(pattern, ast.MatchValue):
        return compare(run, ast.Eq(), subject, run.evaluate(pattern.value, frame))
    if isinstance(pattern, ast.MatchSingleton):
        return compare(run, ast.Is(), subject, (pattern.value,))
    if isinstance(pattern, ast.MatchOr):
        outcomes = [_matches(run, each, subject, frame) for each in pattern.patterns]
        return True if True in outcomes else None if None in outcomes else False
    return True if isinstance(pattern, ast.MatchAs) and pattern.pattern is None else None


def _bind_pattern(run: Run, pattern: ast.pattern, subject: Value, frame: Frame) -> None:
    if isinstance(pattern, ast.MatchAs) and pattern.name:
        run.assign(pattern.name, subject, frame)
        return
    for each in ast.walk(pattern):
        name = getattr(each, "name", None) or getattr(each, "rest", None)
        if isinstance(name, str):
            run.assign(name, ANY, frame)


def _nothing(run: Run, node: ast.stmt, frame: Frame) -> int:
    return NEXT


_TABLE: dict[type, Callable[[Run, Any, Frame], int]] = {
    ast.Expr: _expression,
    ast.Assign: _assign,
    ast.AnnAssign: _annotated,
    ast.AugAssign: _augmented,
    ast.Delete: _delete,
    ast.Return: _return,
    ast.Break: _break,
    ast.Continue: _continue,
    ast.Raise: _raise,
    ast.Assert: _assert,
    ast.If: _if,
    ast.For: _for,
    ast.AsyncFor: _for,
    ast.While: _while,
    ast.Try: _try,
    ast.With: _with,
    ast.AsyncWith: _with,
    ast.FunctionDef: _function,
    ast.AsyncFunctionDef: _function,
    ast.ClassDef: _class,
    ast.Global: _global,
    ast.Nonlocal: _global,
    ast.Import: _import,
    ast.ImportFrom: _import_from,
    ast.Match: _match,
    ast.Pass: _nothing,
}
STATEMENTS.update(_TABLE)
if hasattr(ast, "TryStar"):
    STATEMENTS[ast.TryStar] = _try
if hasattr(ast, "TypeAlias"):
    STATEMENTS[ast.TypeAlias] = _nothing
