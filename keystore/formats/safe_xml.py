"""XML from outside -> an element tree, without anything that reaches beyond the text itself.

No DOCTYPE (hence no entities and no expansion bombs), no network, bounded size; comments and processing
instructions are dropped, so that no reader meets them as children.
"""

from __future__ import annotations

import re
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING

from keystore.errors import InvalidInputError

if TYPE_CHECKING:
    from lxml import etree

MAX_BYTES = 4_000_000


def parse_xml(document: bytes, where: str) -> etree._Element:
    """Parse XML to its root element; raises ``InvalidInputError`` with ``where`` and the line."""
    from lxml import etree

    if len(document) > MAX_BYTES:
        raise InvalidInputError(f"{where}: larger than the allowed {MAX_BYTES} bytes")
    _refuse_doctype(b"<!DOCTYPE" in document, where)
    parser = etree.XMLParser(
        resolve_entities=False,
        no_network=True,
        load_dtd=False,
        huge_tree=False,
        remove_comments=True,
        remove_pis=True,
    )
    try:
        root = etree.fromstring(document, parser)
    except etree.XMLSyntaxError as error:
        raise InvalidInputError(f"{where}:{error.lineno}: not well-formed XML: {error.msg}") from None
    _refuse_doctype(root.getroottree().docinfo.internalDTD is not None, where)  # other encodings
    return root


def check_schema(root: etree._Element, schema_name: str, where: str, what: str) -> None:
    """Compare with a bundled schema. Raises ``InvalidInputError`` with file:line for the first difference."""
    from lxml import etree

    try:
        _schema(schema_name).assertValid(root)
    except etree.DocumentInvalid as error:
        problem = re.match(r"(.*?)(?:, line (\d+))?$", str(error), re.DOTALL)
        message, line = problem.groups() if problem else (str(error), None)
        raise InvalidInputError(f"{where}:{line or 1}: not a valid {what}: {message}") from None


def _refuse_doctype(present: bool, where: str) -> None:
    if present:
        raise InvalidInputError(f"{where}: a DOCTYPE is not allowed; remove it and write entities out")


@cache
def _schema(name: str) -> etree.XMLSchema:
    from lxml import etree

    text = (files("keystore") / "schemas" / name).read_bytes()
    return etree.XMLSchema(etree.fromstring(text))
