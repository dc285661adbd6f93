"""The file of a host's bundle: sizes and bytes, and no names. What it holds says the signed manifest alone.

    enclave-launch bundle 1
    SIZE, then the manifest (S/MIME)                                  \\
    SIZE, then the certificates of the permissions CA                  > read before anything is authentic
    SIZE, then who follows that CA (S/MIME), nothing if nobody does   /
    SIZE, then the bytes of each other file, in the order of their names in the manifest

A size is a line of decimal digits. So nothing is left to parse but what the signature needs, and nothing can be added.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from enclave_common.files import read_bytes
from enclave_common.terminal import quoted
from keystore.disk import layout
from keystore.errors import DamagedKeystoreError, storage_errors
from keystore.formats.bundle import Manifest
from keystore.formats.role import Role

MAX_BUNDLE = 256_000_000
"""Bytes; some 20 000 enclaves."""
MAX_FILE = 8_000_000
"""Bytes of one file, as large as a file of a keystore may be."""
_MAGIC = b"enclave-launch bundle 1\n"
_FIRST = (layout.ca_cert(Role.PERMISSIONS), layout.HANDOVER)
_LONGEST_SIZE = len(str(MAX_FILE))


class SealedBundle(NamedTuple):
    """A bundle whose signature is not checked yet. ``authorities``: certificates of the permissions CA; ``handover``:
    empty if no CA follows."""

    place: str
    signed: bytes
    authorities: bytes
    handover: bytes
    content: bytes
    rest: int

    def opened(self, manifest: Manifest) -> dict[str, bytes]:
        """Return path -> bytes of each file of ``manifest``, which the caller authenticated; hashes are not checked.

        Raises DamagedKeystoreError for a bundle that is cut off or longer.
        """
        found = {_FIRST[0]: self.authorities}
        if self.handover:
            found[layout.HANDOVER] = self.handover
        at = self.rest
        for name in sorted(set(manifest.files) - set(_FIRST)):
            found[name], at = _taken(self.content, at, self.place)
        if at != len(self.content):
            raise DamagedKeystoreError(f"{self.place} is longer than its manifest says; copy it again")
        return found


def bundle_bytes(signed: bytes, files: Mapping[str, bytes]) -> bytes:
    """Return the file of a bundle: the signed manifest and the files that it names."""
    others = [files[name] for name in sorted(set(files) - set(_FIRST))]
    parts = [signed, *(files.get(name, b"") for name in _FIRST), *others]
    return _MAGIC + b"".join(b"%d\n%b" % (len(part), part) for part in parts)


def read_bundle(bundle: Path) -> SealedBundle:
    """Read a bundle. Raises DamagedKeystoreError, StorageError."""
    with storage_errors("reading the bundle"):
        content = read_bytes(bundle, MAX_BUNDLE)
    return sealed_bundle(content, quoted(bundle))


def sealed_bundle(content: bytes, place: str) -> SealedBundle:
    """Take the first parts of a bundle apart. Raises DamagedKeystoreError."""
    if not content.startswith(_MAGIC):
        raise DamagedKeystoreError(
            f"{place} is not a host's bundle (secure-keystore export --hosts), or cut off"
        )
    signed, at = _taken(content, len(_MAGIC), place)
    authorities, at = _taken(content, at, place)
    handover, at = _taken(content, at, place)
    return SealedBundle(place, signed, authorities, handover, content, at)


def _taken(content: bytes, at: int, place: str) -> tuple[bytes, int]:
    end = content.find(b"\n", at, at + _LONGEST_SIZE + 1)
    digits = content[at:end] if end > at else b""
    size = int(digits) if digits.isdigit() else -1
    if not 0 <= size <= MAX_FILE or end + 1 + size > len(content):
        raise DamagedKeystoreError(f"{place} is cut off, or was changed; copy it again")
    return content[end + 1 : end + 1 + size], end + 1 + size
