"""XML from outside -> an element tree, without anything that reaches beyond the text itself.

No DOCTYPE (hence no entities and no expansion bombs), no network, bounded size; comments and processing
instructions are dropped, so that no reader meets them as children.
"""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING

from keystore.errors import InvalidInput

if TYPE_CHECKING:
    from lxml import etree

MAX_BYTES = 4_000_000


def parse_xml(document: bytes, where: str, max_bytes: int = MAX_BYTES) -> etree._Element:
    """The root element. ``where`` names the document in errors; raises ``InvalidInput`` with file:line."""
    from lxml import etree

    if len(document) > max_bytes:
        raise InvalidInput(f"{where}: larger than the allowed {max_bytes} bytes")
    _refuse_doctype(b"<!DOCTYPE" in document, where)
    parser = etree.XMLParser(
        resolve_entities=False,
        no_network=True,
        load_dtd=False,
        huge_tree=False,
        remove_comments=True,
        remove_pis=True,
        base_url=where,
    )
    try:
        root = etree.fromstring(document, parser)
    except etree.XMLSyntaxError as error:
        raise InvalidInput(f"{where}:{error.lineno}: not well-formed XML: {error.msg}") from None
    _refuse_doctype(root.getroottree().docinfo.internalDTD is not None, where)  # other encodings
    return root


def check_schema(root: etree._Element, schema_name: str, where: str, what: str) -> None:
    """Compare with a bundled schema. Raises ``InvalidInput`` with file:line for the first difference."""
    schema = _schema(schema_name)
    if not schema.validate(root):
        problem = next(iter(schema.error_log))
        raise InvalidInput(f"{where}:{problem.line}: not a valid {what}: {problem.message}")


def _refuse_doctype(present: bool, where: str) -> None:
    if present:
        raise InvalidInput(f"{where}: a DOCTYPE is not allowed; remove it and write entities out")


@cache
def _schema(name: str) -> etree.XMLSchema:
    from lxml import etree

    text = (files("keystore") / "schemas" / name).read_bytes()
    return etree.XMLSchema(etree.fromstring(text))
