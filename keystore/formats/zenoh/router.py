"""The Zenoh configuration of the router (``ZENOH_ROUTER_CONFIG_URI``): what enforces. Pure.

Mutual TLS only, everything denied that no rule allows, each rule bound to the common name of an enclave's certificate.
No gossip and no multicast, so that nobody learns of ways around; links end with the certificate they were opened with.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from keystore.formats.zenoh.rules import AccessRule
from keystore.formats.zenoh.session import NO_SCOUTING, TIMESTAMPING, TlsFiles, json_bytes, transport

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
    """``metadata`` says what else the file was made from; Zenoh only carries it."""
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
    """An enclave without rules is named nowhere: nothing matches it, so everything is denied."""
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
