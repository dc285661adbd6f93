"""The manners that all commands share: how they read options, name their version, and answer a slip of the fingers."""

from __future__ import annotations

import argparse
import os
import re
import shlex
import shutil
import sys
import textwrap
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn, Protocol

from enclave_common import VERSION
from enclave_common.add_ons import add_ons
from enclave_common.dependencies import missing_dependency
from enclave_common.terminal import OutputError, choose_colour, quoted
from enclave_common.words import counted, nearest

_INVALID_CHOICE = re.compile(r".*invalid choice: '([^']*)' \(choose from (.*)\)$", re.DOTALL)


Kind = Mapping[str, Any]
Option = tuple[str, Kind, str]
"""An option in three parts: as the help shows it, with its metavar (a positional by its name); what it takes, in
argparse's words; what it is for. A flag in brackets, as in ``--new (--old) FILE``, is understood and never shown."""


def given_path(text: str) -> Path:
    """Return ``text`` as a path; raises argparse.ArgumentTypeError if it is empty, as an unset variable."""
    if not text:
        raise argparse.ArgumentTypeError("an empty path; is a variable of the shell not set?")
    try:
        return Path(text).expanduser()  # bash leaves the ~ of --option=~/folder as it is
    except RuntimeError:
        raise argparse.ArgumentTypeError(f"{text!r}: there is no such user") from None


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


@dataclass(frozen=True)
class FromProject:
    """The source of the value of an option that was not given (``enclave_common/project.py``).

    Attributes:
        key: A key of ``enclaves.yaml``.
        if_exists: A path that does not exist counts as not given, where the command only reads it.
        unless: Another option (``dest``) beside which the value is not taken.
        beside: Another option (``dest``) without which the value is not taken.
    """

    key: str
    if_exists: bool = False
    unless: str = ""
    beside: str = ""

    def applies(self, given: Collection[str]) -> bool:
        """Return whether the value is taken, by the names of the options that were written."""
        return self.unless not in given and (not self.beside or self.beside in given)


def one_of(*choices: str) -> Kind:
    """Return the kind of an option with choices; the first is the default."""
    return {"choices": choices, "default": choices[0]}


class OptionGroup(Protocol):
    """A parser, or a group of its options."""

    def add_argument(self, *flags: str, **kind: Any) -> argparse.Action:
        """Add one option, as ``argparse`` does."""

    def add_mutually_exclusive_group(self) -> OptionGroup:
        """Add a group of options of which one at most may be given, as ``argparse`` does."""


_NOTES = ("completer", "configured")
"""Keys of a kind beside argparse's own: argcomplete's attribute, and ``FromProject``."""


def add_options(group: OptionGroup, options: Iterable[Option]) -> list[argparse.Action]:
    """Add each to a parser or group; return argparse's actions, with what is in a kind beside argparse's words."""
    added = []
    for written, kind, text in options:
        words = [word for word in written.split() if not word.startswith("(")]
        aliases = [word[1:-1] for word in written.split() if word.startswith("(")]
        flags = [word for word in words if word.startswith("-")] or words[:1]
        metavar = {"metavar": words[-1]} if len(words) > len(flags) else {}
        settings = {**metavar, **kind, "help": text}
        notes = {name: settings.pop(name) for name in _NOTES if name in settings}
        action = group.add_argument(*flags, **settings)
        for name, note in notes.items():
            setattr(action, name, note)
        added.append(action)
        if aliases:
            added.append(
                group.add_argument(*aliases, **{**settings, "dest": action.dest, "help": argparse.SUPPRESS})
            )
    return added


def filled(text: str, indent: int = 0) -> str:
    """Fill the paragraphs of ``text`` to the terminal's width; those with an indented line (examples, tables) stay."""
    width = max(shutil.get_terminal_size().columns - 2, 20) - indent  # argparse's own measure
    paragraphs = re.split(r"\n\s*\n", text.strip("\n"))
    return "\n\n".join(
        each.strip("\n") if re.search(r"^ ", each, re.M) else textwrap.fill(" ".join(each.split()), width)
        for each in paragraphs
    )


class CommandParser(argparse.ArgumentParser):
    """Options are written out, since an abbreviation can mean another option after an update; what is mistyped is
    answered with what was probably meant.

    The help has one form: the usage on one line, then what belongs to the command itself, last a list of the options
    that another help describes (``fold``). ``arguments`` are those of the command, ``verbs`` its verbs' parsers."""

    def __init__(self, **settings: Any):
        self.arguments: list[argparse.Action] = []
        self.verbs: dict[str, CommandParser] = {}
        self.verb_dest = ""
        self.words: list[str] = []
        self._daily: frozenset[str] | None = None
        self._left_out: Counter[str] = Counter()
        texts = {name: filled(settings[name]) for name in ("description", "epilog") if settings.get(name)}
        form = {"allow_abbrev": False, "formatter_class": argparse.RawDescriptionHelpFormatter}
        super().__init__(**{**form, **settings, **texts})
        self.color = False  # Python 3.14 colours help by itself, with codes that terminal.py would escape

    def show_first(self, daily: Iterable[str], everything: Callable[[], CommandParser]) -> None:
        """Let the help show only what is used daily, and add ``--help-all``. To be called before anything is added.

        Args:
            daily: Long options and verbs.
            everything: Builds the parser whose help shows all of them.
        """
        self._daily = frozenset(daily)
        self.add_argument(
            "--help-all", action=_HelpAll, nargs=0, const=everything, help="show everything and exit"
        )

    def add_options(self, options: Iterable[Option], title: str = "") -> None:
        """Add each, those with a ``title`` as a group of the help."""
        self.arguments += add_options(self.add_argument_group(title) if title else self, self._shown(options))

    def _shown(self, options: Iterable[Option]) -> Iterator[Option]:
        for written, kind, text in options:
            flags = {word for word in written.split() if word.startswith("-")}
            if self._daily is not None and flags and not flags & self._daily and text != argparse.SUPPRESS:
                self._left_out["option"] += 1
                text = argparse.SUPPRESS
            yield written, kind, text

    def add_one_of(self, options: Iterable[Option], title: str = "") -> None:
        """Add options of which one at most may be given."""
        group = self.add_argument_group(title) if title else self
        self.arguments += add_options(group.add_mutually_exclusive_group(), self._shown(options))

    def add_verbs(self, dest: str = "verb") -> None:
        """Prepare for ``add_verb``; the parsed value ``dest`` names the verb."""
        self.verb_dest = dest
        self._add_parser = self.add_subparsers(
            title="verbs", metavar="VERB", required=True, dest=dest
        ).add_parser

    def add_verb(self, name: str, docstring: str | None, **settings: Any) -> CommandParser:
        """Add the parser of a verb, described by the docstring of its module: its first line in the list of verbs."""
        text = (docstring or "").strip()
        description, mark, status = text.partition("exit status")
        head = {
            "help": text.partition("\n")[0],
            "description": description.rstrip(),
            "epilog": f"{mark}{status}" if mark else None,
        }
        if self._daily is not None and name not in self._daily:
            self._left_out["verb"] += 1
            del head["help"]  # argparse then leaves it out of the list
        self.verbs[name] = self._add_parser(name, **{**head, **settings})
        return self.verbs[name]

    def add_verb_modules(self, package: str, names: Iterable[str]) -> Iterator[tuple[CommandParser, Any]]:
        """Add the verbs of a command: modules of ``package``, and those that add-ons bring as entry points.

        Args:
            package: The package with the core's verbs. The program's name and ``verb`` make the group of entry
                points, such as ``secure_nodl.verb``.
            names: The core's verbs.

        Yields:
            The parser of each verb and its module. A verb whose module is absent reports that when it is used.
        """
        modules = {name: f"{package}.{name.replace('-', '_')}" for name in names}
        brought = add_ons(f"{self.prog.replace('-', '_')}.verb")
        for name, path in (modules | {name: each.value for name, each in brought.items()}).items():
            try:
                module: Any = import_module(path)
            except ModuleNotFoundError as error:
                self._add_absent_verb(name, error)
                continue
            verb = self.add_verb(name, module.__doc__, **getattr(module, "SETTINGS", {}))
            verb.set_defaults(run=getattr(module, "run", None))
            yield verb, module

    def _add_absent_verb(self, name: str, error: ImportError) -> None:
        if missing_dependency(error) is None:
            raise error
        missing = error

        def run(_: argparse.Namespace) -> int:
            raise missing

        # No word begins with this prefix, so options of the verb are words like others.
        verb = self._add_parser(name, help="not part of this installation", add_help=False, prefix_chars="\0")
        verb.add_argument("words", nargs="*")
        verb.set_defaults(run=run)

    def fold(self, options: Iterable[Option], described_in: str) -> None:
        """Let the help only name those of ``options`` that were added; ``described_in`` describes them."""
        flags = {word for written, *_ in options for word in written.split() if word.startswith("-")}
        folded = [each for each in self.arguments if flags.intersection(each.option_strings)]
        for each in folded:
            each.help = argparse.SUPPRESS
        names = ", ".join(max(each.option_strings, key=len) for each in folded)
        if folded:
            self.add_argument_group(f"options described by {described_in}", filled(names, indent=2))

    def format_usage(self) -> str:
        """Return the usage on one line; options are in the help."""
        self.usage = self.usage or self._one_usage()
        return super().format_usage()

    def format_help(self) -> str:
        """Return the help, below the usage on one line."""
        self.usage = self.usage or self._one_usage()
        text = super().format_help()
        if not self._left_out:
            return text
        more = " and ".join(counted(number, f"more {what}") for what, number in self._left_out.items())
        return f"{text}\n{more}: {self.prog} --help-all\n"

    def _one_usage(self) -> str:
        """Return the command with the options that it cannot do without, and its arguments."""
        required = [
            f"{each.option_strings[0]} {_in_usage(each)}"
            for each in self.arguments
            if each.option_strings and each.required
        ]
        arguments = [
            _in_usage(each)
            for each in self.arguments
            if not each.option_strings and each.help != argparse.SUPPRESS
        ]
        verb = ["VERB ..."] if self.verbs else []
        return " ".join(("%(prog)s", *required, "[options]", *arguments, *verb))

    def error(self, message: str) -> NoReturn:
        """Print usage and message, and exit with status 2, as argparse."""
        self.usage = self.usage or self._one_usage()
        wrong, known = self._mistyped(message)
        meant = nearest(wrong, known) if wrong else None
        if choice := _INVALID_CHOICE.match(message):  # Python's own words differ from version to version
            message = f"{message.partition(': ')[0]}: {quoted(choice[1])} is not one of {', '.join(known)}"
        question = f"; did you mean {meant!r}?" if meant else ""
        corrected = shlex.join(_replaced(self.words, wrong, meant)) if meant else "--help"
        super().error(f"{message}{question}\ntry: {self.prog} {corrected}")

    def _mistyped(self, message: str) -> tuple[str, list[str]]:
        """Return the word that is not known, and those that are known in its place."""
        if message.startswith("unrecognized arguments: "):
            options = [word.partition("=")[0] for word in message.split()[2:] if word.startswith("-")]
            return options[0] if options else "", [
                flag for each in self._actions for flag in each.option_strings
            ]
        if choice := _INVALID_CHOICE.match(message):
            return choice[1], re.findall(r"[^\s',]+", choice[2])
        return "", []


class _HelpAll(argparse.Action):
    """Print the help of the whole command and exit. ``const`` builds the parser that shows everything."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> NoReturn:
        self.const().print_help()
        parser.exit()


def _replaced(words: Iterable[str], wrong: str, meant: str) -> list[str]:
    """Return ``words`` with the mistyped one corrected, also in ``--option=value``."""
    return [
        meant
        if word == wrong
        else f"{meant}={word.partition('=')[2]}"
        if word.startswith(f"{wrong}=")
        else word
        for word in words
    ]


def _in_usage(action: argparse.Action) -> str:
    metavar = action.metavar or action.dest.upper()
    if not isinstance(metavar, str):
        return f"{metavar[0]} [{metavar[1]} ...]"
    if action.choices is not None and action.metavar is None:
        metavar = "{" + ",".join(map(str, action.choices)) + "}"
    if " " in metavar:  # it says by itself what may be repeated
        return metavar
    forms = {"?": f"[{metavar}]", "*": f"[{metavar} ...]", "+": f"{metavar} ..."}
    return forms.get(str(action.nargs), metavar)


def parsers(parser: CommandParser) -> Iterator[CommandParser]:
    """Yield ``parser`` and those of its verbs, of any depth."""
    yield parser
    for verb in parser.verbs.values():
        yield from parsers(verb)


def add_version(parser: argparse.ArgumentParser) -> None:
    """Add ``--version``, the same for all commands."""
    parser.add_argument("--version", action="version", version=f"{parser.prog} {VERSION}")


def complete(parser: argparse.ArgumentParser) -> None:
    """Answer a shell that asks for completions through argcomplete, if it is installed; then end."""
    if "_ARGCOMPLETE" not in os.environ:
        return
    try:
        import argcomplete
    except ImportError:
        raise SystemExit(1) from None
    argcomplete.autocomplete(parser, always_complete_options="long", print_suppressed=True)


VERBOSITY: tuple[Option, ...] = (
    ("-q --quiet", FLAG, "only errors and the answer; no warnings"),
    ("-v --verbose", FLAG, "list everything instead of counts"),
)


_MACHINE_FORMATS = frozenset({"json", "sarif", "policy", "html", "markdown", "dot", "mermaid", "v2"})
COLOUR: Option = (
    "--color",
    one_of("auto", "always", "never"),
    "colours: on a terminal (auto; NO_COLOR is respected)",
)


def add_verbosity(parser: CommandParser) -> None:
    """Add ``-q`` and ``-v`` to a command, or to each of its verbs."""
    for each in parsers(parser):
        if not each.verb_dest:
            each.add_one_of(VERBOSITY)
            each.add_options((COLOUR,))


def guarded(program: str, work: Callable[[], int], *mistakes: type[Exception]) -> int:
    """Return the exit status of ``work``, or of the error that ended it: one line on stderr, no traceback.

    An error of ``mistakes`` may have its own ``exit_status``, else 1. 130: interrupted (Ctrl-C). 0: who read our output
    has enough. An error of this program is raised.
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
    except Exception as error:
        # By name: this module must not load cryptography.
        if (type(error).__module__, type(error).__name__) != ("cryptography.exceptions", "InternalError"):
            raise
        # As the releases of cryptography write it, the newest first.
        causes = re.findall(r"error:[0-9A-F]{8}:[^:]*:[^:]*:([^:]*):", str(error))
        causes = causes or re.findall(r"reason_text=b?'?([^)>']*)", str(error)) or [str(error)[-200:]]
        where = os.environ.get("OPENSSL_CONF") or "the machine's openssl.cnf"
        text = f"OpenSSL cannot work as {quoted(where)} configures it: {', '.join(dict.fromkeys(causes))}"
        print(
            f"{program}: error: {text}; activate the providers that it names, or the default one",
            file=sys.stderr,
        )
        return 1


def _drop_output() -> None:
    """Discard what is still buffered; otherwise the interpreter reports the error again at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


@dataclass(frozen=True)
class CommandLine:
    """A parsed command line.

    Attributes:
        options: Every option with its value.
        given: The names of the options that were written.
        actions: The options of the command or verb.
        words: The command line behind the name of the command.
    """

    options: argparse.Namespace
    given: frozenset[str]
    actions: tuple[argparse.Action, ...] = ()
    words: tuple[str, ...] = ()


def read_command_line(parser: CommandParser, argv: Sequence[str] | None) -> CommandLine:
    """Parse a command line. Options and words may stand in any order behind the verb.

    Args:
        parser: The parser of the command. It is used up: its defaults are changed.
        argv: The words, by default those of this process.

    Returns:
        Every option, and the names of those that were written.
    """
    words = list(sys.argv[1:] if argv is None else argv)
    everything = tuple(words)
    chosen = {}
    parser.words = words
    while parser.verb_dest:
        if not words or words[0] not in parser.verbs:
            return CommandLine(parser.parse_args(words), frozenset())  # or ends: help, a version, an error
        chosen[parser.verb_dest] = words[0]
        parser, words = parser.verbs[words[0]], words[1:]
        parser.words = words
    defaults = {action.dest: _default(action) for action in parser.arguments}
    for action in parser.arguments:
        if action.nargs != "?":  # argparse would convert the mark as a value
            action.default = argparse.SUPPRESS
    given = vars(parser.parse_intermixed_args(words))
    known = {name: value for name, value in defaults.items() if value is not argparse.SUPPRESS}
    written = frozenset(name for name, value in given.items() if name in defaults and value is not None)
    plain = given.get("format", known.get("format")) in _MACHINE_FORMATS
    choose_colour("never" if plain else given.get("color", "auto"))
    return CommandLine(
        argparse.Namespace(**{**chosen, **known, **given}), written, tuple(parser.arguments), everything
    )


def _default(action: argparse.Action) -> Any:
    return [] if action.nargs == "*" and action.default is None else action.default
