"""What the source may mean by a recorded name that begins with the node's own place. Performs no I/O.

A name below the node's name is private (``nodl.record.written``), unless a parameter has that text as its value, too.
An absolute name below the node's namespace is made from it (``resolve_topic_name``, ``get_namespace``) or stands so in
the source. Each reading holds until a run under another name or namespace decides.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence, Set

from nodl.names import split_fqn
from nodl.record.requested import RequestedEndpoint, RequestedNode


def with_readings(nodes: Sequence[RequestedNode]) -> list[RequestedNode]:
    """Return ``nodes``, all of one program, whose endpoints have the likeliest name and the others as ``readings``."""
    found = [[_readings(asked, node) for asked in node.endpoints] for node in nodes]
    places: dict[str, set[str]] = {}
    for node, of_node in zip(nodes, found, strict=True):
        for reading in (reading for readings in of_node for reading in readings):
            places.setdefault(reading, set()).add(node.fqn)
    return [
        node._replace(
            endpoints=tuple(
                _read_as(asked, _left(readings, node, places))
                for asked, readings in zip(node.endpoints, of_node, strict=True)
            )
        )
        for node, of_node in zip(nodes, found, strict=True)
    ]


def _read_as(asked: RequestedEndpoint, readings: Sequence[str]) -> RequestedEndpoint:
    return asked._replace(name=readings[0], readings=tuple(readings[1:]))


def _readings(asked: RequestedEndpoint, node: RequestedNode) -> tuple[str, ...]:
    namespace, own_name = split_fqn(node.fqn)
    texts = set(_texts(node))
    if asked.moved or asked.spellings or asked.name in texts:
        return (asked.name,)
    if asked.name.startswith("~/") and asked.written.startswith(f"{own_name}/") and own_name in texts:
        return asked.written, asked.name
    below = asked.name.removeprefix(f"{namespace}/")
    if namespace == "/" or below == asked.name or asked.name != asked.written or node.namespace:
        return (asked.name,)
    named_by_a_value = not texts.isdisjoint(namespace.split("/"))
    return (asked.name, below) if named_by_a_value else (below, asked.name)


def _texts(node: RequestedNode) -> Iterable[str]:
    for value in (*node.parameters.values(), *node.declared.values()):
        yield from (
            each for each in (value if isinstance(value, list | tuple) else (value,)) if isinstance(each, str)
        )
    yield from node.arguments


def _left(readings: tuple[str, ...], node: RequestedNode, places: Mapping[str, Set[str]]) -> tuple[str, ...]:
    """Return those of ``readings`` that also hold in another place, if one does."""
    return tuple(each for each in readings if len(readings) == 1 or places[each] - {node.fqn}) or readings
