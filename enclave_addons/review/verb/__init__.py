"""``secure-plan VERB``: what works on plans without running anything. A verb is a file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from enclave_addons.review.verb.plans import WORDS
from enclave_common.command_line import (
    CommandLine,
    CommandParser,
    Option,
    add_verbosity,
    add_version,
    complete,
    guarded,
    read_command_line,
)
from enclave_common.project import ProjectError, described, find_project, with_project
from enclave_common.terminal import print_notes, safe_output
from enclave_launch.errors import EnclaveLaunchError
from enclave_launch.verb.options import EVALUATION, POLICY
from enclave_launch.verb.target import launch_folder
from nodl.ament_index import search_prefixes

PLAN: tuple[Option, ...] = (("words", WORDS, "a plan or what to plan"),)
RESOLVING = (*POLICY, *EVALUATION)
"""As of ``secure-launch``; a saved plan takes none."""
VERBS = ("init", "doctor", "show", "check", "diff", "flow", "suggest", "report", "evidence")
DESCRIPTION = """\
Look at what a launch file would start and allow, without starting anything: show it, check it, compare two
revisions, ask which enclave can influence which, place it on hosts, export it to systemd, Compose or Kubernetes.
A plan is a launch file, given as to secure-launch, or the JSON that secure-launch --dry-run --format json printed
(a file that ends in .json).
"""
EPILOG = """\
examples:
  secure-plan init                                            an enclaves.yaml for this workspace
  secure-plan doctor demo_nodes talker_listener.launch.xml    what is missing before a secured start
  secure-plan check demo_nodes talker_listener.launch.xml     what is wrong or worth a look
  secure-plan diff main: demo_nodes talker_listener.launch.xml
  secure-plan report demo_nodes talker_listener.launch.xml -o report.html
"""


DAILY = ("doctor", "check", "diff", "report")
"""Verbs that ``--help`` shows; ``--help-all`` shows the others."""


def build_parser(*, first: bool = False) -> CommandParser:
    """Build the parser: a subparser for each verb, described by the head of its file.

    With ``first`` the help is for daily use.
    """
    parser = CommandParser(prog="secure-plan", description=DESCRIPTION, epilog=EPILOG)
    if first:
        parser.show_first(DAILY, build_parser)
    add_version(parser)
    parser.add_verbs()
    for verb, module in parser.add_verb_modules("enclave_addons.review.verb", VERBS):
        verb.add_options(getattr(module, "WORDS", PLAN))
        for title, options in module.OPTIONS.items():
            verb.add_options(options, title)
        if getattr(module, "PLANS", True):
            own = {option for table in module.OPTIONS.values() for option, *_ in table}
            verb.add_options(row for row in RESOLVING if row[0].split()[0] not in own)
            verb.fold(RESOLVING, "secure-launch --help-all")
            # A launch prefix is only of use where something is started.
            verb.set_defaults(launch_prefix=None, launch_prefix_filter=None)
    add_verbosity(parser)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line ``argv``. Gives the exit status, never a traceback for what a user can cause."""
    with safe_output():
        parser = build_parser(first=True)
        complete(parser)
        line = read_command_line(parser, argv)
        return guarded("secure-plan", lambda: _run(line), EnclaveLaunchError, ProjectError)


def _run(line: CommandLine) -> int:
    words = getattr(line.options, "words", [])
    prefixes = search_prefixes(getattr(line.options, "prefix", []))
    options = with_project(line, find_project(launch_folder(words, prefixes), Path()))
    if getattr(options, "verbose", False):
        print_notes(described(options))
    return int(options.run(options))
