"""Why a participant was not made, from rcl's texts and from what the middleware prints; as advice for a person.

The lines were measured on Cyclone DDS 0.10 and Fast DDS 2.9 and 2.14, each with its fault injected.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import NamedTuple


class Cause(NamedTuple):
    """A cause and its remedy. ``said``: the words it was recognised by."""

    what: str
    remedy: str
    said: str


_PROVISION = "start the launch with --secure again, which provisions it again"
_CAUSES: tuple[tuple[str, str, str], ...] = (
    (
        r"SECURITY ERROR: directory '([^']*)' does not exist",
        "its enclave {0} is not in the keystore",
        f"{_PROVISION}; or check ROS_SECURITY_KEYSTORE and --enclave of the process",
    ),
    (
        r"could not find all security files|SECURITY ERROR: .*not found",
        "files of its enclave are missing",
        "secure-keystore verify reports which; " + _PROVISION,
    ),
    (
        r"Could not find domain (\d+) in governance",
        "its permissions are not for DDS domain {0}",
        "provision with --domain-id {0}, or start it in the domain of the keystore",
    ),
    (
        r"[Pp]ermissions validity period expired",
        "its permissions have expired",
        "secure-keystore renew, or " + _PROVISION,
    ),
    (r"certificate has expired", "its certificate has expired", "secure-keystore renew, or " + _PROVISION),
    (
        r"unable to get local issuer certificate",
        "its certificate was issued by another CA than the one that its enclave names",
        "secure-keystore verify reports which files do not belong together",
    ),
    (
        r"Failed to parse PKCS7 SMIME document",
        "its signed permissions or governance are damaged, or signed by another CA",
        "secure-keystore verify reports which; " + _PROVISION,
    ),
    (
        r"Subject name is invalid",
        "its permissions are those of another subject",
        "secure-keystore verify; " + _PROVISION,
    ),
    (
        r"DECODER routines|Error obtaining private key|Failed to finish reading private key",
        "its key or certificate cannot be read by this process",
        "check the owner and mode of key.pem and cert.pem in its enclave",
    ),
    (
        r"doesn't have the security libraries|not compiled with security|security is not supported",
        "its middleware was built without DDS-Security",
        "use a middleware that has it (RMW_IMPLEMENTATION), or run without --secure",
    ),
    (
        r"Failed to convert octet sequence to ASN1 integer",
        "Cyclone DDS and Fast DDS of these releases do not understand each other's handshake",
        "use one middleware for all processes of the launch (RMW_IMPLEMENTATION)",
    ),
    (
        r"security_attributes mismatch",
        "its governance requires another protection than its peer's",
        "give all processes the governance of one keystore",
    ),
    (
        r"validate_local_identity",
        "its certificate was not accepted: it was issued by another CA than the one its enclave names, or has expired",
        "secure-keystore verify reports which",
    ),
)
_AT_LAST = (
    (
        r"Cannot create participant due to initialization error",
        "Fast DDS does not accept the files of its enclave, and does not say which",
        "secure-keystore verify reports whether its permissions, governance or certificates are damaged, expired or "
        "were signed by another CA; " + _PROVISION,
    ),
)
"""Said in any case, whatever the reason: of use where nothing else was said."""
MIXED_MIDDLEWARES = Cause(
    "secured, some pairs of them never finish the handshake, and are silent",
    "use one middleware for all (RMW_IMPLEMENTATION)",
    "",
)
NOT_AS_PLANNED = Cause(
    "the permissions in its enclave are not those of the plan, or are for another DDS domain than the one it talks in",
    "compare ROS_DOMAIN_ID with the domain that was provisioned; secure-keystore verify; " + _PROVISION,
    "",
)
HARMLESS = re.compile(r"Remote secure participant .* not allowed")
"""Printed while a peer is met before it is authenticated; ends with the handshake."""


def cause_of(texts: Iterable[str]) -> Cause | None:
    """Return the first cause that one of ``texts`` names."""
    said = tuple(texts)
    return _first_cause(said, _CAUSES) or _first_cause(said, _AT_LAST)


def _first_cause(texts: Iterable[str], causes: Iterable[tuple[str, str, str]]) -> Cause | None:
    for text in texts:
        for pattern, what, remedy in causes:
            match = re.search(pattern, text)
            if match is not None and not HARMLESS.search(text):
                return Cause(what.format(*match.groups()), remedy.format(*match.groups()), match[0])
    return None
