"""What a keystore remembers about itself: ``secure-keystore.json``, beside what SROS2 knows. Performs no I/O.

Absent in keystores made by SROS2; then the defaults hold. It also marks a directory as a keystore in the
making, so that an interrupted ``create`` can be completed while a foreign directory is left alone.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from datetime import timedelta
from typing import Any

from keystore.errors import DamagedKeystoreError
from keystore.formats.subject import SubjectScheme
from keystore.formats.validity import DEFAULT_LIFETIME

_VERSION = 1


@dataclass(frozen=True, slots=True)
class KeystoreSettings:
    """The settings that a keystore keeps. ``lifetime`` is for new certificates of enclaves."""

    subjects: SubjectScheme = SubjectScheme.EXACT
    lifetime: timedelta = DEFAULT_LIFETIME

    def to_json(self) -> bytes:
        content = {
            "version": _VERSION,
            "subjects": self.subjects.value,
            "lifetime_seconds": int(self.lifetime.total_seconds()),
        }
        return json.dumps(content, indent=2, sort_keys=True).encode() + b"\n"

    @classmethod
    def from_json(cls, text: bytes, place: str) -> KeystoreSettings:
        """Parse what ``to_json`` writes; raises DamagedKeystoreError for anything else."""
        try:
            content: Any = json.loads(text)
            if content["version"] != _VERSION:
                raise DamagedKeystoreError(f"{place} was written by a newer version; update secure-keystore")
            return cls(
                SubjectScheme(content["subjects"]),
                timedelta(seconds=int(content["lifetime_seconds"])),
            )
        except (ValueError, KeyError, TypeError, OverflowError, RecursionError):
            raise DamagedKeystoreError(
                f"{place} is not the settings file of a keystore; restore or remove it"
            ) from None
