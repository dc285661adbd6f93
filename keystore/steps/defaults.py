"""The governance in force as plain values, and what of it is weaker than the default. Reads only."""

from __future__ import annotations

import dataclasses
from enum import Enum
from pathlib import Path
from typing import Any, NamedTuple

from keystore.disk import layout
from keystore.disk.governance_file import signed_governance
from keystore.disk.safe_files import resolve_root
from keystore.disk.view import KeystoreView
from keystore.formats.domains import Domains
from keystore.formats.governance import DomainRule, TopicRule, parse_governance
from keystore.verification.governance import weaknesses


class GovernanceFacts(NamedTuple):
    """``rules``: one for each set of domains, by the attribute names of DDS-Security."""

    rules: list[dict[str, Any]]
    weaknesses: tuple[str, ...]


def governance_facts(keystore: Path | str) -> GovernanceFacts:
    """Raises NotAKeystoreError, DamagedKeystoreError and InvalidInputError for what cannot be read."""
    view = KeystoreView(resolve_root(keystore))
    view.require_complete()
    governance = parse_governance(signed_governance(view).document, layout.GOVERNANCE)
    return GovernanceFacts([_plain(rule) for rule in governance.domain_rules], tuple(weaknesses(governance)))


def _plain(value: Any) -> Any:
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, Domains):
        return str(value)
    if isinstance(value, tuple):
        return [_plain(each) for each in value]
    if isinstance(value, (DomainRule, TopicRule)):
        return {field.name: _plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    return value
