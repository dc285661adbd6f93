"""NoDL documents, v1 (XML) and v2 (YAML, JSON): files in, ``ManifestNode`` values with places out."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from types import MappingProxyType

from enclave_launch.boundary.files import read_bytes
from enclave_launch.boundary.light import TYPE_CHECKING, NamedTuple
from nodl.errors import InvalidNoDLError
from nodl.node_interface import NodeInterface
from nodl.source_ref import SourceRef

if TYPE_CHECKING:
    from pathlib import Path

    from nodl.yaml_text import YamlMap

__all__ = [
    "RESOURCE_TYPE",
    "V1_SUFFIX",
    "V2_SUFFIXES",
    "ManifestNode",
    "read_document",
    "read_root",
    "resource_key",
]

V1_SUFFIX = ".nodl.xml"
V2_SUFFIXES = (".nodl.yaml", ".nodl.yml", ".nodl.json", ".yaml", ".yml", ".json")
RESOURCE_TYPE = "nodl"  # of v2 documents in the ament index
_MAX_BYTES = 4_000_000


class ManifestNode(NamedTuple):
    """One node as one document describes it, in ``version`` 1 or 2 of NoDL. ``parameter_types``: declared parameters
    with the type as written.

    ``explicit_executable``: the document itself says which executable or plugin runs the node (always in
    v1; in v2 only through our extension), rather than the name under which it was registered.
    ``included``: files that were merged in, to know what the description depends on.
    """

    interface: NodeInterface
    version: int
    parameter_types: Mapping[str, str] = MappingProxyType({})
    explicit_executable: bool = True
    included: tuple[str, ...] = ()


def read_document(
    path: str | Path, *, package: str | None = None, name: str | None = None, prefixes: Sequence[str] = ()
) -> tuple[ManifestNode, ...]:
    """All nodes of one file, whichever version it is in; what begins with ``<`` is XML.

    ``name`` is the registered name of a v2 document (default: from the file name). Raises
    ``InvalidNoDLError`` with file:line, also for a file that cannot be read.
    """
    file = str(path)
    text = _read(file)
    if text.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] == b"<":
        from nodl.document.v1 import parse_v1

        return parse_v1(text, file, package)
    from nodl.document.v2 import parse_v2

    return (parse_v2(text, file, package=package, name=name or _stem(file), prefixes=prefixes),)


def read_root(path: str | Path) -> YamlMap:
    """A v2 document as it is written, checked. Raises ``InvalidNoDLError`` as ``read_document``."""
    from nodl.document.v2_schema import check_document
    from nodl.yaml_text import parse_yaml

    return check_document(parse_yaml(_read(str(path)), str(path)))


def resource_key(package: str, name: str) -> str:
    """Name in the ament index of the v2 document ``nodl://package/name``."""
    return f"{package}__{name}"


def _read(file: str) -> bytes:
    try:
        return read_bytes(file, _MAX_BYTES)
    except OSError as error:
        raise InvalidNoDLError.at(SourceRef(file), f"cannot be read: {error.strerror}") from None


def _stem(file: str) -> str:
    base = os.path.basename(file)
    suffix = next((s for s in V2_SUFFIXES if base.endswith(s)), "")
    return base[: len(base) - len(suffix)].rpartition("__")[2]
