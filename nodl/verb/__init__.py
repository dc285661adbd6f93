"""``secure-nodl VERB``: one module per verb, with ``add_parser(subparsers)`` and ``run(arguments)``.

Exit status: 0 fine, 1 a document is wrong or nothing was found, 2 wrong usage.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib import import_module
from pathlib import Path

from enclave_common.command_line import (
    TEXTS,
    CommandParser,
    Option,
    add_absent_verb,
    add_options,
    add_verbosity,
    add_version,
    complete,
    guarded,
    verb_head,
)
from enclave_common.new_file import write_text
from enclave_common.terminal import printable, safe_output
from nodl.errors import NoDLError

VERBS = ("check_record", "convert", "infer", "library", "observe", "show", "validate")
PREFIX: Option = (
    "--prefix DIR", {**TEXTS, "type": os.path.abspath},
    "ament install prefix, searched before AMENT_PREFIX_PATH (repeatable)",
)  # fmt: skip


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; return the exit status."""
    with safe_output():
        parser = build_parser()
        complete(parser)
        arguments = parser.parse_args(argv)
        return guarded(f"secure-nodl {arguments.verb}", lambda: _run(arguments), NoDLError)


def _run(arguments: argparse.Namespace) -> int:
    try:
        return int(arguments.run(arguments))
    except BrokenPipeError:
        raise
    except OSError as error:
        raise NoDLError(f"{error.filename}: {error.strerror}") from error


def build_parser() -> argparse.ArgumentParser:
    """Build one subparser for each verb."""
    parser = CommandParser(
        prog="secure-nodl",
        description="NoDL manifests: what a ROS 2 node publishes, subscribes, serves and calls.",
        epilog="exit status: 0 fine, 1 a document is wrong or nothing was found, 2 wrong usage",
    )
    add_version(parser)
    verbs = parser.add_subparsers(dest="verb", title="verbs", required=True, metavar="VERB")
    for name in VERBS:
        try:
            verb = import_module(f"nodl.verb.{name}")
        except ModuleNotFoundError as error:
            add_absent_verb(verbs, name.replace("_", "-"), error)
            continue
        verb.add_parser(verbs)
    add_verbosity(parser)
    return parser


def add_verb(
    verbs: argparse._SubParsersAction[argparse.ArgumentParser],
    name: str,
    run: Callable[[argparse.Namespace], int],
    options: Iterable[Option],
    docstring: str | None,
) -> argparse.ArgumentParser:
    """Add the parser of a verb, or of an action of a verb; ``docstring`` becomes its help."""
    parser = verbs.add_parser(name, **verb_head(docstring)._asdict())
    add_options(parser, options)
    parser.set_defaults(run=run)
    return parser


def encodable(text: str) -> str:
    """Names of files need not be UTF-8; their odd bytes are shown as escapes."""
    return text.encode("utf-8", "backslashreplace").decode()


def write_documents(folder: Path, documents: Mapping[str, str]) -> None:
    """Write each text into a file of that name, and say which."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in documents.items():
        write_text(folder / name, text)
        print(printable(str(folder / name)))
