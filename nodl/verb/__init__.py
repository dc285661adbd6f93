"""``secure-nodl VERB``: one module per verb, with ``OPTIONS``, ``SECTIONS`` (more of
them, by their title in the help) and ``run(arguments)``, or ``VERBS`` of its own.

Exit status: 0 fine, 1 a document is wrong or nothing was found, 2 wrong usage.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from enclave_common.command_line import (
    TEXTS,
    CommandLine,
    CommandParser,
    Option,
    add_verbosity,
    add_version,
    complete,
    guarded,
    read_command_line,
)
from enclave_common.files import write_text
from enclave_common.project import ProjectError, described, find_project, with_project
from enclave_common.terminal import print_notes, printable, safe_output
from nodl.errors import NoDLError

VERBS = ("convert", "show", "validate")
PREFIX: Option = (
    "--prefix DIR", {**TEXTS, "type": os.path.abspath},
    "ament install prefix, searched before AMENT_PREFIX_PATH (repeatable)",
)  # fmt: skip


class Verb(NamedTuple):
    """A verb of a verb."""

    run: Callable[[argparse.Namespace], int]
    options: tuple[Option, ...]
    help: str


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; return the exit status."""
    with safe_output():
        parser = build_parser(first=True)
        complete(parser)
        line = read_command_line(parser, argv)
        return guarded(f"secure-nodl {line.options.verb}", lambda: _run(line), NoDLError, ProjectError)


def _run(line: CommandLine) -> int:
    arguments = with_project(line, find_project(Path()))
    if getattr(arguments, "verbose", False):
        print_notes(described(arguments))
    try:
        return int(arguments.run(arguments))
    except BrokenPipeError:
        raise
    except OSError as error:
        raise NoDLError(f"{error.filename}: {error.strerror}") from error


DAILY = ("infer",)
"""Verbs that ``--help`` shows; ``--help-all`` shows the others."""
EPILOG = """\
examples:
  secure-nodl infer my_package               what its nodes publish, subscribe, serve and call
  secure-nodl infer src/my_package -o nodl   the same as manifests, to complete by hand

exit status: 0 fine, 1 a document is wrong or nothing was found, 2 wrong usage
"""


def build_parser(*, first: bool = False) -> CommandParser:
    """Build one subparser for each verb. ``first``: its help is for daily use."""
    parser = CommandParser(
        prog="secure-nodl",
        description="NoDL manifests: what a ROS 2 node publishes, subscribes, serves and calls.",
        epilog=EPILOG,
    )
    if first:
        parser.show_first(DAILY, build_parser)
    add_version(parser)
    parser.add_verbs(dest="verb")
    for verb, module in parser.add_verb_modules("nodl.verb", VERBS):
        verb.add_options(module.OPTIONS)
        for title, options in getattr(module, "SECTIONS", {}).items():
            verb.add_options(options, title)
        _add_verbs(verb, getattr(module, "VERBS", {}))
    add_verbosity(parser)
    return parser


def _add_verbs(parser: CommandParser, verbs: Mapping[str, Verb]) -> None:
    if verbs:
        parser.add_verbs(dest="action")
    for name, each in verbs.items():
        verb = parser.add_verb(name, each.help)
        verb.add_options(each.options)
        verb.set_defaults(run=each.run)


def encodable(text: str) -> str:
    """Return ``text`` with bytes that are not UTF-8, which file names may hold, as escapes."""
    return text.encode("utf-8", "backslashreplace").decode()


def write_documents(folder: Path, documents: Mapping[str, str]) -> None:
    """Write each text into a file of that name, and say which."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in documents.items():
        write_text(folder / name, text)
        print(printable(str(folder / name)))
