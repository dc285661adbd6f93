"""NoDL documents, v1 (XML) and v2 (YAML, JSON): files in, ``ManifestNode`` values with places out."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from enclave_common.files import read_bytes
from enclave_common.source_location import SourceLocation
from nodl.document.v1 import parse_v1
from nodl.document.v2 import parse_v2
from nodl.document.v2_include import RESOURCE_TYPE, resource_key
from nodl.document.v2_schema import check_document
from nodl.errors import InvalidNoDLError
from nodl.node_interface import ManifestNode
from nodl.yaml_text import YamlMap, parse_yaml

__all__ = [
    "RESOURCE_TYPE",
    "V1_SUFFIX",
    "V2_SUFFIXES",
    "ManifestNode",
    "parse_document",
    "read_document",
    "read_root",
    "resource_key",
]

V1_SUFFIX = ".nodl.xml"
V2_SUFFIXES = (".nodl.yaml", ".nodl.yml", ".nodl.json", ".yaml", ".yml", ".json")
_MAX_BYTES = 4_000_000


def read_document(
    path: str | Path, *, package: str | None = None, name: str | None = None, prefixes: Sequence[str] = ()
) -> tuple[ManifestNode, ...]:
    """Read all nodes of one file, whichever version it is in; ``name``: registered, by default from the file name.

    Raises ``InvalidNoDLError``, also for a file that cannot be read."""
    file = str(path)
    return parse_document(_read(file), file, package=package, name=name, prefixes=prefixes)


def parse_document(
    text: bytes,
    file: str,
    *,
    package: str | None = None,
    name: str | None = None,
    prefixes: Sequence[str] = (),
) -> tuple[ManifestNode, ...]:
    """Return the nodes of the text of ``file``. Arguments and errors are those of ``read_document``."""
    if text.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] == b"<":
        return parse_v1(text, file, package)

    return (parse_v2(text, file, package=package, name=name or _stem(file), prefixes=prefixes),)


def read_root(path: str | Path) -> YamlMap:
    """Read a v2 document as it is written, checked. Raises ``InvalidNoDLError`` as ``read_document``."""
    return check_document(parse_yaml(_read(str(path)), str(path)))


def _read(file: str) -> bytes:
    try:
        return read_bytes(file, _MAX_BYTES)
    except OSError as error:
        raise InvalidNoDLError.at(SourceLocation(file), f"cannot be read: {error.strerror}") from None


def _stem(file: str) -> str:
    base = os.path.basename(file)
    suffix = next((s for s in V2_SUFFIXES if base.endswith(s)), "")
    return base[: len(base) - len(suffix)].rpartition("__")[2]
