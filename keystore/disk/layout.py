"""Paths of a keystore's files, as SROS2 lays them out (ros2/sros2 keystore package, ros2/rcl security.c).

    <keystore>/public/{identity,permissions}_ca.cert.pem      trust anchors; SROS2: links to ca.cert.pem
               private/{identity,permissions}_ca.key.pem      CA keys, mode 0600 in a 0700 directory
               enclaves/governance.{xml,p7s}                  one for all
               enclaves/<path>/...                            one directory per enclave; / is enclaves/ itself
               zenoh/router.{json5,cert.pem,key.pem}          of the Zenoh router, where enclaves are on Zenoh
               containers/e.<path>/...                        of an imported keystore: enclaves for containers

All paths here are POSIX text relative to the keystore, so that they read the same in reports and tests.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import cache

from keystore.formats.enclave_name import flat_name, segments, validate_enclave_name
from keystore.formats.role import Role

PUBLIC, PRIVATE, ENCLAVES = "public", "private", "enclaves"
CONTAINERS = "containers"
STAGING = ".staging"
LOCK = ".lock"
GITIGNORE = ".gitignore"
SETTINGS = "secure-keystore.json"
GOVERNANCE_XML = "enclaves/governance.xml"
GOVERNANCE = "enclaves/governance.p7s"
CRL = "public/crl.pem"
SHARED_CA_CERT, SHARED_CA_KEY = "public/ca.cert.pem", "private/ca.key.pem"
RETIRED = "private/retired"
INCOMING = "private/incoming"
NEXT = "private/next"
REGISTER = "private/register.json"
SHARES = "private/shares"
ZENOH = "zenoh"
ZENOH_ROUTER = "zenoh/router.json5"
ZENOH_ROUTER_CERT, ZENOH_ROUTER_KEY = "zenoh/router.cert.pem", "zenoh/router.key.pem"
BUNDLE = "bundle.p7s"
"""The signed manifest: first in a bundle, and beside ``public/`` where one was imported."""
HANDOVER = "handover.p7s"
"""In a bundle and where one was imported: which CAs follow, signed by the permissions CA before them."""
SIGNED_HANDOVER = f"private/{HANDOVER}"
"""The same where it was signed; the CA that signed it may be gone since."""
REQUESTS = "private/requests"
"""Of enclaves whose keys were made on their hosts: the certificate requests, in the place of the keys."""
BUNDLES = "private/bundles"
"""The manifest that was signed last for each host."""
PRIVATE_FOLDERS = (INCOMING, NEXT, RETIRED, SHARES, BUNDLES, REQUESTS)
CRL_UNLINKED = "private/crl-unlinked"
"""There while a published CRL is given to the enclaves: an interrupted run left some without."""

KEY, CERT = "key.pem", "cert.pem"
KEY_URI = "key.p11"
"""In the place of a key: the ``pkcs11:`` URI of one in a token (rmw_dds_common security.cpp)."""
REQUEST = "request.csr"
"""Beside a key that waits on its host for a certificate."""
PERMISSIONS_XML, PERMISSIONS = "permissions.xml", "permissions.p7s"
ENCLAVE_GOVERNANCE = "governance.p7s"
ENCLAVE_CRL = "crl.pem"
ENCLAVE_ZENOH = "zenoh.json5"
"""There for the enclaves that are on Zenoh."""
ENCLAVE_FILES = frozenset({
    KEY, CERT, PERMISSIONS_XML, PERMISSIONS, ENCLAVE_GOVERNANCE, ENCLAVE_CRL,
    "identity_ca.cert.pem", "permissions_ca.cert.pem",
})  # fmt: skip
RUNTIME_FILES = (
    "identity_ca.cert.pem", CERT, KEY, "permissions_ca.cert.pem", ENCLAVE_GOVERNANCE, PERMISSIONS,
)  # fmt: skip
"""The files that a process needs to start (rmw_dds_common security.cpp): all six, or none."""


def read_by_processes(enclaves: Iterable[str]) -> Iterator[str]:
    """Yield the folders and files that processes in these enclaves read; some may be missing."""
    yield from ("", PUBLIC, *(ca_cert(role) for role in Role), *CA_LINKS, CRL, ENCLAVES, GOVERNANCE)
    for enclave in enclaves:
        folder = enclave_directory(enclave)
        parts = folder.split("/")
        yield from ("/".join(parts[:count]) for count in range(2, len(parts) + 1))
        yield from (f"{folder}/{name}" for name in (*RUNTIME_FILES, ENCLAVE_CRL))


def ca_cert(role: Role) -> str:
    """Return the path of the certificate of the CA for ``role``."""
    return f"{PUBLIC}/{role.value}.cert.pem"


def ca_key(role: Role) -> str:
    """Return the path of the private key of the CA for ``role``."""
    return f"{PRIVATE}/{role.value}.key.pem"


def ca_key_uri(role: Role) -> str:
    """Return the path of a file with the ``pkcs11:`` URI of a key in a token, named as rcl names such files."""
    return f"{PRIVATE}/{role.value}.key.p11"


def enclave_directory(enclave: str) -> str:
    """Return ``enclaves/a/b``. Raises InvalidEnclaveNameError, so no path is built from an unchecked name."""
    return "/".join((ENCLAVES, *segments(validate_enclave_name(enclave))))


def enclave_file(enclave: str, name: str) -> str:
    """Return the path of the file ``name`` of ``enclave``."""
    return f"{enclave_directory(enclave)}/{name}"


def zenoh_session(enclave: str) -> str:
    """Return the path of what ``ZENOH_SESSION_CONFIG_URI`` names for processes of ``enclave``."""
    return enclave_file(enclave, ENCLAVE_ZENOH)


def shares(enclave: str) -> str:
    """Return the path of the record of launches that share ``enclave``."""
    return f"{SHARES}/{flat_name(enclave)}.json"


def request(enclave: str) -> str:
    """Return the path of the certificate signing request of ``enclave``, for an identity CA elsewhere."""
    return f"{REQUESTS}/{flat_name(enclave)}.csr"


def enclave_links(enclave: str, *, crl: bool = False) -> dict[str, str]:
    """Return link name -> relative target of an enclave directory; the root enclave shares ``governance.p7s``.

    ``crl``: with the link that each enclave has once the keystore revokes something.
    """
    links = dict(_links(len(segments(enclave))))
    if not crl:
        del links[ENCLAVE_CRL]
    return links


@cache  # a keystore has enclaves by the hundred at a few depths
def _links(depth: int) -> Mapping[str, str]:
    links = {f"{role.value}.cert.pem": "../" * (depth + 1) + ca_cert(role) for role in Role}
    if depth:
        links[ENCLAVE_GOVERNANCE] = "../" * depth + "governance.p7s"
    links[ENCLAVE_CRL] = "../" * (depth + 1) + CRL
    return links


def crl_link(enclave: str) -> str:
    """Return the target of the CRL link of ``enclave``, relative to its directory."""
    return _links(len(segments(enclave)))[ENCLAVE_CRL]


def container_directory(enclave: str) -> str:
    """Return where an imported keystore has ``enclave`` once more, as files that belong to a container's user."""
    return f"{CONTAINERS}/{flat_name(enclave)}"


def link_source(name: str) -> str:
    """Return the keystore file that an enclave's link called ``name`` points to."""
    if name == ENCLAVE_CRL:
        return CRL
    return GOVERNANCE if name == ENCLAVE_GOVERNANCE else f"{PUBLIC}/{name}"


def source_of(enclave: str, name: str) -> str:
    """Return the keystore file behind the file ``name`` of ``enclave``, which may be a link."""
    if name in (KEY, KEY_URI, CERT, PERMISSIONS):
        return enclave_file(enclave, name)
    return link_source(name)


CA_LINKS = {
    **{ca_cert(role): "ca.cert.pem" for role in Role},
    **{ca_key(role): "ca.key.pem" for role in Role},
}
"""The links SROS2 makes for its single CA: the only ones allowed in ``public/`` and ``private/``."""


def signed_bundle(host: str) -> str:
    """Return the path of the manifest signed last for ``host``, an already checked name."""
    return f"{BUNDLES}/{host}.p7s"


def bundle_files(enclaves: Iterable[tuple[str, bool]], *, crl: bool, handover: bool = False) -> set[str]:
    """Return every file that a host's bundle of these enclaves has besides its manifest; True: with its private key."""
    names = {*(ca_cert(role) for role in Role), GOVERNANCE}
    names |= {name for name, is_there in ((CRL, crl), (HANDOVER, handover)) if is_there}
    for enclave, has_key in enclaves:
        own = (CERT, PERMISSIONS, *([KEY] if has_key else []))
        names |= {enclave_file(enclave, name) for name in own}
    return names
