"""The register on disk. Cheap: asked before a launch; ``store`` writes it, first of each batch.

Earlier versions remembered certificates that were replaced but had not ended in ``private/superseded.json``, so that
removing an enclave revokes all it ever had: whoever copied one, with its key, can still use it.
"""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from datetime import datetime
from functools import lru_cache
from pathlib import Path
from typing import Any

from keystore.disk import layout, safe_files
from keystore.disk.view import KeystoreView
from keystore.errors import DamagedKeystoreError, printable
from keystore.formats.enclave_name import validate_enclave_name
from keystore.formats.register import Register, parse_register
from keystore.formats.role import Role
from keystore.formats.validity import parse_moment

_parsed = lru_cache(maxsize=2)(parse_register)
"""By content: a launch asks before each of its processes."""


def read_register(root: Path) -> Register | None:
    """None where there is none: a bundle without ``private/``, a keystore of SROS2 or of an earlier version.

    Raises DamagedKeystoreError for what is not a register, UnsafeKeystoreError for one that others could have
    written.
    """
    if not os.path.lexists(f"{root}/{layout.REGISTER}"):
        return None
    text = safe_files.read_private(root, layout.REGISTER)
    return _parsed(text, printable(root / layout.REGISTER))


def needs_register(view: KeystoreView) -> bool:
    """Whether this keystore issues but has no register: SROS2 made it, or an earlier version."""
    return (
        not os.path.lexists(view.root / layout.REGISTER)
        and all(os.path.isfile(view.root / layout.ca_cert(role)) for role in Role)
        and any(view.key_file(role) is not None for role in Role)
    )


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
