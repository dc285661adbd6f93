"""NoDL v1 (``*.nodl.xml``) -> ``ManifestNode`` values.

What ubuntu-robotics/nodl's schema ``v1.xsd`` accepts is accepted, everything else refused with file and
line; comments are ignored and a name with two roles keeps both, unlike in its parser. Names are checked
as rcl would, which the schema leaves open.
"""

from __future__ import annotations

from collections.abc import Iterable

from enclave_common.source_location import SourceLocation
from enclave_common.terminal import quoted
from enclave_common.xml_tree import XmlElement
from nodl.document.v2_schema import plain_types
from nodl.errors import (
    InvalidElementError,
    InvalidNodeChildError,
    InvalidNoDLDocumentError,
    UnsupportedInterfaceError,
)
from nodl.name_template import NameTemplate
from nodl.names import (
    InvalidNameError,
    split_fqn,
    validate_full_name,
    validate_node_name,
    validate_written_name,
)
from nodl.node_interface import Endpoint, EndpointKind, ManifestNode, NodeInterface
from nodl.xml_text import parse_xml

VERSION = 1

# element -> role -> the endpoints it stands for
_ROLES: dict[str, dict[str, tuple[EndpointKind, ...]]] = {
    one.family: {one.role: (one,), other.role: (other,), "both": (one, other)}
    for one, other in (
        (EndpointKind.PUBLISHER, EndpointKind.SUBSCRIPTION),
        (EndpointKind.SERVICE_SERVER, EndpointKind.SERVICE_CLIENT),
        (EndpointKind.ACTION_SERVER, EndpointKind.ACTION_CLIENT),
    )
}
_XSI = "{http://www.w3.org/2001/XMLSchema-instance}"
# What any schema allows.
_ALLOWED_ANYWHERE = (f"{_XSI}schemaLocation", f"{_XSI}noNamespaceSchemaLocation")


def parse_v1(text: bytes, file: str, package: str | None = None) -> tuple[ManifestNode, ...]:
    """Return the nodes of one document, in document order. Raises ``InvalidNoDLError`` with file:line."""
    root = parse_xml(text, file)
    _expect(root, "interface", ("version",), file)
    version = root.get("version", "")
    if version != str(VERSION):
        raise UnsupportedInterfaceError.at(
            _at(root, file), f"interface version {quoted(version)} is not supported, only {VERSION} is"
        )
    nodes = tuple(_node(element, file, package) for element in root)
    if not nodes:
        raise InvalidNoDLDocumentError.at(_at(root, file), "<interface> needs at least one <node>")
    return nodes


def _node(element: XmlElement, file: str, package: str | None) -> ManifestNode:
    _expect(element, "node", ("name", "executable"), file)
    namespace, name = _node_name(element, file)
    executable = element.get("executable", "")
    if not executable or not executable.isprintable():
        raise InvalidElementError.at(
            _at(element, file), f"executable {quoted(executable)} is not a program name"
        )
    if not len(element):
        raise InvalidNoDLDocumentError.at(_at(element, file), f"node {name} describes no interface at all")
    own_prefix = f"{(namespace or '').rstrip('/')}/{name}/"
    endpoints: dict[Endpoint, None] = {}
    parameters: dict[str, str] = {}
    for child in element:
        if child.tag == "parameter":
            _expect(child, "parameter", ("name", "type"), file)
            _expect_no_elements(child, file)
            parameters[child.get("name", "")] = child.get("type", "")
        elif child.tag in _ROLES:
            endpoints.update(dict.fromkeys(_endpoints(child, file, own_prefix)))
        else:
            raise InvalidNodeChildError.at(
                _at(child, file),
                f"<{child.tag}> is not allowed in a node, only action, parameter, service and topic are",
            )
    interface = NodeInterface(
        package=package,
        executable=None if "::" in executable else executable,
        plugin=executable if "::" in executable else None,
        name=name,
        namespace=namespace,
        endpoints=_once(endpoints),
        source=_at(element, file),
        parameters=tuple(parameters),
        parameter_types=plain_types(parameters),
    )
    return ManifestNode(interface, VERSION, parameters)


def _node_name(element: XmlElement, file: str) -> tuple[str | None, str]:
    written = element.get("name", "")
    try:
        if "/" not in written:
            validate_node_name(written)
            return None, written
        absolute = written if written.startswith("/") else f"/{written}"
        validate_full_name(absolute, "node name")
        namespace, name = split_fqn(absolute)
        return namespace, name
    except InvalidNameError as error:
        raise InvalidElementError.at(_at(element, file), f"<node> {error}") from None


def _endpoints(element: XmlElement, file: str, own_prefix: str) -> list[Endpoint]:
    """Return the endpoints; ``/node_name/x`` is v1's habit of writing the private name ``~/x``."""
    tag = element.tag
    _expect(element, tag, ("name", "type", "role"), file)
    _expect_no_elements(element, file)
    name, role = element.get("name", ""), element.get("role", "")
    if role not in _ROLES[tag]:
        raise InvalidNoDLDocumentError.at(
            _at(element, file), f"role {quoted(role)} of <{tag}> must be one of {', '.join(_ROLES[tag])}"
        )
    try:
        validate_written_name(name, f"{tag} name")
    except InvalidNameError as error:
        raise InvalidElementError.at(_at(element, file), str(error)) from None
    source = _at(element, file)
    private = name.startswith(own_prefix)
    template = NameTemplate.literal(f"~/{name[len(own_prefix) :]}" if private else name)
    written = name if private else ""
    type_name = element.get("type", "")
    return [Endpoint(kind, template, type_name, source, written=written) for kind in _ROLES[tag][role]]


def _once(endpoints: Iterable[Endpoint]) -> tuple[Endpoint, ...]:
    first: dict[tuple[EndpointKind, NameTemplate, str], Endpoint] = {}
    for endpoint in endpoints:
        first.setdefault((endpoint.kind, endpoint.name, endpoint.type), endpoint)
    return tuple(first.values())


def _expect(element: XmlElement, tag: str, attributes: tuple[str, ...], file: str) -> None:
    if element.tag != tag:
        raise InvalidNoDLDocumentError.at(_at(element, file), f"expected <{tag}>, found <{element.tag}>")
    for name in attributes:
        if name not in element.attrib:
            raise InvalidNoDLDocumentError.at(_at(element, file), f"<{tag}> needs the attribute {name}")
    for attribute in element.attrib:
        if attribute not in attributes and attribute not in _ALLOWED_ANYWHERE:
            raise InvalidNoDLDocumentError.at(_at(element, file), f"<{tag}> has no attribute {attribute!s}")
    if element.text:  # the schema knows none; some there is mostly a tag that lost its bracket
        why = f"<{element.tag}> holds the text {quoted(element.text[:40])}, which has no meaning"
        raise InvalidNoDLDocumentError.at(_at(element, file), why)


def _expect_no_elements(element: XmlElement, file: str) -> None:
    for child in element:
        raise InvalidNoDLDocumentError.at(
            _at(child, file), f"<{child.tag}> is not allowed in <{element.tag}>, which holds no elements"
        )


def _at(element: XmlElement, file: str) -> SourceLocation:
    return SourceLocation(file, element.sourceline)
