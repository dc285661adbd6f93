"""The comparing half of ``keystore.steps.provisioning``: enclaves held against what they should be, in full.

Also the engine behind create-enclave and renew, which want something else than a policy. Reads only, without
``cryptography``; ``provisioning_run`` writes.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

from keystore.disk import layout
from keystore.disk.crl_file import crl_validity
from keystore.disk.governance_file import governance_domains, governance_stands
from keystore.disk.safe_files import resolve_root
from keystore.disk.stamps import enclave_stamp
from keystore.disk.view import KeystoreView
from keystore.errors import NotAKeystore, printable
from keystore.formats.domains import Domains
from keystore.formats.permissions import permissions_document
from keystore.formats.policy import EnclavePolicy
from keystore.formats.role import Role
from keystore.formats.validity import Validity, later, utc_now
from keystore.steps.enclave_state import EnclaveState, Identity, PermissionsSource, inspect
from keystore.steps.provisioning import EnclaveReport, ProvisionOptions, ProvisionReport
from keystore.steps.standing import Question, remember


class Wish(NamedTuple):
    """What one enclave should have: these permissions, and at least this renewal of its identity."""

    permissions: PermissionsSource
    identity: Identity = Identity.GOOD


def provision_policies(
    root: Path, policies: Sequence[EnclavePolicy], options: ProvisionOptions
) -> ProvisionReport:
    """``provision`` without a look at what is remembered; what is found to stand is remembered."""
    chosen = with_domains(root, options)
    # Before the comparison: what changes meanwhile counts as touched.
    head = Question(root, chosen.domains or Domains.single(0), chosen.rmw).head()
    stamps = {policy.path: enclave_stamp(str(root), policy.path) for policy in policies}
    report = bring_about(
        root, {policy.path: Wish(policy_source(policy, chosen)) for policy in policies}, chosen
    )
    standing = report.validities
    if not report.changed:
        found = [
            (policy, stamps[policy.path], standing[policy.path])
            for policy in policies
            if policy.path in standing
        ]
        remember(root, head, _shared_validity(KeystoreView(root)), found)
    return report._replace(stamps={path: stamps[path] for path in standing})


def _shared_validity(view: KeystoreView) -> tuple[datetime, datetime]:
    """From when until when the CAs and the CRL all hold. With an old CA in a bundle the end may come first."""
    held = [ca.validity for role in Role for ca in view.ca_bundle(role)]
    if view.has_crl:
        held.append(crl_validity(view))
    return max(one.not_before for one in held), min(one.not_after for one in held)


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
    from keystore.steps.provisioning_run import write_wishes  # brings cryptography: not on the warm path

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
