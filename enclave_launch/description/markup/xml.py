"""XML launch files: ``Entity`` and ``Parser`` of ``launch_xml``."""

from __future__ import annotations

import re
from functools import partial
from typing import TYPE_CHECKING, Any, TextIO
from xml.etree.ElementTree import ParseError
from xml.parsers import expat

from enclave_common.source_location import SourceLocation
from enclave_common.xml_tree import RefusedXml, XmlElement, collect_elements
from enclave_launch.description.markup.entity import Entity as BaseEntity
from enclave_launch.description.markup.entity import check_is_list_entity
from enclave_launch.description.markup.parser import FilePath
from enclave_launch.description.markup.parser import Parser as BaseParser
from enclave_launch.description.typed_values import get_typed_value
from enclave_launch.frontend import launch_file
from enclave_launch.frontend.error_location import mark_at

if TYPE_CHECKING:
    from collections.abc import Container

    from enclave_common.xml_tree import XmlElement


_VALUE_TYPES = frozenset({str, int, float, bool, None})  # certainly no lists of entities


class Entity(BaseEntity):
    """One XML element; attributes are coerced to the requested type."""

    def __init__(self, xml_element: XmlElement, *, parent: Entity | None = None, file: str = "") -> None:
        self._element = xml_element
        self._parent = parent
        self._file = file
        self._read_attributes: set[str] = set()
        self._read_children: set[str] = set()

    @property
    def type_name(self) -> str:
        return self._element.tag

    @property
    def parent(self) -> Entity | None:
        return self._parent

    @property
    def children(self) -> list[BaseEntity]:
        self._read_children = {child.tag for child in self._element}
        return [Entity(child, file=self._file) for child in self._element]

    @property
    def source_location(self) -> SourceLocation:
        return SourceLocation(self._file, self._element.sourceline, self._element.tag)

    @property
    def given(self) -> Container[str]:
        element = self._element
        if not element.children:
            return element.attrib
        return {*element.attrib, *[child.tag for child in element.children]}

    def find_text(self, text: str) -> SourceLocation | None:
        """Return the first place at or below this element where an attribute has exactly this text."""
        if text in self._element.attrib.values():
            return self.source_location
        places = (Entity(child, file=self._file).find_text(text) for child in self._element)
        return next((place for place in places if place is not None), None)

    def assert_entity_completely_parsed(self) -> None:
        element = self._element
        if element.children and (unread := {child.tag for child in element} - self._read_children):
            raise ValueError(f"Unexpected nested tag(s) found in `{element.tag}`: {unread}")
        if len(self._read_attributes) != len(element.attrib):
            unread = element.attrib.keys() - self._read_attributes
            raise ValueError(f"Unexpected attribute(s) found in `{element.tag}`: {unread}")

    def get_attr(
        self, name: str, *, data_type: Any = str, optional: bool = False, can_be_str: bool = True
    ) -> Any:
        attributes = self._element.attrib
        text = attributes.get(name)
        if data_type is str and text is not None and name + "-sep" not in attributes:
            self._read_attributes.add(name)
            return text
        if data_type not in _VALUE_TYPES and check_is_list_entity(data_type):
            return self._children_named(name, data_type, optional)
        if text is None:
            if optional:
                return None
            raise self._missing(name, data_type)
        self._read_attributes.add(name)
        value: str | list[str] = text
        separator = attributes.get(name + "-sep")
        if separator is not None:
            self._read_attributes.add(name + "-sep")
            value = text.split(separator)
        return self._typed(name, value, data_type, can_be_str)

    def _typed(self, name: str, value: str | list[str], data_type: Any, can_be_str: bool) -> Any:
        try:
            return get_typed_value(value, data_type, can_be_str=can_be_str)
        except ValueError as error:
            raise TypeError(
                f"Attribute '{name}' of Entity '{self.type_name}' expected to be of type '{data_type}'."
                f"'{value}' can not be converted to one of those types"
            ) from error

    def _children_named(self, name: str, data_type: Any, optional: bool) -> list[Entity] | None:
        found = [Entity(child, file=self._file) for child in self._element if child.tag == name]
        if found:
            self._read_children.add(name)
            return found
        if optional:
            return None
        raise self._missing(name, data_type)

    def _missing(self, name: str, data_type: Any) -> AttributeError:
        return AttributeError(
            f"Attribute '{name}' of type '{data_type}' not found in Entity '{self.type_name}'"
        )


class Parser(BaseParser):
    """Front end of ``.launch.xml``."""

    @classmethod
    def load(cls, file: FilePath | TextIO) -> tuple[Entity, Parser]:
        """Load an XML file; return root entity and parser. Raises ``ParseError``, ``RefusedXml``, ``OSError``."""
        return cls.load_source(launch_file.read(file))

    @classmethod
    def load_source(cls, source: launch_file.LaunchFile) -> tuple[Entity, Parser]:
        try:
            root = source.parsed_by(parse_launch_xml)
        except (SyntaxError, ValueError) as error:
            line = getattr(error, "line", None) or getattr(error, "position", (0, 0))[0]
            mark_at(error, SourceLocation(source.name, line))
            raise
        return Entity(root, file=source.name), cls()

    @classmethod
    def get_file_extensions(cls) -> set[str]:
        return {"launch.xml", "xml", "launch"}


MAX_ENTITY_LENGTH = 256  # characters of one declared entity
_REFERENCE = re.compile("&([^;&#]+);")
_PREDEFINED = dict.fromkeys(("lt", "gt", "amp", "apos", "quot"), " ")
_UNKNOWN = " " * (MAX_ENTITY_LENGTH + 1)


def parse_launch_xml(text: str) -> XmlElement:
    """Return the root element; raises ElementTree's ParseError, and ``RefusedXml`` for unsafe entities.

    Parsed by expat, as upstream does through ElementTree: same dialect, same messages. Nothing outside the file is
    loaded, and an entity that the file declares must be short, the entities in it included.
    """
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
