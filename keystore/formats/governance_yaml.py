"""Governance as a person writes it: YAML -> ``Governance``. Strict, with file and place in errors.

docs/keystore.md shows the file. Names are those of the governance document; what is left out is SROS2's default.
"""

from __future__ import annotations

from pathlib import Path
from typing import Union

from pydantic import Field, StrictBool, StrictInt, StrictStr

from enclave_common.strict_yaml import Strict, StrictDocument
from keystore.errors import InvalidInputError
from keystore.formats.domains import Domains
from keystore.formats.given_file import read_given
from keystore.formats.given_yaml import parse_given
from keystore.formats.governance import DomainRule, Governance, Protection, TopicRule, read_foreign_governance


class _Topic(Strict, frozen=True):
    topic_expression: StrictStr
    enable_discovery_protection: StrictBool = True
    enable_liveliness_protection: StrictBool = True
    enable_read_access_control: StrictBool = True
    enable_write_access_control: StrictBool = True
    metadata_protection_kind: Protection = Protection.ENCRYPT
    data_protection_kind: Protection = Protection.ENCRYPT


class _Domain(Strict, frozen=True):
    domains: Union[StrictInt, StrictStr] = 0
    allow_unauthenticated_participants: StrictBool = False
    enable_join_access_control: StrictBool = True
    discovery_protection_kind: Protection = Protection.ENCRYPT
    liveliness_protection_kind: Protection = Protection.ENCRYPT
    rtps_protection_kind: Protection = Protection.SIGN
    topic_rules: list[_Topic] = Field(default_factory=list)


class GovernanceDocument(StrictDocument, frozen=True):
    """Content of a governance in YAML."""

    domain_rules: list[_Domain]


def governance_of(path: Path) -> Governance:
    """Read a governance as a person keeps it, our YAML or XML; raises InvalidInputError naming the file and the line
    or the entry."""
    if path.suffix != ".xml":
        return parse_governance_yaml(read_given(path), str(path))
    governance, lost = read_foreign_governance(read_given(path), str(path))
    if lost:
        raise InvalidInputError(f"{path}: cannot be written as it is: {'; '.join(lost)}")
    return governance


def parse_governance_yaml(text: bytes, where: str) -> Governance:
    """Read ``governance.yaml``. Raises ``InvalidInputError``, which begins with ``where``."""
    document = parse_given(GovernanceDocument, text, where)
    if not document.domain_rules:
        raise InvalidInputError(f"{where}: domain_rules: at least one rule is needed")
    try:
        return Governance(tuple(_domain_rule(rule) for rule in document.domain_rules))
    except InvalidInputError as error:
        raise InvalidInputError(f"{where}: {error}") from None


def _domain_rule(rule: _Domain) -> DomainRule:
    values = dict(rule)
    values["domains"] = Domains.parse(str(rule.domains))
    values["topic_rules"] = tuple(TopicRule(**dict(topic)) for topic in rule.topic_rules) or (TopicRule(),)
    return DomainRule(**values)
