"""The manners that all commands share: how they read options, name their version, and answer a slip of the fingers."""

from __future__ import annotations

import argparse
import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

from enclave_common import VERSION
from enclave_common.dependencies import missing_dependency
from enclave_common.terminal import OutputError
from enclave_common.words import did_you_mean

_INVALID_CHOICE = re.compile(r"^(.*invalid choice: '([^']*)') \(choose from .*\)$", re.DOTALL)


Kind = Mapping[str, Any]
Option = tuple[str, Kind, str]
"""As the help shows it, with its metavar (a positional by its name); what it takes, in argparse's words; what it is
for."""


def given_path(text: str) -> Path:
    """Return ``text`` as a path; raises argparse.ArgumentTypeError if it is empty, as an unset variable."""
    if not text:
        raise argparse.ArgumentTypeError("an empty path; is a variable of the shell not set?")
    return Path(text)


def time_span(text: str) -> float:
    """Return ``20s``, ``5m``, ``1h``, ``2d`` or a number in seconds; raises argparse.ArgumentTypeError."""
    found = _SPAN.fullmatch(text)
    if found is None:
        raise argparse.ArgumentTypeError(f"{text!r} is not a time such as 20s, 5m, 1h or 2d")
    return float(found[1]) * _UNITS[found[2] or "s"]


_SPAN = re.compile(r"([0-9]+(?:\.[0-9]+)?)(s|m|h|d)?")
_UNITS = {"s": 1.0, "m": 60.0, "h": 3600.0, "d": 86400.0}

FLAG: Kind = {"action": "store_true"}
TEXT: Kind = {}
PATH: Kind = {"type": given_path}
TIME: Kind = {"type": time_span}
TEXTS: Kind = {"action": "append", "default": []}
PATHS: Kind = {**TEXTS, **PATH}


def one_of(*choices: str) -> Kind:
    """Return the kind of an option with choices; the first is the default."""
    return {"choices": choices, "default": choices[0]}


def add_options(group: argparse._ActionsContainer, options: Iterable[Option]) -> None:
    """Add each to a parser, or to a group of its options."""
    for written, kind, text in options:
        words = written.split()
        flags = [word for word in words if word.startswith("-")] or words[:1]
        metavar = {"metavar": words[-1]} if len(words) > len(flags) else {}
        group.add_argument(*flags, **{**metavar, **kind, "help": text})


class VerbHead(NamedTuple):
    """The docstring of a verb's module as its help: ``help`` for the list of verbs; ``epilog`` has examples and exit
    status."""

    help: str
    description: str
    epilog: str | None


def verb_head(docstring: str | None) -> VerbHead:
    """Split the docstring of a verb's module, whose first line is a sentence."""
    text = (docstring or "").strip()
    description, mark, status = text.partition("exit status")
    return VerbHead(text.partition("\n")[0], description.rstrip(), f"{mark}{status}" if mark else None)


class HelpText(argparse.HelpFormatter):
    """Paragraphs are filled; those with an indented line (examples, tables) stay as they are written."""

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        paragraphs = re.split(r"\n\s*\n", text.strip("\n"))
        return "\n\n".join(
            each.strip("\n")
            if re.search(r"^ ", each, re.M)
            else super(HelpText, self)._fill_text(each, width, indent)
            for each in paragraphs
        )


class CommandParser(argparse.ArgumentParser):
    """Options are written out, since an abbreviation can mean another option after an update; what is mistyped is
    answered with what was probably meant.

    The help has one form: the usage on one line, then what belongs to the command itself, last a list of the options
    that another help describes (``fold``)."""

    def __init__(self, **settings: Any):
        settings.setdefault("allow_abbrev", False)
        settings.setdefault("formatter_class", HelpText)
        super().__init__(**settings)
        self._positionals.title = "arguments"
        self._folded: list[argparse.Action] = []
        self._described_in = ""

    def fold(self, options: Iterable[Option], described_in: str) -> None:
        """Let the help only name those of ``options`` that were added; ``described_in`` describes them."""
        flags = {word for written, *_ in options for word in written.split() if word.startswith("-")}
        self._folded = [each for each in self._actions if flags.intersection(each.option_strings)]
        self._described_in = described_in

    def format_usage(self) -> str:
        """Return the usage on one line; options are in the help."""
        return f"usage: {self.usage or self._one_usage()}\n"

    def format_help(self) -> str:
        """Return the help."""
        formatter = self._get_formatter()
        formatter.add_text(self.description)
        for group in self._action_groups:
            formatter.start_section(group.title)
            formatter.add_text(group.description)
            formatter.add_arguments(each for each in group._group_actions if each not in self._folded)
            formatter.end_section()
        if self._folded:
            formatter.start_section(f"options described by {self._described_in}")
            formatter.add_text(", ".join(max(each.option_strings, key=len) for each in self._folded))
            formatter.end_section()
        formatter.add_text(self.epilog)
        return f"{self.format_usage()}\n{formatter.format_help()}"

    def _one_usage(self) -> str:
        """Return the command with the options that it cannot do without, and its arguments."""
        required = [
            f"{each.option_strings[0]} {_in_usage(each)}"
            for each in self._actions
            if each.option_strings and each.required
        ]
        arguments = [
            _in_usage(each)
            for each in self._actions
            if not each.option_strings and each.help != argparse.SUPPRESS
        ]
        return " ".join((self.prog, *required, "[options]", *arguments))

    def error(self, message: str) -> NoReturn:
        """Print usage and message, and exit with status 2, as argparse."""
        super().error(message + self._suggestion(message))

    def _suggestion(self, message: str) -> str:
        if message.startswith("unrecognized arguments: "):
            options = [word.partition("=")[0] for word in message.split()[2:] if word.startswith("-")]
            known = [flag for parser in parsers(self) for flag in parser._option_string_actions]
            return did_you_mean(options[0], known) if options else ""
        if choice := _INVALID_CHOICE.match(message):
            return did_you_mean(choice[2], [str(known) for known in self._choices()])
        return ""

    def _choices(self) -> Iterator[object]:
        for action in self._actions:
            yield from action.choices or ()


def _in_usage(action: argparse.Action) -> str:
    if isinstance(action, argparse._SubParsersAction):
        return f"{action.metavar} ..."
    metavar = action.metavar or action.dest.upper()
    if not isinstance(metavar, str):
        return f"{metavar[0]} [{metavar[1]} ...]"
    if action.choices is not None and action.metavar is None:
        metavar = "{" + ",".join(map(str, action.choices)) + "}"
    if " " in metavar:  # it says by itself what may be repeated
        return metavar
    forms = {"?": f"[{metavar}]", "*": f"[{metavar} ...]", "+": f"{metavar} ..."}
    return forms.get(str(action.nargs), metavar)


def parsers(parser: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    """Yield ``parser`` and those of its verbs, of any depth, each once."""
    yield parser
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for below in dict.fromkeys(action.choices.values()):
                yield from parsers(below)


def add_version(parser: argparse.ArgumentParser) -> None:
    """Add ``--version``, the same for all commands."""
    parser.add_argument("--version", action="version", version=f"{parser.prog} {VERSION}")


def complete_with(
    commands: Iterable[argparse.ArgumentParser], name: str, completer: Callable[..., Iterable[str]]
) -> None:
    """Let the positional argument ``name`` of ``commands`` be completed by ``completer``, which argcomplete calls."""
    for each in commands:
        for action in each._actions:
            if action.dest == name and not action.option_strings:
                setattr(action, "completer", completer)  # noqa: B010  # argcomplete's own attribute


def complete(
    parser: argparse.ArgumentParser, offer: Callable[[argparse.ArgumentParser], None] | None = None
) -> None:
    """Answer a shell that asks for completions through argcomplete, if it is installed; then end.

    ``offer`` says what can be offered for the arguments of ``parser``."""
    if "_ARGCOMPLETE" not in os.environ:
        return
    try:
        import argcomplete
    except ImportError:
        raise SystemExit(1) from None
    if offer is not None:
        offer(parser)
    argcomplete.autocomplete(parser, always_complete_options="long")


def add_verbosity(parser: argparse.ArgumentParser) -> None:
    """Add ``-q`` and ``-v`` to a command, or to each of its verbs."""
    verbs = [each for each in parsers(parser) if each is not parser]
    for each in verbs or [parser]:
        if each.prefix_chars != "-":  # an absent verb, which takes no options
            continue
        group = each.add_mutually_exclusive_group()
        group.add_argument(
            "-q",
            "--quiet",
            action="store_true",
            help="only errors and the answer; no warnings",
        )
        group.add_argument("-v", "--verbose", action="store_true", help="list everything instead of counts")


def add_absent_verb(
    verbs: argparse._SubParsersAction[CommandParser],
    name: str,
    error: ImportError,
    handler: str = "run",
) -> None:
    """Add a verb of an add-on that is not installed; raises ``error`` again if it is about something else."""
    if missing_dependency(error) is None:
        raise error
    missing = error

    def run(_: argparse.Namespace) -> int:
        raise missing

    # No word begins with this prefix, so options of the verb are words like others.
    verb = verbs.add_parser(name, help="not part of this installation", add_help=False, prefix_chars="\0")
    verb.add_argument("words", nargs="*")
    verb.set_defaults(**{handler: run})


def guarded(program: str, work: Callable[[], int], *mistakes: type[Exception]) -> int:
    """Return the exit status of ``work``, or of the error that ended it: one line on stderr, no traceback.

    An error of ``mistakes`` may have its own ``exit_status``, else 1. 130: interrupted (Ctrl-C). 0: who read our output
    has enough. What is nobody's mistake but ours is raised.
    """
    try:
        status = work()
        if sys.stdout is not None:  # closed by whoever started us
            sys.stdout.flush()
        return status
    except mistakes as error:
        print(f"{program}: error: {error}", file=sys.stderr)
        return int(getattr(error, "exit_status", 1))
    except ImportError as error:
        text = missing_dependency(error)
        if text is None:
            raise
        print(f"{program}: error: {text}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print(f"{program}: interrupted", file=sys.stderr)
        return 130
    except OutputError as error:
        print(f"{program}: error: {error}", file=sys.stderr)
        _drop_output()
        return 1
    except BrokenPipeError:
        _drop_output()
        return 0


def _drop_output() -> None:
    """Discard what is still buffered; otherwise the interpreter reports the error again at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
