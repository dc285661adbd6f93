"""A permissions document, ours or another tool's -> plain values, and back to the rules of a policy.

For ``check``, ``verify`` and the comparison of an enclave's old permissions with new ones. Takes the
signed content as bytes; the signature is not its business. Touches no files but the bundled schema.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from keystore.formats.permissions_names import ros_rules
from keystore.formats.policy import Qualifier, Rule
from keystore.formats.safe_xml import check_schema, parse_xml

if TYPE_CHECKING:
    from lxml import etree


@dataclass(frozen=True, slots=True)
class DdsRule:
    """One ``allow_rule`` or ``deny_rule``; ``domains`` are pairs (first, last), last ``None`` when open."""

    qualifier: Qualifier
    domains: tuple[tuple[int, int | None], ...]
    publish: tuple[str, ...]
    subscribe: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Grant:
    """``not_before`` and ``not_after`` as written; their zone depends on the DDS implementation."""

    name: str
    subject_name: str
    not_before: str
    not_after: str
    rules: tuple[DdsRule, ...]
    default: Qualifier

    @property
    def ros_rules(self) -> tuple[tuple[Rule, ...], tuple[str, ...]]:
        """The grant in terms of a policy, and the DDS topics that no policy rule can express."""
        found: list[Rule] = []
        unknown: list[str] = []
        for qualifier in (Qualifier.DENY, Qualifier.ALLOW):
            mine = [rule for rule in self.rules if rule.qualifier is qualifier]
            publish = [topic for rule in mine for topic in rule.publish]
            subscribe = [topic for rule in mine for topic in rule.subscribe]
            rules, rest = ros_rules(publish, subscribe, qualifier)
            found.extend(rules)
            unknown.extend(rest)
        return tuple(sorted(set(found))), tuple(sorted(set(unknown)))


def parse_permissions(document: bytes, where: str = "permissions.xml") -> tuple[Grant, ...]:
    """All grants of the document. Raises ``InvalidInputError`` (with file:line) for what DDS would not read."""
    root = check_permissions_schema(document, where)
    return tuple(_grant(element) for element in root.iter("grant"))


def check_permissions_schema(document: bytes, where: str = "permissions.xml") -> etree._Element:
    """Parse and compare with the bundled schema. Raises ``InvalidInputError`` with file:line."""
    root = parse_xml(document, where)
    check_schema(root, "permissions.xsd", where, "DDS permissions document")
    return root


def _grant(element: etree._Element) -> Grant:
    return Grant(
        name=element.get("name", ""),
        subject_name=_text(element, "subject_name"),
        not_before=_text(element, "validity/not_before"),
        not_after=_text(element, "validity/not_after"),
        rules=tuple(_rule(child) for child in element if child.tag in ("allow_rule", "deny_rule")),
        default=Qualifier(_text(element, "default")),
    )


def _rule(element: etree._Element) -> DdsRule:
    return DdsRule(
        qualifier=Qualifier.ALLOW if element.tag == "allow_rule" else Qualifier.DENY,
        domains=tuple(_domain(child) for child in element[0]),
        publish=_topics(element, "publish"),
        subscribe=_topics(element, "subscribe"),
    )


def _domain(element: etree._Element) -> tuple[int, int | None]:
    if element.tag == "id":
        value = int(element.text or "0")
        return value, value
    maximum = element.findtext("max")
    return int(element.findtext("min") or "0"), None if maximum is None else int(maximum)


def _topics(element: etree._Element, tag: str) -> tuple[str, ...]:
    return tuple(topic.text or "" for topic in element.iterfind(f"{tag}/topics/topic"))


def _text(element: etree._Element, path: str) -> str:
    return element.findtext(path) or ""
