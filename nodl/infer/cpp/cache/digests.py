"""SHA-256 of values and of files. Reads files."""

from __future__ import annotations

import hashlib

from enclave_launch.boundary.files import read_bytes


def digest(*parts: object) -> str:
    """Of anything whose ``repr`` says all of it."""
    return digest_of_content(repr(parts).encode("utf-8", "surrogatepass"))


def digest_of(path: str) -> str:
    """Of a file's content; of one that cannot be read, that it cannot."""
    try:
        return digest_of_content(read_bytes(path))
    except OSError as error:
        return f"unreadable: {error.errno}"


def digest_of_content(content: bytes) -> str:
    """SHA-256 of bytes, in hexadecimal."""
    return hashlib.sha256(content).hexdigest()
