"""Zenoh's configuration: of one enclave's processes, of the router, and where that is. Performs no I/O.

Processes (``ZENOH_SESSION_CONFIG_URI``): ``client`` mode, so that nothing goes past the router; only TLS, with the
enclave's own certificate; the router must be who it says it is. A custom file replaces that of rmw_zenoh as a whole, so
what ROS needs otherwise than Zenoh's defaults stands here too (DEFAULT_RMW_ZENOH_SESSION_CONFIG.json5).

Router (``ZENOH_ROUTER_CONFIG_URI``): what enforces. Mutual TLS only, everything denied that no rule allows, each rule
bound to the common name of an enclave's certificate. No gossip and no multicast, so that no peer learns of other
routes; links end with the certificate they were opened with.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from typing import Any, NamedTuple

from enclave_addons.zenoh.rules import AccessRule
from enclave_common.terminal import quoted
from keystore.errors import InvalidInputError

OPEN_TIMEOUT_MS = 30_000
"""How long a process looks for the router before it ends with an error. Zenoh's default gives up at once."""


class TlsFiles(NamedTuple):
    """Absolute paths. ``authorities``: all identity CAs that are trusted."""

    authorities: str
    certificate: str
    key: str


def session_configuration(router: Sequence[str], files: TlsFiles) -> bytes:
    """Return a session's configuration. ``router``: endpoints such as ``tls/localhost:7447``."""
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
    """Return the transport: only TLS; no shared memory, of which access control knows nothing.

    With the patience of rmw_zenoh's own files for many nodes that start together.
    """
    return {
        "unicast": {"open_timeout": 60_000, "accept_timeout": 60_000, "accept_pending": 10_000, "max_sessions": 10_000},
        "link": {"protocols": ["tls"], "tx": {"lease": 60_000, "keep_alive": 2}, "tls": tls},
        "shared_memory": {"enabled": False},
    }  # fmt: skip


def json_bytes(content: dict[str, Any]) -> bytes:
    """Write JSON, which is JSON5, with a line for each setting and each entry of a list of the access control.

    Two versions can be compared line by line. The same content gives the same bytes.
    """
    return (_lines(content, 2) + "\n").encode()


def _lines(value: Any, depth: int) -> str:
    if depth and isinstance(value, dict) and value:
        inner = ",\n".join(f"{json.dumps(name)}: {_lines(one, depth - 1)}" for name, one in value.items())
        return f"{{\n{inner}\n}}"
    if isinstance(value, list) and value and isinstance(value[0], dict):
        return "[\n" + ",\n".join(map(json.dumps, value)) + "\n]"
    return json.dumps(value)


ROUTER_NAME = "zenoh-router"
"""Common name of the router's certificate. No enclave has such a name (``subject.common_name``), and no rule is for it:
as a client it may do nothing."""


class Subject(NamedTuple):
    """An enclave with rules; ``common_name`` of the certificate that is in force."""

    enclave: str
    common_name: str
    rules: tuple[AccessRule, ...]


def router_configuration(
    listen: Sequence[str], files: TlsFiles, subjects: Sequence[Subject], metadata: dict[str, Any]
) -> bytes:
    """Return a router's configuration; ``metadata`` says what else the file was made from, Zenoh only carries it."""
    content = {
        "mode": "router",
        "metadata": metadata,
        "listen": {"endpoints": list(listen), "exit_on_failure": True},
        "connect": {"endpoints": []},
        "scouting": NO_SCOUTING,
        "timestamping": TIMESTAMPING,
        "queries_default_timeout": 600_000,
        "adminspace": {"enabled": False},
        "transport": transport({
            "root_ca_certificate": files.authorities,
            "enable_mtls": True,
            "listen_certificate": files.certificate,
            "listen_private_key": files.key,
            "close_link_on_expiration": True,
        }),
        "access_control": access_control(subjects),
    }  # fmt: skip
    return json_bytes(content)


def access_control(subjects: Sequence[Subject]) -> dict[str, Any]:
    """Return the access control; an enclave without rules is named nowhere: nothing matches it, so everything is
    denied.
    """
    served = [subject for subject in subjects if subject.rules]
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": [rule.block(subject.enclave) for subject in served for rule in subject.rules],
        "subjects": [
            {"id": subject.enclave, "cert_common_names": [subject.common_name]} for subject in served
        ],
        "policies": [
            {
                "rules": [rule.block(subject.enclave)["id"] for rule in subject.rules],
                "subjects": [subject.enclave],
            }
            for subject in served
        ],
    }


DEFAULT_PORT = 7447
_LOOPBACK = ("localhost", "127.0.0.1", "::1")
_ADDRESS = re.compile(
    r"(?:\[([0-9A-Fa-f:.]+)\]|([A-Za-z0-9](?:[A-Za-z0-9.-]*[A-Za-z0-9])?))(?::([0-9]{1,5}))?\Z"
)


class RouterAddress(NamedTuple):
    """The address of a router. ``host`` is what sessions connect to, and what the router's certificate says."""

    host: str = "localhost"
    port: int = DEFAULT_PORT

    @classmethod
    def parse(cls, text: str) -> RouterAddress:
        """Parse ``HOST``, ``HOST:PORT`` or ``[IPv6]:PORT``; raises ``InvalidInputError``."""
        match = _ADDRESS.match(text)
        port = int(match[3] or DEFAULT_PORT) if match else 0
        if match is None or not 0 < port < 65536 or len(match[1] or match[2]) > 253:
            raise InvalidInputError(f"{quoted(text)} is not where a router can be; write HOST or HOST:PORT")
        return cls(match[1] or match[2], port)

    def __str__(self) -> str:
        return f"{self._bracketed}:{self.port}"

    @property
    def _bracketed(self) -> str:
        return f"[{self.host}]" if ":" in self.host else self.host

    @property
    def endpoint(self) -> str:
        """Return the endpoint that sessions connect to."""
        return f"tls/{self}"

    @property
    def is_here(self) -> bool:
        """Return True if only processes of the router's own host can reach it."""
        return self.host in _LOOPBACK

    @property
    def listens(self) -> str:
        """Return the endpoint at which it listens: on loopback alone, or on every address of its host."""
        return self.endpoint if self.is_here else f"tls/[::]:{self.port}"

    @property
    def hosts(self) -> tuple[str, ...]:
        """Return the hosts that its certificate names."""
        return _LOOPBACK if self.is_here else (self.host,)
