"""Exceptions of the analysed program, thrown through the interpreter where it is certain that they are raised.

An exception is certain when no undecided test lies between the ``raise`` and the innermost ``try`` (or the start). All
others end their path, as ever, and count as a risk: a handler is left out only when nothing in its ``try`` could fail.
"""

from __future__ import annotations

import builtins

from nodl.infer.interpreter.define import linearized
from nodl.infer.interpreter.frames import Frame
from nodl.infer.interpreter.run import Run
from nodl.infer.values import ClassValue, External, Instance, Value


class Raised(Exception):
    """A certain exception of the program. ``value``: its object; ``kinds``: paths or classes, most special first."""

    def __init__(self, value: Value, kinds: tuple[object, ...]):
        super().__init__()
        self.value = value
        self.kinds = kinds


def is_certain(run: Run) -> bool:
    """Whether no undecided branch lies between here and the innermost ``try`` (or the start)."""
    return run.state.forks == run.try_forks


def throw(run: Run, error: type[BaseException] | str, text: str = "") -> None:
    """Raise a built-in exception of the program if that is certain; else note the risk and return."""
    run.risks += 1
    if is_certain(run):
        kind = error if isinstance(error, type) else getattr(builtins, error)
        raised = Instance(External(f"builtins.{kind.__name__}"))
        raised.cells["text"] = (text,)
        raise Raised((raised,), _builtin_kinds(kind))


def throw_value(run: Run, value: Value) -> None:
    """The same for an exception of the program's own making."""
    run.risks += 1
    if not is_certain(run) or len(value) != 1:
        return
    kinds = kinds_of(value[0])
    if kinds:
        raise Raised(value, kinds)


def kinds_of(atom: object) -> tuple[object, ...]:
    """The classes of an exception object; nothing when they are not all known."""
    cls = atom.cls if isinstance(atom, Instance) else atom
    if isinstance(cls, External):
        return _builtin_kinds(_builtin(cls.path))
    if not isinstance(cls, ClassValue):
        return ()
    kinds: list[object] = []
    for base in linearized(cls):
        if isinstance(base, ClassValue):
            kinds.append(base)
        elif isinstance(base, External):
            kinds.extend(_builtin_kinds(_builtin(base.path)))
        else:
            return ()
    return tuple(kinds)


def catches(handled: Value, raised: Raised) -> bool | None:
    """Whether ``except handled`` catches it; ``None``: not known."""
    outcomes = {_catches_one(atom, raised) for atom in handled}
    return outcomes.pop() if len(outcomes) == 1 else None


def _catches_one(atom: object, raised: Raised) -> bool | None:
    if isinstance(atom, ClassValue):
        return atom in raised.kinds
    if isinstance(atom, External):
        if _builtin(atom.path) is not None:
            return atom.path in raised.kinds
        known = all(isinstance(kind, str) for kind in raised.kinds)
        return False if known else None
    return None


def _builtin(path: str) -> type[BaseException] | None:
    found = getattr(builtins, path.removeprefix("builtins."), None)
    return found if isinstance(found, type) and issubclass(found, BaseException) else None


def is_builtin_exception(path: str) -> bool:
    """Whether the path of an ``External`` names an exception class of Python itself."""
    return path.startswith("builtins.") and _builtin(path) is not None


def _builtin_kinds(kind: type[BaseException] | None) -> tuple[object, ...]:
    if kind is None:
        return ()
    return tuple(f"builtins.{each.__name__}" for each in kind.__mro__ if issubclass(each, BaseException))


class Attempt:
    """A ``try``, or what works like one: until its ``end`` risks are counted. ``risks``: how many there were before;
    an exception that ends it is itself one more."""

    def __init__(self, run: Run, frame: Frame) -> None:
        state = run.state
        self._numbers = run.context, state.depth, run.unrolled, run.tries, run.try_forks, frame.loop_forks
        self._stack = len(run.stack)
        self.risks = run.risks
        state.depth += 1
        run.tries += 1
        run.try_forks = state.forks

    def end(self, run: Run, frame: Frame) -> None:
        """Go back to where the interpreter stood, also after an exception."""
        run.context, run.state.depth, run.unrolled, run.tries, run.try_forks, frame.loop_forks = self._numbers
        del run.stack[self._stack :]
        frame.jump = ""
