"""Callbacks: what the world outside may call, called until nothing changes.

Subscriptions, timers, threads and hooks of foreign classes run in any order and any number of times: the state after
each call is joined with the one before, to a fixpoint. One is not called again while nothing has changed since.
"""

from __future__ import annotations

from collections.abc import Callable

from nodl.infer.interpreter.define import expect_methods
from nodl.infer.interpreter.frames import Arguments, Call, Frame
from nodl.infer.interpreter.run import Run
from nodl.infer.values import ClassValue, ModuleValue, unknown
from nodl.source_ref import SourceRef

MAX_ROUNDS = 12
WIDEN_TEXTS_FROM = 4


def settle(run: Run, at_end: bool = True) -> None:
    """Call all callbacks until neither state nor findings change; ``at_end``: the program itself has ended."""
    run.repeated += 1
    outermost = run.settle is not _no_settling
    run.settle = _no_settling
    expected: set[object] = set()
    for turn in range(MAX_ROUNDS):
        _expect_escaped(run, expected)
        before = run.state.version(), dict(run.callbacks)
        for callback, arity in before[1].items():
            if run.called_back.get((callback, arity)) != run.state.version():
                if at_end:
                    run.state.forget()
                _call_back(run, callback, arity, turn >= WIDEN_TEXTS_FROM)
        if before == (run.state.version(), run.callbacks) and expected.issuperset(run.escaped):
            break
    else:
        run.findings.gap(SourceRef(run.main.path), "the callbacks do not settle; names may be missing")
    run.repeated -= 1
    run.settle = settle_meanwhile if outermost else _no_settling


def settle_meanwhile(run: Run) -> None:
    """Call all callbacks where the program waits for them."""
    settle(run, at_end=False)


def _no_settling(run: Run) -> None:
    """Do nothing: callbacks are running already."""


def _call_back(run: Run, callback: object, arity: int | None, widen_texts: bool) -> None:
    """Call it once. What it made stands for what each of its calls makes."""
    run.born = []
    run.called_back[callback, arity] = run.state.version()
    run.state.repeatedly(_called_from_outside(run, callback, arity), widen_texts)
    for made in run.born:
        made.summary = True


def _expect_escaped(run: Run, expected: set[object]) -> None:
    """Expect that code which was handed a class or an object makes objects of it and calls its methods, in
    any order.
    """
    for atom in list(run.escaped):
        if atom in expected:
            continue
        expected.add(atom)
        if isinstance(atom, ClassValue):
            run.callbacks.setdefault(atom, None)
        else:
            expect_methods(run, (atom,))


def _called_from_outside(run: Run, callback: object, arity: int | None) -> Callable[[], bool]:
    made = unknown("an argument given by code that is not analysed")
    args = Arguments(more=made) if arity is None else Arguments([made] * arity)
    module = next(iter(run.modules.values()))

    def call() -> bool:
        made = call_from_outside(run, module, callback, args)
        if isinstance(callback, ClassValue):
            run.escape_value(made)
        return True

    return call


def call_from_outside(run: Run, module: ModuleValue, atom: object, args: Arguments) -> tuple[object, ...]:
    """Call ``atom`` as nobody in the program does; returns what it gives."""
    frame = Frame(module, {}, None, run.state.depth)
    return run.call_atom(atom, Call(args, module.source.tree, frame))
