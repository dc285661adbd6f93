"""XML text -> elements with line numbers. Pure.

Parsed by expat, as upstream does through ElementTree: same dialect, same messages, right line numbers in long
files, and less time than lxml takes to build a tree and give it to Python. Unlike ElementTree we keep the
line of each element and refuse what only an attacker writes: nothing outside the file is ever loaded, and an
entity that the file declares must be short, the entities in it included, so that no file grows by more than
``MAX_ENTITY_LENGTH`` times.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import partial
from xml.parsers import expat

MAX_ENTITY_LENGTH = 256  # characters of one declared entity
_REFERENCE = re.compile("&([^;&#]+);")
_PREDEFINED = dict.fromkeys(("lt", "gt", "amp", "apos", "quot"), " ")
_UNKNOWN = " " * (MAX_ENTITY_LENGTH + 1)
MAX_NESTING = 250  # elements in elements; upstream ends in a RecursionError before


class RefusedXml(ValueError):
    """Well-formed, but made to exhaust memory or to reach outside the file. ``line`` counts from 1."""

    def __init__(self, message: str, line: int):
        super().__init__(f"{message}: line {line}")
        self.line = line


class XmlElement:
    """One element. Iterating gives the child elements; text, comments and instructions are not kept."""

    __slots__ = ("attrib", "children", "sourceline", "tag")

    def __init__(self, tag: str, attrib: dict[str, str], sourceline: int):
        self.tag = tag
        self.attrib = attrib
        self.sourceline = sourceline
        self.children: list[XmlElement] = []

    def __iter__(self) -> Iterator[XmlElement]:
        return iter(self.children)

    def __len__(self) -> int:
        return len(self.children)


def parse_launch_xml(text: str) -> XmlElement:
    """Text -> root element.

    Raises ``xml.etree.ElementTree.ParseError`` with ElementTree's message and position, or ``RefusedXml``.
    """
    parser = expat.ParserCreate(namespace_separator="}")
    parser.EntityDeclHandler = partial(_check_entity, parser, dict(_PREDEFINED))
    parser.SkippedEntityHandler = partial(_refuse_skipped_entity, parser)
    document = _collect_elements(parser, namespaces="xmlns" in text)
    try:
        # Encoded text and not str, as upstream: a declared encoding then counts, oddly, a second time.
        parser.Parse(text.encode("utf-8", "surrogatepass"), True)
    except expat.ExpatError as error:
        raise _parse_error(str(error), error.code, (error.lineno, error.offset)) from None
    return document[0]


def _collect_elements(parser: expat.XMLParserType, *, namespaces: bool) -> list[XmlElement]:
    """Let ``parser`` build elements; the returned list holds the root when it is done.

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

    parser.StartElementHandler = start_with_namespaces if namespaces else start
    parser.EndElementHandler = lambda _tag: ascend()
    return document


def _clark(name: str) -> str:
    """``uri}name`` -> ``{uri}name``, ElementTree's way to write a name in a namespace."""
    return "{" + name if "}" in name else name


def _check_entity(
    parser: expat.XMLParserType,
    declared: dict[str, str],
    name: str,
    is_parameter: bool,
    value: str | None,
    *_external: str | None,
) -> None:
    """``declared``: the entities so far with their whole text; of two of one name the first counts."""
    line = parser.CurrentLineNumber
    if value is None:
        raise RefusedXml(f"entity '{name}' is external: nothing outside the file is read", line)
    if is_parameter or "%" in value:
        raise RefusedXml(f"entity '{name}' is more than plain text", line)
    if len(value) > MAX_ENTITY_LENGTH or _longer(name, value, declared):
        raise RefusedXml(f"entity '{name}' has more than {MAX_ENTITY_LENGTH} characters", line)


def _longer(name: str, value: str, declared: dict[str, str]) -> bool:
    """Whether ``value`` is too long with the entities in it; one that is not declared yet is not known to be plain."""
    text = _REFERENCE.sub(lambda match: declared.get(match[1], _UNKNOWN), value)
    declared.setdefault(name, text)
    return len(text) > MAX_ENTITY_LENGTH


def _refuse_skipped_entity(parser: expat.XMLParserType, name: str, is_parameter: bool) -> None:
    """An entity that an external DTD might have declared; none is read."""
    if is_parameter:
        return
    position = (parser.CurrentLineNumber, parser.CurrentColumnNumber)
    message = f"undefined entity &{name};: line {position[0]}, column {position[1]}"
    raise _parse_error(message, expat.errors.codes[expat.errors.XML_ERROR_UNDEFINED_ENTITY], position)


def _parse_error(message: str, code: int, position: tuple[int, int]) -> SyntaxError:
    """What ElementTree raises; imported only now, because a good file does not need it."""
    from xml.etree.ElementTree import ParseError

    error = ParseError(message)
    error.code = code
    error.position = position
    return error
