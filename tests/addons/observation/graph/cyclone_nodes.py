"""Nodes on Cyclone DDS as rmw makes them, by command; see ``nodes.py`` for the commands.

Run by path, as a process of its own: ``python cyclone_nodes.py DOMAIN ENCLAVE GID_SIZE [ENCLAVE_DIRECTORY]``.
"""

from __future__ import annotations

import struct
import sys
from pathlib import Path
from typing import Any

DEMO_NODES = Path(__file__).parents[4] / "fixtures" / "demo_ws" / "lib" / "demo_nodes"
sys.path.insert(0, str(DEMO_NODES))

from cyclonedds.core import Entity, Listener  # noqa: E402, F401
from cyclonedds.domain import Domain, DomainParticipant  # noqa: E402
from cyclonedds.pub import DataWriter  # noqa: E402
from cyclonedds.qos import Policy, Qos  # noqa: E402
from cyclonedds.sub import DataReader  # noqa: E402
from cyclonedds.topic import Topic  # noqa: E402
from cyclonedds.util import duration  # noqa: E402
from demo_rcl.messages import opaque  # noqa: E402
from demo_rcl.node import LOOPBACK_ONLY  # noqa: E402
from demo_rcl.security import SecurityOptions  # noqa: E402

LIST_TYPE: Any = opaque("rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_")
LATCHED = Qos(
    Policy.Reliability.Reliable(duration(seconds=1)),
    Policy.History.KeepLast(1),
    Policy.Durability.TransientLocal,
)


def quality(words: list[str]) -> Qos:
    policies: list[Any] = [
        Policy.Reliability.BestEffort
        if "best_effort" in words
        else Policy.Reliability.Reliable(duration(seconds=1)),
        Policy.History.KeepLast(7),
    ]
    if "transient_local" in words:
        policies.append(Policy.Durability.TransientLocal)
    return Qos(*policies)


class Lists:
    """What each node has, and the message that says so."""

    def __init__(self, participant: bytes, gid_size: int) -> None:
        self._participant, self._size = participant, gid_size
        self.nodes: dict[str, tuple[list[bytes], list[bytes]]] = {}

    def message(self) -> bytes:
        self._data = bytearray(self._gid(self._participant))
        self._number(len(self.nodes))
        for fqn, (readers, writers) in self.nodes.items():
            namespace, _, name = fqn.rpartition("/")
            self._text(namespace or "/")
            self._text(name)
            for guids in (readers, writers):
                self._number(len(guids))
                for guid in guids:
                    self._data += self._gid(guid)
        return b"\x00\x01\x00\x00" + bytes(self._data)

    def _gid(self, guid: bytes) -> bytes:
        return guid + bytes(self._size - len(guid))

    def _number(self, value: int) -> None:
        self._data += bytes(-len(self._data) % 4) + struct.pack("<I", value)

    def _text(self, text: str) -> None:
        self._number(len(text) + 1)
        self._data += text.encode() + b"\0"


def main(domain: int, enclave: str, gid_size: int, directory: str = "") -> None:
    options = SecurityOptions(enclave, Path(directory) if directory else None, "")
    policies = [Policy.Property(key, value) for key, value in options.properties().items()]
    keep = Domain(domain, LOOPBACK_ONLY)
    participant = DomainParticipant(domain, Qos(Policy.Userdata(f"enclave={enclave};".encode()), *policies))
    lists = Lists(participant.guid.bytes, gid_size or 16)
    made: dict[tuple[str, str], tuple[Any, list[bytes]]] = {}
    node = ""

    class Raw(LIST_TYPE):  # type: ignore[misc]
        def serialize(self, *_: Any, **__: Any) -> bytes:
            return lists.message()

    # As rmw sends it: without a description of the type.
    LIST_TYPE.__idl__._xt_data, LIST_TYPE.__idl__._xt_bytedata = (LIST_TYPE, LIST_TYPE), (b"", b"")
    publisher = DataWriter(participant, Topic(participant, "ros_discovery_info", LIST_TYPE), LATCHED)
    reader = DataReader(participant, Topic(participant, "ros_discovery_info", LIST_TYPE), LATCHED)
    for line in sys.stdin:
        verb, *words = line.split()
        if verb == "node":
            node = words[0]
            lists.nodes.setdefault(node, ([], []))
        elif verb in ("writer", "reader"):
            topic = Topic(participant, words[0], opaque(words[1]))
            kind = DataWriter if verb == "writer" else DataReader
            entity = kind(participant, topic, quality(words[2:]))
            owned = lists.nodes.setdefault(node, ([], []))[verb == "writer"] if node else []
            owned.append(entity.guid.bytes)
            made[verb, words[0]] = (entity, owned)
        elif verb == "remove":
            entity, owned = made.pop((words[0], words[1]))
            owned.remove(entity.guid.bytes)
            entity._delete(entity._ref)
        elif verb == "list" and gid_size:
            publisher.write(Raw(0))
        elif verb == "end":
            break
        print(f"ok {participant.guid.bytes.hex()}", flush=True)
    del reader, keep


main(int(sys.argv[1]), sys.argv[2], int(sys.argv[3]), *sys.argv[4:5])
