"""Check NoDL documents, v1 and v2: one line per document, file:line for what is wrong.

A document of v2 is valid if it fits the schema of NoDL 2 and its includes resolve. Where ROS would still refuse a name
in it, a warning says so.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from enclave_common.command_line import FLAG, Option
from enclave_common.terminal import printable, warn
from nodl.ament_index import search_prefixes
from nodl.document import V1_SUFFIX, read_document, read_root
from nodl.errors import InvalidElementError, NoDLError
from nodl.verb import PREFIX

OPTIONS: tuple[Option, ...] = (
    ("files FILE", {"nargs": "*"}, "documents (default: all *.nodl.* files of this folder)"),
    ("--no-resolve", FLAG, "check documents of v2 by their schema alone; do not read what they include"),
    PREFIX,
)


def run(arguments: argparse.Namespace) -> int:
    """Print what each document describes, or its first fault; return 0 if all are valid, 1 not, 2 without any."""
    files = arguments.files or [str(path) for path in sorted(Path().glob("*.nodl.*"))]
    if not files:
        print(f"no documents here; name some, such as package{V1_SUFFIX}", file=sys.stderr)
        return 2
    prefixes = search_prefixes(arguments.prefix)
    wrong = 0
    for file in files:
        try:
            print(printable(f"{file}: {_verdict(file, prefixes, resolve=not arguments.no_resolve)}"))
        except NoDLError as error:
            wrong += 1
            print(error, file=sys.stderr)
    return 1 if wrong else 0


def _verdict(file: str, prefixes: Sequence[str], *, resolve: bool) -> str:
    """Return what a valid document describes; raises ``NoDLError`` for an invalid one."""
    if not resolve and not file.endswith(V1_SUFFIX):
        read_root(file)
        return "fits the schema of NoDL v2"
    try:
        nodes = read_document(file, prefixes=prefixes)
    except InvalidElementError as error:
        if file.endswith(V1_SUFFIX):
            raise
        read_root(file)
        warn(f"{error}; ROS refuses it, so no launch can use this document")
        return "fits the schema of NoDL v2"
    names = ", ".join(node.interface.name or "(name not given)" for node in nodes)
    return f"valid NoDL v{nodes[0].version}: {names}"
