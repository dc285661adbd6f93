"""``match``: which case a value takes, and what its pattern binds (language reference, 8.6)."""

from __future__ import annotations

import ast

from nodl.infer.interpreter import special
from nodl.infer.interpreter.conditions import compare_values, truth
from nodl.infer.interpreter.define import linearized, program_classes
from nodl.infer.interpreter.frames import Frame
from nodl.infer.interpreter.run import Run
from nodl.infer.text import Text
from nodl.infer.values import (
    ANY,
    CONSTANTS,
    ClassValue,
    Dictionary,
    External,
    Instance,
    NativeObject,
    Sequence,
    Unknown,
    Value,
)

Outcome = bool | None  # it matches, it does not, or that is not known
_KINDS = {"str": str, "int": int, "float": float, "bool": bool, "bytes": bytes}


def matches(run: Run, pattern: ast.pattern, value: Value, frame: Frame) -> Outcome:
    """Whether ``value`` fits, binding names on the way (also where that is not known)."""
    if isinstance(pattern, ast.MatchAs):
        return _as(run, pattern, value, frame)
    if isinstance(pattern, ast.MatchOr):
        return _any_of(run, pattern, value, frame)
    if isinstance(pattern, ast.MatchValue):
        return _equal(run, value, run.evaluate(pattern.value, frame), pattern, frame)
    if isinstance(pattern, ast.MatchSingleton):
        outcomes = {_same_constant(atom, pattern.value) for atom in value}
        return outcomes.pop() if len(outcomes) == 1 else None
    if isinstance(pattern, ast.MatchSequence):
        return _sequence(run, pattern, value, frame)
    if isinstance(pattern, ast.MatchMapping):
        return _mapping(run, pattern, value, frame)
    if isinstance(pattern, ast.MatchClass):
        return _class(run, pattern, value, frame)
    return None


def both(first: Outcome, second: Outcome) -> Outcome:
    """``and``: false if one of them is false, true if both are true, else ``None``."""
    if first is False or second is False:
        return False
    return True if first and second else None


def _as(run: Run, pattern: ast.MatchAs, value: Value, frame: Frame) -> Outcome:
    outcome: Outcome = True if pattern.pattern is None else matches(run, pattern.pattern, value, frame)
    if pattern.name is not None and outcome is not False:
        run.assign_name(pattern.name, value, frame)
    return outcome


def _any_of(run: Run, pattern: ast.MatchOr, value: Value, frame: Frame) -> Outcome:
    known = True
    for each in pattern.patterns:
        outcome = matches(run, each, value, frame)
        if outcome:
            return True if known else None
        known = known and outcome is False
    return False if known else None


def _equal(run: Run, value: Value, other: Value, node: ast.AST, frame: Frame) -> Outcome:
    own = special.comparison(run, ast.Eq(), value, other, node, frame)
    return truth(own) if own else compare_values(ast.Eq(), value, other)


def _same_constant(atom: object, constant: object) -> Outcome:
    if isinstance(atom, CONSTANTS):
        return atom is constant
    return None if isinstance(atom, Unknown | External | Text) else False


def _sequence(run: Run, pattern: ast.MatchSequence, value: Value, frame: Frame) -> Outcome:
    atom = value[0] if len(value) == 1 else None
    star = next((i for i, each in enumerate(pattern.patterns) if isinstance(each, ast.MatchStar)), None)
    if isinstance(atom, (*CONSTANTS, Dictionary)):
        return False
    exact = atom.items.exact if isinstance(atom, Sequence) and not atom.escaped else None
    if exact is None:
        _bind_all(run, pattern, frame)
        return None
    least = len(pattern.patterns) - (star is not None)
    if len(exact) < least or (star is None and len(exact) > least):
        return False
    outcome: Outcome = True
    after = len(pattern.patterns) - (star or 0) - 1
    for index, each in enumerate(pattern.patterns):
        if isinstance(each, ast.MatchStar):
            rest = exact[index : len(exact) - after]
            if each.name is not None:
                run.assign_name(each.name, run.tuple_of(rest), frame)
            continue
        at = index if star is None or index < star else len(exact) - (len(pattern.patterns) - index)
        outcome = both(outcome, matches(run, each, exact[at], frame))
        if outcome is False:
            return False
    return outcome


def _mapping(run: Run, pattern: ast.MatchMapping, value: Value, frame: Frame) -> Outcome:
    atom = value[0] if len(value) == 1 else None
    if isinstance(atom, (*CONSTANTS, Sequence)):
        return False
    if not isinstance(atom, Dictionary) or atom.is_open:
        _bind_all(run, pattern, frame)
        return None
    outcome: Outcome = True
    used: set[object] = set()
    for key, each in zip(pattern.keys, pattern.patterns, strict=True):
        constant = run.evaluate(key, frame)[0]
        held, certain = atom.held(constant)
        if not held:
            return False
        used.add(constant)
        outcome = both(outcome if certain else both(outcome, None), matches(run, each, held, frame))
        if outcome is False:
            return False
    if pattern.rest is not None:
        rest = run.allocate(pattern, "dict", Dictionary)
        for entry, held, _ in atom.entries():
            if entry.constant not in used:
                run.state.store(rest, entry, held)
        run.assign_name(pattern.rest, (rest,), frame)
    return outcome


def _class(run: Run, pattern: ast.MatchClass, value: Value, frame: Frame) -> Outcome:
    cls = run.evaluate(pattern.cls, frame)
    outcome = is_instance(value, cls)
    if outcome is False:
        return False
    wanted = cls[0] if len(cls) == 1 else None
    names = _positional_names(run, wanted)
    for index, each in enumerate(pattern.patterns):
        if isinstance(wanted, External) and index == 0:
            outcome = both(outcome, matches(run, each, value, frame))
        elif index < len(names):
            held = run.attribute(value, names[index], pattern, frame)
            outcome = both(outcome, matches(run, each, held, frame))
        else:
            _bind_all(run, each, frame)
            outcome = both(outcome, None)
        if outcome is False:
            return False
    for name, each in zip(pattern.kwd_attrs, pattern.kwd_patterns, strict=True):
        outcome = both(outcome, matches(run, each, run.attribute(value, name, pattern, frame), frame))
        if outcome is False:
            return False
    return outcome


def _positional_names(run: Run, cls: object) -> list[str]:
    if not isinstance(cls, ClassValue):
        return []
    for base in program_classes(cls):
        listed = base.cells.get("__match_args__", ())
        if listed and isinstance(listed[0], Sequence) and listed[0].items.exact is not None:
            return [name for item in listed[0].items.exact for name in item if isinstance(name, str)]
        if base.fields is not None:
            return [name for name, _ in base.fields]
    return []


def _bind_all(run: Run, pattern: ast.AST, frame: Frame) -> None:
    """Names of a pattern whose parts are not known."""
    for part in ast.walk(pattern):
        name = getattr(part, "name", None) or getattr(part, "rest", None)
        if isinstance(name, str):
            run.assign_name(name, ANY, frame)


# --- isinstance ---------------------------------------------------------------------------------------------


def is_instance(value: Value, classes: Value) -> Outcome:
    """``isinstance(value, classes)``; ``classes`` may be a tuple of them."""
    outcomes = {_any_class(atom, classes) for atom in value}
    return outcomes.pop() if len(outcomes) == 1 else None


def _any_class(atom: object, classes: Value) -> Outcome:
    known = True
    if len(classes) != 1:
        return None
    listed: tuple[Value, ...] = (classes,)
    if isinstance(classes[0], Sequence):
        if classes[0].items.exact is None:
            return None
        listed = classes[0].items.exact
    for cls in listed:
        outcome = _of_class(atom, cls[0]) if len(cls) == 1 else None
        if isinstance(cls[0], Sequence):
            outcome = _any_class(atom, cls)
        if outcome:
            return True
        known = known and outcome is False
    return False if known else None


_CONTAINERS = ("list", "tuple", "set", "frozenset", "dict")


def _of_class(atom: object, cls: object) -> Outcome:
    if isinstance(atom, Unknown | External | Text | NativeObject):
        return None
    name = cls.path.removeprefix("builtins.") if isinstance(cls, External) and "builtins." in cls.path else ""
    if isinstance(atom, Instance) and isinstance(atom.cls, ClassValue):
        order = linearized(atom.cls)
        paths = {base.path for base in order if isinstance(base, External)}
        if name == "object" or cls in order or (isinstance(cls, External) and cls.path in paths):
            return True
        if all(isinstance(base, ClassValue) for base in order):
            return False
        return False if isinstance(cls, ClassValue) else None
    if isinstance(cls, ClassValue):
        return False if isinstance(atom, (*CONSTANTS, Sequence, Dictionary)) else None
    if not name:
        return None
    if isinstance(atom, CONSTANTS):
        expected = _KINDS.get(name)
        return isinstance(atom, expected) if expected else False if name in _CONTAINERS else None
    known = name in _CONTAINERS or name in _KINDS
    if isinstance(atom, Sequence):
        return name == atom.kind if known and atom.kind != "generator" else None
    return name == "dict" if known and isinstance(atom, Dictionary) else None
