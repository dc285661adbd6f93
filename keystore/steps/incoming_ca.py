"""A CA's certificate and key, published together.

The pair is renamed into ``private/incoming`` as one directory and installed from there, so that no crash can leave a
certificate beside another CA's key. Writes the keystore.
"""

from __future__ import annotations

from enclave_common.terminal import quoted
from keystore.disk import layout, safe_files, store
from keystore.disk.store import Content, Store
from keystore.errors import DamagedKeystoreError
from keystore.formats.certificate import read_certificates
from keystore.formats.register import AuthorityState
from keystore.formats.role import Role
from keystore.signing.token_key import is_token_uri


def put_incoming(opened: Store, role: Role, cert: bytes, key: bytes) -> None:
    """Stage a CA pair durably; ``install_incoming`` publishes it, now or in the next run. ``key``: PEM, or the
    ``pkcs11:`` URI of one in a token."""
    opened.ensure_directory(layout.PRIVATE)
    opened.ensure_directory(layout.INCOMING)
    name = layout.KEY_URI if is_token_uri(key) else layout.KEY
    facts = read_certificates(cert, layout.INCOMING)[0]
    with opened.batch() as batch:
        batch.record(opened.register.with_authority(role, facts.der, AuthorityState.IN_USE))
        batch.directory(
            f"{layout.INCOMING}/{role.value}",
            {name: Content(key, store.PRIVATE_MODE), layout.CERT: Content(cert)},
        )


def install_incoming(opened: Store) -> None:
    """Publish every complete CA pair waiting in ``private/incoming``; repeats safely after a crash."""
    for role in Role:
        waiting = f"{layout.INCOMING}/{role.value}"
        if not opened.is_directory(waiting):
            continue
        cert = safe_files.read_if_there(opened.root, f"{waiting}/{layout.CERT}")
        if cert is not None:
            _install(opened, role, waiting, cert)
        # The certificate first: without it nothing is installed.
        for name in (layout.CERT, layout.KEY, layout.KEY_URI):
            opened.remove(f"{waiting}/{name}")
        opened.remove_empty_directory(waiting)
    opened.remove_empty_directory(layout.INCOMING)


def _install(opened: Store, role: Role, waiting: str, cert: bytes) -> None:
    pem = safe_files.read_if_there(opened.root, f"{waiting}/{layout.KEY}")
    uri = safe_files.read_if_there(opened.root, f"{waiting}/{layout.KEY_URI}")
    if pem is None and uri is None:
        raise DamagedKeystoreError(
            f"{quoted(opened.root / waiting)} holds a certificate without key; remove it"
        )
    name, stale = layout.ca_key(role), layout.ca_key_uri(role)
    if pem is None:
        name, stale = stale, name
    opened.ensure_directory(layout.PUBLIC)
    with opened.batch() as batch:
        batch.file(name, pem or uri or b"", store.PRIVATE_MODE)
        batch.file(layout.ca_cert(role), cert)
    opened.remove(stale)
