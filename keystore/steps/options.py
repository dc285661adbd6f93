"""The options of provisioning enclaves, and the report of what was done."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from datetime import datetime, timedelta
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

from keystore.disk.lock import DEFAULT_TIMEOUT
from keystore.disk.share_files import LaunchHold
from keystore.formats.domains import Domains
from keystore.formats.subject import Half
from keystore.formats.validity import DEFAULT_BACKDATE, Validity
from keystore.signing.ca_access import CaAccess

if TYPE_CHECKING:
    from keystore.formats.subject import SubjectScheme
    from keystore.steps.creation import CreateOptions
    from keystore.steps.signing_process import SigningProcess


Progress = Callable[[int, int], None]
"""Called with (enclaves done, enclaves to do)."""


class ProvisionOptions(NamedTuple):
    """``enclave_domains``: enclaves whose permissions are for fewer of the ``domains``.

    ``domains`` None: those of the keystore's governance, 0 for a new one. ``lifetime``, ``subjects`` None:
    what the keystore was created with. ``renew_within``: certificates that end sooner are re-issued, by
    default only the expired. ``creation``: for a new keystore; its domains, access, clock and durability are
    taken from here."""

    domains: Domains | None = None
    create: bool = True
    creation: CreateOptions | None = None
    lifetime: timedelta | None = None
    valid_until: datetime | None = None
    backdate: timedelta = DEFAULT_BACKDATE
    renew_within: timedelta = timedelta(0)
    subjects: SubjectScheme | None = None
    rmw: str | None = None
    allow_subject_overlap: bool = False
    access: CaAccess = CaAccess()
    lock_timeout: float = DEFAULT_TIMEOUT
    durable: bool = True
    progress: Progress | None = None
    now: datetime | None = None
    accept_clock: bool = False
    launch: LaunchHold | None = None
    """The launch whose share of the enclaves this is: shares of other launches stay, the enclaves get all of them
    together. None: the enclaves get exactly what is given, and no launch has a share."""
    revoke: bool = True
    """Revoke certificates whose rights shrink or whose key is not safe; without it they are usable until they end."""
    types: Mapping[str, tuple[tuple[str, tuple[str, ...]], ...]] = MappingProxyType({})
    """By enclave, of those on Zenoh: the types of what the launch asks for (``zenoh.types.types_text``)."""
    enclave_domains: Mapping[str, Domains] = MappingProxyType({})
    signing: SigningProcess | None = None
    """Where signing is done by a process of its own; it has the ``access``, and everything that was asked for."""
    guid_halves: Mapping[str, Half] = MappingProxyType({})
    """Where the participants of enclaves without a certificate yet should sort; their subjects are chosen so."""


class EnclaveReport(NamedTuple):
    """``actions``: ``created``, ``certificate``, ``permissions``, ``links``, ``mode``; or none. ``validity``: of
    certificate and permissions, where they were found to be as wanted or are new."""

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
        """Return the validities of the enclaves that are as wanted."""
        return {report.enclave: report.validity for report in self.enclaves if report.validity is not None}
