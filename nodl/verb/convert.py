"""Convert NoDL documents between v1 (one XML file, many nodes) and v2 (one YAML file for each node)."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from enclave_common.command_line import PATH, Option
from enclave_common.files import write_text
from nodl.ament_index import search_prefixes
from nodl.document import read_document
from nodl.document.write import Written, v1_xml, v2_yaml
from nodl.errors import NoDLError
from nodl.node_interface import ManifestNode
from nodl.verb import PREFIX

OPTIONS: tuple[Option, ...] = (
    ("files FILE", {"nargs": "+"}, "documents of one version"),
    ("-o --output PATH", PATH,
     "file to write (default: standard output); a folder when v1 becomes several v2 files"),
    PREFIX,
)  # fmt: skip


def run(arguments: argparse.Namespace) -> int:
    """Print or write the documents in the other version. Returns 0."""
    prefixes = search_prefixes(arguments.prefix)
    nodes = [node for file in arguments.files for node in read_document(file, prefixes=prefixes)]
    versions = {node.version for node in nodes}
    if len(versions) > 1:
        raise NoDLError("the documents are of different versions; convert them one version at a time")
    if versions == {2}:
        _emit(v1_xml(nodes), arguments.output)
    elif len(nodes) == 1 and not (arguments.output and arguments.output.is_dir()):
        _emit(v2_yaml(nodes[0]), arguments.output)
    else:
        _emit_folder(nodes, arguments.output)
    return 0


def _emit_folder(nodes: Sequence[ManifestNode], folder: Path | None) -> None:
    # All texts before the first file is written, so that an error leaves nothing behind.
    if folder is None:
        raise NoDLError(f"{len(nodes)} nodes become {len(nodes)} v2 documents: name a folder with -o")
    written = {folder / f"{_file_name(node)}.nodl.yaml": v2_yaml(node) for node in nodes}
    if len(written) < len(nodes):
        raise NoDLError("two nodes of one executable would be written to one file; convert them apart")
    folder.mkdir(parents=True, exist_ok=True)
    for path, document in written.items():
        _emit(document, path)


def _file_name(node: ManifestNode) -> str:
    name = node.interface.executable or node.interface.plugin or node.interface.name or "node"
    return name.replace("::", ".").replace(os.sep, "_")


def _emit(document: Written, path: Path | None) -> None:
    if path is None:
        sys.stdout.write(document.text)
    else:
        write_text(path, document.text)
        print(path)
    for note in document.notes:
        print(f"note: {note}", file=sys.stderr)
