"""``secure-nodl VERB``: one module per verb, with ``add_parser(subparsers)`` and ``run(arguments)``.

Exit status: 0 fine, 1 a document is wrong or nothing was found, 2 wrong usage.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from importlib import import_module

from enclave_launch.boundary.dependencies import missing_dependency
from enclave_launch.boundary.terminal import safe_output

VERBS = ("check_record", "convert", "infer", "library", "observe", "show", "validate")


def main(argv: Sequence[str] | None = None) -> int:
    """The command line; returns the exit status."""
    with safe_output():
        return _main(argv)


def _main(argv: Sequence[str] | None) -> int:
    from nodl.errors import NoDLError

    arguments = build_parser().parse_args(argv)
    try:
        status: int = arguments.run(arguments)
        return status
    except NoDLError as error:
        message = str(error)
    except ImportError as error:
        text = missing_dependency(error)
        if text is None:
            raise
        message = text
    except OSError as error:
        message = f"{error.filename}: {error.strerror}"
    print(f"secure-nodl {arguments.verb}: {message}", file=sys.stderr)
    return 1


def build_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="secure-nodl",
        description="NoDL manifests: what a ROS 2 node publishes, subscribes, serves and calls.",
        epilog="exit status: 0 fine, 1 a document is wrong or nothing was found, 2 wrong usage",
    )
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    for name in VERBS:
        import_module(f"nodl.verb.{name}").add_parser(verbs)
    return parser
