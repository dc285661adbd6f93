"""The interfaces that a configuration file of a tool requests."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from enclave_common.source_location import SourceLocation
from nodl.name_template import NameTemplate
from nodl.names import InvalidNameError, validate_written_name
from nodl.node_interface import Endpoint, EndpointKind, Gap


class ConfiguredPlugin(NamedTuple):
    """A plugin that the file names, such as ``display of class 'a/B'`` (``what``), with its properties.

    ``node``: that of ``Configured.nodes`` which is its own, if it has one.
    """

    what: str
    plugin_class: str
    place: SourceLocation
    properties: Mapping[str, object]
    node: str = ""


class Configured(NamedTuple):
    """The contents of a configuration file. ``nodes``: names of further nodes that the program makes, of which nothing
    else is known to differ.

    ``plugins``: what documents describe, if they do. ``unused``: what the tool does not take as it is written, and why.
    """

    endpoints: tuple[Endpoint, ...] = ()
    gaps: tuple[Gap, ...] = ()
    nodes: tuple[str, ...] = ()
    plugins: tuple[ConfiguredPlugin, ...] = ()
    unused: tuple[str, ...] = ()


def collected(parts: Iterable[Endpoint | Gap]) -> Configured:
    """Return each once, in their order."""
    found = list(dict.fromkeys(parts))
    endpoints = tuple(part for part in found if isinstance(part, Endpoint))
    return Configured(endpoints, tuple(part for part in found if isinstance(part, Gap)))


def endpoint_named(
    kind: EndpointKind, name: str, type_name: str, place: SourceLocation, note: str, about: str = ""
) -> Endpoint | Gap:
    """Return the endpoint that a tool makes under the ``name`` in its file, or why there can be none of that name.

    ``about``: what the gap begins with.
    """
    try:
        validate_written_name(name)
    except InvalidNameError as error:
        return Gap(place, f"{about}{error}")
    return Endpoint(kind, NameTemplate.literal(name), type_name, place, note=note)
