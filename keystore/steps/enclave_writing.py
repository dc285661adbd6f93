"""Issuing and signing what the comparison found missing, into a batch of the store."""

from __future__ import annotations

from datetime import datetime, timedelta
from functools import cached_property
from itertools import count

from enclave_common.terminal import quoted
from enclave_common.words import some_of
from keystore.disk import layout, safe_files, store
from keystore.disk.store import Batch, Content, Link, Store
from keystore.disk.view import KeystoreView
from keystore.errors import InvalidInputError
from keystore.formats.certificate import CertificateFacts
from keystore.formats.permissions_size import FAST_DDS_LIMIT_BYTES, WARN_BYTES
from keystore.formats.register import IssuedCertificate, Register, SignedPermissions
from keystore.formats.role import Role
from keystore.formats.subject import (
    SubjectScheme,
    borrowable,
    common_name,
    half_of,
    indistinguishable,
    scheme_of,
    subject_name,
)
from keystore.formats.validity import Validity, iso
from keystore.signing.authority import Authority
from keystore.signing.certificate_request import public_half
from keystore.signing.private_key import PublicKey, key_pem, new_key
from keystore.signing.public_key import fingerprint
from keystore.signing.records import certificate_record, permissions_record
from keystore.signing.smime import sign_document
from keystore.steps.crl import can_revoke, revocable
from keystore.steps.enclave_state import NEW, EnclaveState, PermissionsSource, Reissue, granted_lifetime
from keystore.steps.options import EnclaveReport, ProvisionOptions
from keystore.steps.past_permissions import previous_permissions, what_is_taken_away

_DAY = timedelta(days=1)


class EnclaveWriter:
    """One run's issuing: CA keys are opened only when something is to be signed with them."""

    def __init__(self, opened: Store, view: KeystoreView, options: ProvisionOptions, now: datetime):
        self._opened = opened
        self._view = view
        self._options = options
        self._now = now
        self._issued: list[IssuedCertificate] = []
        self._signed: list[SignedPermissions] = []
        self._revoked: set[int] = set()  # of this batch, all in the register
        self.has_revoked = False
        self.warnings: list[str] = []

    @property
    def _register(self) -> Register:
        return self._opened.register

    @cached_property
    def _identity_ca(self) -> Authority:
        return self._view.authority(Role.IDENTITY, self._options.access)

    @cached_property
    def _permissions_ca(self) -> Authority:
        return self._view.authority(Role.PERMISSIONS, self._options.access)

    @cached_property
    def _can_revoke(self) -> bool:
        return self._options.revoke and can_revoke(self._view)

    def _lifetime(self, enclave: str) -> timedelta:
        options = self._options
        if options.valid_until is not None:
            return options.valid_until - self._now
        if options.lifetime is not None:
            return options.lifetime
        return granted_lifetime(self._view, self._register, enclave) or self._view.settings.lifetime

    def _validity(self, enclave: str) -> Validity:
        self._view.refuse_ended(self._now, *Role)
        cas = [self._view.ca(role).validity for role in Role]
        requested = Validity.starting(self._now, self._lifetime(enclave))
        return requested.within(cas[0]).within(cas[1])

    @property
    def _scheme(self) -> SubjectScheme:
        return self._options.subjects or self._view.settings.subjects

    def check_subjects(self, states: list[EnclaveState]) -> None:
        """Refuse, with compatible subjects, new enclaves that Cyclone DDS could confuse with others."""
        fresh = {state.enclave for state in states if state.reissue is not Reissue.NOTHING}
        if self._scheme is SubjectScheme.EXACT or not fresh or self._options.allow_subject_overlap:
            return
        names = {enclave: common_name(enclave, self._scheme) for enclave in (*self._view.enclaves(), *fresh)}
        present = {enclave: self._view.common_name(enclave) for enclave in self._view.enclaves()}
        names |= {enclave: name for enclave, name in present.items() if name and enclave not in fresh}
        pairs = [pair for pair in borrowable(names) if fresh & set(pair)]
        if pairs:
            raise InvalidInputError(
                f"with compatible subjects, on Cyclone DDS {indistinguishable(pairs)}; use exact "
                "subjects, rename the enclaves, or accept it with --allow-subject-overlap"
            )

    def write(self, batch: Batch, state: EnclaveState, permissions: PermissionsSource) -> EnclaveReport:
        """Adds the enclave's missing files; returns what was done.

        Order: key, certificate, links, permissions, so that a process never finds permissions without an identity.
        """
        found = state.reasons
        entries: dict[str, Content | Link] = {}
        actions: list[str] = []
        if state.incident:
            self._revoke(state, "key")
        lost = what_is_taken_away(self._view, self._register, state.enclave, permissions)
        if lost:
            state = self._end_rights(state, lost)
        facts = self._identity(state, bool(lost), entries, actions)
        links = store.enclave_links(state.enclave, crl=True)
        entries |= {name: links[name] for name in state.links}
        if state.permissions:
            self._permissions(state.enclave, facts, permissions, entries)
        if "created" not in actions:
            actions += [
                word for word, done in (("permissions", state.permissions), ("links", state.links)) if done
            ]
        if entries:
            batch.directory(layout.enclave_directory(state.enclave), entries)
        if any(self._register.certificates[serial].enclave == state.enclave for serial in self._revoked):
            actions.append("old certificate revoked")
        return EnclaveReport(state.enclave, tuple(actions), found, facts.validity)

    def record(self, batch: Batch) -> None:
        """Put what was added to the batch on record before anything of it is visible."""
        if not (self._issued or self._signed or self._revoked):
            return
        register = self._register.with_certificates(self._issued).with_documents(self._signed)
        if self._revoked:
            register = register.with_revoked(self._revoked, self._now)
            self.has_revoked = True
        batch.record(register.without_ended(self._now))
        self._issued, self._signed, self._revoked = [], [], set()

    def _end_rights(self, state: EnclaveState, lost: tuple[str, ...]) -> EnclaveState:
        """End what the enclave was permitted: with another subject, and the old certificate on the CRL.

        Documents cannot be revoked: the old one would match until it expires.
        """
        what = some_of(lost, 3)
        if self._scheme is SubjectScheme.COMPATIBLE:
            self.warnings.append(
                f"{state.enclave} may no longer {what}, but with compatible subjects its old permissions fit it until "
                f"{self._end_of(state)}: whoever copied them can use them again"
            )
            return state
        self._revoke(state, what)
        reissue = Reissue.CERTIFICATE if state.reissue is Reissue.NOTHING else state.reissue
        return state._replace(reissue=reissue, permissions=True)

    def _revoke(self, state: EnclaveState, what: str) -> None:
        found = revocable(self._view, self._register, [state.enclave])
        if not found:
            return
        if self._can_revoke:
            self._revoked |= {one.serial for one in found}
        else:
            self.warnings.append(
                f"the old certificate of {state.enclave} was not revoked: whoever copied it with its key and "
                f"permissions can use them until {self._end_of(state)} ({what})"
            )

    def _end_of(self, state: EnclaveState) -> str:
        ends = [one.not_after for one in self._register.of_enclave(state.enclave) if one.revoked is None]
        return iso(max(ends)) if ends else "they end"

    def _identity(
        self,
        state: EnclaveState,
        new_generation: bool,
        entries: dict[str, Content | Link],
        actions: list[str],
    ) -> CertificateFacts:
        if state.reissue is Reissue.NOTHING and state.facts is not None:
            return state.facts
        name = self._subject(state.enclave, new_generation)
        key = self._public_key(state, entries, actions)
        facts = self._identity_ca.issue(name, key, self._validity(state.enclave))
        entries[layout.CERT] = Content(facts.pem)
        lifetime = self._lifetime(state.enclave)
        self._issued.append(certificate_record(state.enclave, facts, self._identity_ca.facts, lifetime))
        self._revoke_longer(state, facts.validity)
        return facts

    def _public_key(
        self, state: EnclaveState, entries: dict[str, Content | Link], actions: list[str]
    ) -> PublicKey:
        """Return the key to certify: a new one, which is added to ``entries``, or the one that is there."""
        if self._view.enclave_file(state.enclave, layout.KEY_URI) is not None:
            return self._token_key(state)
        made_on_host = self._view.has_request(state.enclave)
        if state.reissue is Reissue.KEY_PAIR and made_on_host:
            raise InvalidInputError(
                f"the key of enclave {state.enclave} was made on its host, so a new one is made there: "
                f"secure-keystore request KEYSTORE {state.enclave}, then sign it here"
            )
        if state.reissue is Reissue.KEY_PAIR:
            known = state.facts is not None or bool(self._register.of_enclave(state.enclave))
            actions.append("key and certificate" if known and state.reasons != (NEW,) else "created")
            key = new_key()
            entries[layout.KEY] = Content(key_pem(key), store.PRIVATE_MODE)
            return key.public_key()
        key_file = layout.enclave_file(state.enclave, layout.KEY)
        relative = layout.request(state.enclave) if made_on_host else key_file
        actions.append("certificate")
        return public_half(
            safe_files.read_private(self._view.root, relative), quoted(self._view.root / relative)
        )

    def _token_key(self, state: EnclaveState) -> PublicKey:
        """Return the key in a token that is to be certified again: the one that was certified here before."""
        held = self._register.in_force(state.enclave)
        is_ours = (
            state.facts is not None and held is not None and held.key == fingerprint(state.facts.public_key)
        )
        if state.reissue is Reissue.KEY_PAIR or state.facts is None or not is_ours:
            raise InvalidInputError(
                f"the key of enclave {state.enclave} is in a token ({layout.KEY_URI}), so a new one is made there: "
                f"secure-keystore request KEYSTORE {state.enclave}, then sign it here; for a key in a file remove "
                f"{quoted(self._view.root / layout.enclave_file(state.enclave, layout.KEY_URI))}"
            )
        return state.facts.certificate.public_key()  # type: ignore[return-value]

    def _subject(self, enclave: str, new_generation: bool) -> str:
        """Return the subject it has; another one for a new generation, or after a change of the scheme."""
        records = self._register.of_enclave(enclave)
        used = {one.subject for one in records} | {
            one.subject for one in self._register.documents if one.enclave == enclave
        }
        latest = self._register.permissions(enclave)
        present = latest.subject if latest is not None else records[-1].subject if records else ""
        new_generation = new_generation or self._is_revoked_on_zenoh(enclave, present)
        if present and not new_generation and scheme_of(present) is self._scheme:
            return present
        wanted = self._options.guid_halves.get(enclave) if self._scheme is SubjectScheme.EXACT else None
        for generation in count(1):
            name = common_name(enclave, self._scheme, generation)
            taken = new_generation and name in used
            if not taken and (wanted is None or half_of(name) is wanted):
                break
        return name

    def _is_revoked_on_zenoh(self, enclave: str, name: str) -> bool:
        """Return True if the name was of a revoked certificate: a Zenoh router knows no CRL and goes by names."""
        return self._view.has_zenoh_router and any(
            one.subject == name and (one.revoked is not None or one.serial in self._revoked)
            for one in self._register.of_enclave(enclave)
        )

    def _revoke_longer(self, state: EnclaveState, validity: Validity) -> None:
        """Revoke the longer certificate: only then is a shorter life that was requested a shorter one."""
        if self._options.lifetime is None and self._options.valid_until is None:
            return
        found = revocable(self._view, self._register, [state.enclave])
        longer = {one.serial for one in found if one.not_after > validity.not_after + _DAY} - self._revoked
        if longer and self._can_revoke:
            self._revoked |= longer

    def _permissions(
        self,
        enclave: str,
        facts: CertificateFacts,
        source: PermissionsSource,
        entries: dict[str, Content | Link],
    ) -> None:
        name = facts.common_name or ""
        subject = subject_name(name)
        document = source(subject, facts.validity) or previous_permissions(
            self._view, self._register, enclave, subject, facts.validity
        )
        signed = sign_document(document, self._permissions_ca)
        self._signed.append(permissions_record(enclave, name, document))
        if len(signed) >= WARN_BYTES:
            self.warnings.append(
                f"the permissions of enclave {enclave} take {len(signed)} bytes; Fast DDS carries "
                f"at most {FAST_DDS_LIMIT_BYTES}, beyond that its peers never match: secure-keystore create KEYSTORE "
                "--compact, or split the enclave"
            )
        entries[layout.PERMISSIONS_XML] = Content(document)
        entries[layout.PERMISSIONS] = Content(signed)
