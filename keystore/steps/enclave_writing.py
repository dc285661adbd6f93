"""Issuing and signing what ``enclave_state`` found missing, into a batch of the store."""

from __future__ import annotations

import shlex
from datetime import datetime
from functools import cached_property
from typing import TYPE_CHECKING

from keystore.disk import layout, safe_files, store
from keystore.disk.governance_file import governance_domains
from keystore.disk.store import Batch, Content, Link, Store
from keystore.disk.superseded import Superseded
from keystore.disk.trusted_documents import trusted_document
from keystore.disk.view import KeystoreView
from keystore.errors import DamagedKeystore, InvalidInput, KeystoreError, printable
from keystore.formats.permissions import permissions_document
from keystore.formats.permissions_size import FAST_DDS_LIMIT_BYTES, WARN_BYTES
from keystore.formats.policy import EnclavePolicy
from keystore.formats.role import Role
from keystore.formats.subject import (
    SubjectScheme,
    borrowable,
    cannot_be_told_apart,
    common_name,
    subject_name,
)
from keystore.formats.validity import Validity
from keystore.signing.authority import Authority, IdentityIssuer
from keystore.signing.identity import certify, new_identity, public_half
from keystore.steps.creation import sign_document
from keystore.steps.enclave_state import EnclaveState, PermissionsSource, Reissue

if TYPE_CHECKING:
    from keystore.steps.options import ProvisionOptions


class EnclaveWriter:
    """One run's issuing: CA keys are opened only when something is to be signed with them."""

    def __init__(self, opened: Store, view: KeystoreView, options: ProvisionOptions, now: datetime):
        self._opened = opened
        self._view = view
        self._options = options
        self._now = now
        self.warnings: list[str] = []

    @cached_property
    def _issuer(self) -> IdentityIssuer:
        return IdentityIssuer(self._identity_ca)

    @cached_property
    def _identity_ca(self) -> Authority:
        return self._view.authority(Role.IDENTITY, self._options.access)

    @cached_property
    def _permissions_ca(self) -> Authority:
        return self._view.authority(Role.PERMISSIONS, self._options.access)

    @cached_property
    def _validity(self) -> Validity:
        """Of new certificates; permissions take over what their certificate got."""
        cas = [self._view.ca(role).validity for role in Role]
        if not all(ca.covers(self._now) for ca in cas):
            root = shlex.quote(str(self._view.root))
            raise DamagedKeystore(
                "a CA of this keystore is expired, or not yet valid (is the clock right?); to replace it: "
                f"secure-keystore renew {root} --ca start"
            )
        options = self._options
        lifetime = self._view.settings.lifetime if options.lifetime is None else options.lifetime
        asked = Validity.starting(self._now, lifetime, until=options.valid_until, backdate=options.backdate)
        return asked.within(cas[0]).within(cas[1])

    @property
    def _scheme(self) -> SubjectScheme:
        return self._options.subjects or self._view.settings.subjects

    def check_subjects(self, states: list[EnclaveState]) -> None:
        """With compatible subjects: refuse new enclaves that Cyclone DDS could confuse with others."""
        fresh = {state.enclave for state in states if state.reissue is not Reissue.NOTHING}
        if self._scheme is SubjectScheme.EXACT or not fresh or self._options.allow_subject_overlap:
            return
        names = {enclave: self._present_name(enclave) for enclave in self._view.enclaves()}
        names |= {enclave: common_name(enclave, self._scheme) for enclave in fresh}
        pairs = [pair for pair in borrowable(names) if fresh & set(pair)]
        if pairs:
            raise InvalidInput(
                f"with compatible subjects, on Cyclone DDS {cannot_be_told_apart(pairs)}; use exact "
                "subjects, rename the enclaves, or accept it with --allow-subject-overlap"
            )

    def _present_name(self, enclave: str) -> str:
        from keystore.formats.certificate import read_certificate

        relative = f"{layout.enclave_directory(enclave)}/{layout.CERT}"
        pem = safe_files.read_if_there(self._view.root, relative)
        facts = read_certificate(pem, printable(relative)) if pem else None
        return (facts.common_name if facts else None) or common_name(enclave, self._scheme)

    def replaced(self, states: list[EnclaveState]) -> list[Superseded]:
        """Certificates by the present CA that ``write`` will replace before they have ended."""
        ca = self._view.ca(Role.IDENTITY)
        return [
            Superseded(state.enclave, state.facts.serial, state.facts.validity.not_after)
            for state in states
            if state.reissue is not Reissue.NOTHING
            and state.facts is not None
            and state.facts.names_issuer(ca)
        ]

    def write(self, batch: Batch, state: EnclaveState, permissions: PermissionsSource) -> tuple[str, ...]:
        """Add the enclave's missing files; returns what was done. Order: key, certificate, links,
        permissions, so that a process never finds permissions without an identity."""
        entries: dict[str, Content | Link] = {}
        actions: list[str] = []
        named = self._identity(state, entries, actions)
        links = layout.enclave_links(state.enclave, crl=True)
        for name in state.links:
            entries[name] = Link(links[name], layout.link_source(name))
        if state.permissions:
            self._permissions(state, *named, permissions, entries)
        self._name_actions(state, actions)
        if state.lax_key and layout.KEY not in entries:
            self._opened.set_mode(
                f"{layout.enclave_directory(state.enclave)}/{layout.KEY}", store.PRIVATE_MODE
            )
        if entries:
            batch.directory(layout.enclave_directory(state.enclave), entries)
        return tuple(actions)

    def _name_actions(self, state: EnclaveState, actions: list[str]) -> None:
        if "created" in actions:
            return
        if state.permissions:
            actions.append("permissions")
        if state.links:
            actions.append("links")
        if state.lax_key:
            actions.append("mode")

    def _identity(
        self, state: EnclaveState, entries: dict[str, Content | Link], actions: list[str]
    ) -> tuple[str, Validity]:
        """Subject and validity of the certificate the enclave will have."""
        if state.reissue is Reissue.NOTHING and state.facts is not None:
            return subject_name(state.facts.common_name or ""), state.facts.validity
        cn = common_name(state.enclave, self._scheme)
        if state.reissue is Reissue.KEY_PAIR:
            made = new_identity(self._issuer, cn, self._validity, self._view.settings.curve)
            actions.append("key and certificate" if state.facts is not None else "created")
        else:
            relative = f"{layout.enclave_directory(state.enclave)}/{layout.KEY}"
            key = safe_files.read_private(self._view.root, relative)
            place = printable(self._view.root / relative)
            made = certify(self._issuer, cn, public_half(key, place), self._validity)
            actions.append("certificate")
        if made.key is not None:
            entries[layout.KEY] = Content(made.key, store.PRIVATE_MODE)
        entries[layout.CERT] = Content(made.cert)
        return subject_name(made.common_name), made.validity

    def _permissions(
        self,
        state: EnclaveState,
        subject: str,
        validity: Validity,
        source: PermissionsSource,
        entries: dict[str, Content | Link],
    ) -> None:
        document = source(subject, validity) or self._kept(state, subject, validity)
        signed = sign_document(document, self._permissions_ca, self._now)
        if len(signed) >= WARN_BYTES:
            self.warnings.append(
                f"the permissions of enclave {state.enclave} take {len(signed)} bytes; Fast DDS carries "
                f"at most {FAST_DDS_LIMIT_BYTES}, beyond that its peers never match: split the enclave"
            )
        entries[layout.PERMISSIONS_XML] = Content(document)
        entries[layout.PERMISSIONS] = Content(signed)

    def _kept(self, state: EnclaveState, subject: str, validity: Validity) -> bytes:
        """What the enclave was granted before, under its new subject and dates; without a past, nothing."""
        from keystore.formats.permissions_dates import redated

        relative = f"{layout.enclave_directory(state.enclave)}/{layout.PERMISSIONS}"
        if safe_files.read_if_there(self._view.root, relative) is None:
            nothing = EnclavePolicy(state.enclave, ())
            return permissions_document(
                subject,
                nothing,
                validity=validity,
                domains=governance_domains(self._view),
                rmw=self._options.rmw,
            )
        try:
            document = trusted_document(self._view, relative)
            return redated(document, _own_subjects(state), subject, validity, printable(relative))
        except KeystoreError as error:
            raise DamagedKeystore(
                f"{error}. What it may do is not known then: give it with secure-keystore apply-policy"
            ) from None


def _own_subjects(state: EnclaveState) -> set[str]:
    """Every subject this enclave can have had: an interrupted renewal may have replaced only its certificate."""
    names = {common_name(state.enclave, scheme) for scheme in SubjectScheme} | {state.enclave}
    if state.facts is not None and state.facts.common_name is not None:
        names.add(state.facts.common_name)
    return {subject_name(cn) for cn in names}
