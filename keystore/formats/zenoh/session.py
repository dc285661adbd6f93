"""The Zenoh configuration of one enclave's processes (``ZENOH_SESSION_CONFIG_URI``). Pure.

``client`` mode, so that nothing goes past the router; only TLS, with the enclave's own certificate; the router
must be who it says it is. A custom file replaces that of rmw_zenoh as a whole, so what ROS needs otherwise than
Zenoh's defaults stands here too (DEFAULT_RMW_ZENOH_SESSION_CONFIG.json5).
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any, NamedTuple

OPEN_TIMEOUT_MS = 30_000
"""How long a process looks for the router before it ends with an error. Zenoh's default gives up at once."""


class TlsFiles(NamedTuple):
    """Absolute paths. ``authorities``: all identity CAs that are trusted."""

    authorities: str
    certificate: str
    key: str


def session_configuration(router: Sequence[str], files: TlsFiles) -> bytes:
    """``router``: endpoints such as ``tls/localhost:7447``."""
    content = {
        "mode": "client",
        "connect": {
            "endpoints": list(router),
            "timeout_ms": OPEN_TIMEOUT_MS,
            "exit_on_failure": True,
        },
        "listen": {"endpoints": []},
        "scouting": NO_SCOUTING,
        "timestamping": TIMESTAMPING,
        "queries_default_timeout": 600_000,
        "transport": transport({
            "root_ca_certificate": files.authorities,
            "enable_mtls": True,
            "connect_certificate": files.certificate,
            "connect_private_key": files.key,
            "verify_name_on_connect": True,
            "close_link_on_expiration": True,
        }),
    }  # fmt: skip
    return json_bytes(content)


NO_SCOUTING: dict[str, Any] = {"multicast": {"enabled": False}, "gossip": {"enabled": False}}
TIMESTAMPING: dict[str, Any] = {"enabled": {"router": True, "peer": True, "client": True}}
"""Transient local publishers cache nothing without."""


def transport(tls: dict[str, Any]) -> dict[str, Any]:
    """Only TLS; no shared memory, of which access control knows nothing; the patience of rmw_zenoh's own files for many
    nodes that start together."""
    return {
        "unicast": {"open_timeout": 60_000, "accept_timeout": 60_000, "accept_pending": 10_000, "max_sessions": 10_000},
        "link": {"protocols": ["tls"], "tx": {"lease": 60_000, "keep_alive": 2}, "tls": tls},
        "shared_memory": {"enabled": False},
    }  # fmt: skip


def json_bytes(content: dict[str, Any]) -> bytes:
    """JSON is JSON5. A line for each setting, and for each entry of a list of the access control: two versions can be
    compared line by line. The same content gives the same bytes."""
    return (_lines(content, 2) + "\n").encode()


def _lines(value: Any, depth: int) -> str:
    if depth and isinstance(value, dict) and value:
        inner = ",\n".join(f"{json.dumps(name)}: {_lines(one, depth - 1)}" for name, one in value.items())
        return f"{{\n{inner}\n}}"
    if isinstance(value, list) and value and isinstance(value[0], dict):
        return "[\n" + ",\n".join(map(json.dumps, value)) + "\n]"
    return json.dumps(value)
