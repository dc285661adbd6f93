"""What an enclave was granted before: to grant it again, or to see what it loses.

Only the document signed last counts, as the register has it. An older one that was put back was signed by us
too; to sign it again, or to compare with it, would give back what was taken away.
"""

from __future__ import annotations

from keystore.disk import layout
from keystore.disk.signed_documents import governance_domains, trusted_document
from keystore.disk.view import KeystoreView
from keystore.errors import DamagedKeystoreError, KeystoreError, printable
from keystore.formats.permissions import permissions_document
from keystore.formats.permissions_document import Grant, parse_permissions, redated, taken_away
from keystore.formats.policy import EnclavePolicy
from keystore.formats.register import Register, SignedPermissions
from keystore.formats.role import Role
from keystore.formats.subject import names_enclave
from keystore.formats.validity import Validity
from keystore.signing.public_key import fingerprint
from keystore.signing.records import rules_digest
from keystore.steps.enclave_state import PermissionsSource

UNKNOWN_RIGHTS = "do what it was granted before"


def what_is_taken_away(
    view: KeystoreView, register: Register, enclave: str, wanted: PermissionsSource
) -> tuple[str, ...]:
    """Return what the enclave was granted last and loses now (``publish rt/chatter``), empty for nothing.

    If what it had cannot be read any more, that is said instead.
    """
    last = register.permissions(enclave)
    if last is None:
        return ()
    grant = _granted_last(view, last)
    probe = wanted(f"CN={last.subject}", view.ca(Role.IDENTITY).validity)
    if probe is None:
        present = view.enclave_file(enclave, layout.PERMISSIONS)
        if present is not None:
            return ()  # it keeps what it has
        probe = _nothing(view, enclave, f"CN={last.subject}", view.ca(Role.IDENTITY).validity)
    (new,) = parse_permissions(probe)
    if rules_digest(new) == last.rules:
        return ()
    return taken_away(grant, new) if grant is not None else (UNKNOWN_RIGHTS,)


def previous_permissions(
    view: KeystoreView, register: Register, enclave: str, subject: str, validity: Validity
) -> bytes:
    """Return what the enclave was granted before, under its new subject and dates; without a past, nothing.

    Raises DamagedKeystoreError for a document that is not the one signed last for this enclave.
    """
    place, last = layout.enclave_file(enclave, layout.PERMISSIONS), register.permissions(enclave)
    if view.enclave_file(enclave, layout.PERMISSIONS) is None:
        return _nothing(view, enclave, subject, validity)
    try:
        document = _document(view, enclave, last)
        mine = _grant(document, enclave)
        if last is not None and (mine is None or rules_digest(mine) != last.rules):
            raise DamagedKeystoreError(
                f"{printable(view.root / place)} is not what was signed last for {enclave}"
            )
        names = {mine.subject_name.strip()} if mine is not None else set()
        return redated(document, names, subject, validity, printable(place))
    except KeystoreError as error:
        raise DamagedKeystoreError(
            f"{error}. What it may do is not known then: give it with secure-keystore apply-policy"
        ) from None


def _document(view: KeystoreView, enclave: str, last: SignedPermissions | None) -> bytes:
    twin = view.enclave_file(enclave, layout.PERMISSIONS_XML)
    if last is not None and twin is not None and fingerprint(twin) == last.document:
        return twin
    return trusted_document(view, layout.enclave_file(enclave, layout.PERMISSIONS))


def _granted_last(view: KeystoreView, last: SignedPermissions) -> Grant | None:
    try:
        grant = _grant(_document(view, last.enclave, last), last.enclave)
    except KeystoreError:
        return None
    return grant if grant is not None and rules_digest(grant) == last.rules else None


def _grant(document: bytes, enclave: str) -> Grant | None:
    """Return the first grant of a document for this enclave, under any subject it can have had."""
    grants = parse_permissions(document, f"the permissions of {enclave}")
    prefix = "CN="
    return next(
        (
            grant
            for grant in grants
            if grant.subject_name.strip().startswith(prefix)
            and names_enclave(grant.subject_name.strip().removeprefix(prefix), enclave)
        ),
        None,
    )


def _nothing(view: KeystoreView, enclave: str, subject: str, validity: Validity) -> bytes:
    nothing = EnclavePolicy(enclave, ())
    return permissions_document(subject, nothing, validity=validity, domains=governance_domains(view))
