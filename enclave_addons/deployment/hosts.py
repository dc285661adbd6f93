"""Read the hosts file, which says to which host an enclave or a node belongs, and what a node needs there.

docs/deployment.md shows the file. Enclaves and nodes are names or fnmatch patterns (``*`` also covers further ``/``). A
name that is written out takes precedence over patterns. If the patterns of two hosts match, or both write a name out,
that is an error: nobody should have to know which line wins.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple, Optional

from pydantic import Field, StrictBool, StrictStr

from enclave_common.strict_yaml import Strict, StrictDocument
from enclave_common.terminal import quoted
from keystore.errors import InvalidInputError
from keystore.formats.bundle import refuse_host_name as refuse_host_name
from keystore.formats.given_file import read_given
from keystore.formats.given_yaml import parse_given

_MEMORY = re.compile(r"[1-9][0-9]{0,6}[KMG]i\Z")
_DEVICE = re.compile(r"/dev/[A-Za-z0-9._/-]+\Z")
_GROUP = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_-]{0,31}\Z")


# Only what pydantic 1.8 and 2 have in common, see strict_yaml.
class HostPatterns(Strict, frozen=True):
    """Patterns of what belongs on one host."""

    enclaves: list[StrictStr] = Field(default_factory=list)
    nodes: list[StrictStr] = Field(default_factory=list)


class Needs(Strict, frozen=True):
    """What a process needs of its host beyond the network.

    Attributes:
        memory: Its limit, such as ``256Mi``.
        groups: Names or numbers of supplementary groups, such as those of the devices.
    """

    devices: list[StrictStr] = Field(default_factory=list)
    realtime: StrictBool = False
    writable_code: StrictBool = False
    memory: Optional[StrictStr] = None
    groups: list[StrictStr] = Field(default_factory=list)


class NodeNeeds(Needs, frozen=True):
    """What the named nodes need of the host they run on."""

    nodes: list[StrictStr]


class HostsDocument(StrictDocument, frozen=True):
    """Content of a hosts file."""

    hosts: dict[StrictStr, HostPatterns] = Field(default_factory=dict)
    needs: list[NodeNeeds] = Field(default_factory=list)


class Hosts(NamedTuple):
    """The contents of a hosts file, hosts by their names. ``where`` names it in errors."""

    hosts: Mapping[str, HostPatterns] = MappingProxyType({})
    needs: Sequence[NodeNeeds] = ()
    where: str = "the hosts file"

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the hosts."""
        return tuple(self.hosts)

    def of_enclave(self, enclave: str) -> str | None:
        """Return the host of ``enclave``, None if there is none. Raises InvalidInputError if there are several."""
        return self._of("enclave", enclave, {host: one.enclaves for host, one in self.hosts.items()})

    def of_node(self, node: str) -> str | None:
        """Return the host of a fully qualified node name, as ``of_enclave`` does."""
        return self._of("node", node, {host: one.nodes for host, one in self.hosts.items()})

    def needs_of(self, nodes: Iterable[str]) -> Needs:
        """Return what the nodes of one process need together; the last matching ``memory`` counts."""
        names = list(nodes)
        found = [
            entry
            for entry in self.needs
            if any(fnmatchcase(name, pattern) for name in names for pattern in entry.nodes)
        ]
        return Needs(
            devices=sorted({device for one in found for device in one.devices}),
            realtime=any(one.realtime for one in found),
            writable_code=any(one.writable_code for one in found),
            memory=next((one.memory for one in reversed(found) if one.memory is not None), None),
            groups=sorted({group for one in found for group in one.groups}),
        )

    def _of(self, what: str, name: str, patterns: Mapping[str, list[str]]) -> str | None:
        exact = [host for host, listed in patterns.items() if name in listed]
        fitting = exact or [
            host for host, listed in patterns.items() if any(fnmatchcase(name, one) for one in listed)
        ]
        if len(fitting) > 1:
            raise InvalidInputError(
                f"{self.where}: {what} {name} belongs to several hosts: {', '.join(fitting)}; "
                "write the name out for one of them, or make the patterns narrower"
            )
        return fitting[0] if fitting else None


def load_hosts(path: Path) -> Hosts:
    """Read a hosts file. Raises InvalidInputError naming the file and the line or the entry."""
    return parse_hosts(read_given(path), str(path))


def parse_hosts(text: bytes, where: str) -> Hosts:
    """Return what ``load_hosts`` returns, from the file's content."""
    document = parse_given(HostsDocument, text, where)
    for name in document.hosts:
        refuse_host_name(name, where)
    for needs in document.needs:
        _check(needs, where)
    return Hosts(document.hosts, document.needs, where)


def _check(one: Needs, where: str) -> None:
    if one.memory is not None and not _MEMORY.match(one.memory):
        raise InvalidInputError(f"{where}: memory: {quoted(one.memory)} is not a size such as 256Mi")
    for device in one.devices:
        if not _DEVICE.match(device) or ".." in device:
            raise InvalidInputError(f"{where}: devices: {quoted(device)} is not a path below /dev")
    for group in one.groups:
        if not _GROUP.match(group):
            raise InvalidInputError(f"{where}: groups: {quoted(group)} is not a group's name or number")
