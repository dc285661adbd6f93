"""Where the CA is: certificates for keys that were made on their hosts."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from keystore.disk import layout
from keystore.disk.safe_files import resolve_root
from keystore.disk.store import PRIVATE_MODE
from keystore.disk.view import KeystoreView
from keystore.errors import InvalidInputError, printable
from keystore.formats.register import Register
from keystore.formats.subject import names_enclave
from keystore.formats.validity import utc_now
from keystore.signing.requests import request_key
from keystore.steps.host_keys import Request
from keystore.steps.opening import opened_for_change
from keystore.steps.options import ProvisionOptions
from keystore.steps.renewal import RenewOptions, renew
from keystore.steps.report import ProvisionReport


@dataclass(frozen=True, slots=True)
class SigningOptions:
    """``revoke_old``: revoke what the enclaves had before, of which the private key was here."""

    revoke_old: bool = False
    provisioning: ProvisionOptions = field(default_factory=ProvisionOptions)


def sign_requests(
    keystore: Path | str, requests: Iterable[Request], *, options: SigningOptions | None = None
) -> ProvisionReport:
    """Certify the requested keys in the place of those that the enclaves have; repeating does nothing more.

    The enclaves must exist, with the permissions that they are to have; their private keys are deleted here.
    Raises InvalidInputError for an enclave that does not exist and a key that is another's, SigningUnavailableError.
    """
    chosen = options or SigningOptions()
    root, listed = resolve_root(keystore), list(requests)
    KeystoreView(root).require_complete()
    provisioning = chosen.provisioning
    now = provisioning.now or utc_now()
    with opened_for_change(
        root, now, timeout=provisioning.lock_timeout, durable=provisioning.durable
    ) as opened:
        view = KeystoreView(root)
        for one in listed:
            _refuse_unfit(view, opened.register, one)
        fresh = [one for one in listed if not _is_signed(view, opened.register, one)]
        with opened.batch() as batch:
            for one in fresh:
                batch.file(layout.request(one.enclave), one.pem, PRIVATE_MODE)
        for one in listed:
            opened.remove(f"{layout.enclave_directory(one.enclave)}/{layout.KEY}")
    names = [one.enclave for one in fresh]
    asked = RenewOptions(revoke_old=chosen.revoke_old, provisioning=provisioning)
    return renew(root, names, options=asked)


def _is_signed(view: KeystoreView, register: Register, one: Request) -> bool:
    present = register.in_force(one.enclave)
    return view.has_request(one.enclave) and present is not None and present.key == one.key


def _refuse_unfit(view: KeystoreView, register: Register, one: Request) -> None:
    if one.enclave not in view.enclaves():
        raise InvalidInputError(
            f"no enclave {one.enclave} in {printable(view.root)}; give it its permissions first (secure-launch, "
            "apply-policy or create-enclave)"
        )
    asked = request_key(one.pem, f"the request of {one.enclave}")
    if not names_enclave(asked.common_name, one.enclave):
        raise InvalidInputError(
            f"the request of {one.enclave} names {printable(asked.common_name)}, another enclave's subject"
        )
    for issued in register.certificates.values():
        if issued.key == one.key and issued.enclave != one.enclave:
            raise InvalidInputError(
                f"the key that {one.enclave} asks with is that of {issued.enclave}; each enclave needs its own"
            )
        if issued.key == one.key and issued.revoked is not None:
            raise InvalidInputError(f"the key that {one.enclave} asks with was revoked; make a new one")
