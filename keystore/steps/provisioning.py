"""Enclaves brought to exactly the wanted state: what a launch calls before it starts anything.

    as when it was last compared (``standing``) -> done
    compare (``provisioning_check``, no lock)   -> nothing to do -> done
                                                -> lock, compare again, issue and sign, publish in batches

Idempotent: what stands is not touched, keys are never replaced unless asked. An interrupted run is completed
by the next one, because ``enclave_state`` finds every missing step again.
"""

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from datetime import datetime, timedelta
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

from keystore.disk import layout
from keystore.disk.safe_files import resolve_root
from keystore.disk.stamps import Stamp
from keystore.errors import InvalidInput, printable
from keystore.formats.domains import Domains
from keystore.formats.enclave_name import validate_enclave_name
from keystore.formats.policy import EnclavePolicy
from keystore.formats.validity import DEFAULT_BACKDATE, Validity, later, utc_now
from keystore.signing.ca_access import CaAccess
from keystore.steps.standing import Question, recall

if TYPE_CHECKING:
    from keystore.formats.subject import SubjectScheme
    from keystore.steps.creation import CreateOptions

Progress = Callable[[int, int], None]
"""Called with (enclaves done, enclaves to do)."""

DEFAULT_LOCK_TIMEOUT = 30.0


class ProvisionOptions(NamedTuple):
    """``domains`` None: those of the keystore's governance, 0 for a new one. ``lifetime``, ``subjects`` None:
    what the keystore was created with. ``renew_within``: certificates that end sooner are re-issued, by
    default only the expired. ``creation``: for a new keystore; its domains, access, clock and durability are
    taken from here."""

    domains: Domains | None = None
    create: bool = True
    creation: "CreateOptions | None" = None
    lifetime: timedelta | None = None
    valid_until: datetime | None = None
    backdate: timedelta = DEFAULT_BACKDATE
    renew_within: timedelta = timedelta(0)
    subjects: "SubjectScheme | None" = None
    rmw: str | None = None
    allow_subject_overlap: bool = False
    access: CaAccess = CaAccess()
    lock_timeout: float = DEFAULT_LOCK_TIMEOUT
    durable: bool = True
    progress: Progress | None = None
    now: datetime | None = None


class EnclaveReport(NamedTuple):
    """``actions``: ``created``, ``certificate``, ``permissions``, ``links``, ``mode``; or none. ``validity``: of
    certificate and permissions, where they were found to stand."""

    enclave: str
    actions: tuple[str, ...]
    reasons: tuple[str, ...] = ()
    validity: Validity | None = None


class ProvisionReport(NamedTuple):
    keystore: Path
    created: tuple[str, ...]
    """What was done to the keystore itself, in words."""
    enclaves: tuple[EnclaveReport, ...]
    warnings: tuple[str, ...] = ()
    stamps: Mapping[str, Stamp] = MappingProxyType({})
    """Of enclaves that were found to stand: their files, just before they were looked at."""
    ends: datetime | None = None
    """When the first of all certificates and the CRL ends, where that is known without opening them."""

    @property
    def changed(self) -> bool:
        return bool(self.created) or any(report.actions for report in self.enclaves)

    @property
    def validities(self) -> Mapping[str, Validity]:
        """Of the enclaves that were found to stand."""
        return {report.enclave: report.validity for report in self.enclaves if report.validity is not None}


def provision(
    keystore: Path | str, enclaves: Iterable[EnclavePolicy], *, options: ProvisionOptions | None = None
) -> ProvisionReport:
    """Give every enclave a valid identity and exactly the permissions of its policy.

    Creates the keystore if ``options.create``. Other enclaves of the keystore are left alone. Raises a
    KeystoreError and leaves only complete, valid enclaves visible.
    """
    root = resolve_root(keystore)
    chosen = options or ProvisionOptions()
    policies = _distinct(enclaves)
    if (known := _as_last_seen(root, policies, chosen)) is not None:
        return known
    from keystore.steps.provisioning_check import provision_policies  # compares in full

    return provision_policies(root, policies, chosen)


def _as_last_seen(
    root: Path, policies: Sequence[EnclavePolicy], options: ProvisionOptions
) -> ProvisionReport | None:
    """What every start of an unchanged launch comes to: no certificate and no document is opened."""
    if options.domains is None or os.path.lexists(root / layout.INCOMING):
        return None
    now = options.now or utc_now()
    question = Question(root, options.domains, options.rmw)
    standing = recall(question, policies, now, later(now, options.renew_within))
    if standing is None:
        return None
    reports = tuple(EnclaveReport(policy.path, ()) for policy in policies)
    return ProvisionReport(root, (), reports, stamps=standing.stamps, ends=standing.ends)


def _distinct(enclaves: Iterable[EnclavePolicy]) -> list[EnclavePolicy]:
    policies = sorted(enclaves, key=lambda policy: policy.path)
    names = [validate_enclave_name(policy.path) for policy in policies]
    if len(set(names)) != len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise InvalidInput(f"enclave {printable(twice)} is given twice; merge its profiles into one policy")
    return policies
