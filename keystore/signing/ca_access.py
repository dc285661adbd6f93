"""How to get at the keys of the CAs: where passphrase and PIN are, never what they are; read to sign."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from enclave_common.terminal import quoted
from keystore.errors import InvalidInputError

_PR_SET_DUMPABLE = 4
_MAX_SECRET = 1023  # what OpenSSL takes for an encrypted key


class Secret:
    """A passphrase or PIN by reference: exactly one of a file, an open descriptor or an environment variable.

    Never given on the command line, where every user of the machine could read it.
    """

    def __init__(
        self, file: Path | None = None, descriptor: int | None = None, variable: str | None = None
    ) -> None:
        self.file = file
        self.descriptor = descriptor
        self.variable = variable
        self._read: bytes | None = None

    def __repr__(self) -> str:
        return f"Secret({self._place()})"

    @property
    def is_given(self) -> bool:
        return (self.file, self.descriptor, self.variable) != (None, None, None)

    def value(self) -> bytes:
        """Return the secret without its trailing newline, read once; raises InvalidInputError."""
        if self._read is None:
            keep_memory_private()
            self._read = self._fetch()
        return self._read

    def _fetch(self) -> bytes:
        try:
            if self.file is not None:
                with open(self.file, "rb") as stream:  # a pipe, too: that is how a shell hands secrets over
                    content = stream.read(_MAX_SECRET + 3)
            elif self.descriptor is not None:
                content = _read_all(self.descriptor)
            else:
                content = os.fsencode(os.environ[self.variable or ""])
        except (OSError, KeyError, ValueError, OverflowError) as error:
            reason = error.strerror if isinstance(error, OSError) else "not set"
            raise InvalidInputError(f"cannot read the passphrase from {self._place()}: {reason}") from None
        content = content.removesuffix(b"\n").removesuffix(b"\r")
        if not content or len(content) > _MAX_SECRET:
            raise InvalidInputError(f"the passphrase in {self._place()} is empty or over {_MAX_SECRET} bytes")
        return content

    def _place(self) -> str:
        if self.file is not None:
            return quoted(self.file)
        return f"descriptor {self.descriptor}" if self.descriptor is not None else f"${self.variable}"


def keep_memory_private() -> None:
    """Disable core dumps of this process and reading of its memory by the same user (prctl(2), Linux only)."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_DUMPABLE, 0, 0, 0, 0)


def _read_all(descriptor: int) -> bytes:
    # A pipe may give the secret in pieces.
    content = b""
    while len(content) <= _MAX_SECRET + 2 and (piece := os.read(descriptor, _MAX_SECRET + 3)):
        content += piece
    return content


class CaAccess(NamedTuple):
    """For every function that signs. ``environment``: where ``PKCS11_MODULE_PATH`` is looked up when a
    ``pkcs11:`` URI names no module."""

    passphrase: Secret | None = None
    pin: Secret | None = None
    environment: Mapping[str, str] = os.environ

    def __repr__(self) -> str:
        return f"CaAccess(passphrase={self.passphrase}, pin={self.pin})"
