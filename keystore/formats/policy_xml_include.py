"""XInclude for policy files, only as far as it is safe: reading elements of XML files in the policy's folder.

SROS2 lets libxml2 include anything (``parse="text"`` of a private file ends up, signed and broadcast, in
a topic name). Here an include names an XML file at or below the folder of the first policy file, links
resolved, and takes elements from it by a plain path. The tree is walked, not changed: every element
comes with the file it was written in. Reads files.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from enclave_launch.boundary.files import read_bytes
from keystore.errors import printable
from keystore.formats.policy import PolicyError
from keystore.formats.safe_xml import parse_xml

if TYPE_CHECKING:
    from lxml import etree

MAX_DEPTH = 16
MAX_FILES = 256
MAX_INCLUDES = 2_000  # followed in all: files that include each other twice multiply
MAX_TOTAL_BYTES = 4_000_000
_NAMESPACES = ("http://www.w3.org/2001/XInclude", "http://www.w3.org/2003/XInclude")
_INCLUDE_TAGS = frozenset(f"{{{namespace}}}include" for namespace in _NAMESPACES)
_XPOINTER = re.compile(r"xpointer\((/[A-Za-z_]+(?:/[A-Za-z_]+)*(?:/\*)?)\)\Z")
_XML_BASE = "{http://www.w3.org/XML/1998/namespace}base"


@dataclass(frozen=True, slots=True)
class Place:
    """The file an element is written in, and the files whose includes led there, outermost first."""

    file: str
    chain: tuple[str, ...] = ()

    def at(self, element: etree._Element) -> str:
        included = "".join(f", included from {file}" for file in reversed(self.chain))
        return f"{self.file}:{element.sourceline}{included}"


class IncludingReader:
    """Children of elements with their includes followed. ``folder`` is the only place to read from."""

    def __init__(self, folder: Path | None):
        self._folder = None if folder is None else folder.resolve()
        self._roots: dict[Path, etree._Element] = {}
        self._bytes = 0
        self._followed = 0

    def children(self, element: etree._Element, place: Place) -> Iterator[tuple[etree._Element, Place]]:
        """Each child element and where it is written. Raises ``PolicyError`` for an unsafe include."""
        for child in element:
            if child.tag in _INCLUDE_TAGS:
                yield from self._included(child, place)
            else:
                child.attrib.pop(_XML_BASE, "")
                yield child, place

    def _included(self, include: etree._Element, place: Place) -> Iterator[tuple[etree._Element, Place]]:
        where = place.at(include)
        path = self._path(include, place, where)
        self._followed += 1
        if self._followed > MAX_INCLUDES:
            raise PolicyError(f"{where}: more than {MAX_INCLUDES} includes")
        chain = (*place.chain, f"{place.file}:{include.sourceline}")
        inner = Place(str(path), chain)
        if len(chain) > MAX_DEPTH or str(path) in (place.file, *(c.rpartition(":")[0] for c in chain)):
            raise PolicyError(f"{where}: the include of {printable(path)} goes round in a circle or too deep")
        root = self._root(path, where)
        for found in _pointed(root, include, where):
            if found.tag in _INCLUDE_TAGS:
                yield from self._included(found, inner)
            else:
                found.attrib.pop(_XML_BASE, "")
                yield found, inner

    def _path(self, include: etree._Element, place: Place, where: str) -> Path:
        href = include.get("href", "")
        if include.get("parse", "xml") != "xml":
            raise PolicyError(f'{where}: an include may only read XML (parse="xml")')
        if len(include):
            raise PolicyError(f"{where}: an include with a fallback is not supported; every file must exist")
        if self._folder is None:
            raise PolicyError(f"{where}: includes are only followed in a policy file, not here")
        if not href or ":" in href or "\\" in href or not href.isprintable() or href.startswith("/"):
            raise PolicyError(f"{where}: {printable(href)} is not a relative path of a file")
        path = (Path(place.file).parent / href).resolve()
        if not path.is_relative_to(self._folder):
            raise PolicyError(
                f"{where}: {printable(href)} is outside the policy's folder {printable(self._folder)}; "
                "copy the file there"
            )
        return path

    def _root(self, path: Path, where: str) -> etree._Element:
        if path not in self._roots:
            try:
                document = read_bytes(path, MAX_TOTAL_BYTES)
            except OSError as error:
                raise PolicyError(f"{where}: cannot include {printable(path)}: {error.strerror}") from None
            self._bytes += len(document)
            if len(self._roots) >= MAX_FILES or self._bytes > MAX_TOTAL_BYTES:
                raise PolicyError(f"{where}: more than {MAX_FILES} files or {MAX_TOTAL_BYTES} bytes included")
            self._roots[path] = parse_xml(document, str(path))
        return self._roots[path]


def _pointed(root: etree._Element, include: etree._Element, where: str) -> list[etree._Element]:
    """The elements that ``xpointer`` selects: the root without one, else an absolute path of names."""
    pointer = include.get("xpointer")
    if pointer is None:
        return [root]
    match = _XPOINTER.match(pointer)
    if match is None:
        raise PolicyError(
            f"{where}: xpointer {printable(pointer)} is not supported; write a plain path such as xpointer(/profile/*)"
        )
    first, *steps = match[1][1:].split("/")
    found = [root] if root.tag == first else []
    for step in steps:
        found = [child for element in found for child in element if _fits(child, step)]
    if not found:
        raise PolicyError(f"{where}: xpointer {printable(pointer)} selects nothing")
    return found


def _fits(element: etree._Element, step: str) -> bool:
    return step in ("*", element.tag) or element.tag in _INCLUDE_TAGS
