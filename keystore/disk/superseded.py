"""Certificates that were replaced but have not ended: whoever copied one, with its key, can still use it.

``private/superseded.json`` remembers their serial numbers, so that removing an enclave revokes all it ever had.
Written by earlier versions; the register (``formats.register``) holds them now.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from keystore.disk import layout, safe_files
from keystore.disk.view import KeystoreView
from keystore.errors import DamagedKeystoreError, printable
from keystore.formats.enclave_name import validate_enclave_name
from keystore.formats.validity import parse_moment

_VERSION = 1


@dataclass(frozen=True, slots=True)
class Superseded:
    """A certificate that was replaced and not revoked: it is good until ``not_after``."""

    enclave: str
    serial: int
    not_after: datetime


def superseded(view: KeystoreView) -> tuple[Superseded, ...]:
    """All that is remembered; raises DamagedKeystoreError when the file is not ours."""
    if safe_files.read_if_there(view.root, layout.SUPERSEDED) is None:
        return ()
    text = safe_files.read_private(view.root, layout.SUPERSEDED)
    try:
        content: Any = json.loads(text)
        if content["version"] != _VERSION:
            raise KeyError("version")
        return tuple(_entry(entry) for entry in content["certificates"])
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise DamagedKeystoreError(
            f"{printable(view.root / layout.SUPERSEDED)} is not a list of replaced certificates; restore it"
        ) from None


def _entry(entry: dict[str, str]) -> Superseded:
    """InvalidInputError and InvalidEnclaveNameError are ValueErrors."""
    return Superseded(
        validate_enclave_name(entry["enclave"]), int(entry["serial"], 16), parse_moment(entry["not_after"])
    )
