"""Findings of ``verify`` as plain values. They are worded here and rendered elsewhere."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Severity(str, Enum):
    """From worst to mildest.

    ERROR: something does not work or lets others in. EXPOSURE: it works, but the holder of one enclave's key
    can gain more on the DDS versions named. WARNING: it will matter. NOTE: worth knowing.
    """

    ERROR = "error"
    EXPOSURE = "exposure"
    WARNING = "warning"
    NOTE = "note"

    @property
    def fails(self) -> bool:
        return self in (Severity.ERROR, Severity.EXPOSURE)


@dataclass(frozen=True, slots=True)
class Finding:
    """One finding of a verification. ``code`` is stable, for scripts; ``place`` a file of the keystore or an enclave;
    ``repair`` a command or what to do, empty when nothing needs doing."""

    severity: Severity
    code: str
    place: str
    message: str
    repair: str = ""
