"""Messages of ``ros_discovery_info``: which node of a participant owns which endpoint. Performs no I/O.

Source: ros2/rmw_dds_common, ``ParticipantEntitiesInfo.msg``. Identifiers have 24 bytes up to Humble and 16 since Iron;
a reader generated for 16 takes a message of 24 for one without nodes, so the bytes are read here, strictly.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import NamedTuple, TypeVar

from nodl.names import InvalidNameError, join, validate_namespace, validate_node_name

TYPE_NAME = "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_"
GID_SIZES = (24, 16)

_GUID = 16  # what DDS itself calls things by; more is padding
_LONGEST_NAME = 256
_MOST = 4096  # nodes of a participant, or endpoints of a node
# CDR and XCDR2, big and little endian.
_PLAIN_ENCODINGS = (b"\x00\x00", b"\x00\x01", b"\x00\x06", b"\x00\x07")

Item = TypeVar("Item")


class ListedNode(NamedTuple):
    """A node and the GUIDs, as hexadecimal digits, of what it reads and writes."""

    fqn: str
    readers: tuple[str, ...]
    writers: tuple[str, ...]


class ParticipantList(NamedTuple):
    """The whole state of one participant: ``nodes`` is empty when all have ended."""

    participant: str
    nodes: tuple[ListedNode, ...]
    gid_size: int


def decode(message: bytes) -> ParticipantList | None:
    """Decode ``message`` with its header of four bytes; None for what fits neither size to the last byte."""
    for size in GID_SIZES:
        try:
            return _Decoder(message, size).participant_list()
        except (ValueError, struct.error, IndexError):
            continue
    return None


class _Decoder:
    def __init__(self, message: bytes, gid_size: int) -> None:
        if message[:2] not in _PLAIN_ENCODINGS:
            raise ValueError("encoding")
        self._number_format = "<I" if message[1] & 1 else ">I"
        self._body = message[4:]
        self._at = 0
        self._gid_size = gid_size

    def participant_list(self) -> ParticipantList:
        result = ParticipantList(self._gid(), self._several(self._node), self._gid_size)
        if len(self._body) - self._at > 3:  # the padding of the whole
            raise ValueError("bytes are left")
        return result

    def _node(self) -> ListedNode:
        namespace, name = self._text() or "/", self._text()
        try:
            validate_namespace(namespace)
            validate_node_name(name)
        except InvalidNameError as error:
            raise ValueError(str(error)) from error
        return ListedNode(join(namespace, name), self._several(self._gid), self._several(self._gid))

    def _number(self) -> int:
        self._at += -self._at % 4
        (value,) = struct.unpack_from(self._number_format, self._body, self._at)
        self._at += 4
        return int(value)

    def _gid(self) -> str:
        raw = self._body[self._at : self._at + self._gid_size]
        self._at += self._gid_size
        if len(raw) != self._gid_size or any(raw[_GUID:]):
            raise ValueError("identifier")
        return raw[:_GUID].hex()

    def _text(self) -> str:
        size = self._number()
        if not 1 <= size <= _LONGEST_NAME + 1 or self._body[self._at + size - 1]:
            raise ValueError("string")
        raw = self._body[self._at : self._at + size - 1]
        self._at += size
        return raw.decode("ascii")

    def _several(self, item: Callable[[], Item]) -> tuple[Item, ...]:
        count = self._number()
        if count > _MOST:
            raise ValueError("length")
        return tuple(item() for _ in range(count))
