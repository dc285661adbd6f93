"""XML text -> elements with line numbers and their text. Pure; for NoDL v1.

expat and not lxml: every dry run reads manifests, and to load lxml takes longer than to read them all.
Nothing outside the document is ever read, and nothing in it can grow: a DOCTYPE, where entities would be
declared, is refused.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NoReturn
from xml.parsers import expat

from nodl.errors import InvalidXMLError
from nodl.source_ref import SourceRef

MAX_BYTES = 4_000_000
MAX_NESTING = 250  # elements in elements; lxml's limit is near it


class XmlElement:
    """One element. ``text`` is the first of its own that is not blank; comments and instructions are dropped."""

    __slots__ = ("attrib", "children", "line", "tag", "text")

    def __init__(self, tag: str, attrib: dict[str, str], line: int):
        self.tag = tag
        self.attrib = attrib
        self.line = line
        self.text = ""
        self.children: list[XmlElement] = []

    def __iter__(self) -> Iterator[XmlElement]:
        return iter(self.children)

    def __len__(self) -> int:
        return len(self.children)

    def get(self, name: str, default: str = "") -> str:
        return self.attrib.get(name, default)


def parse_xml(text: bytes, file: str) -> XmlElement:
    """Bytes -> root element. Raises ``InvalidXMLError`` with file:line."""
    if len(text) > MAX_BYTES:
        raise InvalidXMLError.at(SourceRef(file), f"larger than the allowed {MAX_BYTES} bytes")
    builder = _Builder(file)
    try:
        builder.parser.Parse(text, True)
    except expat.ExpatError as error:
        why = expat.ErrorString(error.code)
        raise InvalidXMLError.at(SourceRef(file, error.lineno), f"not well-formed XML: {why}") from None
    except (LookupError, ValueError) as error:  # from Python's side of an encoding that expat does not know
        raise InvalidXMLError.at(SourceRef(file, 1), f"not well-formed XML: {error}") from None
    return builder.document.children[0]


class _Builder:
    """Puts the elements together while ``parser`` reads."""

    def __init__(self, file: str):
        self.document = XmlElement("", {}, 0)
        self._open = [self.document]
        self._file = file
        self.parser = expat.ParserCreate(namespace_separator="}")
        self.parser.buffer_text = True
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._text
        self.parser.StartDoctypeDeclHandler = self._doctype

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        names = {_clark(name): value for name, value in attributes.items()}
        element = XmlElement(_clark(tag), names, self.parser.CurrentLineNumber)
        self._open[-1].children.append(element)
        self._open.append(element)
        if len(self._open) > MAX_NESTING:
            self._refuse(f"elements are nested more than {MAX_NESTING} deep")

    def _end(self, _tag: str) -> None:
        self._open.pop()

    def _text(self, text: str) -> None:
        element = self._open[-1]
        element.text = element.text or text.strip()

    def _doctype(self, *_declaration: object) -> None:
        self._refuse("a DOCTYPE is not allowed; remove it and write entities out")

    def _refuse(self, message: str) -> NoReturn:
        raise InvalidXMLError.at(SourceRef(self._file, self.parser.CurrentLineNumber), message)


def _clark(name: str) -> str:
    """``uri}name`` -> ``{uri}name``, the usual way to write a name in a namespace."""
    return "{" + name if "}" in name else name
