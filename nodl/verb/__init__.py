"""``secure-nodl VERB``: one module per verb with ``HELP``, ``add_arguments(parser)`` and ``run(arguments)``.

Exit status: 0 fine, 1 a document is wrong or nothing was found, 2 wrong usage.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from importlib import import_module

VERBS = ("convert", "show", "validate")


def main(argv: Sequence[str] | None = None) -> int:
    """The command line; returns the exit status."""
    from nodl.errors import NoDLError

    arguments = build_parser().parse_args(argv)
    try:
        status: int = arguments.run(arguments)
        return status
    except NoDLError as error:
        print(f"secure-nodl {arguments.verb}: {error}", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"secure-nodl {arguments.verb}: {error.filename}: {error.strerror}", file=sys.stderr)
        return 1


def build_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="secure-nodl",
        description="NoDL manifests: what a ROS 2 node publishes, subscribes, serves and calls.",
        epilog="exit status: 0 fine, 1 a document is wrong or nothing was found, 2 wrong usage",
    )
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="|".join(VERBS))
    for name in VERBS:
        module = import_module(f"nodl.verb.{name}")
        verb = verbs.add_parser(name, help=module.HELP, description=module.__doc__)
        module.add_arguments(verb)
        verb.set_defaults(run=module.run)
    return parser


def add_prefix_argument(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--prefix",
        metavar="DIR",
        action="append",
        default=[],
        type=os.path.abspath,
        help="ament install prefix, searched before AMENT_PREFIX_PATH (repeatable)",
    )
