"""A keystore held against what is wanted of it. Reads only, without ``cryptography``; ``reconciliation`` writes.

``compare`` answers for a whole launch before it starts, ``differences`` for one enclave before each of its processes.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

from keystore.disk import layout
from keystore.disk.authorities import refuse_foreign_authorities
from keystore.disk.crl_file import crl_problem, crl_validity
from keystore.disk.governance_file import governance_domains, governance_stands
from keystore.disk.register_file import needs_register, read_register
from keystore.disk.safe_files import resolve_root
from keystore.disk.view import KeystoreView
from keystore.errors import NotAKeystore, printable
from keystore.formats.domains import Domains
from keystore.formats.permissions import permissions_document
from keystore.formats.policy import EnclavePolicy
from keystore.formats.register import Register
from keystore.formats.role import Role
from keystore.formats.validity import Validity, later, utc_now
from keystore.steps.enclave_state import EnclaveState, PermissionsSource, Reissue, inspect
from keystore.steps.options import ProvisionOptions
from keystore.steps.report import EnclaveReport, ProvisionReport


class WantedEnclave(NamedTuple):
    """What one enclave should have: these permissions, and at least this much of its identity issued anew."""

    permissions: PermissionsSource
    reissue: Reissue = Reissue.NOTHING


def compare(
    root: Path, wanted: Mapping[str, WantedEnclave], options: ProvisionOptions, now: datetime
) -> ProvisionReport | None:
    """The report of a run in which nothing is to be done; None when something is.

    Raises NotAKeystore when the keystore is not complete and must not, or cannot, be made.
    """
    view = KeystoreView(root)
    if not view.is_complete:
        _refuse_unless_it_can_be_made(view, options)
        return None
    if os.path.lexists(root / layout.INCOMING):  # an interrupted change of a CA
        return None
    if needs_register(view):
        return None
    register = read_register(root)
    refuse_foreign_authorities(view, register)
    if not governance_stands(view, options.domains, register) or crl_problem(view, register, now):
        return None
    states = []
    for name, one in wanted.items():
        states.append(inspect_wanted(view, register, name, one, options, now))
        if not states[-1].is_good:
            return None
    ends = _first_end(view, (state.validity for state in states))
    return ProvisionReport(root, (), tuple(as_found(state) for state in states), ends=ends)


def _refuse_unless_it_can_be_made(view: KeystoreView, options: ProvisionOptions) -> None:
    if not options.create:
        raise NotAKeystore(
            f"{printable(view.root)} is not a complete keystore, and creating it was forbidden; "
            "make it with: secure-keystore create"
        )
    if not view.can_be_completed:
        raise NotAKeystore(
            f"{printable(view.root)} exists and is not a keystore; choose an empty or new directory"
        )


def _first_end(view: KeystoreView, enclaves: Iterable[Validity | None]) -> datetime:
    ends = [ca.validity.not_after for role in Role for ca in view.ca_bundle(role)]
    ends += [validity.not_after for validity in enclaves if validity is not None]
    if view.has_crl:
        ends.append(crl_validity(view).not_after)
    return min(ends)


def differences(
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
    register = read_register(root)
    refuse_foreign_authorities(view, register)
    now = chosen.now or utc_now()
    wanted = WantedEnclave(permissions_source(policy, chosen))
    state = inspect_wanted(view, register, policy.path, wanted, chosen, now)
    reasons = [] if state.is_good else [*state.reasons]
    if not governance_stands(view, chosen.domains, register):
        reasons.append("the governance is not what it was")
    if problem := crl_problem(view, register, now):
        reasons.append(problem)
    return tuple(reasons)


def with_domains(root: Path, options: ProvisionOptions) -> ProvisionOptions:
    """The same options with the domains decided."""
    if options.domains is not None:
        return options
    view = KeystoreView(root)
    return options._replace(domains=governance_domains(view) if view.is_complete else Domains.single(0))


def permissions_source(policy: EnclavePolicy, options: ProvisionOptions) -> PermissionsSource:
    """Makes the document of exactly this policy."""
    domains = options.enclave_domains.get(policy.path) or options.domains or Domains.single(0)

    def document(subject: str, validity: Validity) -> bytes:
        return permissions_document(subject, policy, validity=validity, domains=domains, rmw=options.rmw)

    return document


def as_found(state: EnclaveState) -> EnclaveReport:
    """Nothing was done."""
    return EnclaveReport(state.enclave, (), (), state.validity)


def inspect_wanted(
    view: KeystoreView,
    register: Register | None,
    enclave: str,
    wanted: WantedEnclave,
    options: ProvisionOptions,
    now: datetime,
) -> EnclaveState:
    """The enclave's state against what is wanted; what is asked to be issued anew counts as a difference."""
    state = inspect(view, register, enclave, wanted.permissions, now, later(now, options.renew_within))
    if wanted.reissue is Reissue.NOTHING or state.reissue is Reissue.KEY_PAIR:
        return state
    return state._replace(reissue=wanted.reissue, permissions=True, reasons=(*state.reasons, "asked for"))
