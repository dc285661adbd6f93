"""Governance as a person writes it: YAML -> ``Governance``. Strict, with file and place in errors.

    version: 1
    domain_rules:                        # the first rule that lists a domain counts
      - domains: 0-10,42                 # or "all"; default 0
        allow_unauthenticated_participants: false
        enable_join_access_control: true
        discovery_protection_kind: ENCRYPT       # NONE, SIGN, ENCRYPT, SIGN_WITH_ORIGIN_AUTHENTICATION,
        liveliness_protection_kind: ENCRYPT      # ENCRYPT_WITH_ORIGIN_AUTHENTICATION
        rtps_protection_kind: SIGN
        topic_rules:                     # first match wins; the default rule for * is added at the end
          - topic_expression: rt/camera/*        # DDS name with prefix, fnmatch pattern
            enable_discovery_protection: true
            enable_liveliness_protection: true
            enable_read_access_control: true
            enable_write_access_control: true
            metadata_protection_kind: SIGN
            data_protection_kind: NONE           # NONE, SIGN, ENCRYPT

Names are those of the governance document; everything left out is SROS2's default, shown above except for
the topic rule's last two (ENCRYPT).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Union

import yaml
from pydantic import BaseModel, Field, StrictBool, StrictInt, StrictStr, ValidationError

from enclave_launch.boundary.files import read_bytes
from keystore.errors import InvalidInputError, printable
from keystore.formats.domains import Domains
from keystore.formats.governance import DomainRule, Governance, Protection, TopicRule, parse_governance

_MAX_BYTES = 200_000


# Only what pydantic 1.8 and 2 have in common: no Python union operator, no ``model_*``, no constraint on a list.
class _Strict(BaseModel, extra="forbid"):
    """The base of all entries: an unknown key is an error."""


class _Topic(_Strict):
    topic_expression: StrictStr
    enable_discovery_protection: StrictBool = True
    enable_liveliness_protection: StrictBool = True
    enable_read_access_control: StrictBool = True
    enable_write_access_control: StrictBool = True
    metadata_protection_kind: Protection = Protection.ENCRYPT
    data_protection_kind: Protection = Protection.ENCRYPT


class _Domain(_Strict):
    domains: Union[StrictInt, StrictStr] = 0
    allow_unauthenticated_participants: StrictBool = False
    enable_join_access_control: StrictBool = True
    discovery_protection_kind: Protection = Protection.ENCRYPT
    liveliness_protection_kind: Protection = Protection.ENCRYPT
    rtps_protection_kind: Protection = Protection.SIGN
    topic_rules: list[_Topic] = Field(default_factory=list)


class _Document(_Strict):
    version: StrictInt
    domain_rules: list[_Domain]


def load_governance_yaml(path: Path) -> Governance:
    """Raises InvalidInputError naming the file and the line or the entry."""
    try:
        text = read_bytes(path, _MAX_BYTES)
    except OSError as error:
        raise InvalidInputError(f"cannot read {printable(path)}: {error.strerror}") from None
    return parse_governance_yaml(text, str(path))


def governance_of(path: Path) -> Governance:
    """A governance as a person keeps it: our YAML, or the XML that is signed. Raises InvalidInputError."""
    if path.suffix == ".xml":
        try:
            return parse_governance(read_bytes(path, _MAX_BYTES), str(path))
        except OSError as error:
            raise InvalidInputError(f"cannot read {printable(path)}: {error.strerror}") from None
    return load_governance_yaml(path)


def parse_governance_yaml(text: bytes, where: str) -> Governance:
    if len(text) > _MAX_BYTES:
        raise InvalidInputError(f"{where}: larger than {_MAX_BYTES} bytes")
    try:
        content = yaml.load(text, _SafeLoader)
    except yaml.MarkedYAMLError as error:
        line = f":{error.problem_mark.line + 1}" if error.problem_mark else ""
        raise InvalidInputError(f"{where}{line}: {error.problem or 'not YAML'}") from None
    except (yaml.YAMLError, ValueError, RecursionError):  # numbers, dates, nesting that Python refuses
        raise InvalidInputError(f"{where}: not YAML text") from None
    try:
        document = _Document(**_mapping(content, where))
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"]) or "document"
        raise InvalidInputError(f"{where}: {place}: {first['msg']}") from None
    if document.version != 1:
        raise InvalidInputError(f"{where}: version: {document.version} is not known, only 1 is")
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


def _mapping(content: Any, where: str) -> dict[str, Any]:
    if not isinstance(content, dict) or not all(isinstance(key, str) for key in content):
        raise InvalidInputError(f"{where}: document: not a mapping with the keys version and domain_rules")
    return content


class _SafeLoader(yaml.SafeLoader):
    """No aliases (nothing here needs them, bombs do) and no key twice."""

    def compose_node(self, parent: Any, index: Any) -> Any:
        if self.check_event(yaml.AliasEvent):
            event = self.peek_event()  # type: ignore[no-untyped-call]
            raise yaml.composer.ComposerError(None, None, "aliases are not allowed here", event.start_mark)
        return super().compose_node(parent, index)

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen = set()
        for key, _ in node.value:
            if not isinstance(key, yaml.ScalarNode):
                mark = key.start_mark
                raise yaml.constructor.ConstructorError(None, None, "a key must be a plain word", mark)
            if key.value in seen:
                mark = key.start_mark
                raise yaml.constructor.ConstructorError(None, None, f"{key.value!r} is written twice", mark)
            seen.add(key.value)
        return super().construct_mapping(node, deep)
