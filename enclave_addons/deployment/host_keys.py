"""Make keys where they are used: the host makes them and requests, the CA signs, the private key never travels.

    request         on the host: a key (in a file, or in a PKCS#11 token) and a certificate request for each enclave
    sign_requests   where the CA is: the enclave's certificate for that key; no private key is kept there
    import          on the host: the bundle, beside the key that waited in ``pending``

A request proves that whoever made it holds the key (RFC 2986); it does not prove who asks. Compare the fingerprints
that both commands print, or carry it on a way that you trust.
"""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from enclave_common.dependencies import require
from enclave_common.terminal import quoted
from keystore.disk import layout, lock, safe_files, store
from keystore.disk.store import write_new
from keystore.disk.versions import Versions
from keystore.errors import (
    DamagedKeystoreError,
    InvalidInputError,
    SigningUnavailableError,
    StorageError,
    UnsafeKeystoreError,
    storage_errors,
)
from keystore.formats.bundle import BundledEnclave
from keystore.formats.certificate import read_certificate
from keystore.formats.enclave_name import flat_name, validate_enclave_name
from keystore.formats.subject import common_name
from keystore.signing.ca_access import CaAccess
from keystore.signing.certificate_request import new_request, request_key
from keystore.signing.private_key import PrivateKey, key_pem, load_private_key, new_key, spki
from keystore.signing.public_key import fingerprint
from keystore.signing.token_key import open_key

_BLOCK = re.compile(
    rb"^enclave: ([^\n]{1,300})\n(-----BEGIN CERTIFICATE REQUEST-----\n.*?\n-----END CERTIFICATE REQUEST-----\n)",
    re.DOTALL | re.MULTILINE,
)


class HostKey(NamedTuple):
    """A private key of this host. ``name``: key.pem or key.p11; ``data``: the file's bytes."""

    name: str
    data: bytes

    def __repr__(self) -> str:
        return f"HostKey({self.name!r})"


class Request(NamedTuple):
    """A certificate request. ``key``: SHA-256 of the public key, as in the register; ``pem``: the PKCS#10 request."""

    enclave: str
    key: str
    pem: bytes


@dataclass(frozen=True, slots=True)
class RequestOptions:
    """How to request. ``token``: ``pkcs11:`` URI of an existing key in a token, for one enclave only."""

    token: str | None = None
    access: CaAccess = field(default_factory=CaAccess)
    lock_timeout: float = lock.DEFAULT_TIMEOUT


def request(
    keystore: Path | str, enclaves: Iterable[str], *, options: RequestOptions | None = None
) -> tuple[Request, ...]:
    """Make a key for each enclave and request its certificate; one that waits already is requested again, unchanged.

    The present key of an enclave stays in use until a bundle with the certificate of the new one is imported.
    Raises InvalidInputError, StorageError, SigningUnavailableError (a token that refuses).
    """
    require("cryptography")
    chosen = options or RequestOptions()
    names = sorted({validate_enclave_name(name) for name in enclaves})
    if chosen.token is not None and len(names) != 1:
        raise InvalidInputError("one key in a token is for one enclave; make one request for each")
    versions = Versions(keystore)
    with versions.opened(chosen.lock_timeout):
        _make_private(versions.pending)
        return tuple(_request(versions.pending, name, chosen) for name in names)


def _request(pending: Path, enclave: str, options: RequestOptions) -> Request:
    place = pending / flat_name(enclave)
    if not place.is_dir():
        file, key = _new_key(options)
        pem = new_request(common_name(enclave), key)
        request_key(
            pem, f"the request of {enclave}"
        )  # before it is kept: one that no CA takes would wait for ever
        aside = pending / f".{place.name}"
        shutil.rmtree(aside, ignore_errors=True)
        with storage_errors("writing the request"):
            os.mkdir(aside, 0o700)
            write_new(aside / file.name, file.data, store.PRIVATE_MODE)
            write_new(aside / layout.REQUEST, pem, store.PUBLIC_MODE)
            os.rename(aside, place)
    pem = safe_files.read(place, layout.REQUEST)
    return Request(enclave, fingerprint(request_key(pem, f"the request of {enclave}").spki), pem)


def _new_key(options: RequestOptions) -> tuple[HostKey, PrivateKey]:
    if options.token is None:
        made = new_key()
        return HostKey(layout.KEY, key_pem(made)), made
    reference = f"{options.token}\n".encode()
    if not reference.startswith(b"pkcs11:") or len(reference.split()) != 1:
        raise InvalidInputError("a token's key is named by a pkcs11: URI without blanks (RFC 7512)")
    return HostKey(layout.KEY_URI, reference), open_key(reference, "the token", options.access)


def _make_private(folder: Path) -> None:
    try:
        os.mkdir(folder, 0o700)
    except FileExistsError:
        safe_files.refuse_unsafe_directory(folder)
    except OSError as error:
        raise StorageError.of(error, "making room for keys") from None


def requests_text(requests: Iterable[Request]) -> bytes:
    """Return the file that goes to the CA. Each block is a PEM request that openssl reads, too."""
    return b"".join(b"enclave: %s\n%s" % (one.enclave.encode(), one.pem) for one in requests)


def parse_requests(text: bytes, place: str) -> tuple[Request, ...]:
    """Read the file of requests. Raises DamagedKeystoreError, also if a request is not signed by its own key."""
    found = [
        Request(
            validate_enclave_name(name.decode("utf-8", "replace")),
            fingerprint(
                request_key(pem, f"{place}: the request of {quoted(name.decode('utf-8', 'replace'))}").spki
            ),
            pem,
        )
        for name, pem in _BLOCK.findall(text.replace(b"\r\n", b"\n"))
    ]
    if not found or len({one.enclave for one in found}) != len(found):
        raise DamagedKeystoreError(f"{place} holds no certificate requests of secure-keystore, or one twice")
    return tuple(found)


def find_key(versions: Versions, wanted: BundledEnclave) -> HostKey:
    """Return the key that the certificate of ``wanted`` was issued for: it waits here, or is in use already.

    Raises UnsafeKeystoreError when it is not on this host.
    """
    for folder, public in _candidates(versions, wanted.enclave):
        for name in (layout.KEY_URI, layout.KEY):
            data = _private(folder, name)
            if data is not None and _belongs(name, data, public, wanted):
                return HostKey(name, data)
    raise UnsafeKeystoreError(
        f"the certificate of enclave {wanted.enclave} in this bundle is for a key that is not on this host; make a "
        f"new request here: secure-keystore request {quoted(versions.root)} {wanted.enclave}"
    )


def _candidates(versions: Versions, enclave: str) -> Iterator[tuple[Path, Path]]:
    waiting = versions.pending / flat_name(enclave)
    yield waiting, waiting / layout.REQUEST
    if versions.current is not None:
        present = versions.current / layout.enclave_directory(enclave)
        yield present, present / layout.CERT


def _private(folder: Path, name: str) -> bytes | None:
    if not os.path.lexists(folder / name):
        return None
    return safe_files.read_private(folder, name)


def _belongs(name: str, data: bytes, public: Path, wanted: BundledEnclave) -> bool:
    """Return the public key: of a key in a file from itself, of one in a token from the request or certificate."""
    if name == layout.KEY:
        try:
            key = load_private_key(data, None, name).public_key()
        except SigningUnavailableError:
            return False
        return fingerprint(spki(key)) == wanted.key
    pem = safe_files.read(public.parent, public.name)
    known = (
        request_key(pem, str(public)).spki
        if public.name == layout.REQUEST
        else read_certificate(pem, str(public)).public_key
    )
    return fingerprint(known) == wanted.key


def forget_pending(versions: Versions, used: Mapping[str, HostKey]) -> None:
    """Delete the waiting copies of keys that a bundle put in force."""
    for enclave, key in used.items():
        place = versions.pending / flat_name(enclave)
        if place.is_dir() and _private(place, key.name) == key.data:
            shutil.rmtree(place)
