"""XML text -> elements with line numbers and their text; a DOCTYPE, where entities would be declared, is refused."""

from __future__ import annotations

from functools import partial
from xml.parsers import expat

from enclave_common.source_location import SourceLocation
from enclave_common.xml_tree import RefusedXml, XmlElement, collect_elements
from nodl.errors import InvalidXMLError

MAX_BYTES = 4_000_000


def parse_xml(text: bytes | str, file: str) -> XmlElement:
    """Parse text, or bytes in the encoding that they declare; raises ``InvalidXMLError`` with file:line."""
    if len(text) > MAX_BYTES:
        raise InvalidXMLError.at(SourceLocation(file), f"larger than the allowed {MAX_BYTES} bytes")
    parser = expat.ParserCreate(namespace_separator="}")
    parser.StartDoctypeDeclHandler = partial(_refuse_doctype, parser)
    document = collect_elements(parser, namespaces=True, keep_text=True)
    try:
        parser.Parse(text, True)
    except RefusedXml as error:
        raise InvalidXMLError.at(SourceLocation(file, error.line), error.message) from None
    except expat.ExpatError as error:
        why = expat.ErrorString(error.code)
        raise InvalidXMLError.at(SourceLocation(file, error.lineno), f"not well-formed XML: {why}") from None
    except (LookupError, ValueError) as error:  # from Python's side of an encoding that expat does not know
        raise InvalidXMLError.at(SourceLocation(file, 1), f"not well-formed XML: {error}") from None
    return document[0]


def _refuse_doctype(parser: expat.XMLParserType, *_declaration: object) -> None:
    raise RefusedXml("a DOCTYPE is not allowed; remove it and write entities out", parser.CurrentLineNumber)
