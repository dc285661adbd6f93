"""CAs replaced: with an overlap in which old and new are trusted, or at once.

    start    a new CA is made and trusted besides the old one; everything stays signed by the old one
    switch   everything is signed by the new CA; the old one is still trusted
    finish   the old CA is trusted no more

Deploy after each step. As measured: Fast DDS trusts every certificate in ``identity_ca.cert.pem``, so robots can take
``switch`` one by one, as far as the identity CA goes. Cyclone DDS reads only the first, and neither bridges a change of
the permissions CA: there ``switch`` is a change of all participants together. A CRL names one CA and both read only
one, so a keystore with revocations skips the overlap: the CRL goes with the old CA.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Mapping
from contextlib import suppress
from datetime import datetime
from enum import Enum
from pathlib import Path

from enclave_common.terminal import quoted
from enclave_common.words import some_of
from keystore.add_ons import follow
from keystore.disk import layout, safe_files, store
from keystore.disk.signed_documents import governance_stands
from keystore.disk.store import Content, Store, refresh_copies
from keystore.disk.view import KeystoreView, keystore_at
from keystore.errors import DamagedKeystoreError, InvalidInputError
from keystore.formats.bundle import handover_json
from keystore.formats.certificate import read_certificate
from keystore.formats.register import AuthorityState
from keystore.formats.role import Role
from keystore.formats.tool_needs import is_tool_enclave
from keystore.formats.validity import utc_now
from keystore.signing import smime
from keystore.signing.authority import Authority, authority_of
from keystore.signing.ca_access import CaAccess
from keystore.signing.public_key import fingerprint, issued_by
from keystore.signing.smime import sign_document
from keystore.signing.token_key import open_key
from keystore.steps.comparison import WantedEnclave, with_domains
from keystore.steps.creation import CreateOptions, new_ca
from keystore.steps.crl import drop_crl
from keystore.steps.incoming_ca import install_incoming, put_incoming
from keystore.steps.opening import opened_for_change
from keystore.steps.options import ProvisionOptions, ProvisionReport
from keystore.steps.provisioning import bring_about, keep, rehearse
from keystore.steps.removal import RemoveOptions, remove


class Step(str, Enum):
    """The three steps in which a CA is replaced without a stop: both trusted, the new one signs, the old one
    goes."""

    START = "start"
    SWITCH = "switch"
    FINISH = "finish"


def roll_over(
    keystore: Path | str,
    step: Step,
    roles: Collection[Role] = tuple(Role),
    *,
    options: ProvisionOptions | None = None,
    encrypt: bool = False,
    lost_key: bool = False,
) -> ProvisionReport:
    """Do one step of replacing CAs; repeating an interrupted step completes it.

    ``lost_key``: the key of the permissions CA is gone, so no handover to the next CA can be signed.

    Raises InvalidInputError for a step out of order. What would stop ``start`` or ``switch`` half-way raises before
    anything is written: SigningUnavailableError for a key that does not open, DamagedKeystoreError for a document.
    """
    chosen = (options or ProvisionOptions())._replace(create=False)
    root = keystore_at(keystore).root
    now = chosen.now or utc_now()
    creation = _creation(chosen, now, encrypt)
    with opened_for_change(root, now, chosen) as opened:
        install_incoming(opened)
        wanted = {name: WantedEnclave(keep) for name in KeystoreView(root).enclaves()}
        tools = tool_enclaves(KeystoreView(root))
        for name, end in tools.items():
            if end <= now:
                del wanted[name]  # not worth a signature of the new CA
        if step is Step.START:
            _refuse_without_keys(opened, roles, chosen.access, lost_key)
        for role in roles:
            _forget_installed(opened, role)
        if step is Step.SWITCH and (successors := _successors(opened, roles, chosen.access)):
            rehearse(opened, wanted, with_domains(root, chosen), now, successors)
        if step is Step.FINISH:
            _refuse_to_strand(opened, roles)
            _refuse_without_start(opened, roles)
        done = [_STEPS[step](opened, role, creation) for role in roles]
        if step is Step.START and not lost_key:
            _hand_over(opened, chosen.access)
        elif step is Step.START:
            opened.remove(layout.SIGNED_HANDOVER)
            done.append("no handover: pin the new CAs on each host, secure-keystore import --require-ca")
        refresh_copies(opened)
    if step is not Step.SWITCH:
        warnings = tuple(follow(root, chosen))
        return ProvisionReport(root, tuple(text for text in done if text), (), warnings)
    robots = {name: one for name, one in wanted.items() if name not in tools}
    report = bring_about(root, robots, with_domains(root, chosen))
    report = with_tools_reissued(report, tools, chosen, now)
    return report._replace(created=(*(text for text in done if text), *report.created))


def tool_enclaves(view: KeystoreView) -> dict[str, datetime]:
    """Return the enclaves of tools whose certificate can be read, and when each ends."""
    facts = {name: view.readable_certificate(name) for name in view.enclaves() if is_tool_enclave(name)}
    return {name: found.validity.not_after for name, found in facts.items() if found is not None}


def with_tools_reissued(
    report: ProvisionReport, tools: Mapping[str, datetime], options: ProvisionOptions, now: datetime
) -> ProvisionReport:
    """Issue the enclaves of tools again under the present CAs, each for what is left of its life; remove ended ones."""
    root = report.keystore
    for name, end in tools.items():
        if end > now:
            until = with_domains(root, options._replace(lifetime=None, valid_until=end))
            again = bring_about(root, {name: WantedEnclave(keep)}, until)
            report = report._replace(
                enclaves=(*report.enclaves, *again.enclaves),
                warnings=tuple(dict.fromkeys((*report.warnings, *again.warnings))),
            )
    if ended := [name for name, end in tools.items() if end <= now]:
        changing = RemoveOptions(
            access=options.access,
            lock_timeout=options.lock_timeout,
            durable=options.durable,
            now=options.now,
            revoke=False,
        )
        remove(root, ended, options=changing)
        removed = f"removed {some_of(ended, 8)}: made for tools, and ended"
        report = report._replace(created=(*report.created, removed))
    return report


def _creation(options: ProvisionOptions, now: datetime, encrypt: bool) -> CreateOptions:
    return CreateOptions(
        ca_lifetime=options.ca_lifetime,
        access=options.access,
        encrypt_ca_keys=encrypt,
        now=now,
    )


def _refuse_without_keys(opened: Store, roles: Collection[Role], access: CaAccess, lost_key: bool) -> None:
    """Open the keys before anything is written. The permissions CA signs who follows; an identity CA may be elsewhere.

    What opens the present keys encrypts the new ones, too.
    """
    view = KeystoreView(opened.root)
    if lost_key and (Role.PERMISSIONS not in roles or not opened.has_register):
        raise InvalidInputError("--lost-key is for the permissions CA of a keystore that issues")
    for role in Role:
        if (role is Role.PERMISSIONS and not lost_key) or (
            role is Role.IDENTITY and role in roles and view.key_file(role) is not None
        ):
            view.authority(role, access)


def _successors(opened: Store, roles: Collection[Role], access: CaAccess) -> dict[Role, Authority]:
    """Return the new CAs ready to sign; none of a role that is switched already."""
    found = {}
    for role in roles:
        if opened.is_directory(_waiting(role)):
            place = quoted(opened.root / _waiting(role))
            cert = safe_files.read(opened.root, f"{_waiting(role)}/{layout.CERT}")
            key = safe_files.read_private(opened.root, f"{_waiting(role)}/{layout.KEY}")
            found[role] = authority_of(read_certificate(cert, place), open_key(key, place, access), place)
        elif not _is_switched(opened, role):
            raise InvalidInputError(f"there is no new {role.label} yet: first --ca start, and deploy")
    return found


def _is_switched(opened: Store, role: Role) -> bool:
    retired = any((opened.root / layout.RETIRED).glob(f"{role.value}-*.cert.pem"))
    return retired or len(KeystoreView(opened.root).ca_bundle(role)) > 1


def _start(opened: Store, role: Role, creation: CreateOptions) -> str:
    view = KeystoreView(opened.root)
    if view.shares_one_ca:
        raise InvalidInputError(
            "one CA for identities and permissions: first run secure-keystore renew KEYSTORE"
        )
    if not opened.is_directory(_waiting(role)):
        made, key = new_ca(role, creation)
        opened.ensure_directory(layout.PRIVATE)
        opened.ensure_directory(layout.NEXT)
        pair = {layout.KEY: Content(key, store.PRIVATE_MODE), layout.CERT: Content(made.facts.pem)}
        with opened.batch() as batch:
            batch.record(opened.register.with_authority(role, made.facts.der, AuthorityState.WAITING))
            batch.directory(_waiting(role), pair)
    new = safe_files.read(opened.root, f"{_waiting(role)}/{layout.CERT}")
    return _trust(opened, role, view.ca(role).pem + new)


def _hand_over(opened: Store, access: CaAccess) -> None:
    """Let the present permissions CA sign who follows; hosts that miss the next steps are shown it."""
    view = KeystoreView(opened.root)
    named = {role: tuple(fingerprint(ca.der) for ca in view.ca_bundle(role)) for role in Role}
    document = handover_json(named)
    present = safe_files.read_if_there(opened.root, layout.SIGNED_HANDOVER)
    if present is not None and smime.read(present, layout.SIGNED_HANDOVER).document == document:
        return
    signed = sign_document(document, view.authority(Role.PERMISSIONS, access))
    with opened.batch() as batch:
        batch.file(layout.SIGNED_HANDOVER, signed, store.PRIVATE_MODE)


def _trust(opened: Store, role: Role, bundle: bytes) -> str:
    target = layout.ca_cert(role)
    if safe_files.read_if_there(opened.root, target) == bundle:
        return ""
    with opened.batch() as batch:
        batch.file(target, bundle)
    return f"{role.label}: trust anchors written"


def _switch(opened: Store, role: Role, creation: CreateOptions) -> str:
    if not opened.is_directory(_waiting(role)):
        return ""  # switched already
    view = KeystoreView(opened.root)
    new = safe_files.read(opened.root, f"{_waiting(role)}/{layout.CERT}")
    key = safe_files.read_private(opened.root, f"{_waiting(role)}/{layout.KEY}")
    bundle = new
    if read_certificate(new, _waiting(role)).der != view.ca(role).der:
        old = retire(opened, role)
        bundle = new if role is Role.IDENTITY and view.has_crl else new + old
        put_incoming(opened, role, bundle, key)
        install_incoming(opened)
    if role is Role.IDENTITY and view.has_crl:
        drop_crl(opened)
        _retire_for_good(opened, role)
    _forget_next(opened, role)
    return f"{role.label} replaced"


def retire(opened: Store, role: Role) -> bytes:
    """Keep the certificate in use among the retired, whose documents may be signed again; as PEM."""
    facts = KeystoreView(opened.root).ca(role)
    pem = facts.pem
    opened.ensure_directory(layout.PRIVATE)
    opened.ensure_directory(layout.RETIRED)
    with opened.batch() as batch:
        batch.file(f"{layout.RETIRED}/{role.value}-{facts.serial:040x}.cert.pem", pem)
    return pem


def _forget_installed(opened: Store, role: Role) -> None:
    """Remove what an interrupted ``switch`` left: the key goes first, and only after it was installed."""
    waiting = opened.root / _waiting(role)
    if waiting.is_dir() and not os.path.lexists(waiting / layout.KEY):
        _forget_next(opened, role)


def _forget_next(opened: Store, role: Role) -> None:
    for name in (layout.KEY, layout.CERT):
        opened.remove(f"{_waiting(role)}/{name}")
    opened.remove_empty_directory(_waiting(role))
    opened.remove_empty_directory(layout.NEXT)


def _finish(opened: Store, role: Role, creation: CreateOptions) -> str:
    if opened.is_directory(_waiting(role)):
        raise InvalidInputError(
            f"everything is still signed by the old {role.label}: first --ca switch, and deploy"
        )
    said = _trust(opened, role, KeystoreView(opened.root).ca(role).pem)
    _retire_for_good(opened, role)
    return said


def _refuse_without_start(opened: Store, roles: Collection[Role]) -> None:
    states = {state for (role, _), state in opened.register.authorities.items() if role in roles}
    if states <= {AuthorityState.IN_USE}:
        raise InvalidInputError(
            "no CA is being replaced: first secure-keystore renew KEYSTORE --ca start, deploy, --ca switch, deploy, "
            "and then --ca finish"
        )


def _retire_for_good(opened: Store, role: Role) -> None:
    """Record the retirement after the trust file is written: an old CA that is put back there is found."""
    retired = opened.register.with_retired([role])
    if retired != opened.register:
        with opened.batch() as batch:
            batch.record(retired)


def _refuse_to_strand(opened: Store, roles: Collection[Role]) -> None:
    view = KeystoreView(opened.root)
    stranded = [name for name in view.enclaves() if _hangs_on_old_ca(view, name, roles)]
    governance = Role.PERMISSIONS in roles and not governance_stands(view, None)
    if not stranded and not governance:
        return
    what = []
    if stranded:
        some = ", ".join(stranded[:3]) + (" ..." if len(stranded) > 3 else "")
        what.append(f"{len(stranded)} of {len(view.enclaves())} enclaves ({some})")
    if governance:
        what.append("the governance")
    raise InvalidInputError(
        f"{' and '.join(what)} still belong to the old CA and would be trusted no more; complete the switch first: "
        "secure-keystore renew KEYSTORE --ca switch, then deploy"
    )


def _hangs_on_old_ca(view: KeystoreView, enclave: str, roles: Collection[Role]) -> bool:
    signed = view.enclave_file(enclave, layout.PERMISSIONS)
    with suppress(DamagedKeystoreError):
        facts = view.certificate(enclave) if Role.IDENTITY in roles else None
        if facts is not None and not issued_by(facts, view.ca(Role.IDENTITY)):
            return True
        if Role.PERMISSIONS in roles and signed:
            return not smime.read(signed, layout.enclave_directory(enclave)).embeds(
                view.ca(Role.PERMISSIONS).der
            )
    return False


def separate_permissions_ca(
    opened: Store,
    wanted: Mapping[str, WantedEnclave],
    options: ProvisionOptions,
    now: datetime,
    *,
    encrypt: bool,
) -> None:
    """Give a keystore with a single CA its own permissions CA; ``bring_about`` signs all again.

    Raises before anything is written if that would not succeed.
    """
    KeystoreView(opened.root).authority(Role.IDENTITY, options.access)
    made, key = new_ca(Role.PERMISSIONS, _creation(options, now, encrypt))
    rehearse(opened, wanted, options, now, {Role.PERMISSIONS: made})
    retire(opened, Role.PERMISSIONS)
    put_incoming(opened, Role.PERMISSIONS, made.facts.pem, key)
    install_incoming(opened)
    _retire_for_good(opened, Role.PERMISSIONS)


def _waiting(role: Role) -> str:
    return f"{layout.NEXT}/{role.value}"


_STEPS = {Step.START: _start, Step.SWITCH: _switch, Step.FINISH: _finish}
