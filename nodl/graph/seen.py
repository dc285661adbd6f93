"""Participants and endpoints as DDS discovery announced them: claims of whoever sent them. Pure."""

from __future__ import annotations

import re
from typing import NamedTuple

from nodl.graph.quality import Quality

_ENCLAVE = re.compile(r"(?:\A|;)enclave=([^;]*);")
_PREFIX_DIGITS = 24  # 12 bytes of a GUID are the participant's, the last 4 the entity's
_HASH_DIGITS = 12


class SeenParticipant(NamedTuple):
    """``guid``: 32 hexadecimal digits. ``enclave`` is what it says in clear; ``pid`` is of its own pid namespace, and
    ``None`` where it does not say; ``own_history``: it announces how much it keeps (Cyclone DDS)."""

    guid: str
    enclave: str = ""
    pid: int | None = None
    host: str = ""
    program: str = ""
    own_history: bool = False

    @property
    def prefix(self) -> str:
        return self.guid[:_PREFIX_DIGITS]

    @property
    def claims_security(self) -> bool:
        """Its GUID begins as DDS-Security 9.3.3 makes it of a certificate: the highest bit is set. Unsecured ones
        begin with the vendor's number. Peers that authenticate it have verified that."""
        return int(self.guid[:2], 16) & 0x80 != 0

    @property
    def subject_hash(self) -> int:
        """The first 48 bits of its GUID: of a secured one a hash of the certificate's subject."""
        return int(self.guid[:_HASH_DIGITS], 16)


class SeenEndpoint(NamedTuple):
    """One writer or reader; ``participant`` is a GUID."""

    guid: str
    participant: str
    writes: bool
    topic: str
    type: str
    quality: Quality = Quality()


def claimed_enclave(user_data: bytes) -> str:
    """The enclave that rmw writes into the participant's user data (``enclave=/x;``); empty for none."""
    match = _ENCLAVE.search(user_data.decode("utf-8", "replace"))
    return match[1] if match else ""
