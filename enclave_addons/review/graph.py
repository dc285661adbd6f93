"""A plan as a graph, for pictures: elements go by numbers, so that no name is an identifier in another language."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from enclave_addons.review.document import KIND_OF, OPERATIONS, Kind, fqn_of
from enclave_launch.admission.middleware import ZENOH
from enclave_launch.dry_run import DryRun, Interface, Operation
from keystore.formats.permissions_patterns import has_wildcard

OUTWARD: frozenset[str] = frozenset({"publish", "call_services", "call_actions"})
"""Drawn from the node to the name; the other operations from the name to the node."""

NO_ENCLAVE = ""
"""The group of programs that run without an enclave."""


class NodeMember(NamedTuple):
    """A node in its enclave. ``known`` is false for a program whose interfaces nobody knows: what it may need is a gap.

    ``launched_at``: file and line of the launch file, empty where that is not known.
    """

    name: str
    enclave: str
    program: str
    launched_at: str
    known: bool = True

    @property
    def namespace(self) -> str:
        return self.name.rpartition("/")[0] or "/"


class Channel(NamedTuple):
    """A topic, service or action by its final name, which may hold wildcards."""

    kind: Kind
    name: str
    types: tuple[str, ...]

    @property
    def is_pattern(self) -> bool:
        return has_wildcard(self.name)


class ChannelUse(NamedTuple):
    """The use of one channel by one member, both by number; ``member`` is ``None`` where only the enclave's policy
    says so and no node of it requests it; ``reasons``: the node's interfaces that need it."""

    member: int | None
    enclave: str
    channel: int
    operation: Operation
    reasons: tuple[Interface, ...]

    @property
    def built_in(self) -> bool:
        """Return True if the use has no other reason than that every node has it."""
        return bool(self.reasons) and all(reason.built_in for reason in self.reasons)


class EnclaveGraph(NamedTuple):
    """Everything sorted by name; ``uses`` by enclave, member, operation and name; ``middlewares``: what enforces the
    permissions of an enclave, ``DDS``, ``Zenoh`` or both."""

    enclaves: tuple[str, ...]
    members: tuple[NodeMember, ...]
    channels: tuple[Channel, ...]
    uses: tuple[ChannelUse, ...]
    middlewares: Mapping[str, str]

    def enforcement(self, enclave: str) -> str:
        """Return words to add to a sentence: none for DDS, which is what a reader expects."""
        middleware = self.middlewares[enclave]
        return "" if middleware == "DDS" else f", enforced by {middleware}"


_Key = tuple[str, "int | None", Operation, str]


def plan_graph(document: DryRun, root: str = "") -> EnclaveGraph:
    """Build the graph of enclaves, members and channels of a dry run; ``root``: prefix to strip from paths."""
    members = tuple(sorted(_members(document, root)))
    reasons: dict[_Key, list[Interface]] = dict(_reasons(document, members, root))
    requested = {(enclave, operation, name) for enclave, _, operation, name in reasons}
    for enclave, lists in document.enclaves.items():
        for operation in OPERATIONS:
            for name in getattr(lists, operation):
                if (enclave, operation, name) not in requested:
                    reasons[enclave, None, operation, name] = []
    channels = _channels(reasons)
    number_of = {(channel.kind, channel.name): number for number, channel in enumerate(channels)}
    uses = tuple(
        ChannelUse(member, enclave, number_of[KIND_OF[operation], name], operation, tuple(why))
        for (enclave, member, operation, name), why in sorted(reasons.items(), key=_order)
    )
    enclaves = tuple(sorted(document.enclaves))
    return EnclaveGraph(
        enclaves, members, channels, uses, {path: _middlewares(document, path) for path in enclaves}
    )


def _middlewares(document: DryRun, enclave: str) -> str:
    own = (process for process in document.processes if process.enclave == enclave)
    found = {"Zenoh" if process.middleware == ZENOH else "DDS" for process in own}
    return " and ".join(sorted(found)) or "DDS"


def _order(item: tuple[_Key, list[Interface]]) -> tuple[str, int, int, str]:
    enclave, member, operation, name = item[0]
    return enclave, -1 if member is None else member, OPERATIONS.index(operation), name


def short_path(path: str, root: str) -> str:
    """Strip ``root`` from ``path``, which may end in a line number."""
    return path.removeprefix(os.path.join(root, "")) if root.strip("/") else path


def _members(document: DryRun, root: str) -> Iterator[NodeMember]:
    places = {fqn_of(item): short_path(item.place, root) for item in document.launched if item.fqn}
    for node in document.nodes:
        yield NodeMember(node.fqn, node.enclave, node.program, places.get(node.fqn, ""))
    for path, enclave in document.enclaves.items():
        for name in enclave.permissions_unknown:
            yield NodeMember(name, path, "interfaces unknown", places.get(name, ""), known=False)
    for process in document.processes:
        if process.enclave is None:
            name = process.fqn or process.executable
            yield NodeMember(name, NO_ENCLAVE, "runs unsecured", short_path(process.place, root), known=False)


def _reasons(
    document: DryRun, members: tuple[NodeMember, ...], root: str
) -> Iterator[tuple[_Key, list[Interface]]]:
    number_of = {
        (member.enclave, member.name): number for number, member in enumerate(members) if member.known
    }
    for node in document.nodes:
        found: dict[_Key, list[Interface]] = {}
        for item in node.interfaces:
            key = (node.enclave, number_of[node.enclave, node.fqn], item.operation, item.name)
            found.setdefault(key, []).append(_reason(item, root))
        yield from found.items()


def _reason(item: Interface, root: str) -> Interface:
    rules = (rule.rpartition(" at ") for rule in item.remapped_by)
    remapped_by = [f"{rule}{at}{short_path(origin, root)}" for rule, at, origin in rules]
    return item.changed(place=short_path(item.place, root), remapped_by=remapped_by)


def _channels(reasons: Mapping[_Key, list[Interface]]) -> tuple[Channel, ...]:
    types: dict[tuple[Kind, str], set[str]] = {}
    for (_, _, operation, name), why in reasons.items():
        types.setdefault((KIND_OF[operation], name), set()).update(
            reason.type for reason in why if reason.type
        )
    return tuple(sorted(Channel(kind, name, tuple(sorted(found))) for (kind, name), found in types.items()))


def evidence_text(reason: Interface) -> str:
    """Format a reason as ``talker.nodl.xml:4; written chatter; remapped by chatter:=conversation at
    f.launch.xml:7``."""
    parts = [reason.place]
    if reason.written:
        parts.append(f"written {reason.written}")
    parts += [f"remapped by {rule}" for rule in reason.remapped_by]
    if reason.note:
        parts.append(reason.note)
    return "; ".join(parts)
