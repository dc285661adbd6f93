"""XML from outside -> an element tree, without anything that reaches beyond the text itself.

UTF-8 only, no DOCTYPE (hence no entities and no expansion bombs), no network, bounded size; comments and processing
instructions are dropped, so that no reader meets them as children.
"""

from __future__ import annotations

import re
from contextlib import suppress
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from enclave_common.terminal import quoted
from keystore.errors import InvalidInputError, OtherFormError

if TYPE_CHECKING:
    from lxml import etree

MAX_BYTES = 4_000_000
_LABEL = re.compile(rb"""\s*<\?xml[^>]*?\sencoding\s*=\s*["']([^"'>]*)""")
_READ_APART = re.compile(rb"<!\[CDATA\[|&#|<\?(?!xml\s)|[^>\s]\s*<!--|-->\s*[^<\s]")
"""Character data and references, processing instructions, comments beside text: measured on Cyclone DDS, Fast DDS."""


def parse_xml(document: bytes, where: str) -> etree._Element:
    """Parse XML in UTF-8 to its root element; raises ``InvalidInputError`` with ``where`` and the line."""
    from lxml import etree

    if len(document) > MAX_BYTES:
        raise InvalidInputError(f"{where}: larger than the allowed {MAX_BYTES} bytes")
    label = _LABEL.match(document)
    if label is not None and label[1].lower() not in (b"utf-8", b"us-ascii"):
        raise InvalidInputError(
            f"{where}: says that it is in {quoted(label[1].decode('latin-1'))}; write it in UTF-8"
        )
    # The parser takes the bytes as UTF-8 whatever they say, as DDS implementations do.
    parser = etree.XMLParser(
        encoding="utf-8",
        resolve_entities=False,
        no_network=True,
        load_dtd=False,
        huge_tree=False,
        remove_comments=True,
        remove_pis=True,
    )
    try:
        document.decode("utf-8")
        root = etree.fromstring(document, parser)
    except UnicodeDecodeError:
        raise InvalidInputError(f"{where}: not in UTF-8") from None
    except etree.XMLSyntaxError as error:
        raise InvalidInputError(f"{where}:{error.lineno}: not well-formed XML: {error.msg}") from None
    if root.getroottree().docinfo.internalDTD is not None:
        raise InvalidInputError(f"{where}: a DOCTYPE is not allowed; remove it and write entities out")
    return root


def parse_own(document: bytes, head: bytes, where: str) -> Element:
    """Parse what we wrote, which begins with ``head``. Raises OtherFormError for what cannot be that.

    The caller still compares: only what would be written for the same content is ours.
    """
    if (
        document.isascii()
        and document.startswith(head)
        and not any(mark in document for mark in (b"<!", b"&"))
    ):
        with suppress(ElementTree.ParseError):
            return ElementTree.fromstring(document)
    raise not_as_written(where)


def not_as_written(where: str) -> OtherFormError:
    """Return the error for a document that DDS implementations may read otherwise than we do."""
    return OtherFormError(
        f"{where} is not, byte for byte, what secure-keystore writes for what it says: DDS implementations may read "
        "something else in it"
    )


def parse_foreign(document: bytes, schema: str, where: str, what: str) -> Element:
    """Parse a document that another tool wrote for DDS, and compare it with a bundled schema.

    Raises ``InvalidInputError`` with file:line also for what DDS implementations read otherwise than an XML parser.
    """
    from lxml import etree

    if found := _READ_APART.search(document):
        line = document.count(b"\n", 0, found.start()) + 1
        raise InvalidInputError(
            f"{where}:{line}: {quoted(found[0].decode('latin-1'))}: DDS implementations read this in different ways"
        )
    root = parse_xml(document, where)
    try:
        _schema(schema).assertValid(root)
    except etree.DocumentInvalid as error:
        problem = re.match(r"(.*?)(?:, line (\d+))?$", str(error), re.DOTALL)
        message, line_number = problem.groups() if problem else (str(error), None)
        raise InvalidInputError(f"{where}:{line_number or 1}: not a valid {what}: {message}") from None
    return ElementTree.fromstring(document)


@cache
def _schema(name: str) -> etree.XMLSchema:
    from lxml import etree

    text = (files("keystore") / "schemas" / name).read_bytes()
    return etree.XMLSchema(etree.fromstring(text))
