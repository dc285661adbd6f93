"""Middlewares: which read enclaves, and which two cannot authenticate each other.

rcl hands every middleware the path of the enclave; what it does with it is its own business.

Sources: rmw_cyclonedds_cpp ``rmw_node.cpp``, rmw_fastrtps_shared_cpp ``participant.cpp``, rmw_connextdds
``rmw_context.cpp`` (all three set DDS-Security properties from the enclave); rmw_zenoh_cpp reads none and is
secured by a configuration that the keystore has for the enclave, and by its router.

Measured on Cyclone DDS 0.10.2 with Fast DDS 2.9.1: where the Fast participant has the smaller GUID and so begins the
handshake, Cyclone refuses each attempt for ever. The beginning of a GUID follows from the subject, so the pairs are
known beforehand, and a subject that is chosen well avoids them.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from enum import Enum
from typing import NamedTuple

from enclave_common.dependencies import absence
from keystore.formats.subject import Half, guid_prefix

VARIABLE = "RMW_IMPLEMENTATION"
DEFAULT = "rmw_fastrtps_cpp"


class Vendor(str, Enum):
    """The vendor of a DDS; decides who can authenticate whom."""

    __str__ = str.__str__

    CYCLONE = "Cyclone DDS"
    FAST = "Fast DDS"
    CONNEXT = "RTI Connext"


HONOURS_ENCLAVES: dict[str, Vendor] = {
    "rmw_cyclonedds_cpp": Vendor.CYCLONE,
    "rmw_fastrtps_cpp": Vendor.FAST,
    "rmw_fastrtps_dynamic_cpp": Vendor.FAST,
    "rmw_connextdds": Vendor.CONNEXT,
}
ZENOH = "rmw_zenoh_cpp"
_NO_ENCLAVES = {
    "rmw_iceoryx_cpp": "it reads no enclaves and has no security of its own",
    "rmw_email_cpp": "it reads no enclaves and has no security of its own",
}


def middleware_of(environment: Mapping[str, str]) -> str:
    """Return the middleware that a process loads (rmw_implementation functions.cpp: an empty variable is unset)."""
    return environment.get(VARIABLE) or DEFAULT


def vendor_of(middleware: str) -> Vendor | None:
    """Return the DDS vendor of an ``RMW_IMPLEMENTATION`` that honours enclaves, None for any other."""
    return HONOURS_ENCLAVES.get(middleware)


def zenoh_absence() -> str:
    """Return what to do if the add-on that secures Zenoh is not installed, empty if it is."""
    return absence("enclave_addons.zenoh")


def why_not(middleware: str, accepted: Collection[str] = ()) -> str | None:
    """Return why a process with ``middleware`` must not start in an enclave, None if it may."""
    if middleware in HONOURS_ENCLAVES:
        return None
    if middleware == ZENOH:
        return zenoh_absence() or None
    if middleware in _NO_ENCLAVES:
        return _NO_ENCLAVES[middleware]
    return None if middleware in accepted else "it is not known to read enclaves"


class EnclaveProcess(NamedTuple):
    """A process of an enclave: whose DDS it runs on, in which domain."""

    enclave: str
    domain: int
    vendor: Vendor | None


class Pair(NamedTuple):
    """Two enclaves on two DDS implementations in one domain. ``fast`` and ``cyclone`` are enclaves. Of one and the
    same enclave chance decides."""

    fast: str
    cyclone: str


def mixed_pairs(members: Iterable[EnclaveProcess]) -> tuple[Pair, ...]:
    """Return every pair of enclaves with a Fast and a Cyclone process in one domain, sorted."""
    enclaves: dict[tuple[Vendor | None, int], set[str]] = {}
    for one in members:
        enclaves.setdefault((one.vendor, one.domain), set()).add(one.enclave)
    pairs = {
        Pair(fast, cyclone)
        for (vendor, domain), found in enclaves.items()
        if vendor is Vendor.FAST
        for cyclone in enclaves.get((Vendor.CYCLONE, domain), ())
        for fast in found
    }
    return tuple(sorted(pairs))


def failing(pairs: Iterable[Pair], subjects: Mapping[str, str]) -> Iterator[Pair]:
    """Yield the pairs that never authenticate, or only by chance.

    :param subjects: common name by enclave; a pair with an unknown one is assumed to work"""
    for pair in pairs:
        fast, cyclone = subjects.get(pair.fast), subjects.get(pair.cyclone)
        if pair.fast == pair.cyclone or (fast and cyclone and guid_prefix(fast) <= guid_prefix(cyclone)):
            yield pair


def guid_halves(members: Iterable[EnclaveProcess]) -> dict[str, Half]:
    """Return where each enclave should sort so that Cyclone begins every handshake; none for enclaves of both."""
    found = tuple(pair for pair in mixed_pairs(members) if pair.fast != pair.cyclone)
    fast, cyclone = {pair.fast for pair in found}, {pair.cyclone for pair in found}
    return {**dict.fromkeys(fast - cyclone, Half.HIGH), **dict.fromkeys(cyclone - fast, Half.LOW)}
