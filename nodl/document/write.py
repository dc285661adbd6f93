"""``ManifestNode`` -> the text of a NoDL document, v1 or v2, with notes of what it cannot express. Performs no I/O."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Sequence
from html import escape
from typing import NamedTuple

from enclave_common.terminal import quoted
from nodl.document.v2_schema import NAME_PATTERN, PARAMETER_TYPE_OF, PARAMETER_TYPES, TYPE_PATTERN
from nodl.document.v2_section import CATEGORIES, IDENTITY_KEY
from nodl.errors import InvalidNoDLDocumentError
from nodl.node_interface import ClientLibrary, Endpoint, ManifestNode, NodeInterface

_UNKNOWN_QOS = "{history: SYSTEM_DEFAULT, reliability: SYSTEM_DEFAULT}"
_PLAIN_SCALAR = re.compile(r"[A-Za-z/][A-Za-z0-9_/.:]*[A-Za-z0-9_]\Z|~/[A-Za-z0-9_/]+\Z")
_YAML_WORDS = frozenset({"yes", "no", "on", "off", "true", "false", "null", "y", "n"})


class Written(NamedTuple):
    """A document as text. ``notes``: what had to be invented or left out, for the person who converts."""

    text: str
    notes: tuple[str, ...] = ()


def v2_yaml(node: ManifestNode) -> Written:
    """Write one document. Raises ``InvalidNoDLDocumentError`` for names and types that v2 cannot hold."""
    interface = node.interface
    lines = ["nodl_version: 2", *_identity(interface)]
    if node.parameter_types:
        lines.append("parameters:")
        lines += [f"  {_scalar(n)}: {{type: {_v2_type(node, t)}}}" for n, t in node.parameter_types.items()]
    topics = False
    for category, kind in CATEGORIES.items():
        entries = [endpoint for endpoint in interface.endpoints if endpoint.kind is kind]
        if not entries:
            continue
        topics |= kind.family == "topic"
        qos = f", qos: {_UNKNOWN_QOS}" if kind.family == "topic" else ""
        lines.append(f"{category}:")
        lines += [f"  - {{name: {_v2_name(e)}, type: {_v2_endpoint_type(e)}{qos}}}" for e in entries]
    note = (
        f"{interface.name}: v1 has no QoS; SYSTEM_DEFAULT was written, replace it with what the code requests"
    )
    return Written("\n".join(lines) + "\n", (note,) if topics else ())


def v1_xml(nodes: Sequence[ManifestNode]) -> Written:
    """Write one document with all ``nodes``. Raises ``InvalidNoDLDocumentError`` for a node without name."""
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', '<interface version="1">']
    notes: list[str] = []
    for node in nodes:
        lines += _v1_node(node)
        name = node.interface.name
        if node.version == 2:
            notes.append(f"{name}: QoS, descriptions and details of parameters have no place in v1")
        if node.interface.depends is not None:
            notes.append(
                f"{name}: what depends on how launch starts it has no place in v1; defaults were written"
            )
    return Written("\n".join([*lines, "</interface>", ""]), tuple(notes))


def _identity(interface: NodeInterface) -> list[str]:
    fields: dict[str, str] = {}
    if interface.executable != interface.name:
        fields |= {"executable": interface.executable or "", "plugin": interface.plugin or ""}
        fields["node"] = interface.name or ""
    fields["namespace"] = _own_namespace(interface)
    if interface.library is not ClientLibrary.UNKNOWN:
        fields["library"] = interface.library.value
    given = [f"{key}: {_scalar(value)}" for key, value in fields.items() if value]
    if interface.lifecycle:
        given.append("lifecycle: true")
    return ["codegen:", f"  {IDENTITY_KEY}: {{{', '.join(given)}}}"] if given else []


def _own_namespace(interface: NodeInterface) -> str:
    """Return the namespace if it says more than "the root, as everyone's"."""
    return "" if interface.namespace in (None, "/") else str(interface.namespace)


def _v2_type(node: ManifestNode, written: str) -> str:
    known = PARAMETER_TYPE_OF.get(written.lower())
    if known is None:
        raise InvalidNoDLDocumentError.at(
            node.interface.source,
            f"parameter type {quoted(written)} is unknown in v2; write one of {', '.join(PARAMETER_TYPES)}",
        )
    return known


def _v2_name(endpoint: Endpoint) -> str:
    name = endpoint.name.text  # for v1's /node/x this is ~/x, which v2 can say
    if not endpoint.name.is_literal or not re.search(NAME_PATTERN, name):
        raise InvalidNoDLDocumentError.at(
            endpoint.source, f"name {quoted(name)} cannot be written in NoDL v2"
        )
    return _scalar(name)


def _v2_endpoint_type(endpoint: Endpoint) -> str:
    if not re.search(TYPE_PATTERN, endpoint.type):
        raise InvalidNoDLDocumentError.at(
            endpoint.source,
            f"type {quoted(endpoint.type)} is not an interface type such as std_msgs/msg/String",
        )
    return endpoint.type


def _scalar(text: str) -> str:
    if _PLAIN_SCALAR.match(text) and text.lower() not in _YAML_WORDS:
        return text
    return json.dumps(text)


def _v1_node(node: ManifestNode) -> list[str]:
    interface = node.interface
    if not interface.name:
        raise InvalidNoDLDocumentError.at(
            interface.source, f"v1 needs a node name; add codegen: {{{IDENTITY_KEY}: {{node: NAME}}}}"
        )
    namespace = _own_namespace(interface)
    name = f"{namespace}/{interface.name}" if namespace else interface.name
    children = [*_v1_interfaces(interface.endpoints)]
    children += [
        f'    <parameter name="{escape(n)}" type="{escape(t)}"/>' for n, t in node.parameter_types.items()
    ]
    if not children:
        raise InvalidNoDLDocumentError.at(interface.source, "v1 cannot describe a node without any interface")
    executable = interface.executable or interface.plugin or ""
    head = f'  <node name="{escape(name)}" executable="{escape(executable)}">'
    return [head, *children, "  </node>"]


def _v1_interfaces(endpoints: Iterable[Endpoint]) -> Iterable[str]:
    listed = list(endpoints)
    for element in ("topic", "service", "action"):
        roles: dict[tuple[str, str], list[str]] = {}
        for endpoint in listed:
            if endpoint.kind.family == element and not endpoint.type:
                raise InvalidNoDLDocumentError.at(
                    endpoint.source, f"{endpoint.name} is of any type, which NoDL v1 cannot say"
                )
            if endpoint.kind.family == element:
                key = (endpoint.written or endpoint.name.text, endpoint.type)
                roles.setdefault(key, []).append(endpoint.kind.role)
        for (name, type_name), given in roles.items():
            role = "both" if len(given) > 1 else given[0]
            yield f'    <{element} name="{escape(name)}" type="{escape(type_name)}" role="{role}"/>'
