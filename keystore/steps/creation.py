"""A new keystore, or the missing parts of one: CAs, governance, settings. The same call completes what an
interrupted run left; what is there is never made anew.

A new CA's certificate and key are published together (``steps.incoming_ca``).
"""

from __future__ import annotations

import os
import shlex
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import timedelta
from pathlib import Path

from enclave_launch.boundary.dependencies import require
from enclave_launch.boundary.files import read_bytes
from keystore.disk import layout, safe_files, store
from keystore.disk.safe_files import resolve_root
from keystore.disk.settings import KeystoreSettings
from keystore.disk.store import Store
from keystore.disk.view import KeystoreView
from keystore.errors import DamagedKeystoreError, InvalidInputError, NotAKeystoreError, printable
from keystore.formats.certificate import CertificateFacts, read_certificate
from keystore.formats.domains import Domains
from keystore.formats.governance import Governance, governance_document, parse_governance
from keystore.formats.register import AuthorityState
from keystore.formats.role import Role
from keystore.formats.subject import SubjectScheme
from keystore.formats.validity import DEFAULT_BACKDATE, DEFAULT_LIFETIME, Validity, utc_now
from keystore.signing import authority
from keystore.signing.authority import Authority, Curve, check_can_serve
from keystore.signing.ca_access import CaAccess, Secret
from keystore.signing.public_key import key_kind
from keystore.signing.signer import FileSigner, open_signer
from keystore.steps.governance import write_governance
from keystore.steps.incoming_ca import install_incoming, put_incoming
from keystore.steps.opening import ChangeOptions, opened_for_change


@dataclass(frozen=True, slots=True)
class ImportedCa:
    """An existing CA: its PEM certificate and its PEM key, or a file with the key's ``pkcs11:`` URI. Without ``key`` an
    identity CA of somebody else (Vault, step-ca, cert-manager), which issues certificates for requests."""

    certificate: Path
    key: Path | None = None


@dataclass(frozen=True, slots=True)
class CreateOptions(ChangeOptions):
    """``ca_lifetime``, ``lifetime`` (of enclaves) start at ``now``; ``names`` are the CAs' common names."""

    domains: Domains = field(default_factory=lambda: Domains.single(0))
    governance: Governance | None = None
    subjects: SubjectScheme = SubjectScheme.EXACT
    curve: Curve = Curve.P256
    ca_lifetime: timedelta = DEFAULT_LIFETIME
    lifetime: timedelta = DEFAULT_LIFETIME
    backdate: timedelta = DEFAULT_BACKDATE
    names: Mapping[Role, str] = field(default_factory=dict)
    imported: Mapping[Role, ImportedCa] = field(default_factory=dict)
    encrypt_ca_keys: bool = False
    """Encrypt new CA keys with ``access.passphrase``."""

    @property
    def settings(self) -> KeystoreSettings:
        return KeystoreSettings(self.subjects, self.curve, self.lifetime)


@dataclass(frozen=True, slots=True)
class CreateReport:
    """``actions`` in words, empty when the keystore was complete already."""

    keystore: Path
    actions: tuple[str, ...]
    warnings: tuple[str, ...] = ()


def create_keystore(keystore: Path | str, options: CreateOptions | None = None) -> CreateReport:
    """Create the keystore or complete it; a complete one is left as it is.

    Raises NotAKeystoreError for a directory with other things in it, InvalidInputError for a CA that cannot serve.
    """
    require("cryptography", "lxml")
    chosen = options or CreateOptions()
    root = resolve_root(keystore)
    _refuse_foreign(root)
    refuse_unusable(chosen)
    store.create_root(root)
    now = chosen.now or utc_now()
    with opened_for_change(root, now, chosen) as opened:
        return complete(opened, chosen)


def refuse_unusable(options: CreateOptions) -> None:
    """Before anything is written: options that no keystore can be made with. Raises InvalidInputError."""
    now = options.now or utc_now()
    for lifetime in (options.ca_lifetime, options.lifetime):
        Validity.starting(now, lifetime, backdate=options.backdate)
    for name in options.names.values():
        authority.refuse_ca_name(name)
    passphrase = passphrase_for_new_keys(options.encrypt_ca_keys, options.access)
    if passphrase is not None:
        passphrase.value()
    for role, given in options.imported.items():
        if given.key is None:
            _external_ca(role, options)
        else:
            _import_ca(role, options, [])


def _refuse_foreign(root: Path) -> None:
    view = KeystoreView(root)
    if not view.is_complete and not view.can_be_completed:
        raise NotAKeystoreError(
            f"{printable(root)} exists and is not a keystore; choose an empty or new directory"
        )


def complete(opened: Store, options: CreateOptions) -> CreateReport:
    """What ``create_keystore`` does once it holds the lock."""
    _refuse_foreign(opened.root)
    view = KeystoreView(opened.root)
    actions: list[str] = []
    warnings: list[str] = []
    install_incoming(opened)
    if not view.is_complete:
        _write_settings(opened, options, actions)
        for directory in (layout.PUBLIC, layout.PRIVATE, layout.ENCLAVES):
            opened.ensure_directory(directory)
    for role in Role:
        _complete_ca(opened, role, options, actions, warnings)
    _complete_governance(opened, options, actions)
    return CreateReport(opened.root, tuple(actions), tuple(warnings))


def _write_settings(opened: Store, options: CreateOptions, actions: list[str]) -> None:
    """Before anything else: it marks the directory as ours."""
    if os.path.lexists(opened.root / layout.SETTINGS) or os.path.lexists(opened.root / layout.PUBLIC):
        return
    with opened.batch() as batch:
        batch.file(layout.SETTINGS, options.settings.to_json())
    actions.append("settings written")


def _complete_ca(
    opened: Store, role: Role, options: CreateOptions, actions: list[str], warnings: list[str]
) -> None:
    has_cert = os.path.exists(opened.root / layout.ca_cert(role))
    view = KeystoreView(opened.root)
    if has_cert:
        if role in options.imported:
            _refuse_other_ca(opened, role, options.imported[role])
        _record_present_ca(opened, view, role)
        return  # a key may be missing: the CA may be kept elsewhere
    _refuse_foreign_enclaves(view, role)
    if role in options.imported and options.imported[role].key is None:
        facts = _external_ca(role, options)
        with opened.batch() as batch:
            batch.record(opened.register.with_authority(role, facts.der, AuthorityState.IN_USE))
            batch.file(layout.ca_cert(role), authority.pem_certificate(facts.der))
        actions.append(
            f"{role.value.replace('_ca', ' CA')} of somebody else imported; it signs what hosts request"
        )
        return
    if role in options.imported:
        made, key_name, key_bytes = _import_ca(role, options, warnings)
        verb = "imported"
    else:
        made, key_name, key_bytes = _make_ca(opened, view, role, options)
        verb = "created"
    put_incoming(opened, role, made.pem(), key_name, key_bytes)
    install_incoming(opened)
    actions.append(f"{role.value.replace('_ca', ' CA')} {verb}")
    if authority_kind(made) not in ("P-256", "RSA-2048"):
        warnings.append(
            f"the {role.value.replace('_ca', ' CA')} key is {authority_kind(made)}: "
            "Cyclone DDS accepts only P-256 and RSA-2048, Fast DDS any"
        )


def _record_present_ca(opened: Store, view: KeystoreView, role: Role) -> None:
    """Of a keystore that an earlier version, or SROS2, left incomplete: the register knows no CA of this role yet."""
    known = {its for (its, _), state in opened.register.authorities.items() if state is AuthorityState.IN_USE}
    if view.key_file(role) is not None and role not in known:
        with opened.batch() as batch:
            batch.record(opened.register.with_authority(role, view.ca(role).der, AuthorityState.IN_USE))


def _refuse_foreign_enclaves(view: KeystoreView, role: Role) -> None:
    """A bundle of stand-alone enclaves, or a lost CA: another CA would replace what these enclaves trust."""
    if view.key_file(role) is None and os.path.isdir(view.root / layout.ENCLAVES) and view.enclaves():
        raise DamagedKeystoreError(
            f"{printable(view.root)} holds enclaves, but not the {role.value.replace('_ca', ' CA')} they belong to: "
            "a deployed copy, or a keystore to restore from a backup"
        )


def authority_kind(made: Authority) -> str:
    """Algorithm and size of a CA's key, in words for a report."""
    return key_kind(made.facts.public_key)


def _refuse_other_ca(opened: Store, role: Role, imported: ImportedCa) -> None:
    given = read_certificate(_read_given(imported.certificate), printable(imported.certificate))
    if given.der != KeystoreView(opened.root).ca(role).der:
        raise InvalidInputError(
            f"the keystore has another {role.value} already; a CA is replaced with: "
            "secure-keystore renew KEYSTORE --ca start"
        )


def _make_ca(
    opened: Store, view: KeystoreView, role: Role, options: CreateOptions
) -> tuple[Authority, str, bytes]:
    """A new key and certificate; a key that is there already (an interrupted SROS2 run) is kept."""
    now = options.now or utc_now()
    validity = Validity.starting(now, options.ca_lifetime, backdate=options.backdate)
    name = options.names.get(role) or authority.default_ca_name(role)
    present = view.key_file(role)
    if present is not None:
        reference = safe_files.read_private(opened.root, present)
        signer = open_signer(reference, printable(opened.root / present), options.access)
        return authority.self_signed_ca(role, name, signer, validity), present.rpartition("/")[2], reference
    fresh = authority.new_key(options.curve)
    made = authority.self_signed_ca(role, name, fresh, validity)
    return (
        made,
        layout.KEY,
        authority.key_pem(fresh, passphrase_for_new_keys(options.encrypt_ca_keys, options.access)),
    )


def passphrase_for_new_keys(encrypt: bool, access: CaAccess) -> Secret | None:
    """What new CA keys are encrypted with; ``None``: they are not. Raises ``InvalidInputError`` without a
    passphrase."""
    if encrypt and access.passphrase is None:
        raise InvalidInputError("encrypting CA keys needs a passphrase: --passphrase-file, -fd or -env")
    return access.passphrase if encrypt else None


def _import_ca(role: Role, options: CreateOptions, warnings: list[str]) -> tuple[Authority, str, bytes]:
    source = options.imported[role]
    if source.key is None:
        raise InvalidInputError("a CA that is to sign here needs its key, too")
    reference = _read_given(source.key)
    signer = open_signer(reference, printable(source.key), options.access)
    bound = authority.authority_of(_read_given(source.certificate), signer, printable(source.certificate))
    check_can_serve(bound.facts.der, role, options.now or utc_now(), printable(source.certificate))
    other = options.imported.get(Role.PERMISSIONS if role is Role.IDENTITY else Role.IDENTITY)
    if role is Role.PERMISSIONS and other is not None and other.key == source.key:
        warnings.append(
            "one CA for identities and permissions: enclaves certified by it elsewhere can sign permissions "
            "that Cyclone DDS before 11.0 and Fast DDS before 2.6.5 accept (CVE-2023-24010, CVE-2023-24011)"
        )
    return bound, (layout.KEY if isinstance(signer, FileSigner) else layout.KEY_URI), reference


def _external_ca(role: Role, options: CreateOptions) -> CertificateFacts:
    """Raises InvalidInputError for one that cannot serve, and for the permissions CA, which signs here."""
    place = options.imported[role].certificate
    if role is not Role.IDENTITY:
        raise InvalidInputError("only the identity CA can be somebody else's: permissions are signed here")
    facts = read_certificate(_read_given(place), printable(place))
    check_can_serve(facts.der, role, options.now or utc_now(), printable(place))
    return facts


def _read_given(path: Path) -> bytes:
    try:
        return read_bytes(path)
    except OSError as error:
        raise InvalidInputError(f"cannot read {printable(path)}: {error.strerror}") from None


def _complete_governance(opened: Store, options: CreateOptions, actions: list[str]) -> None:
    if os.path.isfile(opened.root / layout.GOVERNANCE):
        return
    document = _unsigned_default(opened.root) or governance_document(
        options.governance or Governance.for_domains(options.domains)
    )
    view = KeystoreView(opened.root)
    signer = view.authority(Role.PERMISSIONS, options.access)
    write_governance(opened, document, signer, options.now or utc_now())
    actions.append("governance signed")


def _unsigned_default(root: Path) -> bytes | None:
    """What an interrupted run left beside a missing ``governance.p7s``, unless it is more lax than the default.

    Raises DamagedKeystoreError for any other document: nobody signed it, so somebody must look at it first.
    """
    present = safe_files.read_if_there(root, layout.GOVERNANCE_XML)
    if present is None:
        return None
    place = root / layout.GOVERNANCE_XML
    try:
        found = parse_governance(present, printable(place))
        if found == Governance.for_domains(found.domains()):
            return present
    except InvalidInputError:
        pass
    raise DamagedKeystoreError(
        f"{printable(place)} is not the default governance, and its signature governance.p7s is missing; look at "
        f"it and remove it: rm {shlex.quote(str(place))}"
    )
