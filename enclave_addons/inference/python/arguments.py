"""argparse: the options of a program, and in a launch what they hold, for which argparse itself is asked."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NamedTuple, NoReturn

from enclave_addons.inference.kernel.texts import Input
from enclave_addons.inference.kernel.values import (
    ANY,
    BOOLEAN,
    NONE,
    External,
    Items,
    Key,
    Obj,
    Unknown,
    Value,
    external,
    join_all,
    sole,
    strings,
    unknown,
)
from enclave_addons.inference.python.containers import elements
from enclave_addons.inference.python.objects import Arguments, Call
from enclave_addons.inference.python.run import COMMAND_LINE, FOREIGN_FIELDS, Run
from nodl.ros_arguments import words_without_ros_arguments

PARSER = "argparse.ArgumentParser"
NAMESPACE = "argparse.Namespace"
_DECLARED = "[declared]"

_CONSTANT = {"store_true": (True,), "store_false": (False,)}


class DeclaredOption(NamedTuple):
    """One call of ``add_argument``."""

    flags: tuple[str, ...]
    keywords: Mapping[str, Value]

    @property
    def action(self) -> object:
        return sole(self.keywords.get("action", ("store",)))

    @property
    def dest(self) -> str:
        long = next((flag for flag in self.flags if flag.startswith("--")), self.flags[0])
        given = sole(self.keywords.get("dest", (long.lstrip("-").replace("-", "_"),)))
        return given if isinstance(given, str) else ""

    @property
    def default(self) -> Value:
        without = {"store_true": (False,), "store_false": (True,)}.get(str(self.action), NONE)
        return self.keywords.get("default", without)


def made_parser(run: Run, call: Call) -> Value:
    """Model ``ArgumentParser(...)``."""
    parser = run.library_object(call, PARSER)
    run.store.write(parser.cells, _DECLARED, ((),))
    return (parser,)


def _add_argument(run: Run, parser: Obj, call: Call) -> Value:
    flags = tuple(flag for value in call.args.positional for flag in strings(value))
    declared = sole(parser.cells.get(_DECLARED))
    if not flags or len(flags) < len(call.args.positional) or not isinstance(declared, tuple):
        run.store.write(parser.cells, _DECLARED, ANY)
        return ANY
    option = DeclaredOption(flags, call.args.keywords)
    run.store.write(parser.cells, _DECLARED, ((*declared, option),))
    return ANY


def _set_defaults(run: Run, parser: Obj, call: Call) -> Value:
    run.store.write(parser.cells, _DECLARED, ANY)
    return NONE


def _parse(run: Run, parser: Obj, call: Call) -> Value:
    namespace = run.library_object(call, NAMESPACE)
    declared = sole(parser.cells.get(_DECLARED))
    given = sole(call.at(0, "args") or NONE)
    whole = given is None or isinstance(given, (Unknown, External))
    words = run.launch.words
    if isinstance(declared, tuple):
        held = _read(run, declared, words, call) if words is not None and whole else {}
        for option in declared:
            value = held.get(option.dest) if held else _open(run, option) if whole else ANY
            run.store.store(namespace, option.dest, value or ANY)
    return (namespace,)


def _open(run: Run, option: DeclaredOption) -> Value:
    """Return what an option may hold while there is no launch."""
    name = next((flag for flag in option.flags if flag.startswith("--")), option.flags[0])
    options, default = run.findings.options, option.default
    run.has_inputs = True
    if option.action in _CONSTANT:
        there, known = option.action == "store_true", sole(default)
        options.declare(name, default)
        edits = (("given", (str(there), str(known))),)
        return run.of_launch(Input(name, options, None, edits)) if isinstance(known, bool) else BOOLEAN
    options.declare(name, tuple(atom for atom in default if atom is not None))
    kept = all(
        isinstance(a, External) and a.path in ("builtins.str", "builtins.int")
        for a in option.keywords.get("type", ())
    )
    if (
        option.action == "store"
        and sole(option.keywords.get("nargs", NONE)) is None
        and kept
        and name.startswith("-")
    ):
        return run.of_launch(Input(name, options))
    return unknown(f"what is made of the command line option {name}")


def _parse_known(run: Run, parser: Obj, call: Call) -> Value:
    given = sole(call.at(0, "args") or NONE)
    whole = given is None or isinstance(given, (Unknown, External))
    rest = unknown(COMMAND_LINE if whole else "arguments that the program makes")
    return run.tuple_of(_parse(run, parser, call), rest)


def namespace_field(run: Run, namespace: Obj, name: str) -> Value | None:
    """Return an attribute of parsed arguments that no option declares."""
    return unknown(f"the command line option {name}")


def as_dictionary(run: Run, namespace: Obj, call: Call) -> Value:
    """Return ``vars(namespace)``."""
    made = run.allocate(call.node, "dict", tag="options")
    for name, value in list(namespace.cells.items()):
        run.store.store(made, Key(name), value)
    return (made,)


METHODS: dict[tuple[str, str], Callable[[Run, Obj, Call], Value]] = {
    (PARSER, "add_argument"): _add_argument,
    (PARSER, "set_defaults"): _set_defaults,
    (PARSER, "add_argument_group"): lambda run, parser, call: (parser,),
    (PARSER, "add_mutually_exclusive_group"): lambda run, parser, call: (parser,),
    (PARSER, "parse_args"): _parse,
    (PARSER, "parse_known_args"): _parse_known,
    (PARSER, "parse_intermixed_args"): _parse,
}
FOREIGN_FIELDS[NAMESPACE] = namespace_field


# --- in a launch --------------------------------------------------------------------------------------------


class _Word(NamedTuple):
    """A word of the command line as argparse hands it to an option; ``None``: the option's constant."""

    declared: DeclaredOption
    text: str | None


class _Refused(Exception):
    """The program would end here, or it is not known what it does."""


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        raise _Refused(message)


def _read(
    run: Run, declared: tuple[DeclaredOption, ...], words: tuple[str, ...], call: Call
) -> dict[str, Value]:
    """Return what each option holds under these words; nothing if that is not known."""
    parser = _Parser(add_help=False, argument_default=argparse.SUPPRESS)
    try:
        for each in declared:
            _declare(parser, each)
        found = vars(parser.parse_known_args(words_without_ros_arguments(words))[0])
        return {each.dest: _held(run, each, found.get(each.dest), call) for each in declared}
    except (_Refused, TypeError, ValueError, argparse.ArgumentError):
        return {}


def _declare(parser: argparse.ArgumentParser, declared: DeclaredOption) -> None:
    constant = _Word(declared, None)
    settings: dict[str, Any] = {
        name: sole(declared.keywords[name]) for name in ("nargs", "dest") if name in declared.keywords
    }
    if declared.action in ("store", "append", "extend"):
        settings.update(action=declared.action, type=partial(_Word, declared))
        if settings.get("nargs") == "?":
            settings.update(const=constant, default=None)
    elif declared.action in ("store_true", "store_false", "store_const"):
        settings.update(action="store_const", const=constant)
    else:
        raise _Refused("an action that is not modelled")
    parser.add_argument(*declared.flags, **settings)


def _held(run: Run, declared: DeclaredOption, found: object, call: Call) -> Value:
    if found is None:
        if (
            declared.default == NONE
            and declared.flags[0][:1] != "-"
            and sole(declared.keywords.get("nargs")) == "*"
        ):
            return run.tuple_of()
        texts = strings(declared.default)
        others = tuple(atom for atom in declared.default if not isinstance(atom, str))
        return join_all([*(_converted(run, declared, text, call) for text in texts), others]) or NONE
    if isinstance(found, _Word):
        return _value(run, found, call)
    words = found if isinstance(found, list) else []
    before = (
        ()
        if declared.action == "store" or declared.default == NONE
        else elements(run, declared.default).exact
    )
    if before is None or not all(isinstance(each, _Word) for each in words):
        return unknown("a list of words of the command line")
    values = (*before, *(_value(run, each, call) for each in words))
    return run.sequence(call.node, "list", Items(values), f"words of {declared.flags}")


def _value(run: Run, word: _Word, call: Call) -> Value:
    if word.text is None:
        return word.declared.keywords.get("const", _CONSTANT.get(str(word.declared.action), NONE))
    return _converted(run, word.declared, word.text, call)


def _converted(run: Run, declared: DeclaredOption, text: str, call: Call) -> Value:
    kind = declared.keywords.get("type", external("builtins.str"))
    return run.call(kind, Arguments([(text,)]), call.node, call.frame)
