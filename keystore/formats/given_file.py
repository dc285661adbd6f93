"""Read a file that the user named: a certificate, a key, a request, YAML."""

from __future__ import annotations

from pathlib import Path

from enclave_common.files import read_bytes
from enclave_common.terminal import quoted
from keystore.errors import InvalidInputError

MAX_BYTES = 200_000


def read_given(path: Path) -> bytes:
    """Read its bytes; raises InvalidInputError for what cannot be read, or is larger than ``MAX_BYTES``."""
    try:
        return read_bytes(path, MAX_BYTES)
    except OSError as error:
        raise InvalidInputError(f"cannot read {quoted(path)}: {error.strerror}") from None
