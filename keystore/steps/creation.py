"""A new keystore, or the missing parts of one: CAs, governance, settings; what is there is never replaced."""

from __future__ import annotations

import os
import shlex
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from datetime import timedelta
from pathlib import Path

from enclave_common.dependencies import require
from enclave_common.terminal import quoted
from keystore.disk import layout, safe_files, store
from keystore.disk.safe_files import resolve_root
from keystore.disk.store import Store
from keystore.disk.view import KeystoreSettings, KeystoreView
from keystore.errors import DamagedKeystoreError, InvalidInputError
from keystore.formats.certificate import CertificateFacts, given_certificates, read_der
from keystore.formats.clock import refuse_clock_before_program
from keystore.formats.domains import Domains
from keystore.formats.given_file import read_given
from keystore.formats.governance import Governance, governance_document, parse_governance
from keystore.formats.register import AuthorityState
from keystore.formats.role import Role
from keystore.formats.subject import SubjectScheme, common_name
from keystore.formats.validity import DEFAULT_LIFETIME, Validity, utc_now
from keystore.signing import authority
from keystore.signing.authority import Authority, check_can_serve
from keystore.signing.ca_access import Secret
from keystore.signing.openssl import refuse_unfit_ca
from keystore.signing.private_key import PrivateKey, key_pem, new_key
from keystore.signing.public_key import cyclone_takes, is_weak, key_kind
from keystore.signing.token_key import open_key
from keystore.steps.governance import write_governance
from keystore.steps.incoming_ca import install_incoming, put_incoming
from keystore.steps.opening import ChangeOptions, opened_for_change


@dataclass(frozen=True, slots=True)
class ImportedCa:
    """An existing CA: its PEM certificate and its PEM key, or a file with the key's ``pkcs11:`` URI. Without ``key`` an
    identity CA of another party (Vault, step-ca, cert-manager), which issues certificates for requests."""

    certificate: Path
    key: Path | None = None


@dataclass(frozen=True, slots=True)
class CreateOptions(ChangeOptions):
    """Options of creating a keystore. ``ca_lifetime``, ``lifetime`` (of enclaves) start at ``now``; ``names`` are the
    CAs' common names."""

    domains: Domains = field(default_factory=lambda: Domains.single(0))
    governance: Governance | None = None
    subjects: SubjectScheme = SubjectScheme.EXACT
    ca_lifetime: timedelta = DEFAULT_LIFETIME
    lifetime: timedelta = DEFAULT_LIFETIME
    names: Mapping[Role, str] = field(default_factory=dict)
    imported: Mapping[Role, ImportedCa] = field(default_factory=dict)
    encrypt_ca_keys: bool = False
    """Make no CA key without ``access.passphrase``, which encrypts new ones whenever it is given."""
    compact: bool | None = None
    """Whether permissions are compact; ``None`` leaves an existing keystore as it is."""

    @property
    def settings(self) -> KeystoreSettings:
        return KeystoreSettings(self.subjects, self.lifetime, self.compact is True)


@dataclass(frozen=True, slots=True)
class CreateReport:
    """The result of creating a keystore. ``actions`` in words, empty when the keystore was complete already."""

    keystore: Path
    actions: tuple[str, ...]
    warnings: tuple[str, ...] = ()


def create_keystore(keystore: Path | str, options: CreateOptions | None = None) -> CreateReport:
    """Create the keystore or complete it; a complete one is left as it is.

    Raises NotAKeystoreError for a directory with other things in it, InvalidInputError for a CA that cannot serve.
    """
    require("cryptography", "asn1crypto", "lxml")
    chosen = options or CreateOptions()
    root = resolve_root(keystore)
    KeystoreView(root).refuse_foreign()
    refuse_unusable(chosen)
    now = chosen.now or utc_now()
    if chosen.now is None and not chosen.accept_clock:
        refuse_clock_before_program(now, quoted(root))
    store.create_root(root)
    with opened_for_change(root, now, chosen) as opened:
        return complete(opened, chosen)


def refuse_unusable(options: CreateOptions) -> None:
    """Refuse, before anything is written, options that no keystore can be made with; raises InvalidInputError."""
    now = options.now or utc_now()
    for lifetime in (options.ca_lifetime, options.lifetime):
        Validity.starting(now, lifetime)
    for name in options.names.values():
        authority.refuse_ca_name(name)
    _passphrase(options)
    for role in options.names.keys() & options.imported.keys():
        raise InvalidInputError(
            f"the {role.label} has the name in its certificate; leave out --{role.value.replace('_', '-')}-name"
        )
    for role, given in options.imported.items():
        if given.key is None:
            _external_ca(role, options)
        else:
            _import_ca(role, options, given.key)


def complete(opened: Store, options: CreateOptions) -> CreateReport:
    """Do what ``create_keystore`` does once it holds the lock."""
    view = KeystoreView(opened.root)
    view.refuse_foreign()
    actions: list[str] = []
    warnings: list[str] = []
    install_incoming(opened)
    if not view.is_complete:
        _passphrase(options)
        if _write_settings(opened, options):
            actions.append("settings written")
            if any((folder / ".git").exists() for folder in opened.root.absolute().parents):
                with opened.batch() as batch:
                    batch.file(layout.GITIGNORE, b"*\n")
                actions.append("kept out of git by its .gitignore, since it holds keys")
        for directory in (layout.PUBLIC, layout.PRIVATE, layout.ENCLAVES):
            opened.ensure_directory(directory)
    if _change_compact(opened, options):
        what = "compact" if options.compact else "written out"
        actions.append(f"permissions are {what} from the next launch or apply-policy on")
    for role in Role:
        if _restore_ca(opened, role):
            actions.append(f"{role.label} restored from the register")
        if os.path.exists(opened.root / layout.ca_cert(role)):
            _record_present_ca(opened, role, options)  # its key may be missing: the CA may be kept elsewhere
            continue
        verb, reported = _add_ca(opened, role, options)
        actions.append(f"{role.label} {verb}")
        warnings += reported
    if _complete_governance(opened, options):
        actions.append("governance signed")
    return CreateReport(opened.root, tuple(actions), tuple(warnings))


def _write_settings(opened: Store, options: CreateOptions) -> bool:
    """Write the settings first: they mark the directory as ours. Returns whether it was needed."""
    if os.path.lexists(opened.root / layout.SETTINGS) or os.path.lexists(opened.root / layout.PUBLIC):
        return False
    with opened.batch() as batch:
        batch.record(replace(opened.register, settings=options.settings.to_json()))
        batch.file(layout.SETTINGS, options.settings.to_json())
    return True


def _change_compact(opened: Store, options: CreateOptions) -> bool:
    """Record whether permissions are to be compact, in a keystore that has it otherwise. Returns whether it was."""
    present = KeystoreView(opened.root).settings
    if options.compact is None or present.compact is options.compact:
        return False
    settings = replace(present, compact=options.compact).to_json()
    with opened.batch() as batch:
        batch.record(replace(opened.register, settings=settings))
        batch.file(layout.SETTINGS, settings)
    return True


def _restore_ca(opened: Store, role: Role) -> bool:
    """Restore a lost trust file from the register. Another CA over the same key would have issued no certificate."""
    trusted = opened.register.trusted_authorities(role)
    is_lost = not os.path.lexists(opened.root / layout.ca_cert(role))
    if not (trusted and is_lost and KeystoreView(opened.root).key_file(role)):
        return False
    with opened.batch() as batch:
        batch.file(layout.ca_cert(role), b"".join(read_der(ca).pem for ca in trusted))
    return True


def _add_ca(opened: Store, role: Role, options: CreateOptions) -> tuple[str, list[str]]:
    view = KeystoreView(opened.root)
    _refuse_foreign_enclaves(view, role)
    given = options.imported.get(role)
    if given is not None and given.key is None:
        facts = _external_ca(role, options)
        with opened.batch() as batch:
            batch.record(opened.register.with_authority(role, facts.der, AuthorityState.IN_USE))
            batch.file(layout.ca_cert(role), facts.pem)
        return "of another owner imported; it signs what hosts request", [*_key_warnings(role, facts)]
    if given is not None and given.key is not None:
        made, key = _import_ca(role, options, given.key)
        verb, warnings = "imported", _shared_ca_warnings(role, options)
    else:
        made, key = _present_key_ca(view, role, options) or new_ca(role, options)
        verb, warnings = "created", []
    put_incoming(opened, role, made.facts.pem, key)
    install_incoming(opened)
    return verb, [*warnings, *_key_warnings(role, made.facts)]


def _key_warnings(role: Role, facts: CertificateFacts) -> Iterator[str]:
    kind = key_kind(facts.public_key)
    if role is Role.IDENTITY and not cyclone_takes(facts.public_key):
        yield f"the {role.label} key is {kind}: Cyclone DDS refuses it, Fast DDS accepts it; P-256 suits both"
    if is_weak(facts.public_key):
        yield f"the {role.label} key is {kind}, which is weak: who breaks it can sign as this CA; take P-256"


def _record_present_ca(opened: Store, role: Role, options: CreateOptions) -> None:
    """Record the CA that SROS2 left, if the register knows none of this role."""
    view = KeystoreView(opened.root)
    if role in options.imported:
        place = options.imported[role].certificate
        if _given(place).der != view.ca(role).der:
            raise InvalidInputError(
                f"the keystore has another {role.value} already; a CA is replaced with: "
                "secure-keystore renew KEYSTORE --ca start"
            )
    known = {its for (its, _), state in opened.register.authorities.items() if state is AuthorityState.IN_USE}
    if view.key_file(role) is not None and role not in known:
        with opened.batch() as batch:
            batch.record(opened.register.with_authority(role, view.ca(role).der, AuthorityState.IN_USE))


def _refuse_foreign_enclaves(view: KeystoreView, role: Role) -> None:
    """Refuse stand-alone enclaves of a bundle, or of a lost CA: another CA would replace what they trust."""
    if view.key_file(role) is None and os.path.isdir(view.root / layout.ENCLAVES) and view.enclaves():
        raise DamagedKeystoreError(
            f"{quoted(view.root)} holds enclaves, but not the {role.label} they belong to: "
            "a deployed copy, or a keystore to restore from a backup"
        )


def new_ca(role: Role, options: CreateOptions) -> tuple[Authority, bytes]:
    """Make a CA and its key file."""
    key = new_key()
    return _self_signed(role, options, key), key_pem(key, _passphrase(options))


def _present_key_ca(view: KeystoreView, role: Role, options: CreateOptions) -> tuple[Authority, bytes] | None:
    """Make a CA for a key that is there already (an interrupted SROS2 run)."""
    present = view.key_file(role)
    if present is None:
        return None
    reference = safe_files.read_private(view.root, present)
    key = open_key(reference, quoted(view.root / present), options.access)
    return _self_signed(role, options, key), reference


def _self_signed(role: Role, options: CreateOptions, key: PrivateKey) -> Authority:
    validity = Validity.starting(options.now or utc_now(), options.ca_lifetime)
    name = options.names.get(role) or authority.default_ca_name(role)
    return authority.self_signed_ca(role, name, key, validity)


def _passphrase(options: CreateOptions) -> Secret | None:
    if options.encrypt_ca_keys and options.access.passphrase is None:
        raise InvalidInputError("encrypting CA keys needs a passphrase: --ca-passphrase-file, -fd or -env")
    if options.access.passphrase is not None:
        options.access.passphrase.value()  # reports what is wrong with it
    return options.access.passphrase


def _import_ca(role: Role, options: CreateOptions, file: Path) -> tuple[Authority, bytes]:
    place, reference = options.imported[role].certificate, read_given(file)
    key = open_key(reference, quoted(file), options.access)
    bound = authority.authority_of(_given(place), key, quoted(place))
    now = options.now or utc_now()
    check_can_serve(bound.facts, role, now, quoted(place))
    probe = None
    if role is Role.IDENTITY:  # its constraints on names show only below it
        name = common_name("/probe")
        probe = bound.issue(name, new_key().public_key(), Validity.starting(now, options.lifetime))
    refuse_unfit_ca(bound.facts, role, quoted(place), probe)
    return bound, reference


def _given(place: Path) -> CertificateFacts:
    return given_certificates(read_given(place), quoted(place))[0]


def _shared_ca_warnings(role: Role, options: CreateOptions) -> list[str]:
    identity = options.imported.get(Role.IDENTITY)
    if role is Role.IDENTITY or identity is None or identity.key != options.imported[role].key:
        return []
    return [
        "one CA for identities and permissions: enclaves certified by it elsewhere can sign permissions "
        "that Cyclone DDS before 11.0 and Fast DDS before 2.6.5 accept (CVE-2023-24010, CVE-2023-24011)"
    ]


def _external_ca(role: Role, options: CreateOptions) -> CertificateFacts:
    place = options.imported[role].certificate
    if role is not Role.IDENTITY:
        raise InvalidInputError("only the identity CA can be external: permissions are signed here")
    facts = _given(place)
    check_can_serve(facts, role, options.now or utc_now(), quoted(place))
    refuse_unfit_ca(facts, role, quoted(place))
    return facts


def _complete_governance(opened: Store, options: CreateOptions) -> bool:
    if os.path.isfile(opened.root / layout.GOVERNANCE):
        return False
    document = _unsigned_default(opened.root) or governance_document(
        options.governance or Governance.for_domains(options.domains)
    )
    signer = KeystoreView(opened.root).authority(Role.PERMISSIONS, options.access)
    write_governance(opened, document, signer, options.now or utc_now())
    return True


def _unsigned_default(root: Path) -> bytes | None:
    """Return what an interrupted run left beside a missing ``governance.p7s``, unless it is weaker than the default.

    Raises DamagedKeystoreError for any other document: it is not signed, so a person must review it first.
    """
    present = safe_files.read_if_there(root, layout.GOVERNANCE_XML)
    if present is None:
        return None
    place = root / layout.GOVERNANCE_XML
    try:
        found = parse_governance(present, quoted(place))
    except DamagedKeystoreError:
        found = None
    if found is not None and found == Governance.for_domains(found.domains()):
        return present
    raise DamagedKeystoreError(
        f"{quoted(place)} is not the default governance, and its signature governance.p7s is missing; look at "
        f"it and remove it: rm {shlex.quote(str(place))}"
    )
