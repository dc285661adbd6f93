"""Observations of nodes → what a manifest of each program says: the union, with the runs. Performs no I/O.

A name below the node's name is private (``record.written``), unless a parameter has that text as its value, too.
An absolute name below the node's namespace is made from it (``resolve_topic_name``, ``get_namespace``) or stands so in
the source. Each reading holds until a run under another name or namespace decides.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence, Set
from typing import NamedTuple

from enclave_addons.recording.record.assembly import Record
from enclave_addons.recording.record.lines import RecordedRun
from enclave_addons.recording.record.origins import FIXED, Name, NameOrigin, Observation, origins_of
from enclave_addons.recording.record.requested import RequestedEndpoint, RequestedNode, all_requested
from nodl.names import split_fqn
from nodl.node_interface import ClientLibrary, EndpointKind
from nodl.ros_arguments import arguments_as_inputs

_NUMBERED = re.compile(r"(.+?)_((?:0x)?(?=[0-9a-f]*[0-9])[0-9a-f]{6,}|[0-9]{3,})\Z")
_TF_LISTENER = "transform_listener_impl_*"
"""The node that tf2_ros makes for a ``TransformListener`` that was given none; our section has a word for it."""
_RANDOM = re.compile(r"(static_transform_publisher)_([A-Za-z0-9]+)\Z")  # tf2_ros, when it is given no name

_UNTIL_DECIDED = "all are granted until a run with another value decides"

OBSERVED = "observed"
"""Value of ``RequestedNode.started_as`` for a node of the graph, whose states are unknown."""


class LearntEndpoint(NamedTuple):
    """One name of a node. ``written`` where the manifest cannot hold it as a plain name; ``moved``: rules of the
    program itself made it of what the source writes, so that it is held as the final name; ``spellings``: what else the
    source may write, as far as the runs show; ``readings``: what it may mean, all of which hold; ``seen``: further
    names from the same parameter."""

    kind: EndpointKind
    name: str
    type: str
    qos: tuple[int, ...]
    runs: tuple[str, ...]
    origin: NameOrigin = FIXED
    introspected: bool = False
    moved_from: str = ""
    spellings: tuple[str, ...] = ()
    readings: tuple[str, ...] = ()
    seen: tuple[str, ...] = ()


class ProgramKey(NamedTuple):
    """Which program, and which node of it."""

    package: str
    executable: str
    plugin: str
    node: str
    namespace: str


class LearntNode(NamedTuple):
    """One node of one program. ``incomplete`` and ``notes`` are for the person who reads the manifest.

    ``random_name``: the program appends ``_`` and something to the name; ``tf_listener``: it makes a node for tf2.
    """

    key: ProgramKey
    library: ClientLibrary
    lifecycle: bool
    logger_services: bool
    entries: tuple[LearntEndpoint, ...]
    runs: tuple[RecordedRun, ...]
    incomplete: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    random_name: bool = False
    tf_listener: bool = False

    @property
    def program(self) -> str:
        return f"{self.key.package}/{self.key.plugin or self.key.executable}"


class Learnt(NamedTuple):
    """Everything that records teach. ``unforeseeable``: nodes whose names differ in each run, as patterns; no manifest
    can name them."""

    nodes: tuple[LearntNode, ...]
    unforeseeable: tuple[str, ...] = ()


class _Seen(NamedTuple):
    node: RequestedNode
    run: RecordedRun


def learn(records: Iterable[Record]) -> Learnt:
    """Return what all ``records`` together teach; order does not matter."""
    return learn_from((record.run, all_requested(record.attributed())) for record in records)


def learn_from(runs: Iterable[tuple[RecordedRun, Sequence[RequestedNode]]]) -> Learnt:
    """Learn from runs whose nodes are known otherwise: by observing the graph."""
    groups: dict[ProgramKey, list[_Seen]] = {}
    listeners: set[ProgramKey] = set()
    unforeseeable: set[str] = set()
    for run, nodes in sorted(runs, key=lambda each: each[0].id):
        before: dict[tuple[str, str], ProgramKey] = {}  # the last node of each program in each process
        for node in nodes:
            if not node.known_start or node.container or node.started_as == "executable":
                continue  # no launch file can give an executable a manifest
            if node.started_as == "container":
                unforeseeable.add(f"{node.fqn} in a container, which this launch did not load,")
                continue
            place, pattern = (node.process, node.start.program), _unforeseeable(node)
            if pattern == _TF_LISTENER and place in before:
                listeners.add(before[place])
            elif pattern:
                unforeseeable.add(f"{pattern} of {node.start.program}")
            else:
                before[place] = _key(node)
                groups.setdefault(_key(node), []).append(_Seen(node, run))
    learnt = [_learnt(key, groups[key]) for key in sorted(groups)]
    return Learnt(
        tuple(node._replace(tf_listener=node.key in listeners) for node in learnt),
        tuple(sorted(unforeseeable)),
    )


def _unforeseeable(node: RequestedNode) -> str:
    """Return the final name as a pattern, if the program makes it of a number or an address: another one in each run.

    A number in the source's own name is learnt (``random_name``).
    """
    name = node.fqn.rpartition("/")[2]
    pattern = f"{_numbered(name)}_*"
    if pattern == _TF_LISTENER:
        return pattern
    by_code = _numbered(name) and name != node.name and not node.start.rules.node_name(node.name).rules
    return pattern if by_code else ""


def _numbered(name: str) -> str:
    match = _RANDOM.match(name) or _NUMBERED.match(name)
    return match[1] if match else ""


def _key(node: RequestedNode) -> ProgramKey:
    name = _numbered(node.name) or node.name
    return ProgramKey(node.start.package, node.start.executable, node.start.plugin, name, node.namespace)


def _learnt(key: ProgramKey, seen: Sequence[_Seen]) -> LearntNode:
    lifecycle = any(each.node.lifecycle for each in seen)
    read = with_readings([each.node for each in seen])
    seen = [each._replace(node=node) for each, node in zip(seen, read, strict=True)]
    entries = tuple(_entries(seen))
    libraries = [each.node.library for each in seen if each.node.library is not ClientLibrary.UNKNOWN]
    return LearntNode(
        key,
        libraries[0] if libraries else ClientLibrary.UNKNOWN,
        lifecycle,
        any(each.node.logger_services for each in seen),
        entries,
        tuple({each.run.id: each.run for each in seen}.values()),
        tuple(_missing(lifecycle, seen)),
        tuple(_notes(entries, seen)),
        random_name=any(_numbered(each.node.name) for each in seen),
    )


def _missing(lifecycle: bool, seen: Sequence[_Seen]) -> Iterable[str]:
    if lifecycle and all(each.node.started_as == OBSERVED for each in seen):
        yield "a lifecycle node: whether it was active while it was observed is not known"
    elif lifecycle and not any("active" in each.node.states for each in seen):
        yield "a lifecycle node that was never active: what it makes when it is activated is not known"


def _notes(entries: Iterable[LearntEndpoint], seen: Sequence[_Seen]) -> Iterable[str]:
    for entry in entries:
        if entry.origin.undecided:
            first = entry.origin.source or "fixed"
            said = ", ".join(map(str, entry.origin.candidates))
            yield f"{entry.name}: {first}, or from one of {said}: {_UNTIL_DECIDED}"
        elif entry.origin.source and not entry.origin.proven:
            yield f"{entry.name}: fixed, or the value of {entry.origin.source}: {_UNTIL_DECIDED}"
        if entry.spellings:
            others = ", ".join(entry.spellings)
            yield f"{entry.name}: or {others}: the runs do not decide; one under another namespace and node name does"
        if entry.readings:
            others = ", ".join(entry.readings)
            yield f"{entry.name}: or {others}: both are granted until a run under another name or namespace decides"
        if entry.moved_from:
            yield f"{entry.name}: the program writes {entry.moved_from} and remaps it itself"
    bad = {(e.written, e.rc) for each in seen for e in each.node.endpoints if e.rc not in (0, 1)}
    for written, rc in sorted(bad):
        yield f"{written!r} was requested and is not a valid name (rcl's error {rc}): a bug of the program"


def _entries(seen: Sequence[_Seen]) -> Iterable[LearntEndpoint]:
    observations = [observation_of(each.node, each.run.id) for each in seen]
    origins = origins_of(observations)
    done: set[object] = set()
    for name, origin in origins.items():
        key = (name.kind, name.type, origin.source) if origin.source else name
        if key in done:
            continue
        done.add(key)
        same = [other for other, o in origins.items() if origin.source and o.source == origin.source]
        proven = any(origins[other].proven for other in same)
        yield _entry(name, origin._replace(proven=proven), {name, *same}, seen)


def _entry(name: Name, origin: NameOrigin, names: set[Name], seen: Sequence[_Seen]) -> LearntEndpoint:
    askers = [
        (endpoint, each.run.id)
        for each in seen
        for endpoint in each.node.endpoints
        if _name(endpoint) in names
    ]
    runs = tuple(dict.fromkeys(run for _, run in askers))
    first = next(endpoint for endpoint, _ in askers if _name(endpoint) == name)
    introspected = any(endpoint.introspected for endpoint, _ in askers)
    moved_from = first.written if first.moved else ""
    return LearntEndpoint(
        name.kind,
        name.name,
        name.type or f"unknown/{name.kind.type_folder}/Unknown",
        _common([endpoint.qos for endpoint, _ in askers]),
        runs,
        origin,
        introspected,
        moved_from,
        () if origin.source else first.spellings,
        () if origin.source else first.readings,
        tuple(sorted(each.name for each in names if each != name and each[::2] == name[::2])),
    )


def _common(qualities: Sequence[tuple[int, ...]]) -> tuple[int, ...]:
    first = qualities[0]
    if any(len(each) != len(first) for each in qualities):
        return ()
    return tuple(values[0] if len(set(values)) == 1 else 0 for values in zip(*qualities, strict=True))


def observation_of(node: RequestedNode, run: str = "") -> Observation:
    """Return what ``node`` was given, and the names that it requested."""
    names = frozenset(_name(endpoint) for endpoint in node.endpoints if endpoint.rc in (0, 1))
    inputs = {**node.start.parameters, **arguments_as_inputs(node.start.arguments)}
    defaults = {
        n: value for n, value in node.declared.items() if n not in inputs and isinstance(value, str | int)
    }
    return Observation(inputs, names, run, defaults)


def _name(endpoint: RequestedEndpoint) -> Name:
    return Name(endpoint.kind, endpoint.name, endpoint.type)


def with_readings(nodes: Sequence[RequestedNode]) -> list[RequestedNode]:
    """Return ``nodes``, all of one program, whose endpoints have the likeliest name and the others as ``readings``."""
    found = [[_readings(endpoint, node) for endpoint in node.endpoints] for node in nodes]
    places: dict[str, set[str]] = {}
    for node, of_node in zip(nodes, found, strict=True):
        for reading in (reading for readings in of_node for reading in readings):
            places.setdefault(reading, set()).add(node.fqn)
    return [
        node._replace(
            endpoints=tuple(
                endpoint._replace(name=likeliest, readings=tuple(others))
                for endpoint, readings in zip(node.endpoints, of_node, strict=True)
                for likeliest, *others in [_left(readings, node, places)]
            )
        )
        for node, of_node in zip(nodes, found, strict=True)
    ]


def _readings(endpoint: RequestedEndpoint, node: RequestedNode) -> tuple[str, ...]:
    namespace, own_name = split_fqn(node.fqn)
    texts = set(_texts(node))
    if endpoint.moved or endpoint.spellings or endpoint.name in texts:
        return (endpoint.name,)
    if endpoint.name.startswith("~/") and endpoint.written.startswith(f"{own_name}/") and own_name in texts:
        return endpoint.written, endpoint.name
    below = endpoint.name.removeprefix(f"{namespace}/")
    if namespace == "/" or below == endpoint.name or endpoint.name != endpoint.written or node.namespace:
        return (endpoint.name,)
    named_by_a_value = not texts.isdisjoint(namespace.split("/"))
    return (endpoint.name, below) if named_by_a_value else (below, endpoint.name)


def _texts(node: RequestedNode) -> Iterable[str]:
    for value in (*node.start.parameters.values(), *node.declared.values()):
        yield from (
            each for each in (value if isinstance(value, list | tuple) else (value,)) if isinstance(each, str)
        )
    yield from node.start.arguments


def _left(readings: tuple[str, ...], node: RequestedNode, places: Mapping[str, Set[str]]) -> tuple[str, ...]:
    """Return those of ``readings`` that also hold in another place, if one does."""
    return tuple(each for each in readings if len(readings) == 1 or places[each] - {node.fqn}) or readings
