"""What provisioning, renewal and roll-over tell of what they did."""

from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

from keystore.formats.validity import Validity


class EnclaveReport(NamedTuple):
    """``actions``: ``created``, ``certificate``, ``permissions``, ``links``, ``mode``; or none. ``validity``: of
    certificate and permissions, where they were found to be as wanted."""

    enclave: str
    actions: tuple[str, ...]
    reasons: tuple[str, ...] = ()
    validity: Validity | None = None


class ProvisionReport(NamedTuple):
    """What one provisioning did, enclave by enclave."""

    keystore: Path
    created: tuple[str, ...]
    """What was done to the keystore itself, in words."""
    enclaves: tuple[EnclaveReport, ...]
    warnings: tuple[str, ...] = ()
    ends: datetime | None = None
    """When the first of all CAs, certificates and the CRL ends, where nothing had to be done."""

    @property
    def changed(self) -> bool:
        return bool(self.created) or any(report.actions for report in self.enclaves)

    @property
    def validities(self) -> Mapping[str, Validity]:
        """Of the enclaves that were found to be as wanted."""
        return {report.enclave: report.validity for report in self.enclaves if report.validity is not None}
