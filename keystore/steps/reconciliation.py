"""A keystore made what is wanted of it: under the lock, in batches."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path

from enclave_common.dependencies import require
from keystore.disk import store
from keystore.disk.authorities import refuse_foreign_authorities
from keystore.disk.signed_documents import governance_domains
from keystore.disk.store import Store
from keystore.disk.view import KeystoreView
from keystore.formats.enclave_name import check_distinct
from keystore.formats.validity import DEFAULT_LIFETIME, Validity
from keystore.steps.comparison import WantedEnclave, as_found, inspect_wanted
from keystore.steps.creation import CreateOptions, complete
from keystore.steps.crl import publish_crl, restore_crl
from keystore.steps.enclave_state import EnclaveState
from keystore.steps.enclave_writing import EnclaveWriter
from keystore.steps.governance import renew_governance
from keystore.steps.opening import opened_for_change
from keystore.steps.options import EnclaveReport, Progress, ProvisionOptions, ProvisionReport
from keystore.steps.sharing import kept_shares
from keystore.steps.signing_here import refuse_without_keys

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
    Validity.starting(now, lifetime, until=options.valid_until, backdate=options.backdate)
    with _locked(root, options, now) as opened:
        done, warnings = _complete_keystore(opened, options, now)
        done = [*opened.notes, *done]
        view = KeystoreView(root)
        register = opened.register if opened.has_register else None
        refuse_foreign_authorities(view, register)
        check_distinct(dict.fromkeys((*view.enclaves(), *wanted)))
        writer = EnclaveWriter(opened, view, options, now)
        wanted = {name: _as_it_is_now(one) for name, one in wanted.items()}
        states = [inspect_wanted(view, register, name, one, options, now) for name, one in wanted.items()]
        refuse_without_keys(view, states, wanted)
        writer.check_subjects(states)
        _record_shares(opened, wanted)
        reports = _write_all(opened, writer, states, wanted, options.progress)
        if writer.has_revoked:
            publish_crl(opened, opened.register, options.access, now)
            warnings.append(
                "certificates were revoked: deploy crl.pem to every host and restart what runs there; participants "
                "read it when they start"
            )
    warnings += kept_shares(one.share for one in wanted.values() if one.share is not None)
    return ProvisionReport(root, tuple(done), reports, (*warnings, *writer.warnings))


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


@contextmanager
def _locked(root: Path, options: ProvisionOptions, now: datetime) -> Iterator[Store]:
    if options.create:
        store.create_root(root)
    with opened_for_change(root, now, options) as opened:
        yield opened


def _complete_keystore(
    opened: Store, options: ProvisionOptions, now: datetime
) -> tuple[list[str], list[str]]:
    domains = options.domains or governance_domains(KeystoreView(opened.root))
    creation = replace(
        options.creation or CreateOptions(),
        domains=domains,
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
