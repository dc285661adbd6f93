"""argparse: options of the command line, with what they are by default."""

from __future__ import annotations

from collections.abc import Callable

from nodl.infer.interpreter.run import Arguments, Call, Run
from nodl.infer.text import Input, Text, input_of
from nodl.infer.values import (
    ANY,
    BOOLEAN,
    BOTTOM,
    COMMAND_LINE,
    NONE,
    External,
    Instance,
    Items,
    Sequence,
    Unknown,
    Value,
    constant_strings,
    external,
    join,
    join_all,
    sole,
    unknown,
)

PARSER = "argparse.ArgumentParser"
NAMESPACE = "argparse.Namespace"
_COUNT = "positional arguments"
_NOT_TOLD = unknown("which word of the command line it is")
_TAKES_ROS_WORDS = "an option that ROS has, too"
_ROS_WORDS = (
    "--ros-args",
    "-r",
    "--remap",
    "-p",
    "--param",
    "-e",
    "--enclave",
    "--log-",
    "--enable-",
    "--disable-",
)
_KEEP_TEXT = frozenset({"builtins.str", "builtins.int"})  # types that leave a well-written value as it is


def made_parser(run: Run, call: Call) -> Value:
    """Model ``ArgumentParser(...)``: the object that collects the options declared on it."""
    parser = run.library_object(call, PARSER)
    inherits = "parents" in call.args.keywords
    run.state.store(parser, _COUNT, unknown("positional arguments of parents") if inherits else (0,))
    return (parser,)


def _add_argument(run: Run, parser: Instance, call: Call) -> Value:
    flags = [flag for value in call.args.positional for flag in constant_strings(value)]
    known = len(flags) == len(call.args.positional) and not call.args.more
    if not known or any(flag.startswith(_ROS_WORDS) for flag in flags):
        run.state.store(parser, _TAKES_ROS_WORDS, (True,))
    if not flags:
        return ANY
    long = next((flag for flag in flags if flag.startswith("--")), flags[0])
    dest = sole(call.args.keywords.get("dest", (long.lstrip("-").replace("-", "_"),)))
    default = call.args.keywords.get("default", BOTTOM)
    owner = parser.cells.get("parser", (parser,))[0]
    assert isinstance(owner, Instance)
    name = long if long.startswith("-") else _place(run, owner, long, call)
    run.options.declare(name, tuple(atom for atom in default if atom is not None))
    if isinstance(dest, str):
        parsed, before = _parsed(run, name, call), owner.cells.get("dest " + dest)
        run.state.store(owner, "dest " + dest, parsed if before in (None, parsed) else ANY)
    return ANY


def _place(run: Run, parser: Instance, name: str, call: Call) -> str:
    """Return ``<1>`` for the first word of the command line, or ``<name>`` where its place is not certain.

    argparse gives each positional argument one word in turn; an optional one takes its word only after all others have
    theirs, and so is certain only at the end.
    """
    before = sole(parser.cells.get(_COUNT, BOTTOM))
    nargs = sole(call.args.keywords.get("nargs", NONE))
    if type(before) is not int:
        run.gap(
            call.node, call.frame, "which word of the command line a positional argument takes is not known"
        )
    elif nargs in (None, "?"):
        run.state.store(parser, _COUNT, (before + 1,) if nargs is None else _NOT_TOLD)
        return f"<{before + 1}>"
    run.state.store(parser, _COUNT, _NOT_TOLD)
    return f"<{name}>"


def _parsed(run: Run, name: str, call: Call) -> Value:
    """Return what the option holds: its text, or whether a flag is there; unknown if it is made into anything else."""
    if name in run.launch.inputs:
        return _settled(run, name, call)
    given = call.args.keywords
    action, nargs = sole(given.get("action", ("store",))), sole(given.get("nargs", NONE))
    if action in ("store_true", "store_false"):
        there = action == "store_true"
        default = sole(given.get("default", (not there,)))
        run.options.declare(name, (default,))
        flag = Input(name, run.options, None, (("given", (str(there), str(default))),))
        return (Text((flag,)),) if isinstance(default, bool) else BOOLEAN
    kept = all(isinstance(atom, External) and atom.path in _KEEP_TEXT for atom in given.get("type", BOTTOM))
    run.asks_launch = run.asks_launch or not kept
    if action != "store" or nargs not in (None, "?") or not kept:
        return unknown(f"what is made of the command line option {name}")
    return (Text((Input(name, run.options),)),)


def _settled(run: Run, name: str, call: Call) -> Value:
    """Return what the option holds in this launch."""
    keywords, word = call.args.keywords, run.launch.inputs[name]
    action, nargs = sole(keywords.get("action", ("store",))), sole(keywords.get("nargs", NONE))
    if action in ("store_true", "store_false"):
        there = action == "store_true"
        return keywords.get("default", (not there,)) if word is None else (there,)
    if action != "store" or nargs not in (None, "?") or (word == "" and nargs == "?"):
        return unknown(f"what is made of the command line option {name}")
    values = keywords.get("default", NONE) if word is None else (word,)
    texts = tuple(atom for atom in values if isinstance(atom, str))
    others = tuple(atom for atom in values if not isinstance(atom, str))
    made = keywords.get("type", external("builtins.str"))
    return join(run.call(made, Arguments([texts]), call.node, call.frame) if texts else BOTTOM, others)


def _set_defaults(run: Run, parser: Instance, call: Call) -> Value:
    for dest, value in call.args.keywords.items():
        cell = "dest " + dest
        option = input_of(sole(parser.cells.get(cell)))
        if option is not None and not option.edits:
            (run.options.declare if run.state.forks else run.options.replace)(option.name, value)
            continue
        run.state.store(parser, cell, join(parser.cells.get(cell, BOTTOM), value))
    return NONE


def _parse_args(run: Run, parser: Instance, call: Call) -> Value:
    namespace = run.library_object(call, NAMESPACE)
    run.state.store(namespace, "parser", (parser,))
    given = call.args.at(0, "args") or NONE
    if any(isinstance(atom, Sequence) for atom in given):
        run.state.store(namespace, "[given]", given)
    return (namespace,)


def _add_subparsers(run: Run, parser: Instance, call: Call) -> Value:
    run.state.store(parser, _COUNT, _NOT_TOLD)
    return unknown("the sub-commands of a command line")


def _parse_known_args(run: Run, parser: Instance, call: Call) -> Value:
    """Return the namespace, and what the parser leaves: the command line as ROS reads it, unless it takes words of it.

    argparse takes an abbreviated option for one of its own, and any word for a positional argument.
    """
    namespace = _parse_args(run, parser, call)
    rest = unknown(COMMAND_LINE)
    parsed = call.args.at(0, "args") or NONE
    whole = all(atom is None or (isinstance(atom, Unknown) and atom.why == COMMAND_LINE) for atom in parsed)
    if not whole or parser.cells.get(_COUNT) != (0,) or _TAKES_ROS_WORDS in parser.cells:
        rest = run.sequence(call.node, "list", Items(None, rest))
    return run.tuple_of((namespace, rest))


def namespace_attribute(run: Run, namespace: Instance, name: str) -> Value:
    """Return what ``args.<name>`` may be; anything if no parser declares it or the program passes the arguments."""
    parsers = (atom for atom in namespace.cells.get("parser", BOTTOM) if isinstance(atom, Instance))
    found = join_all(parser.cells.get("dest " + name, BOTTOM) for parser in parsers)
    if "[given]" in namespace.cells:  # not what launch writes on the command line, but a list of the program
        known = tuple(atom for atom in found if not isinstance(atom, (str, Text)))
        return join(known, unknown(f"the option {name} in arguments that the program makes"))
    return found or unknown(f"the command line option {name}")


METHODS: dict[tuple[str, str], Callable[[Run, Instance, Call], Value]] = {
    (PARSER, "add_argument"): _add_argument,
    (PARSER, "set_defaults"): _set_defaults,
    (PARSER, "add_argument_group"): lambda run, parser, call: (parser,),
    (PARSER, "add_subparsers"): _add_subparsers,
    (PARSER, "add_mutually_exclusive_group"): lambda run, parser, call: (parser,),
    (PARSER, "parse_args"): _parse_args,
    (PARSER, "parse_known_args"): _parse_known_args,
    (PARSER, "parse_intermixed_args"): _parse_args,
}
