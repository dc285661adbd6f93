"""Enclaves brought to exactly the wanted state: what a launch calls before it starts anything.

Compared without the lock, reconciled under it. Keys are never replaced unless asked; an interrupted run is completed by
the next one, because the comparison finds every missing step again.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Mapping
from datetime import timedelta
from pathlib import Path

from enclave_common.words import counted, some_of
from keystore.add_ons import follow
from keystore.disk import layout, store
from keystore.disk.safe_files import resolve_root
from keystore.disk.share_files import read_shares
from keystore.disk.view import KeystoreView, keystore_at
from keystore.errors import InvalidInputError, printable
from keystore.formats.enclave_name import validate_enclave_name
from keystore.formats.policy import EnclavePolicy, Operation, Policy, Profile, Qualifier, Rule
from keystore.formats.validity import Validity, utc_now
from keystore.steps.comparison import (
    WantedEnclave,
    asked_end,
    compare,
    permissions_source,
    wanted_enclave,
    with_domains,
)
from keystore.steps.enclave_state import PermissionsSource
from keystore.steps.options import ProvisionOptions, ProvisionReport
from keystore.steps.reconciliation import reconcile
from keystore.steps.sharing import given_up, left_over, refuse_running
from keystore.verification.before_launch import exposures


def provision(
    keystore: Path | str, enclaves: Iterable[EnclavePolicy], *, options: ProvisionOptions | None = None
) -> ProvisionReport:
    """Give every enclave a valid identity and exactly the permissions of its policy.

    Creates the keystore if ``options.create``. Other enclaves of the keystore are left alone. Raises a
    KeystoreError and leaves only complete, valid enclaves visible.
    """
    root = resolve_root(keystore)
    chosen = with_domains(root, options or ProvisionOptions())
    policies = _distinct(enclaves)
    if chosen.launch is not None:
        chosen.launch.take()
    else:
        refuse_running(root, (policy.path for policy in policies))
    if chosen.signing is not None:
        report = chosen.signing.provision(policies, chosen)
    else:
        wanted = {policy.path: wanted_enclave(root, policy, chosen) for policy in policies}
        report = bring_about(root, wanted, chosen)
    if chosen.launch is not None:
        chosen.launch.take()  # a new keystore had no place for it before
        chosen.launch.enclaves.update(policy.path for policy in policies)
        gone = left_over(root, chosen.launch.owner, (policy.path for policy in policies))
        report = report._replace(warnings=(*report.warnings, *_left_over(root, gone)))
    else:
        drop_share_files(root, [policy.path for policy in policies], chosen)
    return report


def _left_over(root: Path, enclaves: list[str]) -> list[str]:
    if not enclaves:
        return []
    return [
        f"{counted(len(enclaves), 'enclave')} of this launch left over, with all that was granted: "
        f"{some_of(enclaves, 8)}; to revoke and remove: secure-keystore remove {shlex.quote(str(root))} "
        f"{' '.join(enclaves)}"
    ]


def drop_share_files(root: Path, enclaves: Iterable[str], options: ProvisionOptions) -> None:
    """Drop the shares: the enclaves were given exactly what was requested, and nothing of it is a launch's any more."""
    stale = [name for name in enclaves if read_shares(root, name)]
    if stale:
        with store.opened(root, timeout=options.lock_timeout, durable=options.durable) as opened:
            for name in stale:
                opened.remove(layout.shares(name))


def _distinct(enclaves: Iterable[EnclavePolicy]) -> list[EnclavePolicy]:
    policies = sorted(enclaves, key=lambda policy: policy.path)
    names = [validate_enclave_name(policy.path) for policy in policies]
    if len(set(names)) != len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise InvalidInputError(
            f"enclave {printable(twice)} is given twice; merge its profiles into one policy"
        )
    return policies


def bring_about(
    root: Path, wanted: Mapping[str, WantedEnclave], options: ProvisionOptions
) -> ProvisionReport:
    """Compare, and reconcile what differs. ``root`` is resolved, the names are valid and in order."""
    now = options.now or utc_now()
    if (report := compare(root, wanted, options, now)) is None:
        report = reconcile(root, wanted, options, now)
        report = report._replace(warnings=(*report.warnings, *follow(root, options)))
    return report._replace(warnings=(*report.warnings, *exposures(KeystoreView(root))))


def create_enclaves(
    keystore: Path | str,
    names: Iterable[str],
    *,
    allow_all: bool = False,
    options: ProvisionOptions | None = None,
) -> ProvisionReport:
    """Create enclaves in a keystore that exists: without ``allow_all`` new ones may do nothing, others as before."""
    root = resolve_root(keystore)
    chosen = with_domains(root, _as_long_as_asked(options or ProvisionOptions()))
    ordered = sorted({validate_enclave_name(name) for name in names})
    wanted = {
        name: WantedEnclave(_allow_all(name, chosen) if allow_all else keep, ends_by=asked_end(chosen))
        for name in ordered
    }
    return bring_about(root, wanted, chosen)


def create_enclave(
    keystore: Path | str, name: str, *, allow_all: bool = False, options: ProvisionOptions | None = None
) -> ProvisionReport:
    """Create one enclave as ``create_enclaves``."""
    return create_enclaves(keystore, [name], allow_all=allow_all, options=options)


def keep(_subject: str, _validity: Validity) -> None:
    """Return no permissions: for callers who do not want to change them."""


def _allow_all(name: str, options: ProvisionOptions) -> PermissionsSource:
    """Return SROS2's default policy of create_enclave: everything on ``/*``, requested by name here."""
    everything = tuple(Rule(operation, Qualifier.ALLOW, "/*") for operation in Operation)
    return permissions_source(EnclavePolicy(name, (Profile("/", "all", everything),)), options)


def apply_policy(
    keystore: Path | str, policy: Policy, *, options: ProvisionOptions | None = None
) -> ProvisionReport:
    """Give exactly the policy's permissions to the policy's enclaves, created if missing, in a keystore that exists."""
    chosen = _as_long_as_asked(options or ProvisionOptions())
    return provision(keystore, policy.enclaves, options=chosen)


def _as_long_as_asked(options: ProvisionOptions) -> ProvisionOptions:
    """Give a requested life to existing enclaves too: what expires an hour sooner or later is issued again."""
    end = asked_end(options)
    within = options.renew_within if end is None else end - (options.now or utc_now()) - timedelta(hours=1)
    return options._replace(create=False, renew_within=max(options.renew_within, within))


def list_enclaves(keystore: Path | str) -> list[str]:
    """Return the names of all enclaves, sorted; the root is ``/``. Raises NotAKeystoreError."""
    view = keystore_at(keystore)
    return view.enclaves()


def drop_shares(
    keystore: Path | str, owner: str, *, options: ProvisionOptions | None = None
) -> ProvisionReport:
    """Take the shares of a launch out of every enclave; what no other launch asks for is taken away for good.

    Raises InvalidInputError when it has none, or while a launch runs on one of these enclaves.
    """
    root = keystore_at(keystore).root
    chosen = with_domains(root, (options or ProvisionOptions())._replace(create=False))
    wanted = {one.enclave: WantedEnclave(one.document, share=one) for one in given_up(root, owner)}
    return bring_about(root, wanted, chosen)
