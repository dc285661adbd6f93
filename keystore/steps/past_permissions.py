"""Earlier permissions of an enclave: to grant them again, or to show what it loses.

Only the document signed last counts, as the register has it. An older one that was put back was signed by us
too; to sign it again, or to compare with it, would give back what was taken away.
"""

from __future__ import annotations

from enclave_common.terminal import quoted
from keystore.disk import layout
from keystore.disk.signed_documents import governance_domains, own_document
from keystore.disk.view import KeystoreView
from keystore.errors import DamagedKeystoreError, KeystoreError
from keystore.formats.permissions import Permissions, permissions_document
from keystore.formats.permissions_document import parse_permissions, taken_away
from keystore.formats.policy import EnclavePolicy
from keystore.formats.register import Register, SignedPermissions
from keystore.formats.role import Role
from keystore.formats.subject import names_enclave
from keystore.formats.validity import Validity
from keystore.signing.public_key import fingerprint
from keystore.signing.records import rules_digest
from keystore.steps.enclave_state import PermissionsSource
from keystore.steps.opening import taken_over

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
    granted = _granted_last(view, last)
    probe = wanted(f"CN={last.subject}", view.ca(Role.IDENTITY).validity)
    if probe is None:
        present = view.enclave_file(enclave, layout.PERMISSIONS)
        if present is not None:
            return ()  # it keeps what it has
        probe = _nothing(view, enclave, f"CN={last.subject}", view.ca(Role.IDENTITY).validity)
    new = parse_permissions(probe)
    if rules_digest(new) == last.rules:
        return ()
    return taken_away(granted, new) if granted is not None else (UNKNOWN_RIGHTS,)


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
        permissions = _present(view, enclave, last)
        if last is not None and rules_digest(permissions) != last.rules:
            raise DamagedKeystoreError(
                f"{quoted(view.root / place)} is not what was signed last for {enclave}"
            )
        return permissions._replace(subject=subject, validity=validity).document()
    except KeystoreError as error:
        raise DamagedKeystoreError(
            f"{error}. What it may do is not known then: give it with secure-keystore apply-policy"
        ) from None


def _present(view: KeystoreView, enclave: str, last: SignedPermissions | None) -> Permissions:
    """Return what the enclave has: signed by us, and for it, under any subject it can have had.

    Of another tool's document counts what the register took over.
    """
    place = layout.enclave_file(enclave, layout.PERMISSIONS)
    twin = view.enclave_file(enclave, layout.PERMISSIONS_XML)
    if last is not None and twin is not None and fingerprint(twin) == last.document:
        return parse_permissions(twin, quoted(view.root / place))
    document = own_document(view, place) if last is None else taken_over(view, enclave)[0]
    permissions = parse_permissions(document, quoted(view.root / place))
    if not names_enclave(permissions.subject.removeprefix("CN="), enclave):
        raise DamagedKeystoreError(f"{quoted(view.root / place)} is for {quoted(permissions.subject)}")
    return permissions


def _granted_last(view: KeystoreView, last: SignedPermissions) -> Permissions | None:
    try:
        permissions = _present(view, last.enclave, last)
    except KeystoreError:
        return None
    return permissions if rules_digest(permissions) == last.rules else None


def _nothing(view: KeystoreView, enclave: str, subject: str, validity: Validity) -> bytes:
    nothing = EnclavePolicy(enclave, ())
    return permissions_document(subject, nothing, validity=validity, domains=governance_domains(view))
