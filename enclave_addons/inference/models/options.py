"""argparse: options of the command line, with what they are by default.

In a launch ``enclave_addons/inference/models/command_line.py`` says what they hold.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeGuard

from enclave_addons.inference.interpreter.run import Call, Run
from enclave_addons.inference.models.command_line import DeclaredOption, read_words
from enclave_addons.inference.text import Input, Text
from enclave_addons.inference.values import (
    ANY,
    BOOLEAN,
    BOTTOM,
    COMMAND_LINE,
    NONE,
    OTHER,
    WITHOUT_PROGRAM,
    WITHOUT_ROS,
    Dictionary,
    External,
    Instance,
    Items,
    Key,
    Value,
    constant_strings,
    join,
    join_all,
    result_of,
    sole,
    unknown,
)
from nodl.ros_arguments import words_without_ros_arguments

PARSER = "argparse.ArgumentParser"
NAMESPACE = "argparse.Namespace"
_PARSER = "the parser"  # of a namespace; not an attribute of it
_DECLARED = "declared arguments"
# Of a parser; they do not change what its arguments hold.
_HARMLESS = frozenset({"prog", "usage", "description", "epilog", "formatter_class", "add_help"})
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
    run.state.store(parser, _DECLARED, ((),) if _HARMLESS.issuperset(call.args.keywords) else ANY)
    return (parser,)


def _add_argument(run: Run, parser: Instance, call: Call) -> Value:
    flags = [flag for value in call.args.positional for flag in constant_strings(value)]
    known = bool(flags) and len(flags) == len(call.args.positional) and not call.args.more
    if not known or any(flag.startswith(_ROS_WORDS) for flag in flags):
        run.state.store(parser, _TAKES_ROS_WORDS, (True,))
    before = sole(parser.cells.get(_DECLARED))
    declared = DeclaredOption(tuple(flags), call.args.keywords)
    if known and isinstance(before, tuple) and not call.args.more_keywords:
        run.state.store(parser, _DECLARED, ((*before, declared),))
    else:
        run.state.store(parser, _DECLARED, ANY)
    if not flags:
        return ANY
    long = next((flag for flag in flags if flag.startswith("--")), flags[0])
    dest = sole(call.args.keywords.get("dest", (long.lstrip("-").replace("-", "_"),)))
    default = call.args.keywords.get("default", BOTTOM)
    run.options.declare(long, tuple(atom for atom in default if atom is not None))
    if isinstance(dest, str):
        parsed, earlier = _parsed(run, long, call), parser.cells.get("dest " + dest)
        run.state.store(parser, "dest " + dest, parsed if earlier in (None, parsed) else ANY)
    return ANY


def _parsed(run: Run, name: str, call: Call) -> Value:
    """Return the text of an option, or whether a flag is there; until a launch says what they hold, a word without an
    option and what is made into anything else are open.
    """
    run.escape(call.args, opened=False)  # a type or an action is called when the command line is read
    given = call.args.keywords
    action, nargs = sole(given.get("action", ("store",))), sole(given.get("nargs", NONE))
    if action in ("store_true", "store_false"):
        there = action == "store_true"
        default = sole(given.get("default", (not there,)))
        run.options.declare(name, (default,))
        flag = Input(name, run.options, (("given", (str(there), str(default))),))
        return run.of_launch(flag) if isinstance(default, bool) else BOOLEAN
    kept = all(isinstance(atom, External) and atom.path in _KEEP_TEXT for atom in given.get("type", BOTTOM))
    if action == "store" and nargs in (None, "?") and kept and name.startswith("-"):
        run.asks_launch = run.asks_launch or nargs == "?"  # without a word it is ``const``
        return run.of_launch(Input(name, run.options))
    run.asks_launch = True
    return unknown(f"what is made of the command line option {name}")


def _set_defaults(run: Run, parser: Instance, call: Call) -> Value:
    run.state.store(parser, _DECLARED, ANY)
    for dest in call.args.keywords:
        run.state.store(parser, "dest " + dest, unknown(f"a default of the option {dest} that is set later"))
    return NONE


def _parse_args(run: Run, parser: Instance, call: Call, others_too: bool = False) -> Value:
    namespace = run.library_object(call, NAMESPACE)
    run.state.store(namespace, _PARSER, (parser,))
    given = call.args.at(0, "args") or NONE
    left = result_of("rclpy")  # of remove_ros_args(), with the name of the program, as in sys.argv
    takes_program = given in (unknown(COMMAND_LINE), left) and _takes_words(parser)
    if takes_program or not (_is_whole(given) or given in (left, unknown(WITHOUT_ROS))):
        run.state.store(namespace, "[given]", given)
    elif run.launch.words is not None:
        whole = others_too and _is_whole(given)  # else words of ROS would end the program
        words = run.launch.words if whole else words_without_ros_arguments(run.launch.words)
        declared = sole(parser.cells.get(_DECLARED))
        held = read_words(run, declared, words, call) if isinstance(declared, tuple) else {}
        for dest, value in held.items():
            run.state.store(namespace, "dest " + dest, value)
    return (namespace,)


def _is_whole(given: Value) -> bool:
    whole = (NONE, unknown(COMMAND_LINE), unknown(WITHOUT_PROGRAM))
    return all((atom,) in whole for atom in given)


def _takes_words(parser: Instance) -> bool:
    """Return whether a word of the command line may be taken that belongs to no option."""
    declared = sole(parser.cells.get(_DECLARED))
    return not isinstance(declared, tuple) or any(not each.flags[0].startswith("-") for each in declared)


def _add_subparsers(run: Run, parser: Instance, call: Call) -> Value:
    run.state.store(parser, _DECLARED, ANY)
    return unknown("the sub-commands of a command line")


def _parse_known_args(run: Run, parser: Instance, call: Call) -> Value:
    """Return the namespace, and what the parser leaves: the command line as ROS reads it, unless it takes words of it.

    argparse takes an abbreviated option for one of its own, and any word for a positional argument.
    """
    namespace = _parse_args(run, parser, call, others_too=True)
    rest = unknown(COMMAND_LINE)
    whole = _is_whole(call.args.at(0, "args") or NONE)
    if not whole or _takes_words(parser) or _TAKES_ROS_WORDS in parser.cells:
        rest = run.sequence(call.node, "list", Items(None, rest))
    return run.tuple_of((namespace, rest))


def namespace_attribute(run: Run, namespace: Instance, name: str) -> Value:
    """Return what ``args.<name>`` may be; anything if no parser declares it or the program passes the arguments."""
    if "dest " + name in namespace.cells:
        return namespace.cells["dest " + name] or unknown(f"the command line option {name}")
    found = join_all(parser.cells.get("dest " + name, BOTTOM) for parser in _parsers_of(namespace))
    if "[given]" in namespace.cells:  # not what launch writes on the command line, but a list of the program
        known = tuple(atom for atom in found if not isinstance(atom, (str, Text)))
        return join(known, unknown(f"the option {name} in arguments that the program makes"))
    return found or unknown(f"the command line option {name}")


def _parsers_of(namespace: Instance) -> list[Instance]:
    return [atom for atom in namespace.cells.get(_PARSER, BOTTOM) if isinstance(atom, Instance)]


def is_namespace(atom: object) -> TypeGuard[Instance]:
    """Return True for what ``parse_args`` gives."""
    return isinstance(atom, Instance) and isinstance(atom.cls, External) and atom.cls.path == NAMESPACE


def as_dictionary(run: Run, namespace: Instance, call: Call) -> Value:
    """Return what ``**vars(namespace)`` gives: an entry for each option; any if which there are is not known."""
    made = run.allocate(call.node, "options", Dictionary)
    parsers = _parsers_of(namespace)
    if any(not isinstance(sole(parser.cells.get(_DECLARED)), tuple) for parser in parsers) or not parsers:
        run.state.store(made, OTHER, ANY)
    cells = [cell for parser in parsers for cell in parser.cells if isinstance(cell, str)]
    names = [cell.removeprefix("dest ") for cell in cells if cell.startswith("dest ")]
    for name in (
        *names,
        *(cell for cell in namespace.cells if isinstance(cell, str) and cell.isidentifier()),
    ):
        run.state.store(made, Key(name), run.attribute((namespace,), name, call.node, call.frame))
    return (made,)


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
