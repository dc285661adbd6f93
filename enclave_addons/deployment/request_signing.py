"""Where the CA is: certificates for keys that were made on their hosts, by our identity CA or another one."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import datetime
from pathlib import Path

from enclave_addons.deployment.host_keys import Request
from enclave_common.terminal import quoted
from keystore.disk import layout
from keystore.disk.store import PRIVATE_MODE, Batch, Content, Link, enclave_links
from keystore.disk.view import KeystoreView, keystore_at
from keystore.errors import InvalidInputError
from keystore.formats.certificate import CertificateFacts, given_certificates
from keystore.formats.register import Register
from keystore.formats.role import Role
from keystore.formats.subject import common_name, names_enclave, subject_name
from keystore.formats.validity import utc_now
from keystore.signing.authority import Authority
from keystore.signing.certificate_request import request_key
from keystore.signing.openssl import refusals
from keystore.signing.public_key import fingerprint, issued_by
from keystore.signing.records import certificate_record, permissions_record
from keystore.signing.smime import sign_document
from keystore.steps.opening import opened_for_change
from keystore.steps.options import ProvisionOptions, ProvisionReport
from keystore.steps.past_permissions import previous_permissions
from keystore.steps.renewal import RenewOptions, renew


def sign_requests(
    keystore: Path | str,
    requests: Iterable[Request],
    *,
    revoke_old: bool = False,
    options: ProvisionOptions | None = None,
) -> ProvisionReport:
    """Certify the requested keys in the place of those that the enclaves have; repeating does nothing more.

    The enclaves must exist, with the permissions that they are to have; their private keys are deleted here.
    ``revoke_old``: revoke what the enclaves had before, of which the private key was here. Raises
    InvalidInputError for an enclave that does not exist and a key that is another's, SigningUnavailableError.
    """
    chosen = options or ProvisionOptions()
    root, listed = keystore_at(keystore).root, list(requests)
    now = chosen.now or utc_now()
    with opened_for_change(root, now, chosen) as opened:
        view = KeystoreView(root)
        for one in listed:
            _refuse_unfit(view, opened.register, one)
        fresh = [one for one in listed if not _is_signed(view, opened.register, one)]
        with opened.batch() as batch:
            for one in fresh:
                batch.file(layout.request(one.enclave), one.pem, PRIVATE_MODE)
        for one in listed:
            opened.remove(layout.enclave_file(one.enclave, layout.KEY))
    names = [one.enclave for one in fresh]
    return renew(root, names, options=RenewOptions(revoke_old=revoke_old, provisioning=chosen))


def accept_certificates(
    keystore: Path | str,
    requests: Iterable[Request],
    issued: bytes,
    *,
    options: ProvisionOptions | None = None,
) -> tuple[str, ...]:
    """Take the certificates in ``issued`` (PEM) for these requests, matched by their keys; returns the enclaves.

    The enclaves are created where missing and keep their permissions; a new one may do nothing until ``apply-policy``
    or a launch says what. Raises InvalidInputError for a request without its certificate, another issuer or subject, or
    one that is not valid now; SigningUnavailableError without the permissions CA's key.
    """
    chosen = options or ProvisionOptions()
    root, now = keystore_at(keystore).root, chosen.now or utc_now()
    with opened_for_change(root, now, chosen) as opened:
        view = KeystoreView(root)
        by_key = {
            fingerprint(one.public_key): one for one in given_certificates(issued, "the issued certificates")
        }
        found = [(one, _fitting(view, opened.register, one, by_key.get(one.key), now)) for one in requests]
        _refuse_by_openssl(view, found)
        signer = view.authority(Role.PERMISSIONS, chosen.access)
        register = opened.register
        with opened.batch() as batch:
            for one, facts in found:
                register = _accept(batch, view, register, signer, one, facts)
            batch.record(register.without_ended(now))
        for one, _ in found:
            opened.remove(layout.enclave_file(one.enclave, layout.KEY))
    return tuple(one.enclave for one, _ in found)


def _fitting(
    view: KeystoreView, register: Register, one: Request, facts: CertificateFacts | None, now: datetime
) -> CertificateFacts:
    what = f"the certificate for {one.enclave}"
    _refuse_taken_key(register, one)
    if facts is None:
        raise InvalidInputError(f"{what} is not among those issued: none is for the requested key")
    if not names_enclave(facts.common_name, one.enclave) or facts.name_parts != 1:
        raise InvalidInputError(
            f"{what} has another subject than CN={common_name(one.enclave)} alone, which permissions are signed for; "
            "have the CA take the subject of the request"
        )
    if not issued_by(facts, view.ca(Role.IDENTITY)):
        raise InvalidInputError(f"{what} is not signed by the identity CA of this keystore itself")
    if not facts.validity.covers(now):
        raise InvalidInputError(f"{what} is not valid now")
    if facts.can_certify:
        raise InvalidInputError(
            f"{what} may certify enclaves of its own (CA:TRUE, or key usage keyCertSign or cRLSign); have the CA issue "
            "one of an end entity"
        )
    known = register.certificates.get(facts.serial)
    if known is not None and (known.enclave != one.enclave or known.revoked is not None):
        raise InvalidInputError(f"{what} has the serial number of another enclave's, or of a revoked one")
    return facts


def _refuse_by_openssl(view: KeystoreView, found: list[tuple[Request, CertificateFacts]]) -> None:
    judged = refusals(view.ca(Role.IDENTITY), [facts for _, facts in found], Role.IDENTITY)
    for (one, _), why in zip(found, judged, strict=True):
        if why:
            raise InvalidInputError(
                f"the certificate for {one.enclave}: OpenSSL, by which DDS implementations check, refuses it: {why}; "
                "have the CA issue one with its own authorityKeyIdentifier or none, and no critical extensions but "
                "basicConstraints and key usage"
            )


def _accept(
    batch: Batch,
    view: KeystoreView,
    register: Register,
    signer: Authority,
    one: Request,
    facts: CertificateFacts,
) -> Register:
    """Write the enclave's files, with its permissions for the dates of this certificate; return the register with
    both.
    """
    name = facts.common_name or ""
    document = previous_permissions(view, register, one.enclave, subject_name(name), facts.validity)
    entries: dict[str, Content | Link] = {
        layout.CERT: Content(facts.pem),
        layout.PERMISSIONS_XML: Content(document),
        layout.PERMISSIONS: Content(sign_document(document, signer)),
        **enclave_links(one.enclave, crl=view.has_crl),
    }
    batch.file(layout.request(one.enclave), one.pem, PRIVATE_MODE)
    batch.directory(layout.enclave_directory(one.enclave), entries)
    record = certificate_record(one.enclave, facts, view.ca(Role.IDENTITY))
    return register.with_certificates([record]).with_documents(
        [permissions_record(one.enclave, name, document)]
    )


def _is_signed(view: KeystoreView, register: Register, one: Request) -> bool:
    present = register.in_force(one.enclave)
    return view.has_request(one.enclave) and present is not None and present.key == one.key


def _refuse_unfit(view: KeystoreView, register: Register, one: Request) -> None:
    if one.enclave not in view.enclaves():
        raise InvalidInputError(
            f"no enclave {one.enclave} in {quoted(view.root)}; give it its permissions first (secure-launch, "
            "apply-policy or create-enclave)"
        )
    requested = request_key(one.pem, f"the request of {one.enclave}")
    if not names_enclave(requested.common_name, one.enclave):
        raise InvalidInputError(
            f"the request of {one.enclave} names {quoted(requested.common_name)}, another enclave's subject"
        )
    _refuse_taken_key(register, one)


def _refuse_taken_key(register: Register, one: Request) -> None:
    for issued in register.certificates.values():
        if issued.key == one.key and issued.enclave != one.enclave:
            raise InvalidInputError(
                f"the key in the request of {one.enclave} is that of {issued.enclave}; each enclave needs its own"
            )
        if issued.key == one.key and issued.revoked is not None:
            raise InvalidInputError(f"the key in the request of {one.enclave} was revoked; make a new one")
