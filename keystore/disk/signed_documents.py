"""Documents that this keystore signed: the governance in force, and what another tool signed with our CA.

What is in force has, byte for byte, the form that we write. A foreign document (SROS2's) counts for one thing only, to
be taken over: it must have been signed by us, by the present permissions CA, by one of the trust bundle during a
roll-over, or by a retired one.
"""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable, Iterator

from enclave_common.terminal import quoted
from keystore.disk import layout, safe_files
from keystore.disk.register_file import read_register
from keystore.disk.view import KeystoreView
from keystore.errors import DamagedKeystoreError, InvalidInputError, OtherFormError
from keystore.formats.certificate import CertificateFacts, read_certificates
from keystore.formats.domains import Domains
from keystore.formats.governance import Governance, parse_governance, read_foreign_governance
from keystore.formats.register import Register
from keystore.formats.role import Role
from keystore.signing import smime


def signed_governance(view: KeystoreView) -> smime.SignedDocument:
    """Reads what is in force (``governance.p7s``); its signature is not checked. Raises DamagedKeystoreError."""
    place = quoted(view.root / layout.GOVERNANCE)
    return smime.read(safe_files.read(view.root, layout.GOVERNANCE), place)


def governance_in_force(view: KeystoreView) -> Governance:
    """Return what ``governance.p7s`` says; its signature is not checked. Raises DamagedKeystoreError."""
    return parse_governance(signed_governance(view).document, quoted(view.root / layout.GOVERNANCE))


def governance_domains(view: KeystoreView) -> Domains:
    """Return the domains of the governance signed last, in a keystore of another tool too.

    Raises DamagedKeystoreError if that cannot be decided.
    """
    place = quoted(view.root / layout.GOVERNANCE)
    register = read_register(view.root)
    if register is not None and register.governance:
        return parse_governance(register.governance, place).domains()
    try:
        return governance_in_force(view).domains()
    except OtherFormError:
        return foreign_governance(view)[0].domains()


def foreign_governance(view: KeystoreView) -> tuple[Governance, tuple[str, ...]]:
    """Return the governance of another tool as it would be written here, and what of it is lost.

    Raises DamagedKeystoreError for one that none of our CAs signed, or that DDS implementations read differently.
    """
    place = quoted(view.root / layout.GOVERNANCE)
    try:
        return read_foreign_governance(foreign_document(view, layout.GOVERNANCE), place)
    except (InvalidInputError, DamagedKeystoreError) as error:
        raise DamagedKeystoreError(
            f"{error}; put yours in force: secure-keystore governance {shlex.quote(str(view.root))} FILE.yaml"
        ) from None


def governance_stands(view: KeystoreView, domains: Domains | None, register: Register | None = None) -> bool:
    """Returns whether the present permissions CA signed the governance, it is the one signed last as far as the
    register is here to say so, and it lists each of ``domains``."""
    try:
        signed = signed_governance(view)
        smime.check(signed, [view.ca(Role.PERMISSIONS)], layout.GOVERNANCE)
        if not signed.embeds(view.ca(Role.PERMISSIONS).der):
            return False
        if register is not None and register.governance and signed.document != register.governance:
            return False
        governance = parse_governance(signed.document, layout.GOVERNANCE)
    except DamagedKeystoreError:
        return False
    return domains is None or governance.domains().covers(domains)


def own_document(view: KeystoreView, relative: str) -> bytes:
    """Return the XML inside a ``.p7s`` in our form.

    Raises DamagedKeystoreError if none of our CAs signed it, OtherFormError if one did, in another form.
    """
    try:
        return _trusted(view, relative, smime.read)
    except OtherFormError:
        foreign_document(view, relative)
        raise


def foreign_document(view: KeystoreView, relative: str) -> bytes:
    """Return the XML inside a ``.p7s`` in any form; raises DamagedKeystoreError if none of our CAs signed it."""
    return _trusted(view, relative, smime.read_any)


def _trusted(view: KeystoreView, relative: str, read: Callable[[bytes, str], smime.SignedDocument]) -> bytes:
    place = quoted(view.root / relative)
    signed = read(safe_files.read(view.root, relative), place)
    smime.check(signed, list(own_permissions_cas(view)), place)
    return signed.document


def own_permissions_cas(view: KeystoreView) -> Iterator[CertificateFacts]:
    """Return the permissions CAs of this keystore: those in force, a shared one, and retired ones."""
    yield from view.ca_bundle(Role.PERMISSIONS)
    names = [layout.SHARED_CA_CERT]
    if os.path.isdir(view.root / layout.RETIRED):
        names += [f"{layout.RETIRED}/{name}" for name in sorted(os.listdir(view.root / layout.RETIRED))]
    for name in names:
        pem = safe_files.read_if_there(view.root, name)
        if pem is not None and name.endswith(".cert.pem"):
            yield from read_certificates(pem, quoted(view.root / name))
