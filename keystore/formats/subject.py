"""Enclave name -> subject of its certificate and grant, what of it can be borrowed, where it sorts. Performs no I/O.

Cyclone DDS compares subjects as bags: it cuts both names at ``, / |``, and a grant fits an identity when
every piece of the identity occurs in the grant (access_control_utils.c, unchanged on master). With SROS2's
``CN=/talker`` the identity ``/talker`` may therefore use the permissions of ``/robot/talker``, and ``/``
those of everyone. Our common names contain none of these separators: each is one piece and fits only itself.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Mapping
from enum import Enum

from enclave_common.words import counted

# X.520 ub-common-name; cryptography >= 43 enforces it.
MAX_COMMON_NAME = 64
_SEPARATORS = "[,/|]"
_GENERATION = re.compile(r"[1-9][0-9]{0,8}\Z")


class SubjectScheme(str, Enum):
    """How the common name is made from the enclave name."""

    EXACT = "exact"  # ros.front.camera: fits one grant only
    COMPATIBLE = "compatible"  # /front/camera: as SROS2, needed by `ros2 security create_permission`


def common_name(enclave: str, scheme: SubjectScheme = SubjectScheme.EXACT, generation: int = 1) -> str:
    """Return the CN of a valid enclave name, at most 64 characters, different for different names and generations.

    ``/front/camera`` becomes ``ros.front.camera``, the root ``ros``; from the second generation on with its number:
    ``ros.front.camera-2``. Longer names become ``ros-`` + 160 bits of SHA-256 + ``-`` + their last characters; ``-``
    cannot occur in a name, so no two of these ever meet.

    A new generation is what keeps old permissions from matching: both implementations match a grant by its subject.
    """
    numbered = enclave if generation == 1 else f"{enclave}-{generation}"
    if scheme is SubjectScheme.COMPATIBLE:
        return numbered if len(numbered) <= MAX_COMMON_NAME else _short(numbered)
    plain = "ros" + (numbered.removeprefix("/") if enclave == "/" else numbered.replace("/", "."))
    return plain if len(plain) <= MAX_COMMON_NAME else _short(numbered)


def generation_of(cn: str) -> int:
    """Return the generation that a common name of ``common_name`` has; 1 for all others."""
    digits = cn.rpartition("-")[2]
    return int(digits) if "-" in cn and _GENERATION.match(digits) else 1


def names_enclave(cn: str | None, enclave: str) -> bool:
    """Return whether ``cn`` is a common name that ``enclave`` can have, in any scheme and generation."""
    if cn is None:
        return False
    generation = generation_of(cn)
    return cn == enclave or any(cn == common_name(enclave, scheme, generation) for scheme in SubjectScheme)


def _short(enclave: str) -> str:
    head = f"ros-{hashlib.sha256(enclave.encode()).hexdigest()[:40]}-"
    return head + enclave.replace("/", ".")[-(MAX_COMMON_NAME - len(head)) :].lstrip(".")


def subject_name(cn: str) -> str:
    """Return ``subject_name`` of a grant for this common name: both implementations match exactly this form."""
    return f"CN={cn}"


def scheme_of(cn: str) -> SubjectScheme:
    """Return which scheme a certificate's common name follows: SROS2's is the enclave's path."""
    return SubjectScheme.COMPATIBLE if cn.startswith("/") else SubjectScheme.EXACT


def pieces(cn: str) -> frozenset[tuple[str, str]]:
    """Return the bag Cyclone compares: non-empty pieces between separators, each cut at its first ``=``."""
    cut = (piece.partition("=") for piece in re.split(_SEPARATORS, subject_name(cn)) if piece)
    return frozenset((key, value) for key, _, value in cut)


def borrowable(names: Mapping[str, str]) -> list[tuple[str, str]]:
    """Return sorted pairs (borrower, lender) of enclaves whose CNs let Cyclone accept the lender's grant."""
    bags = {enclave: pieces(cn) for enclave, cn in names.items()}
    open_ones = {enclave: bag for enclave, bag in bags.items() if re.search(_SEPARATORS, names[enclave])}
    by_bag: dict[frozenset[tuple[str, str]], list[str]] = {}
    for enclave, bag in bags.items():
        by_bag.setdefault(bag, []).append(enclave)
    pairs = {(a, b) for group in by_bag.values() for a in group for b in group if a != b}
    pairs |= {
        (a, b) for a, bag in open_ones.items() for b, lent in open_ones.items() if a != b and bag <= lent
    }
    return sorted(pairs)


def indistinguishable(pairs: Iterable[tuple[str, str]], limit: int = 3) -> str:
    """Name the first few pairs in one sentence."""
    listed = list(pairs)
    shown = ", ".join(f"{a} could use the permissions of {b}" for a, b in listed[:limit])
    return shown + (f" and {counted(len(listed) - limit, 'more pair')}" if len(listed) > limit else "")


class Half(Enum):
    """Of all GUID prefixes: of two participants the one with the smaller GUID begins the handshake. One subject in two
    lies in each half."""

    LOW = "low"
    HIGH = "high"


def guid_prefix(common_name: str) -> int:
    """Return the first 48 bits of the GUID of every secured participant whose certificate has this subject.

    DDS-Security 9.3.3 makes them from a hash of it, so they are known before anything runs (measured on both
    implementations).
    """
    digest = hashlib.sha256(_subject(common_name)).digest()
    return (int.from_bytes(digest[:6], "big") >> 1) | 1 << 47


def half_of(common_name: str) -> Half:
    """Return in which half the GUID prefix lies that a participant with this certificate must have."""
    return Half.HIGH if guid_prefix(common_name) & 1 << 46 else Half.LOW


def _subject(common_name: str) -> bytes:
    """Returns the DER of a name with this common name alone, as certificates of a keystore have it."""
    from cryptography import x509  # a dry run does without

    return x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, common_name)]).public_bytes()
