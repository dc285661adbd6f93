"""Lists of nodes in both sizes, and bytes that are no list."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from enclave_addons.observation.graph.discovery_info import ListedNode, ParticipantList, decode

GUIDS = st.binary(min_size=16, max_size=16)
TOKENS = st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,9}", fullmatch=True)
FQNS = st.lists(TOKENS, min_size=1, max_size=3).map(lambda tokens: "/" + "/".join(tokens))
NODES = st.lists(st.tuples(FQNS, st.lists(GUIDS, max_size=3), st.lists(GUIDS, max_size=3)), max_size=3)


def encoded(
    participant: bytes, nodes: list[tuple[str, list[bytes], list[bytes]]], size: int, order: str = "<"
) -> bytes:
    """As rmw_dds_common's type support writes it."""
    data = bytearray(participant + bytes(size - 16))

    def number(value: int) -> None:
        data.extend(bytes(-len(data) % 4) + struct.pack(f"{order}I", value))

    def text(value: str) -> None:
        number(len(value) + 1)
        data.extend(value.encode() + b"\0")

    number(len(nodes))
    for fqn, *entities in nodes:
        namespace, _, name = fqn.rpartition("/")
        text(namespace or "/")
        text(name)
        for guids in entities:
            number(len(guids))
            for guid in guids:
                data.extend(guid + bytes(size - 16))
    return bytes([0, order == "<", 0, 0]) + bytes(data) + bytes(-len(data) % 4)


@given(GUIDS, NODES, st.sampled_from([16, 24]), st.sampled_from("<>"))
def test_what_was_written_is_read_in_either_size_and_byte_order(
    participant: bytes, nodes: list[tuple[str, list[bytes], list[bytes]]], size: int, order: str
) -> None:
    listed = decode(encoded(participant, nodes, size, order))
    assert listed is not None
    assert listed.participant == participant.hex()
    assert listed.nodes == tuple(
        ListedNode(fqn, tuple(r.hex() for r in readers), tuple(w.hex() for w in writers))
        for fqn, readers, writers in nodes
    )


def test_a_message_of_24_is_not_taken_for_one_of_16_without_nodes() -> None:
    """What a generated decoder of the other size makes of it, without an error."""
    guid = bytes(range(1, 17))
    nodes: list[tuple[str, list[bytes], list[bytes]]] = [("/talker", [], [guid])]
    assert decode(encoded(guid, nodes, 24)) == ParticipantList(
        guid.hex(), (ListedNode("/talker", (), (guid.hex(),)),), 24
    )
    assert decode(encoded(guid, [], 24)) == ParticipantList(guid.hex(), (), 24)


GOOD = encoded(bytes(range(1, 17)), [("/a/b", [bytes(16)], [])], 16)
BAD = {
    "nothing": b"",
    "a header alone": GOOD[:4],
    "cut": GOOD[:-5],
    "bytes behind its end": GOOD + b"abcd",
    "an encoding that is not CDR": b"\x00\x03\x00\x00" + GOOD[4:],
    "more nodes than there are bytes": GOOD[:20] + struct.pack("<I", 1 << 31) + GOOD[24:],
    "a name that no node can have": GOOD.replace(b"b\0", b"\x1b\0"),
}


@pytest.mark.parametrize("message", BAD.values(), ids=BAD.keys())
def test_what_is_not_a_list_to_the_last_byte_is_none(message: bytes) -> None:
    assert decode(message) is None


@given(st.binary(max_size=200))
def test_no_bytes_break_it(message: bytes) -> None:
    decode(message)
    decode(b"\x00\x01\x00\x00" + message)
