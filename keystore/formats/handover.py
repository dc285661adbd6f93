"""What a permissions CA says before it is replaced: which CAs to trust then. It is in every later bundle."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from keystore.errors import DamagedKeystoreError
from keystore.formats.role import Role

_TYPE = "enclave-launch handover"


def handover_json(authorities: Mapping[Role, tuple[str, ...]]) -> bytes:
    """Return the document that names ``authorities``, by the SHA-256 of their certificates."""
    named = {role.value: list(authorities[role]) for role in Role}
    return (
        json.dumps({"type": _TYPE, "version": 1, "authorities": named}, indent=1, sort_keys=True).encode()
        + b"\n"
    )


def parse_handover(text: bytes, place: str) -> dict[Role, frozenset[str]]:
    """Return the CAs that a handover names, by role. Raises DamagedKeystoreError."""
    try:
        content: Any = json.loads(text)
        if content["type"] == _TYPE and content["version"] == 1:
            return {role: frozenset(map(str, content["authorities"][role.value])) for role in Role}
    except (ValueError, KeyError, TypeError, RecursionError):
        pass
    raise DamagedKeystoreError(f"{place} does not name the CAs that follow")
