"""The grammar of enclave names: rcl's ``rcl_validate_enclave_name``, tightened to what DDS can carry."""

from __future__ import annotations

import re
from collections.abc import Iterable

from enclave_common.terminal import quoted
from keystore.errors import EnclaveTooDeep, InvalidEnclaveNameError

# RMW_TOPIC_MAX_NAME_LENGTH (247) minus two, where SROS2's namespace check stops; rcl itself allows 255.
MAX_LENGTH = 245
# Cyclone DDS cuts subject names into at most 20 pieces, the CN's own first (access_control_utils.c).
MAX_SEGMENTS = 19

_SEGMENT = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")
_ENCLAVE = re.compile(r"(?:/|(?:/[A-Za-z_][A-Za-z0-9_]*)+)\Z")


def validate_enclave_name(name: str) -> str:
    """Return ``name`` unchanged if it is an enclave name, else raise ``InvalidEnclaveNameError``.

    Nothing is normalised: ``/a/``, ``//a`` and ``/a/../b`` are refused, so a name has one spelling and its
    directory lies below ``enclaves``. Segments cannot collide with the keystore's own file names, which all
    contain a dot.
    """
    if len(name) > MAX_LENGTH:
        raise InvalidEnclaveNameError(
            name, f"it has {len(name)} characters, at most {MAX_LENGTH} are allowed"
        )
    if not _ENCLAVE.match(name):
        raise InvalidEnclaveNameError(name, _differences(name))
    if name.count("/") > MAX_SEGMENTS:
        count = name.count("/")
        raise EnclaveTooDeep(name, f"it has {count} segments, Cyclone DDS carries at most {MAX_SEGMENTS}")
    return name


def is_enclave_name(name: str) -> bool:
    """Return whether it is an enclave name."""
    try:
        return validate_enclave_name(name) == name
    except InvalidEnclaveNameError:
        return False


def _differences(name: str) -> str:
    if not name:
        return "it is empty"
    if not name.startswith("/"):
        return "it must be absolute (start with '/')"
    if name.endswith("/"):
        return "it must not end with '/'"
    for segment in name[1:].split("/"):
        if not segment:
            return "it contains '//'"
        if segment in (".", ".."):
            return f"{segment!r} is not allowed, names are not paths"
        if segment[0].isdigit():
            return f"segment {quoted(segment)} starts with a digit"
        if not _SEGMENT.match(segment):
            return f"segment {quoted(segment)} has characters other than ASCII letters, digits and '_'"
    raise AssertionError("a name refused by the whole rule must break one of its parts")


def segments(name: str) -> tuple[str, ...]:
    """Split a valid name into path segments: ``/a/b`` has two, the root ``/`` none."""
    return tuple(name[1:].split("/")) if name != "/" else ()


def check_distinct(names: Iterable[str]) -> None:
    """Refuse names that differ only in case: on case-insensitive file systems they would share one key."""
    seen: dict[str, str] = {}
    for name in names:
        for prefix in _prefixes(name):
            other = seen.setdefault(prefix.lower(), prefix)
            if other != prefix:
                raise InvalidEnclaveNameError(name, f"it differs from {quoted(other)} only in case")


def _prefixes(name: str) -> Iterable[str]:
    parts = segments(name)
    return ("/" + "/".join(parts[:count]) for count in range(1, len(parts) + 1))


def flat_name(enclave: str) -> str:
    """Return ``e.front.camera``; ``.`` cannot occur in a name."""
    return ".".join(("e", *segments(validate_enclave_name(enclave))))


def from_flat_name(name: str) -> str | None:
    """Return the enclave that ``e.front.camera`` stands for, None if it is not such a name."""
    first, *parts = name.split(".")
    enclave = "/" + "/".join(parts)
    return enclave if first == "e" and _ENCLAVE.match(enclave) else None
