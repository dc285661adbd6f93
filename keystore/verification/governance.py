"""The signed governance as a reviewer reads it: is it as strong as SROS2's default, is it for the right domains?"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from keystore.disk import layout
from keystore.formats.domains import Domains
from keystore.formats.governance import (
    DOMAIN_SETTINGS,
    TOPIC_SETTINGS,
    DomainRule,
    Governance,
    Protection,
    TopicRule,
)
from keystore.verification import repair
from keystore.verification.finding import Finding, Severity

_STRENGTH = {
    Protection.NONE: 0,
    Protection.SIGN: 1,
    Protection.SIGN_WITH_ORIGIN_AUTHENTICATION: 1,
    Protection.ENCRYPT: 2,
    Protection.ENCRYPT_WITH_ORIGIN_AUTHENTICATION: 2,
}
_PERMISSIVE = "allow_unauthenticated_participants"  # the one flag whose ``true`` is the weaker value


def weaknesses(governance: Governance) -> Iterator[str]:
    """Return each attribute of each rule that is weaker than the default."""
    for rule in governance.domain_rules:
        yield from _weaker(rule, DomainRule(), DOMAIN_SETTINGS, f"domains {rule.domains}")
        for topic in rule.topic_rules:
            yield from _weaker(topic, TopicRule(), TOPIC_SETTINGS, f"topics {topic.topic_expression}")


def _weaker(
    rule: DomainRule | TopicRule, default: DomainRule | TopicRule, names: tuple[str, ...], where: str
) -> Iterator[str]:
    for name in names:
        value, usual = getattr(rule, name), getattr(default, name)
        if _level(name, value) < _level(name, usual):
            yield f"{name} {_shown(value)} for {where} (default {_shown(usual)})"


def _level(name: str, value: bool | Protection) -> int:
    if isinstance(value, Protection):
        return _STRENGTH[value]
    return int(value != (name == _PERMISSIVE))


def _shown(value: bool | Protection) -> str:
    return value.value if isinstance(value, Protection) else str(value).lower()


def bypasses(governance: Governance) -> Iterator[str]:
    """Return each topic rule that leads past the enclaves where a Fast DDS discovery server is in reach.

    Such a server spares participants the handshake. Without protection of RTPS messages, and of discovery, metadata
    and data of a topic, nothing else keeps them apart. Measured on Fast DDS 2.9.1, where data passed as soon as
    liveliness of the topic was not protected either.
    """
    for rule in governance.domain_rules:
        for topic in rule.topic_rules if rule.rtps_protection_kind is Protection.NONE else ():
            protected = (
                topic.enable_discovery_protection
                or topic.metadata_protection_kind is not Protection.NONE
                or topic.data_protection_kind is not Protection.NONE
            )
            if not protected and (topic.enable_read_access_control or topic.enable_write_access_control):
                yield f"topics {topic.topic_expression} in domains {rule.domains}"


def check_strength(root: Path, governance: Governance, required: Governance | None) -> Iterator[Finding]:
    """Check the strength, or against ``required``, which may be weaker."""
    again = repair.run(root, "governance", "FILE.yaml", note="must reach all participants together")
    for where in bypasses(governance):
        yield Finding(
            Severity.ERROR, "governance-open", layout.GOVERNANCE,
            f"{where} have no protection, and RTPS messages neither: through a Fast DDS discovery server processes "
            "without an enclave can exchange data with secured ones, despite access control",
            f"{again}; with rtps_protection_kind: SIGN, or metadata_protection_kind: SIGN for these topics",
        )  # fmt: skip
    if required is not None:
        if governance != required:
            yield Finding(
                Severity.ERROR, "governance-not-required", layout.GOVERNANCE,
                "is not the governance that --require-governance names", again,
            )  # fmt: skip
        return
    for weakness in weaknesses(governance):
        yield Finding(
            Severity.EXPOSURE, "governance-weak", layout.GOVERNANCE, f"weaker than the default: {weakness}",
            f"{again}; if that is intended: verify --require-governance FILE",
        )  # fmt: skip


def check_domains(root: Path, governance: Governance, granted: dict[str, Domains]) -> Iterator[Finding]:
    """Check the domains. ``granted``: those that the permissions of each enclave name."""
    for enclave, domains in granted.items():
        if missing := _without(domains, governance.domains()):
            yield Finding(
                Severity.ERROR, "domain-not-governed", layout.enclave_file(enclave, layout.PERMISSIONS),
                f"permissions for domains {missing}, which the governance does not list: Cyclone DDS refuses the "
                "participant there, Fast DDS each endpoint",
                repair.renew(root, enclave, note="or add the domains to the governance"),
            )  # fmt: skip
    used = {identifier for domains in granted.values() for identifier in _identifiers(domains)}
    idle = sorted(_identifiers(governance.domains()) - used)
    if used and idle:
        yield Finding(
            Severity.NOTE, "domain-unused", layout.GOVERNANCE,
            f"also for domains {Domains(tuple((one, one) for one in idle))}, which no permissions name",
        )  # fmt: skip


def _without(domains: Domains, others: Domains) -> Domains | None:
    left = sorted(_identifiers(domains) - _identifiers(others))
    return Domains(tuple((one, one) for one in left)) if left else None


def _identifiers(domains: Domains) -> set[int]:
    return {identifier for first, last in domains.ranges for identifier in range(first, last + 1)}
