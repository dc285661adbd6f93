"""A keystore held against what is wanted of it: a whole launch, or one enclave before a process. Reads only."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from datetime import datetime, timedelta
from pathlib import Path
from typing import NamedTuple

from keystore.disk import layout
from keystore.disk.authorities import refuse_foreign_authorities
from keystore.disk.crl_file import crl_problem, crl_validity
from keystore.disk.deployed import deployment_problem, refuse_changed_deployment
from keystore.disk.register_file import needs_register, read_register
from keystore.disk.safe_files import resolve_root
from keystore.disk.signed_documents import governance_domains, governance_stands
from keystore.disk.view import KeystoreView
from keystore.errors import NotAKeystoreError, printable
from keystore.formats.domains import Domains
from keystore.formats.permissions import permissions_document
from keystore.formats.policy import EnclavePolicy
from keystore.formats.register import Register
from keystore.formats.role import Role
from keystore.formats.shares import Share
from keystore.formats.validity import Validity, iso, later, utc_now
from keystore.steps.enclave_state import (
    OTHER_PERMISSIONS,
    EnclaveState,
    PermissionsSource,
    Reissue,
    beyond_and_missing,
    inspect,
)
from keystore.steps.options import EnclaveReport, ProvisionOptions, ProvisionReport
from keystore.steps.sharing import EnclaveShare, kept_shares


class WantedEnclave(NamedTuple):
    """The permissions that one enclave should have, and the least that must be issued again of its identity."""

    permissions: PermissionsSource
    reissue: Reissue = Reissue.NOTHING
    share: EnclaveShare | None = None
    """Where ``permissions`` are those of several launches."""
    ends_by: datetime | None = None
    """When a life was asked for: a certificate that ends later does not do."""


def compare(
    root: Path, wanted: Mapping[str, WantedEnclave], options: ProvisionOptions, now: datetime
) -> ProvisionReport | None:
    """Return the report of a run in which nothing is to be done; None if something is. Raises NotAKeystoreError."""
    view = KeystoreView(root)
    if not view.is_complete:
        if not options.create:
            raise NotAKeystoreError(
                f"{printable(view.root)} is not a complete keystore; "
                "make one with secure-keystore create, or leave out --no-create-keystore"
            )
        view.refuse_foreign()
        return None
    if any(os.path.lexists(f"{root}/{name}") for name in (layout.INCOMING, layout.CRL_UNLINKED)):
        return None  # a run was interrupted: of changing a CA, or of giving the CRL to all
    if needs_register(view):
        return None
    register = read_register(root)
    refuse_foreign_authorities(view, register)
    refuse_changed_deployment(view, wanted)
    if not governance_stands(view, options.domains, register) or crl_problem(view, register, now):
        return None
    states = []
    for name, one in wanted.items():
        states.append(inspect_wanted(view, register, name, one, options, now))
        if not states[-1].is_good or (one.share is not None and not one.share.is_recorded()):
            return None
    ends = _first_end(view, (state.validity for state in states))
    more = [state.reasons[0] for state in states if state.reasons]
    more += kept_shares(one.share for one in wanted.values() if one.share is not None)
    return ProvisionReport(root, (), tuple(as_found(state) for state in states), tuple(more), ends)


def _first_end(view: KeystoreView, enclaves: Iterable[Validity | None]) -> datetime:
    ends = [ca.validity.not_after for role in Role for ca in view.ca_bundle(role)]
    ends += [validity.not_after for validity in enclaves if validity is not None]
    if view.has_crl:
        ends.append(crl_validity(view).not_after)
    return min(ends)


def differences(
    keystore: Path | str, policy: EnclavePolicy, *, options: ProvisionOptions | None = None
) -> tuple[str, ...]:
    """Return why an enclave is not what ``provision`` with the same options left; empty if it is. Reads only.

    Raises ``KeystoreError`` for a keystore that cannot be read.
    """
    root = resolve_root(keystore)
    # What ends soon is renewed by a start, and good until then.
    chosen = with_domains(root, options or ProvisionOptions())._replace(renew_within=timedelta(0))
    view = KeystoreView(root)
    view.require_complete()
    register = read_register(root)
    refuse_foreign_authorities(view, register)
    now = chosen.now or utc_now()
    wanted = wanted_enclave(root, policy, chosen)
    state = inspect_wanted(view, register, policy.path, wanted, chosen, now)
    reasons = [] if state.is_good else [*state.reasons]
    if not governance_stands(view, chosen.domains, register):
        reasons.append("the governance is not what it was")
    if problem := crl_problem(view, register, now) or deployment_problem(view, [policy.path]):
        reasons.append(problem)
    return tuple(reasons)


def with_domains(root: Path, options: ProvisionOptions) -> ProvisionOptions:
    """Return the same options with the domains decided."""
    if options.domains is not None:
        return options
    view = KeystoreView(root)
    return options._replace(domains=governance_domains(view) if view.is_complete else Domains.single(0))


def domains_of(enclave: str, options: ProvisionOptions) -> Domains:
    """Return the domains that the permissions of one enclave are for."""
    return options.enclave_domains.get(enclave) or options.domains or Domains.single(0)


def permissions_source(policy: EnclavePolicy, options: ProvisionOptions) -> PermissionsSource:
    """Makes the document of exactly this policy."""
    domains = domains_of(policy.path, options)

    def document(subject: str, validity: Validity) -> bytes:
        return permissions_document(subject, policy, validity=validity, domains=domains, rmw=options.rmw)

    return document


def wanted_enclave(root: Path, policy: EnclavePolicy, options: ProvisionOptions) -> WantedEnclave:
    """Return the enclave with exactly this policy; of a launch, its share beside those of others."""
    ends_by = asked_end(options)
    if options.launch is None:
        return WantedEnclave(permissions_source(policy, options), ends_by=ends_by)
    owner, domains = options.launch.owner, domains_of(policy.path, options)
    mine = Share(owner, domains, policy.profiles, options.types.get(policy.path, ()))
    share = EnclaveShare(root, policy.path, owner, mine, options.rmw, options.launch)
    return WantedEnclave(share.document, share=share, ends_by=ends_by)


def asked_end(options: ProvisionOptions) -> datetime | None:
    """Return when new certificates are to expire, if the caller said so."""
    if options.valid_until is not None or options.lifetime is None:
        return options.valid_until
    return later(options.now or utc_now(), options.lifetime)


def _with_shares_of_others(view: KeystoreView, state: EnclaveState, wanted: WantedEnclave) -> EnclaveState:
    """Take permissions that hold all of ours as a union: a bundle does not say whose share is whose."""
    beyond, missing = beyond_and_missing(view, state, wanted.permissions)
    if missing or not beyond:
        return state
    some = f"{', '.join(beyond[:4])}{' ...' if len(beyond) > 4 else ''}"
    said = f"enclave {state.enclave} may do more in this bundle than this launch needs ({some})"
    return state._replace(permissions=False, reasons=(said,))


def _outlives(state: EnclaveState, wanted: WantedEnclave) -> bool:
    """Return whether a good certificate lasts longer than requested, by an hour: seconds pass between two runs."""
    if wanted.ends_by is None or state.reissue is not Reissue.NOTHING or state.facts is None:
        return False
    return state.facts.validity.not_after > later(wanted.ends_by, timedelta(hours=1))


def as_found(state: EnclaveState) -> EnclaveReport:
    """Return the result of an enclave to which nothing was done."""
    return EnclaveReport(state.enclave, (), (), state.validity)


def inspect_wanted(
    view: KeystoreView,
    register: Register | None,
    enclave: str,
    wanted: WantedEnclave,
    options: ProvisionOptions,
    now: datetime,
) -> EnclaveState:
    """Compare the enclave with what is wanted; what is requested to be issued again counts as a difference."""
    # A certificate that ends with its CA cannot be renewed for longer.
    due = min(later(now, options.renew_within), *(view.ca(role).validity.not_after for role in Role))
    state = inspect(view, register, enclave, wanted.permissions, now, due)
    if _outlives(state, wanted):
        longer = (
            f"valid until {iso(state.facts.validity.not_after) if state.facts else ''}, longer than requested"
        )
        state = state._replace(
            reissue=Reissue.CERTIFICATE, permissions=True, reasons=(*state.reasons, longer)
        )
    if wanted.share is not None and register is None and state.reasons == (OTHER_PERMISSIONS,):
        state = _with_shares_of_others(view, state, wanted)
    if wanted.reissue is Reissue.NOTHING or state.reissue is Reissue.KEY_PAIR:
        return state
    return state._replace(reissue=wanted.reissue, permissions=True, reasons=(*state.reasons, "requested"))
