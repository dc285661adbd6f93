"""Values of a program's options in a launch: argparse itself parses the command line that the process gets."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple, NoReturn

from enclave_addons.inference.interpreter.run import Arguments, Call, Run
from enclave_addons.inference.values import (
    BOTTOM,
    NONE,
    Items,
    Value,
    external,
    join,
    sole,
    unknown,
)
from enclave_addons.inference.values import Sequence as Elements

_WITHOUT_WORD: dict[object, Value] = {"store_true": (False,), "store_false": (True,)}
_OF_FLAG: dict[object, Value] = {"store_true": (True,), "store_false": (False,)}
_WITH_WORDS = ("store", "append", "extend")
_WITH_CONSTANT = ("store_true", "store_false", "store_const")


class DeclaredOption(NamedTuple):
    """One call of ``add_argument``."""

    flags: tuple[str, ...]
    keywords: Mapping[str, Value]

    @property
    def action(self) -> object:
        return sole(self.keywords.get("action", ("store",)))

    @property
    def default(self) -> Value:
        """Return the value without a word on the command line; nothing for ``SUPPRESS``."""
        value = self.keywords.get("default", _WITHOUT_WORD.get(self.action, NONE))
        return BOTTOM if value == external("argparse.SUPPRESS") else value


class _Word(NamedTuple):
    """A word of the command line as argparse hands it to an option; ``None``: the constant of the option."""

    declared: DeclaredOption
    text: str | None


class _Refused(Exception):
    """The program would end here, or it is not known what it does."""


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        raise _Refused(message)


def read_words(
    run: Run, declared: Sequence[DeclaredOption], words: Sequence[str], call: Call
) -> dict[str, Value]:
    """Return what each option holds, by the attribute of the namespace; nothing if that is not known."""
    parser = _Parser(add_help=False, argument_default=argparse.SUPPRESS)
    try:
        first = {_declare(parser, each): each for each in reversed(declared)}
        found = vars(parser.parse_known_args(list(words))[0])
    except (_Refused, TypeError, ValueError, argparse.ArgumentError):
        return {}
    return {dest: _held(run, each, found.get(dest), call) for dest, each in first.items()}


def _declare(parser: argparse.ArgumentParser, declared: DeclaredOption) -> str:
    """Declare the argument once more; return the attribute that has what it holds."""
    constant = _Word(declared, None)
    settings: dict[str, Any] = {
        name: sole(declared.keywords[name]) for name in ("nargs", "dest") if name in declared.keywords
    }
    if declared.action in _WITH_WORDS:
        settings.update(action=declared.action, type=partial(_Word, declared))
        if settings.get("nargs") == "?":
            settings.update(const=constant, default=None)  # it would make a word of SUPPRESS
    elif declared.action in _WITH_CONSTANT:
        settings.update(action="store_const", const=constant)
    elif declared.action == "count":
        settings["action"] = "count"
    elif declared.action == external("argparse.BooleanOptionalAction")[0]:
        settings["action"] = argparse.BooleanOptionalAction
    else:
        raise _Refused("an action that is not modelled")
    return parser.add_argument(*declared.flags, **settings).dest


def _held(run: Run, declared: DeclaredOption, found: object, call: Call) -> Value:
    """Return the value of an option for which argparse found words, or ``None``."""
    if found is None:
        default = declared.default
        if default == NONE and declared.flags[0][:1] != "-" and declared.keywords.get("nargs") == ("*",):
            return run.sequence(call.node, "list", Items(()), f"words of {declared.flags}")
        texts = tuple(atom for atom in default if isinstance(atom, str))
        others = tuple(atom for atom in default if not isinstance(atom, str))
        return join(_made(run, declared, texts, call) if texts else BOTTOM, others)
    if isinstance(found, bool):
        return (found,)
    if isinstance(found, int):
        start = sole(declared.default)
        return (found + (start or 0),) if start is None or type(start) is int else unknown("a counted option")
    if isinstance(found, _Word):
        return _value(run, found, call)
    words = found if isinstance(found, list) else []
    before = () if declared.action == "store" or declared.default == NONE else _elements(declared.default)
    if before is None or not all(isinstance(each, _Word) for each in words):
        return unknown("a list of words of the command line")
    values = tuple(_value(run, each, call) for each in words)
    return run.sequence(call.node, "list", Items((*before, *values)), f"words of {declared.flags}")


def _elements(value: Value) -> tuple[Value, ...] | None:
    listed = sole(value)
    return listed.items.exact if isinstance(listed, Elements) else None


def _value(run: Run, word: _Word, call: Call) -> Value:
    if word.text is None:
        return word.declared.keywords.get("const", _OF_FLAG.get(word.declared.action, NONE))
    return _made(run, word.declared, (word.text,), call)


def _made(run: Run, declared: DeclaredOption, texts: Value, call: Call) -> Value:
    """Return what the option's ``type`` makes of a text."""
    kind = declared.keywords.get("type", external("builtins.str"))
    return run.call(kind, Arguments([texts]), call.node, call.frame)
