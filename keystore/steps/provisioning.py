"""Bring enclaves to exactly the wanted state: what a launch calls before it starts anything.

Compared without the lock, reconciled under it, in batches. Keys are never replaced unless requested; an
interrupted run is completed by the next one, because the comparison finds every missing step again.
"""

from __future__ import annotations

import os
import shlex
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path

from enclave_common.dependencies import require
from enclave_common.terminal import quoted
from enclave_common.words import counted, some_of
from keystore.add_ons import follow
from keystore.disk import layout, store
from keystore.disk.register_file import refuse_foreign_authorities
from keystore.disk.safe_files import refuse_foreign_owner, resolve_root
from keystore.disk.share_files import read_shares
from keystore.disk.signed_documents import governance_domains, governance_in_force
from keystore.disk.store import Batch, Store
from keystore.disk.view import KeystoreView, keystore_at
from keystore.errors import InvalidInputError, KeystoreError, StorageError
from keystore.formats.clock import refuse_clock_before_program
from keystore.formats.enclave_name import check_distinct, validate_enclave_name
from keystore.formats.policy import EnclavePolicy, Operation, Policy, Profile, Qualifier, Rule
from keystore.formats.role import Role
from keystore.formats.subject import SubjectScheme
from keystore.formats.validity import DEFAULT_LIFETIME, Validity, iso, utc_now
from keystore.signing.authority import Authority
from keystore.steps.comparison import (
    WantedEnclave,
    as_found,
    compare,
    inspect_wanted,
    permissions_source,
    refuse_without_keys,
    wanted_enclaves,
    with_domains,
)
from keystore.steps.creation import CreateOptions, complete
from keystore.steps.crl import publish_crl, restore_crl
from keystore.steps.enclave_state import EnclaveState, PermissionsSource
from keystore.steps.enclave_writing import EnclaveWriter
from keystore.steps.governance import governance_for, renew_governance
from keystore.steps.opening import opened_for_change
from keystore.steps.options import EnclaveReport, Progress, ProvisionOptions, ProvisionReport
from keystore.steps.sharing import given_up, left_over, refuse_running, shares_in_use
from keystore.verification.files import check_links, check_parents
from keystore.verification.finding import Finding
from keystore.verification.governance import weaknesses


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
        wanted = wanted_enclaves(root, policies, chosen)
        report = bring_about(root, wanted, chosen)
    if chosen.launch is not None:
        chosen.launch.take()  # a new keystore had no place for it before
        chosen.launch.enclaves.update(policy.path for policy in policies)
        gone = left_over(root, chosen.launch.owner, (policy.path for policy in policies))
        report = report._replace(warnings=(*report.warnings, *_left_over(root, chosen.launch.owner, gone)))
    else:
        drop_share_files(root, [policy.path for policy in policies], chosen)
    return report._replace(warnings=(*report.warnings, *_replaceable(check_links(keystore))))


def _left_over(root: Path, owner: str, shares: Mapping[str, bool]) -> Iterator[str]:
    """Say which enclaves a launch no longer needs. Of those that others use, only its share may go."""
    keystore = shlex.quote(str(root))
    if alone := [name for name, is_shared in shares.items() if not is_shared]:
        yield (
            f"{counted(len(alone), 'enclave')} of this launch left over, with all that was granted: "
            f"{some_of(alone, 8)}; to revoke and remove: secure-keystore remove {keystore} {' '.join(alone)}"
        )
    if shared := [name for name, is_shared in shares.items() if is_shared]:
        yield (
            f"{some_of(shared, 8)}: other launches use this too, and it still has the share of this launch, which "
            f"does not need it any more; to end all shares of this launch, before it is started again: "
            f"secure-keystore shares {keystore} --drop {shlex.quote(owner)}"
        )


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
        raise InvalidInputError(f"enclave {quoted(twice)} is given twice; merge its profiles into one policy")
    return policies


def bring_about(
    root: Path, wanted: Mapping[str, WantedEnclave], options: ProvisionOptions
) -> ProvisionReport:
    """Compare, and reconcile what differs. ``root`` is resolved, the names are valid and in order."""
    now = options.now or utc_now()
    if options.now is None and not options.accept_clock:
        refuse_clock_before_program(now, quoted(root))
    refuse_foreign_owner(root, wanted)
    if (report := compare(root, wanted, options, now)) is None:
        report = reconcile(root, wanted, options, now)
        report = report._replace(warnings=(*report.warnings, *follow(root, options)))
    view = KeystoreView(root)
    limited = _limited_by_ca(view, report, options)
    return report._replace(warnings=(*report.warnings, *limited, *exposures(view)))


def _limited_by_ca(view: KeystoreView, report: ProvisionReport, options: ProvisionOptions) -> Iterator[str]:
    """Report that new certificates end with a CA, before the requested end."""
    requested = options.requested_end()
    if requested is None or not any(enclave.actions for enclave in report.enclaves):
        return
    for role in Role:
        end = view.ca(role).validity.not_after
        if end < requested:
            yield (
                f"the {role.label} ends at {iso(end)}, before the requested {iso(requested)}: so do the new "
                "certificates and permissions"
            )
            return


def create_enclaves(
    keystore: Path | str,
    names: Iterable[str],
    *,
    allow_all: bool = False,
    options: ProvisionOptions | None = None,
) -> ProvisionReport:
    """Create enclaves in a keystore that exists: without ``allow_all`` new ones may do nothing, others as before."""
    root = resolve_root(keystore)
    chosen = with_domains(root, _lasting_as_requested(options or ProvisionOptions()))
    ordered = sorted({validate_enclave_name(name) for name in names})
    wanted = {
        name: WantedEnclave(_allow_all(name, chosen) if allow_all else keep, ends_by=chosen.requested_end())
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
    chosen = _lasting_as_requested(options or ProvisionOptions())
    return provision(keystore, policy.enclaves, options=chosen)


def _lasting_as_requested(options: ProvisionOptions) -> ProvisionOptions:
    """Give a requested life to existing enclaves too: what expires an hour sooner or later is issued again."""
    end = options.requested_end()
    within = options.renew_within if end is None else end - (options.now or utc_now()) - timedelta(hours=1)
    return options._replace(create=False, renew_within=max(options.renew_within, within))


def list_enclaves(keystore: Path | str) -> list[str]:
    """Return the names of all enclaves, sorted; the root is ``/``. Raises NotAKeystoreError."""
    view = keystore_at(keystore)
    return view.enclaves()


def drop_shares(
    keystore: Path | str, owner: str, *, options: ProvisionOptions | None = None
) -> ProvisionReport:
    """Take the shares of a launch out of every enclave; what no other launch requests is taken away for good.

    Raises InvalidInputError when it has none, or while a launch runs on one of these enclaves.
    """
    root = keystore_at(keystore).root
    chosen = with_domains(root, (options or ProvisionOptions())._replace(create=False))
    wanted = {one.enclave: WantedEnclave(one.document, share=one) for one in given_up(root, owner)}
    return bring_about(root, wanted, chosen)


# Bounds what an interrupted run loses, and how often the disk is waited for.
_BATCH = 250
_CRL_MARGIN = timedelta(days=30)
"""A longer margin is meant for certificates: a CRL lives for a year only."""


def reconcile(
    root: Path, wanted: Mapping[str, WantedEnclave], options: ProvisionOptions, now: datetime
) -> ProvisionReport:
    """Complete the keystore, then every enclave that is not as wanted."""
    require("cryptography", "asn1crypto", "lxml")
    # An impossible validity is refused before a keystore is made for it.
    lifetime = DEFAULT_LIFETIME if options.lifetime is None else options.lifetime
    Validity.starting(now, lifetime, until=options.valid_until)
    if options.create:
        store.create_root(root)
    with opened_for_change(root, now, options) as opened:
        done, warnings = _complete_keystore(opened, options, now)
        done = [*opened.notes, *done]
        view = KeystoreView(root)
        refuse_foreign_authorities(view, opened.register if opened.has_register else None)
        writer = EnclaveWriter(opened, view, options, now)
        wanted = {name: _as_it_is_now(one) for name, one in wanted.items()}
        states = _states(opened, view, writer, wanted, options, now)
        refuse_without_keys(view, states, {name: one.permissions for name, one in wanted.items()})
        _record_shares(opened, wanted)
        reports = _write_all(opened, writer, states, wanted, options.progress)
        if writer.has_revoked:
            publish_crl(opened, opened.register, options.access, now)
            warnings.append(
                "certificates were revoked: deploy crl.pem to every host and restart what runs there; participants "
                "read it when they start"
            )
    warnings += shares_in_use(one.share for one in wanted.values() if one.share is not None)
    return ProvisionReport(root, tuple(done), reports, (*warnings, *writer.warnings))


def rehearse(
    opened: Store,
    wanted: Mapping[str, WantedEnclave],
    options: ProvisionOptions,
    now: datetime,
    successors: Mapping[Role, Authority],
) -> None:
    """Sign everything as these CAs would, and throw it away.

    What would stop ``reconcile`` raises here, before the CAs are replaced and the other enclaves depend on its success.
    """
    view = KeystoreView(opened.root, successors)
    writer = EnclaveWriter(opened, view, options, now)
    governance_for(view, opened.register, options.domains or governance_domains(view))
    states = _states(opened, view, writer, wanted, options, now)
    batch = Batch(opened)
    try:
        for state in states:
            if not state.is_good:
                writer.write(batch, state, wanted[state.enclave].permissions)
    except OSError as error:
        raise StorageError.of(error, "writing the keystore") from None
    finally:
        batch.discard()


def _states(
    opened: Store,
    view: KeystoreView,
    writer: EnclaveWriter,
    wanted: Mapping[str, WantedEnclave],
    options: ProvisionOptions,
    now: datetime,
) -> list[EnclaveState]:
    """Inspect the enclaves; raises InvalidInputError for names or subjects that would be confused."""
    register = opened.register if opened.has_register else None
    check_distinct(dict.fromkeys((*view.enclaves(), *wanted)))
    states = [inspect_wanted(view, register, name, one, options, now) for name, one in wanted.items()]
    writer.check_subjects(states)
    return states


def _as_it_is_now(one: WantedEnclave) -> WantedEnclave:
    """Compare again under the lock: shares that others wrote since the comparison count."""
    if one.share is None:
        return one
    share = replace(one.share)
    return one._replace(share=share, permissions=share.document)


def _record_shares(opened: Store, wanted: Mapping[str, WantedEnclave]) -> None:
    with opened.batch() as batch:
        for one in wanted.values():
            if one.share is not None and not one.share.is_recorded():
                one.share.record(opened, batch)


def _complete_keystore(
    opened: Store, options: ProvisionOptions, now: datetime
) -> tuple[list[str], list[str]]:
    domains = options.domains or governance_domains(KeystoreView(opened.root))
    creation = CreateOptions(
        domains=domains,
        subjects=options.subjects or SubjectScheme.EXACT,
        ca_lifetime=options.ca_lifetime,
        access=options.access,
        durable=options.durable,
        now=now,
    )
    report = complete(opened, creation)
    done = list(report.actions)
    if renew_governance(opened, domains, options.access, now):
        done.append(f"governance signed for domains {domains}")
    done += restore_crl(opened, options.access, now, min(options.renew_within, _CRL_MARGIN))
    return done, list(report.warnings)


def _write_all(
    opened: Store,
    writer: EnclaveWriter,
    states: list[EnclaveState],
    wanted: Mapping[str, WantedEnclave],
    progress: Progress | None,
) -> tuple[EnclaveReport, ...]:
    """Write in batches: bounded loss if interrupted, few calls to make it durable."""
    reports = {state.enclave: as_found(state) for state in states}
    todo = [state for state in states if not state.is_good]
    for start in range(0, len(todo), _BATCH):
        part = todo[start : start + _BATCH]
        with opened.batch() as batch:
            for position, state in enumerate(part, start + 1):
                reports[state.enclave] = writer.write(batch, state, wanted[state.enclave].permissions)
                if progress is not None:
                    progress(position, len(todo))
            writer.record(batch)
    return tuple(reports.values())


def _replaceable(folders: Iterable[Finding]) -> Iterator[str]:
    for finding in folders:
        if finding.severity.fails:
            yield f"{finding.place} {finding.message}; {finding.repair}"


def exposures(view: KeystoreView) -> Iterator[str]:
    """Yield what works and exposes the keystore all the same; a cheap part of ``verify``, without an XML parser."""
    if not view.is_complete:
        return
    if view.shares_one_ca:
        yield (
            "this keystore has one CA for identities and permissions (CVE-2023-24010, CVE-2023-24011); "
            "secure-keystore renew separates them"
        )
    files = [name for role in Role if (name := view.key_file(role)) is not None]
    if any(os.stat(view.root / name).st_mode & 0o077 for name in files):
        yield (
            "the CA keys can be read by others; secure-keystore renew closes them. Whoever read them can make any "
            "enclave: secure-keystore renew --ca start replaces them"
        )
    yield from _replaceable(check_parents(view.root))
    with suppress(KeystoreError):
        for weakness in weaknesses(governance_in_force(view)):
            yield f"the governance is weaker than the default: {weakness}"
