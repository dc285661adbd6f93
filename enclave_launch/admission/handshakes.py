"""Which enclaves of a launch cannot authenticate each other because one runs on Fast DDS and one on Cyclone DDS. Pure.

Measured on Cyclone DDS 0.10.2 with Fast DDS 2.9.1: where the Fast participant has the smaller GUID and so begins the
handshake, Cyclone refuses each attempt for ever. The beginning of a GUID follows from the subject, so the pairs are
known beforehand, and a subject that is chosen well avoids them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from enclave_launch.admission.middleware import Vendor
from enclave_launch.boundary.named_tuple import NamedTuple
from keystore.formats.subject import Half, guid_prefix


class EnclaveProcess(NamedTuple):
    """A process of an enclave: whose DDS it runs on, in which domain."""

    enclave: str
    domain: int
    vendor: Vendor | None


class Pair(NamedTuple):
    """``fast`` and ``cyclone`` are enclaves. Of one and the same enclave chance decides."""

    fast: str
    cyclone: str


def mixed_pairs(members: Iterable[EnclaveProcess]) -> tuple[Pair, ...]:
    """Every pair of enclaves with a Fast and a Cyclone process in one domain, sorted."""
    everybody = tuple(members)
    pairs = {
        Pair(one.enclave, other.enclave)
        for one in everybody
        if one.vendor is Vendor.FAST
        for other in everybody
        if other.vendor is Vendor.CYCLONE and other.domain == one.domain
    }
    return tuple(sorted(pairs))


def failing(pairs: Iterable[Pair], subjects: Mapping[str, str]) -> Iterator[Pair]:
    """Those that never authenticate, or only by chance. ``subjects``: common name by enclave; a pair of which one is
    not known counts as good."""
    for pair in pairs:
        fast, cyclone = subjects.get(pair.fast), subjects.get(pair.cyclone)
        if pair.fast == pair.cyclone or (fast and cyclone and guid_prefix(fast) <= guid_prefix(cyclone)):
            yield pair


def halves(pairs: Iterable[Pair]) -> dict[str, Half]:
    """Where each enclave should sort so that Cyclone begins every handshake; none for enclaves of both."""
    found = tuple(pair for pair in pairs if pair.fast != pair.cyclone)
    fast, cyclone = {pair.fast for pair in found}, {pair.cyclone for pair in found}
    return {
        **dict.fromkeys(fast - cyclone, Half.HIGH),
        **dict.fromkeys(cyclone - fast, Half.LOW),
    }
