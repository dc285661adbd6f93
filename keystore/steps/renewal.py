"""Renewal of what ends soon, and repair of keystores that SROS2 or an accident left exposed.

Certificate and permissions are always renewed together, so that they end together. Keys stay unless new ones are
requested. Repair means: separate CAs where one was shared, certificates that cannot sign documents, subjects nobody
else's permissions fit, private modes. A new permissions CA makes every document change: deploy all enclaves together.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Iterable
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from pathlib import Path

from enclave_common.terminal import quoted
from enclave_common.words import counted, some_of
from keystore.disk import layout, safe_files
from keystore.disk.crl_file import listed_in
from keystore.disk.register_file import describe, read_register
from keystore.disk.store import Store, refresh_copies
from keystore.disk.view import KeystoreView, keystore_at
from keystore.errors import DamagedKeystoreError, InvalidInputError
from keystore.formats.certificate import read_der
from keystore.formats.enclave_name import validate_enclave_name
from keystore.formats.given_file import read_given
from keystore.formats.role import Role
from keystore.formats.subject import SubjectScheme, scheme_of
from keystore.formats.tool_needs import is_tool_enclave
from keystore.formats.validity import iso, utc_now
from keystore.steps import rollover
from keystore.steps.comparison import WantedEnclave, with_domains
from keystore.steps.crl import restore_crl
from keystore.steps.enclave_state import Reissue
from keystore.steps.governance import mirror_governance
from keystore.steps.incoming_ca import install_incoming
from keystore.steps.opening import opened_for_change, with_crls
from keystore.steps.options import ProvisionOptions, ProvisionReport
from keystore.steps.provisioning import bring_about, keep
from keystore.steps.removal import revoke_replaced

DEFAULT_WITHIN = timedelta(days=30)


@dataclass(frozen=True, slots=True)
class RenewOptions:
    """Options of a renewal. ``within``: what ends sooner is due. ``provisioning`` carries lifetime, subjects, access
    and more."""

    within: timedelta = DEFAULT_WITHIN
    everything: bool = False
    new_keys: bool = False
    revoke_old: bool = False
    """Also revoke the certificates that these enclaves had before: for keys that may have been copied."""
    encrypt_ca_keys: bool = False
    adopt_crl: Path | None = None
    """A CRL of this keystore's identity CA that a host has: what it lists stays revoked."""
    provisioning: ProvisionOptions = field(default_factory=ProvisionOptions)


def renew(
    keystore: Path | str, enclaves: Iterable[str] | None = None, *, options: RenewOptions | None = None
) -> ProvisionReport:
    """Renew these enclaves; without a list all that is due or exposed, but no tool's. Repeating does nothing more.

    Each gets the lifetime that it was granted before, unless one is requested. Raises InvalidInputError for an
    enclave that is not there and for new keys of nobody, SigningUnavailableError without the CA keys.
    """
    chosen = options or RenewOptions()
    if chosen.new_keys and enclaves is None and not chosen.everything:
        raise InvalidInputError(
            "new keys for whom? Name the enclaves (secure-keystore renew KEYSTORE /a /b --new-keys), or give --all"
        )
    view = keystore_at(keystore)
    root = view.root
    provisioning = chosen.provisioning._replace(create=False)
    now = provisioning.now or utc_now()
    named = None if enclaves is None else sorted({validate_enclave_name(name) for name in enclaves})
    view.require_enclaves(named or ())
    due = provisioning if named is not None else provisioning._replace(renew_within=chosen.within)
    with opened_for_change(root, now, provisioning) as opened:
        install_incoming(opened)
        if chosen.adopt_crl is not None:
            _adopt(opened, chosen.adopt_crl)
        repaired = [*opened.notes, *_restore_trust_files(opened)]
        view = KeystoreView(root)
        wanted = {
            name: _wanted(view, name, named, chosen)
            for name in view.enclaves()
            if name in (named or ()) or not is_tool_enclave(name)
        }
        due = with_domains(root, due)
        tools: dict[str, datetime] = {}
        if view.shares_one_ca:
            tools = {name: end for name, end in rollover.tool_enclaves(view).items() if name not in wanted}
            rollover.separate_permissions_ca(opened, wanted, due, now, encrypt=chosen.encrypt_ca_keys)
            repaired.append("permissions CA separated from the identity CA; deploy all enclaves together")
        repaired += [f"made {name} private" for name in _close_modes(opened)]
        repaired += restore_crl(opened, provisioning.access, now, chosen.within)
        if mirror_governance(opened):
            repaired.append("governance.xml made equal to the signed governance.p7s")
    report = bring_about(root, wanted, due)
    report = rollover.with_tools_reissued(report, tools, provisioning, now)
    if chosen.revoke_old:
        with opened_for_change(root, now, provisioning) as opened:
            changed = named if named is not None else [one.enclave for one in report.enclaves if one.actions]
            count = revoke_replaced(opened, changed, provisioning.access, now)
        repaired.append(
            f"revoked {counted(count, 'replaced certificate')}; deploy the new crl.pem to all enclaves"
        )
        report = _with_names_of_their_own(root, report, due)
    else:
        report = report._replace(warnings=(*report.warnings, *_still_valid(root, report, now)))
    return report._replace(created=(*repaired, *report.created))


def _adopt(opened: Store, place: Path) -> None:
    """Take over the list of a host: after a restore from a backup it may know more than this keystore."""
    listed = listed_in(read_given(place), KeystoreView(opened.root).ca_bundle(Role.IDENTITY), quoted(place))
    if listed is None:
        raise InvalidInputError(f"{quoted(place)} is not a CRL that an identity CA of this keystore signed")
    register = with_crls(opened, [listed])
    with opened.batch() as batch:
        batch.record(register)


def _still_valid(root: Path, report: ProvisionReport, now: datetime) -> list[str]:
    """Return what was replaced and is usable by a copy of its key, until it expires or is revoked."""
    register = read_register(root)
    renewed = [one.enclave for one in report.enclaves if one.actions]
    earlier = [
        one
        for enclave in renewed
        for one in (register.of_enclave(enclave) if register is not None else ())
        if one.replaced and one.revoked is None and one.not_after > now
    ]
    if not earlier:
        return []
    names = list(dict.fromkeys(one.enclave for one in earlier))
    return [
        f"{counted(len(earlier), 'earlier certificate')} of {some_of(names, 3)} stay valid until "
        f"{iso(max(one.not_after for one in earlier))}; if a key may have been copied, revoke them: secure-keystore "
        f"renew {quoted(root)} {' '.join(names[:3])}{' ...' if len(names) > 3 else ''} --new-keys --revoke-old"
    ]


def _with_names_of_their_own(
    root: Path, report: ProvisionReport, options: ProvisionOptions
) -> ProvisionReport:
    """On Zenoh, where a router goes by names: what has the name of a revoked certificate gets another one."""
    view = KeystoreView(root)
    register = read_register(root)
    if register is None or not view.has_zenoh_router:
        return report
    revoked = {
        (one.enclave, one.subject) for one in register.certificates.values() if one.revoked is not None
    }
    wanted = {
        name: WantedEnclave(keep, Reissue.CERTIFICATE)
        for name in view.zenoh_enclaves()
        if (name, view.common_name(name)) in revoked
    }
    again = bring_about(root, wanted, with_domains(root, options)) if wanted else None
    return report if again is None else again._replace(enclaves=(*report.enclaves, *again.enclaves))


def _wanted(view: KeystoreView, name: str, named: list[str] | None, options: RenewOptions) -> WantedEnclave:
    """Decide what is renewed; enclaves not named are only completed, as any change of a CA demands it of all."""
    requested = name in named if named is not None else options.everything or _is_exposed(view, name, options)
    if not requested:
        return WantedEnclave(keep)
    return WantedEnclave(keep, Reissue.KEY_PAIR if options.new_keys else Reissue.CERTIFICATE)


def _is_exposed(view: KeystoreView, name: str, options: RenewOptions) -> bool:
    """Return whether a certificate could sign documents, or has a subject that another enclave's permissions match.

    What another company's CA issued cannot be replaced here, and ``verify`` reports it.
    """
    facts = view.readable_certificate(name)
    if facts is None or view.key_file(Role.IDENTITY) is None:
        return False
    scheme = options.provisioning.subjects or view.settings.subjects
    borrows = (
        scheme is SubjectScheme.EXACT and scheme_of(facts.common_name or "/") is SubjectScheme.COMPATIBLE
    )
    return facts.can_sign_mail or borrows


def _restore_trust_files(opened: Store) -> list[str]:
    if not opened.has_register:
        return []
    done: list[str] = []
    for role in Role:
        trusted = opened.register.trusted_authorities(role)
        try:
            found = KeystoreView(opened.root).ca_bundle(role)
        except DamagedKeystoreError:
            kept, said = (
                trusted,
                [f"{layout.ca_cert(role)} was not in the form that is written here; written again"],
            )
        else:
            kept = [ca for ca in trusted if ca in (found_ca.der for found_ca in found)] or trusted[:1]
            said = [
                "CA that this keystore did not make, or has retired, removed from "
                f"{layout.ca_cert(role)}: {describe(ca)}"
                for ca in found
                if ca.der not in trusted
            ]
        if said and kept:
            with opened.batch() as batch:
                batch.file(layout.ca_cert(role), b"".join(read_der(ca).pem for ca in kept))
            done += said
    if done:
        refresh_copies(opened)
    return done


def _close_modes(opened: Store) -> list[str]:
    candidates = {layout.PRIVATE: 0o700, layout.SHARED_CA_KEY: 0o600}
    candidates |= {layout.ca_key(role): 0o600 for role in Role}
    closed = []
    for name, mode in candidates.items():
        path = opened.root / name
        if os.path.lexists(path) and not path.is_symlink() and stat.S_IMODE(os.lstat(path).st_mode) & 0o077:
            safe_files.refuse_unsafe_private(opened.root, name)
            opened.set_mode(name, mode)
            closed.append(name)
    return closed
