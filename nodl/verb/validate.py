"""Check NoDL documents, v1 and v2: one line per document, file:line for what is wrong."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from enclave_common.command_line import Option
from enclave_common.terminal import printable
from nodl.ament_index import search_prefixes
from nodl.document import V1_SUFFIX, read_document
from nodl.errors import NoDLError
from nodl.verb import PREFIX

OPTIONS: tuple[Option, ...] = (
    ("files FILE", {"nargs": "*"}, "documents (default: all *.nodl.* files of this folder)"),
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
            nodes = read_document(file, prefixes=prefixes)
        except NoDLError as error:
            wrong += 1
            print(error, file=sys.stderr)
        else:
            names = ", ".join(node.interface.name or "(name not given)" for node in nodes)
            print(printable(f"{file}: valid NoDL v{nodes[0].version}: {names}"))
    return 1 if wrong else 0
