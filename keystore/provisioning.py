"""Enclaves brought to exactly the wanted state: the engine behind provision, create-enclave and renew.

    inspect (cheap, no lock) -> nothing to do -> done
                             -> lock, inspect again, issue and sign what is missing, publish in batches

Idempotent: what stands is not touched, keys are never replaced unless asked. An interrupted run is completed
by the next one, because ``enclave_state`` finds every missing step again.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from datetime import datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from keystore import layout
from keystore.ca_access import CaAccess
from keystore.crl_file import crl_validity
from keystore.domains import Domains
from keystore.enclave_name import validate_enclave_name
from keystore.enclave_state import EnclaveState, Identity, PermissionsSource, inspect
from keystore.errors import InvalidInput, NotAKeystore, printable
from keystore.governance_file import governance_domains, governance_stands
from keystore.permissions import permissions_document
from keystore.policy import EnclavePolicy
from keystore.subject import SubjectScheme
from keystore.validity import DEFAULT_BACKDATE, Validity, later, utc_now
from keystore.view import KeystoreView, resolve_root

if TYPE_CHECKING:
    from keystore.creation import CreateOptions

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
    creation: CreateOptions | None = None
    lifetime: timedelta | None = None
    valid_until: datetime | None = None
    backdate: timedelta = DEFAULT_BACKDATE
    renew_within: timedelta = timedelta(0)
    subjects: SubjectScheme | None = None
    rmw: str | None = None
    allow_subject_overlap: bool = False
    access: CaAccess = CaAccess()
    lock_timeout: float = DEFAULT_LOCK_TIMEOUT
    durable: bool = True
    progress: Progress | None = None
    now: datetime | None = None


class Wish(NamedTuple):
    """What one enclave should have: these permissions, and at least this renewal of its identity."""

    permissions: PermissionsSource
    identity: Identity = Identity.GOOD


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
    chosen = with_domains(root, options or ProvisionOptions())
    wishes = {policy.path: Wish(policy_source(policy, chosen)) for policy in _distinct(enclaves)}
    return bring_about(root, wishes, chosen)


def what_is_wrong(
    keystore: Path | str, policy: EnclavePolicy, *, options: ProvisionOptions | None = None
) -> tuple[str, ...]:
    """Why an enclave is not (or no longer) what ``provision`` with the same options left; empty when it is.

    Reads only, and cheaply: bytes, dates, modes and links, no signatures. Raises a KeystoreError for a
    keystore that cannot be read at all.
    """
    root = resolve_root(keystore)
    chosen = with_domains(root, options or ProvisionOptions())
    view = KeystoreView(root)
    view.require_complete()
    now = chosen.now or utc_now()
    state = inspect_wish(view, policy.path, Wish(policy_source(policy, chosen)), chosen, now)
    governance = () if governance_stands(view, chosen.domains) else ("the governance is not what it was",)
    crl = () if _crl_stands(view, now) else ("the CRL has ended",)
    return (*(() if state.is_good else state.reasons), *governance, *crl)


def with_domains(root: Path, options: ProvisionOptions) -> ProvisionOptions:
    """The same options with the domains decided."""
    if options.domains is not None:
        return options
    view = KeystoreView(root)
    return options._replace(domains=governance_domains(view) if view.is_complete else Domains.single(0))


def _distinct(enclaves: Iterable[EnclavePolicy]) -> list[EnclavePolicy]:
    policies = sorted(enclaves, key=lambda policy: policy.path)
    names = [validate_enclave_name(policy.path) for policy in policies]
    if len(set(names)) != len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise InvalidInput(f"enclave {printable(twice)} is given twice; merge its profiles into one policy")
    return policies


def policy_source(policy: EnclavePolicy, options: ProvisionOptions) -> PermissionsSource:
    domains = options.domains or Domains.single(0)

    def document(subject: str, validity: Validity) -> bytes:
        return permissions_document(subject, policy, validity=validity, domains=domains, rmw=options.rmw)

    return document


def bring_about(root: Path, wishes: Mapping[str, Wish], options: ProvisionOptions) -> ProvisionReport:
    """The engine: see the head of this module. ``root`` is resolved, the names are valid and in order."""
    now = options.now or utc_now()
    view = KeystoreView(root)
    if view.is_complete:
        if not _interrupted(root) and (states := _standing(view, wishes, options, now)) is not None:
            return ProvisionReport(root, (), tuple(as_found(state) for state in states))
    elif not options.create:
        raise NotAKeystore(
            f"{printable(root)} is not a complete keystore, and creating it was forbidden; "
            "make it with: secure-keystore create"
        )
    elif not view.can_be_completed:
        raise NotAKeystore(f"{printable(root)} exists and is no keystore; choose an empty or new directory")
    from keystore.provisioning_run import write_wishes  # brings cryptography: not on the warm path

    return write_wishes(root, wishes, options, now)


def _interrupted(root: Path) -> bool:
    return os.path.lexists(root / layout.INCOMING)


def as_found(state: EnclaveState) -> EnclaveReport:
    """Nothing was done."""
    return EnclaveReport(state.enclave, (), (), state.validity)


def _standing(
    view: KeystoreView, wishes: Mapping[str, Wish], options: ProvisionOptions, now: datetime
) -> list[EnclaveState] | None:
    """None unless everything is as wished."""
    if not (governance_stands(view, options.domains) and _crl_stands(view, now)):
        return None
    states = []
    for name, wish in wishes.items():
        states.append(inspect_wish(view, name, wish, options, now))
        if not states[-1].is_good:
            return None
    return states


def _crl_stands(view: KeystoreView, now: datetime) -> bool:
    """A CRL that has ended keeps every participant from starting."""
    return not view.has_crl or crl_validity(view).covers(now)


def inspect_wish(
    view: KeystoreView, enclave: str, wish: Wish, options: ProvisionOptions, now: datetime
) -> EnclaveState:
    state = inspect(view, enclave, wish.permissions, now, later(now, options.renew_within))
    if wish.identity is Identity.GOOD or state.identity is Identity.PAIR:
        return state
    return state._replace(identity=wish.identity, permissions=True, reasons=(*state.reasons, "asked for"))
