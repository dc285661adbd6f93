"""``secure-keystore``: one file per verb, with ``OPTIONS``, ``run`` (one call, one report), and ``SETTINGS`` of its
parser where it has any.

Exit status: 0 done or all well; 1 an error, or findings of ``verify``; 2 wrong usage or input; 3
something ends soon and 4 something has ended (``status``); 75 the keystore is in use; 130 interrupted.
"""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from enclave_common.command_line import (
    CommandLine,
    CommandParser,
    add_verbosity,
    add_version,
    complete,
    guarded,
    read_command_line,
)
from enclave_common.project import Project, ProjectError, described, find_project, with_project
from enclave_common.terminal import print_notes, safe_output
from keystore.errors import InvalidInputError, KeystoreError
from keystore.verb.common import FOLDED, add_table

VERBS = (
    "create", "create-enclave", "apply-policy", "list", "status", "verify", "renew", "remove", "governance", "shares",
    "tool-enclave",
)  # fmt: skip


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; errors become one line on stderr and an exit status, and nothing is printed twice."""
    with safe_output():
        parser = build_parser(first=True)
        complete(parser)
        line = read_command_line(parser, argv)
        return guarded("secure-keystore", lambda: _run(line), KeystoreError, ProjectError)


def _run(line: CommandLine) -> int:
    project = find_project(Path())
    arguments = _with_keystore(line, project) if "keystore" in vars(line.options) else line.options
    if getattr(arguments, "verbose", False):
        print_notes(described(arguments))
    return int(arguments.run(arguments))


def _with_keystore(line: CommandLine, project: Project | None) -> argparse.Namespace:
    """Return the options with the keystore that was named, or that the project names; raises InvalidInputError."""
    arguments = with_project(line, project)
    if _is_enclave(arguments.keystore) and "enclaves" in vars(arguments):
        elsewhere = with_project(replace(line, given=line.given - {"keystore"}), project)
        if elsewhere.keystore != arguments.keystore:
            elsewhere.enclaves = [str(arguments.keystore), *arguments.enclaves]
            return elsewhere
    if arguments.keystore is None and not _is_optional(line):
        words = [word for each in line.actions if not each.option_strings for word in _words(arguments, each)]
        if words and Path(words[0]).is_dir():
            needed = next(
                each.metavar or each.dest.upper() for each in line.actions[1:] if not each.option_strings
            )
            raise InvalidInputError(
                f"{needed} is missing behind the keystore {words[0]}\ntry: secure-keystore {line.options.verb} --help"
            )
        only = f"; {' '.join(words)} is what it should work on" if words else ""
        raise InvalidInputError(
            f"no keystore is named, neither here nor in ROS_SECURITY_KEYSTORE or enclaves.yaml{only}\n"
            f"try: {shlex.join(['secure-keystore', line.options.verb, 'KEYSTORE', *words])}"
        )
    return arguments


def _is_enclave(word: Path | None) -> bool:
    """Return whether the first word is an enclave rather than the folder of a keystore."""
    return word is not None and word.is_absolute() and not word.exists()


def _words(arguments: argparse.Namespace, action: argparse.Action) -> list[str]:
    value = getattr(arguments, action.dest) or []
    return [str(value)] if isinstance(value, (str, Path)) else [str(each) for each in value]


def _is_optional(line: CommandLine) -> bool:
    """Return whether the verb has an option ``--keystore``, which may be absent."""
    return any(action.dest == "keystore" and action.option_strings for action in line.actions)


DAILY = ("verify", "status", "renew")
"""Verbs that ``--help`` shows; ``--help-all`` shows the others."""
EPILOG = """\
examples:
  secure-keystore verify ks              is everything in it as it should be, and how to repair what is not
  secure-keystore status ks              what expires when
  secure-keystore renew ks               renew what expires soon
  secure-launch --secure --keystore ks PACKAGE LAUNCH_FILE     makes the keystore and its enclaves
"""


def build_parser(*, first: bool = False) -> CommandParser:
    """Build one subparser for each verb, described by the head of its file. ``first``: its help is for daily use."""
    parser = CommandParser(
        prog="secure-keystore",
        description="Create, check, renew and deploy SROS2 keystores. What was interrupted is completed by the same "
        "command.",
        epilog=EPILOG,
    )
    if first:
        parser.show_first(DAILY, build_parser)
    add_version(parser)
    parser.add_verbs()
    for verb, module in parser.add_verb_modules("keystore.verb", VERBS):
        add_table(verb, module.OPTIONS)
        if module.__name__ != "keystore.verb.create":
            verb.fold(FOLDED, "secure-keystore create --help")
    add_verbosity(parser)
    return parser
