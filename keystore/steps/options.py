"""The options of provisioning enclaves, and the report of what was done."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from datetime import datetime, timedelta
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple, Protocol

from keystore.disk.lock import DEFAULT_TIMEOUT
from keystore.disk.share_files import LaunchHold
from keystore.formats.domains import Domains
from keystore.formats.policy import EnclavePolicy
from keystore.formats.subject import Half, SubjectScheme
from keystore.formats.validity import DEFAULT_LIFETIME, Validity, later, utc_now
from keystore.signing.ca_access import CaAccess

Progress = Callable[[int, int], None]
"""Called with (enclaves done, enclaves to do)."""


class Signing(Protocol):
    """A process that signs in place of this one (``signing_process``)."""

    def provision(self, enclaves: Iterable[EnclavePolicy], options: ProvisionOptions) -> ProvisionReport:
        """Call ``provisioning.provision`` there; raises what that raises."""

    def request(self, action: str, content: dict[str, Any], options: ProvisionOptions) -> Any:
        """Request another ``action`` and return its result; raises what that raises."""


class ProvisionOptions(NamedTuple):
    """Options of provisioning. ``enclave_domains``: enclaves whose permissions are for fewer of the ``domains``.

    ``domains`` None: those of the keystore's governance, 0 for a new one. ``lifetime``, ``subjects`` None:
    what the keystore was created with. ``renew_within``: certificates that end sooner are re-issued, by
    default only the expired. ``ca_lifetime``: of CAs that are made. A keystore that is made on the way gets
    ``subjects`` as its own; ``create_keystore`` has more to choose.
    """

    domains: Domains | None = None
    create: bool = True
    ca_lifetime: timedelta = DEFAULT_LIFETIME
    lifetime: timedelta | None = None
    valid_until: datetime | None = None
    renew_within: timedelta = timedelta(0)
    subjects: SubjectScheme | None = None
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
    """By enclave, of those on Zenoh: the types of what the launch requests (``zenoh.types.types_text``)."""
    enclave_domains: Mapping[str, Domains] = MappingProxyType({})
    signing: Signing | None = None
    """The process that signs. It has the ``access`` and everything that was requested."""
    guid_halves: Mapping[str, Half] = MappingProxyType({})
    """The half of GUIDs for participants of enclaves without a certificate. Their subjects are chosen for it."""

    def domains_of(self, enclave: str) -> Domains:
        """Return the domains that the permissions of one enclave are for."""
        return self.enclave_domains.get(enclave) or self.domains or Domains.single(0)

    def requested_end(self) -> datetime | None:
        """Return when new certificates are to expire, if the caller said so."""
        if self.valid_until is not None or self.lifetime is None:
            return self.valid_until
        return later(self.now or utc_now(), self.lifetime)


class EnclaveReport(NamedTuple):
    """The result for one enclave. ``actions``: ``created``, ``certificate``, ``permissions``, ``links``, ``mode``; or
    none. ``validity``: of certificate and permissions, where they were found to be as wanted or are new."""

    enclave: str
    actions: tuple[str, ...]
    reasons: tuple[str, ...] = ()
    validity: Validity | None = None


class ProvisionReport(NamedTuple):
    """Result of one provisioning, enclave by enclave."""

    keystore: Path
    created: tuple[str, ...]
    """Changes to the keystore itself, in words."""
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
