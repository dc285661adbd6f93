"""The governance of a keystore: what is protected how, one document for all enclaves. Performs no I/O.

    Governance (plain values) <-> governance.xml        YAML is ``keystore.formats.governance_yaml``

It must be identical everywhere in a domain: participants whose protection kinds differ do not talk,
without an error. Defaults are SROS2's. Element order is the schema's, which Fast DDS insists on.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field, fields, replace
from enum import Enum
from typing import Any
from xml.etree.ElementTree import Element

from enclave_common.terminal import quoted
from keystore.errors import InvalidInputError
from keystore.formats.domains import Domains, read_domains
from keystore.formats.permissions_names import is_dds_expression
from keystore.formats.safe_xml import not_as_written, parse_foreign, parse_own


class Protection(str, Enum):
    """ProtectionKind of DDS-Security 1.1 section 9.4.1.2.3."""

    NONE = "NONE"
    SIGN = "SIGN"
    ENCRYPT = "ENCRYPT"
    SIGN_WITH_ORIGIN_AUTHENTICATION = "SIGN_WITH_ORIGIN_AUTHENTICATION"
    ENCRYPT_WITH_ORIGIN_AUTHENTICATION = "ENCRYPT_WITH_ORIGIN_AUTHENTICATION"


_DATA_KINDS = (Protection.NONE, Protection.SIGN, Protection.ENCRYPT)


@dataclass(frozen=True, slots=True)
class TopicRule:
    """The protection of topics. ``topic_expression`` is an fnmatch pattern over DDS names (``rt/chatter``); the first
    match wins."""

    topic_expression: str = "*"
    enable_discovery_protection: bool = True
    enable_liveliness_protection: bool = True
    enable_read_access_control: bool = True
    enable_write_access_control: bool = True
    metadata_protection_kind: Protection = Protection.ENCRYPT
    data_protection_kind: Protection = Protection.ENCRYPT

    def __post_init__(self) -> None:
        if not is_dds_expression(self.topic_expression):
            raise InvalidInputError(
                f"governance: topic_expression {quoted(self.topic_expression)} is not one that Cyclone DDS and "
                "Fast DDS read alike: letters, digits, '_', '/', and the wildcards * ? [abc] [a-z] [!abc]"
            )
        if self.data_protection_kind not in _DATA_KINDS:
            raise InvalidInputError("governance: data_protection_kind is NONE, SIGN or ENCRYPT")


@dataclass(frozen=True, slots=True)
class DomainRule:
    """Rules for a set of domains. The last topic rule matches every topic, and is added where it is missing: what no
    rule matches is refused by both implementations."""

    domains: Domains = field(default_factory=lambda: Domains.single(0))
    allow_unauthenticated_participants: bool = False
    enable_join_access_control: bool = True
    discovery_protection_kind: Protection = Protection.ENCRYPT
    liveliness_protection_kind: Protection = Protection.ENCRYPT
    rtps_protection_kind: Protection = Protection.SIGN
    topic_rules: tuple[TopicRule, ...] = (TopicRule(),)

    def __post_init__(self) -> None:
        if not self.topic_rules or self.topic_rules[-1].topic_expression != "*":
            object.__setattr__(self, "topic_rules", (*self.topic_rules, TopicRule()))
        if self.allow_unauthenticated_participants and self.rtps_protection_kind is not Protection.NONE:
            raise InvalidInputError(
                "governance: allow_unauthenticated_participants needs rtps_protection_kind NONE; "
                "Fast DDS refuses the document otherwise, and such a participant could not communicate"
            )


class NoGovernanceRuleError(InvalidInputError):
    """Domains without a rule: ``domains`` are not among the several rules of the governance."""

    def __init__(self, domains: Domains, message: str) -> None:
        self.domains = domains
        super().__init__(message)


@dataclass(frozen=True, slots=True)
class Governance:
    """The rules of a governance document, at least one. Raises ``InvalidInputError`` for none."""

    domain_rules: tuple[DomainRule, ...] = (DomainRule(),)

    def __post_init__(self) -> None:
        if not self.domain_rules:
            raise InvalidInputError("governance: at least one domain rule is needed")

    @classmethod
    def for_domains(cls, domains: Domains) -> Governance:
        """Return SROS2's default for these domains."""
        return cls((DomainRule(domains=domains),))

    def domains(self) -> Domains:
        """Return all domains with a rule; in any other Cyclone DDS refuses the participant."""
        return Domains(tuple(part for rule in self.domain_rules for part in rule.domains.ranges))

    def extended_to(self, domains: Domains) -> Governance:
        """Return the same rules for more domains; raises NoGovernanceRuleError if there are several rules."""
        if len(self.domain_rules) != 1:
            raise NoGovernanceRuleError(
                domains,
                f"the governance has no rule for domains {domains} and several to choose from; "
                "add the domains to its YAML file and run: secure-keystore governance KEYSTORE FILE.yaml",
            )
        rule = self.domain_rules[0]
        both = Domains((*rule.domains.ranges, *domains.ranges))
        return Governance((replace(rule, domains=both),))


_HEAD = (
    b'<?xml version="1.0" encoding="UTF-8"?>\n'
    b'<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:noNamespaceSchemaLocation='
    b'"http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_governance.xsd">\n<domain_access_rules>\n'
)


def governance_document(governance: Governance) -> bytes:
    """Render canonical XML (ASCII, LF, no blanks in values), the form both implementations read alike."""
    rules = "".join(_domain_rule(rule) for rule in governance.domain_rules)
    return _HEAD + f"{rules}</domain_access_rules>\n</dds>\n".encode("ascii")


def _domain_rule(rule: DomainRule) -> str:
    settings = "".join(_leaf(name, getattr(rule, name)) for name in DOMAIN_SETTINGS)
    topics = "".join(
        "<topic_rule>\n"
        + "".join(_leaf(name, getattr(topic, name)) for name in ("topic_expression", *TOPIC_SETTINGS))
        + "</topic_rule>\n"
        for topic in rule.topic_rules
    )
    return (
        f"<domain_rule>\n{rule.domains.xml()}\n{settings}"
        f"<topic_access_rules>\n{topics}</topic_access_rules>\n</domain_rule>\n"
    )


def _leaf(name: str, value: bool | str | Protection) -> str:
    if isinstance(value, bool):
        text = "true" if value else "false"
    else:
        text = value.value if isinstance(value, Protection) else value
    return f"<{name}>{text}</{name}>\n"


DOMAIN_SETTINGS = tuple(
    each.name for each in fields(DomainRule) if each.name not in ("domains", "topic_rules")
)
TOPIC_SETTINGS = tuple(each.name for each in fields(TopicRule) if each.name != "topic_expression")
"""Named and in the order of the schema, after the domains and the expression that they are for."""


def parse_governance(document: bytes, where: str) -> Governance:
    """Read what ``governance_document`` wrote. Raises OtherFormError for any other document."""
    root = parse_own(document, _HEAD, where)
    with suppress(InvalidInputError, LookupError, ValueError):
        found = _read(root, [])
        if governance_document(found) == document:
            return found
    raise not_as_written(where)


def read_foreign_governance(document: bytes, where: str) -> tuple[Governance, tuple[str, ...]]:
    """Read a governance that another tool or a person wrote: as it would be written here, and what of it could not be
    carried over, in words.

    Raises InvalidInputError with file:line for what DDS implementations refuse or read in different ways.
    """
    lost: list[str] = []
    root = parse_foreign(document, "governance.xsd", where, "DDS governance document")
    return _read(root, lost), tuple(lost)


def _read(root: Element, lost: list[str]) -> Governance:
    return Governance(tuple(_read_rule(element, lost) for element in root.iter("domain_rule")))


def _read_rule(element: Element, lost: list[str]) -> DomainRule:
    return DomainRule(
        domains=read_domains(element[0], lost),
        **{name: _setting(element, name) for name in DOMAIN_SETTINGS},
        topic_rules=tuple(map(_read_topic_rule, element.iter("topic_rule"))),
    )


def _read_topic_rule(element: Element) -> TopicRule:
    settings = {name: _setting(element, name) for name in TOPIC_SETTINGS}
    return TopicRule(_text(element, "topic_expression"), **settings)


def _text(element: Element, name: str) -> str:
    return (element.findtext(name) or "").strip()


def _setting(element: Element, name: str) -> Any:
    text = _text(element, name)
    return Protection(text) if name.endswith("_kind") else text in ("true", "1")
