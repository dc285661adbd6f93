"""Read the register from disk, cheaply, before each launch; ``store`` writes it, first of each batch."""

from __future__ import annotations

import os
from functools import lru_cache
from pathlib import Path

from keystore.disk import layout, safe_files
from keystore.disk.view import KeystoreView
from keystore.errors import printable
from keystore.formats.register import Register, parse_register
from keystore.formats.role import Role

_parsed = lru_cache(maxsize=2)(parse_register)
"""By content: a launch asks before each of its processes."""


def read_register(root: Path) -> Register | None:
    """Read the register, None without one. Raises DamagedKeystoreError, UnsafeKeystoreError if others can write it."""
    if not os.path.lexists(f"{root}/{layout.REGISTER}"):
        return None
    text = safe_files.read_private(root, layout.REGISTER)
    return _parsed(text, printable(root / layout.REGISTER))


def needs_register(view: KeystoreView) -> bool:
    """Return whether this keystore issues but has no register: SROS2 made it, or the file was lost."""
    return (
        not os.path.lexists(view.root / layout.REGISTER)
        and all(os.path.isfile(view.root / layout.ca_cert(role)) for role in Role)
        and any(view.key_file(role) is not None for role in Role)
    )
