"""Which of the keystore's two CAs. Its own module, because every path of a keystore is named after one."""

from __future__ import annotations

from enum import Enum


class Role(str, Enum):
    """Which CA; the value is the stem of its file names."""

    IDENTITY = "identity_ca"
    PERMISSIONS = "permissions_ca"

    @property
    def use(self) -> str:
        """Return what it certifies: ``identity`` or ``permissions``."""
        return self.value.removesuffix("_ca")

    @property
    def label(self) -> str:
        """Return the words for a message: ``identity CA``."""
        return f"{self.use} CA"
