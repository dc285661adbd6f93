"""The XML of launch files -> elements with line numbers.

Parsed by expat, as upstream does through ElementTree: same dialect, same messages, right line numbers in long
files, and less time than lxml takes to build a tree and give it to Python. Unlike ElementTree we keep the
line of each element and refuse what only an attacker writes: nothing outside the file is ever loaded, and an
entity that the file declares must be short, the entities in it included, so that no file grows by more than
``MAX_ENTITY_LENGTH`` times.
"""

from __future__ import annotations

import re
from functools import partial
from xml.etree.ElementTree import ParseError
from xml.parsers import expat

from enclave_common.xml_tree import RefusedXml, XmlElement, collect_elements

MAX_ENTITY_LENGTH = 256  # characters of one declared entity
_REFERENCE = re.compile("&([^;&#]+);")
_PREDEFINED = dict.fromkeys(("lt", "gt", "amp", "apos", "quot"), " ")
_UNKNOWN = " " * (MAX_ENTITY_LENGTH + 1)


def parse_launch_xml(text: str) -> XmlElement:
    """Return the root element; raises ElementTree's ParseError, and ``RefusedXml`` for unsafe entities."""
    parser = expat.ParserCreate(namespace_separator="}")
    parser.EntityDeclHandler = partial(_check_entity, parser, dict(_PREDEFINED))
    parser.SkippedEntityHandler = partial(_refuse_skipped_entity, parser)
    document = collect_elements(parser, namespaces="xmlns" in text)
    try:
        # Encoded text and not str, as upstream: a declared encoding then counts, oddly, a second time.
        parser.Parse(text.encode("utf-8", "surrogatepass"), True)
    except expat.ExpatError as error:
        raise _parse_error(str(error), error.code, (error.lineno, error.offset)) from None
    return document[0]


def _check_entity(
    parser: expat.XMLParserType,
    declared: dict[str, str],
    name: str,
    is_parameter: bool,
    value: str | None,
    *_external: str | None,
) -> None:
    """Refuse entities that are external, nested or too long; of two with one name the first is used."""
    line = parser.CurrentLineNumber
    if value is None:
        raise RefusedXml(f"entity '{name}' is external: nothing outside the file is read", line)
    if is_parameter or "%" in value:
        raise RefusedXml(f"entity '{name}' is more than plain text", line)
    if len(value) > MAX_ENTITY_LENGTH or _longer(name, value, declared):
        raise RefusedXml(f"entity '{name}' has more than {MAX_ENTITY_LENGTH} characters", line)


def _longer(name: str, value: str, declared: dict[str, str]) -> bool:
    """Return True if ``value`` is too long with the entities in it; one that is not declared yet may be anything."""
    text = _REFERENCE.sub(lambda match: declared.get(match[1], _UNKNOWN), value)
    declared.setdefault(name, text)
    return len(text) > MAX_ENTITY_LENGTH


def _refuse_skipped_entity(parser: expat.XMLParserType, name: str, is_parameter: bool) -> None:
    """Refuse an entity that an external DTD might have declared; none is read."""
    if is_parameter:
        return
    position = (parser.CurrentLineNumber, parser.CurrentColumnNumber)
    message = f"undefined entity &{name};: line {position[0]}, column {position[1]}"
    raise _parse_error(message, expat.errors.codes[expat.errors.XML_ERROR_UNDEFINED_ENTITY], position)


def _parse_error(message: str, code: int, position: tuple[int, int]) -> SyntaxError:
    error = ParseError(message)
    error.code = code
    error.position = position
    return error
