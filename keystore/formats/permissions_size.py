"""How large a permissions document may be: Fast DDS sends it whole in a handshake message. Performs no I/O.

Measured on Fast DDS 2.9.1 with a certificate of 587 bytes: a signed document of 63,736 bytes works, with 63,821 bytes
no peer ever matches. Cyclone DDS 0.10.2 handles 2 MB.
"""

from __future__ import annotations

from collections import Counter

from keystore.formats.permissions_names import dds_topics, full_name
from keystore.formats.policy import EnclavePolicy, Operation

WARN_BYTES = 48_000
FAST_DDS_LIMIT_BYTES = 63_736
_FRAME_BYTES = (
    3_300  # MIME frame, PKCS#7 and one certificate in base64, rounded up; head and tail of the document
)
_TOPIC_BYTES = 17  # <topic></topic> and CRLF


def _bytes_without_name(operation: Operation) -> tuple[int, int]:
    """Return how many DDS topics an operation needs, and what they take besides the name in each of them."""
    topics = [topic for direction in dds_topics(operation, "") for topic in direction]
    return len(topics), sum(len(topic) + _TOPIC_BYTES for topic in topics)


_BYTES = {operation: _bytes_without_name(operation) for operation in Operation}


def expected_size(policy: EnclavePolicy) -> int:
    """Estimate the bytes of the signed document before anything is signed, from the names. Raises ``PolicyError``."""
    names = {
        (rule.operation, full_name(rule.expression, profile))
        for profile in policy.profiles
        for rule in profile.rules
    }
    return _FRAME_BYTES + sum(_bytes_of(operation, name) for operation, name in names)


def size_concern(policy: EnclavePolicy) -> str | None:
    """Report a document that will be too large, or near it, and what to do; ``None`` if all is well."""
    size = expected_size(policy)
    if size < WARN_BYTES:
        return None
    effect = (
        f"over the {FAST_DDS_LIMIT_BYTES} bytes that Fast DDS can carry: its peers would never match"
        if size > FAST_DDS_LIMIT_BYTES
        else f"close to the {FAST_DDS_LIMIT_BYTES} bytes that Fast DDS can carry"
    )
    return f"the permissions of enclave {policy.path} take {size} bytes, {effect}. {_advice(policy)}"


def _bytes_of(operation: Operation, name: str) -> int:
    topics, fixed = _BYTES[operation]
    return topics * len(name) + fixed


def _advice(policy: EnclavePolicy) -> str:
    weights = Counter(
        {
            f"{p.ns.rstrip('/')}/{p.node}": sum(
                _bytes_of(r.operation, full_name(r.expression, p)) for r in p.rules
            )
            for p in policy.profiles
        }
    )
    compact = "; or name parameter services by one expression: secure-keystore create KEYSTORE --compact"
    heaviest = ", ".join(f"{fqn} (about {weight} bytes)" for fqn, weight in weights.most_common(3))
    if len(policy.profiles) > 1:
        return f"Give some of its {len(policy.profiles)} nodes their own enclave; the largest: {heaviest}{compact}"
    prefixes = Counter(
        full_name(rule.expression, profile).rpartition("/")[0] or "/"
        for profile in policy.profiles
        for rule in profile.rules
    )
    common = ", ".join(f"{prefix}/* ({count} names)" for prefix, count in prefixes.most_common(3))
    return f"Split node {heaviest}, or grant a group of names by a wildcard in a --policy file: {common}{compact}"
