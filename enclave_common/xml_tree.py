"""Elements with line numbers, as expat reads them: loading lxml takes longer than reading all manifests."""

from __future__ import annotations

from collections.abc import Iterator
from xml.parsers import expat

MAX_NESTING = 250
"""Of elements in elements; upstream ends in a RecursionError before, and lxml's limit is near it."""


class RefusedXml(ValueError):
    """Well-formed, but made to exhaust memory or to reach outside the file. ``line`` counts from 1."""

    def __init__(self, message: str, line: int):
        super().__init__(f"{message}: line {line}")
        self.message = message
        self.line = line


class XmlElement:
    """One element. Iterating gives the child elements; comments and instructions are left out.

    ``text`` is the first of its own that is not blank, where the reader keeps text.
    """

    __slots__ = ("attrib", "children", "sourceline", "tag", "text")

    def __init__(self, tag: str, attrib: dict[str, str], sourceline: int):
        self.tag = tag
        self.attrib = attrib
        self.sourceline = sourceline
        self.text = ""
        self.children: list[XmlElement] = []

    def __iter__(self) -> Iterator[XmlElement]:
        return iter(self.children)

    def __len__(self) -> int:
        return len(self.children)

    def iter(self, tag: str = "") -> Iterator[XmlElement]:
        """Yield itself and all elements in it, in the order of the text; with ``tag`` those alone."""
        if tag in ("", self.tag):
            yield self
        for child in self.children:
            yield from child.iter(tag)

    def get(self, name: str, default: str = "") -> str:
        """Return the value of an attribute."""
        return self.attrib.get(name, default)


def collect_elements(
    parser: expat.XMLParserType, *, namespaces: bool, keep_text: bool = False
) -> list[XmlElement]:
    """Let ``parser`` build elements; the returned list holds the root when it is done.

    While it reads, the parser raises ``RefusedXml`` for elements that are nested too deep.
    Closures, for speed: two calls per element are most of the time that a front end takes.
    """
    document: list[XmlElement] = []
    open_elements = [document]
    descend, ascend = open_elements.append, open_elements.pop

    def start(tag: str, attributes: dict[str, str]) -> None:
        element = XmlElement(tag, attributes, parser.CurrentLineNumber)
        open_elements[-1].append(element)
        descend(element.children)
        if len(open_elements) > MAX_NESTING:
            raise RefusedXml(f"elements are nested more than {MAX_NESTING} deep", element.sourceline)

    def start_with_namespaces(tag: str, attributes: dict[str, str]) -> None:
        start(_clark(tag), {_clark(name): value for name, value in attributes.items()})

    def text(characters: str) -> None:
        owner = open_elements[-2][-1]
        owner.text = owner.text or characters.strip()

    if keep_text:
        parser.buffer_text = True
        parser.CharacterDataHandler = text
    parser.StartElementHandler = start_with_namespaces if namespaces else start
    parser.EndElementHandler = lambda _tag: ascend()
    return document


def _clark(name: str) -> str:
    return "{" + name if "}" in name else name
