"""A permissions document, ours or another tool's: read, held against another one, given new dates.

The permissions that an enclave has are the only record of what it may do. The signature is not checked here."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from keystore.errors import DamagedKeystoreError
from keystore.formats.permissions_names import ros_rules
from keystore.formats.permissions_patterns import can_meet, covers, matches
from keystore.formats.policy import Qualifier, Rule
from keystore.formats.safe_xml import check_schema, parse_xml
from keystore.formats.validity import Validity

if TYPE_CHECKING:
    from lxml import etree

DomainRanges = tuple[tuple[int, int | None], ...]
_HIGHEST_DOMAIN = 1 << 16
_DECLARATION = '<?xml version="1.0" encoding="UTF-8"?>\n'


@dataclass(frozen=True, slots=True)
class DdsRule:
    """One ``allow_rule`` or ``deny_rule``; ``domains`` are pairs (first, last), last ``None`` when open.

    ``partitions``: of those parts that are not for the default partition, the one of ROS."""

    qualifier: Qualifier
    domains: DomainRanges
    publish: tuple[str, ...]
    subscribe: tuple[str, ...]
    partitions: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Grant:
    """A grant of a permissions document. ``not_before`` and ``not_after`` as written; their zone depends on the DDS
    implementation."""

    name: str
    subject_name: str
    not_before: str
    not_after: str
    rules: tuple[DdsRule, ...]
    default: Qualifier

    @property
    def ros_rules(self) -> tuple[tuple[Rule, ...], tuple[str, ...]]:
        """Return the grant in terms of a policy, and the DDS topics that no policy rule can express."""
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
    """Parse all grants of the document; raises ``InvalidInputError`` (with file:line) for what DDS would not read."""
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
        partitions=tuple(name for part in element.iter("partitions") for name in _foreign_partitions(part)),
    )


def _foreign_partitions(element: etree._Element) -> list[str]:
    names = [partition.text or "" for partition in element]
    return [] if any(matches(name, "") for name in names) else names


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


class Permitted(NamedTuple):
    """One topic expression of a rule, with its direction (``publish``, ``subscribe``) and domains."""

    direction: str
    topic: str
    domains: DomainRanges

    def __str__(self) -> str:
        return f"{self.direction} {self.topic}"


def grant_for(document: bytes, subject: str, place: str) -> Grant | None:
    """Return the grant that DDS uses for ``subject``: the first. Raises InvalidInputError for another document."""
    grants = parse_permissions(document, place)
    return next((grant for grant in grants if grant.subject_name.strip() == subject), None)


def rules_text(grant: Grant) -> str:
    """Return what the grant allows, apart from its subject and dates; equal for equal rules in any layout."""
    return f"{grant.default.value} {[_plain(rule) for rule in grant.rules]}"


def _plain(rule: DdsRule) -> tuple[str, DomainRanges, tuple[str, ...], tuple[str, ...]]:
    return rule.qualifier.value, rule.domains, rule.publish, rule.subscribe


def taken_away(old: Grant, new: Grant) -> tuple[str, ...]:
    """Return what ``old`` permits and ``new`` surely or possibly does not, sorted words (``publish rt/chatter``)."""
    lost = {str(one) for one in _lost(old, new)}
    if old.default is Qualifier.ALLOW and new.default is not Qualifier.ALLOW:
        lost.add("everything that no rule names")
    return tuple(sorted(lost))


def _lost(old: Grant, new: Grant) -> Iterator[Permitted]:
    allowed, present = _permitted(old, Qualifier.ALLOW), _permitted(new, Qualifier.ALLOW)
    exact = set(present)
    for one in allowed:
        if one not in exact and not any(_includes(other, one) for other in present):
            yield one
    denied = _permitted(old, Qualifier.DENY)
    for denial in _permitted(new, Qualifier.DENY):
        if not any(_includes(before, denial) for before in denied):
            yield from (
                one
                for one in allowed
                if denial.direction == one.direction and can_meet(denial.topic, one.topic)
            )


def _permitted(grant: Grant, qualifier: Qualifier) -> list[Permitted]:
    return [
        Permitted(direction, topic, rule.domains)
        for rule in grant.rules
        if rule.qualifier is qualifier
        for direction, topics in (("publish", rule.publish), ("subscribe", rule.subscribe))
        for topic in topics
    ]


def _includes(wide: Permitted, narrow: Permitted) -> bool:
    return (
        wide.direction == narrow.direction
        and covers(wide.topic, narrow.topic)
        and all(any(_within(inner, outer) for outer in wide.domains) for inner in narrow.domains)
    )


def _within(inner: tuple[int, int | None], outer: tuple[int, int | None]) -> bool:
    last, end = (_HIGHEST_DOMAIN if high is None else high for high in (inner[1], outer[1]))
    return outer[0] <= inner[0] and last <= end


def redated(
    document: bytes, old_subjects: Collection[str], subject: str, validity: Validity, place: str
) -> bytes:
    """Return ``document`` with the grant of one of ``old_subjects`` given to ``subject`` for ``validity``.

    Only the first such grant stays: of several for one subject the implementations use only that one, and foreign
    grants have no place in a document every peer gets to see. Raises InvalidInputError for what is no permissions
    document and DamagedKeystoreError if no grant matches.
    """
    from lxml import etree

    root = check_permissions_schema(document, place)
    grants = list(root.iter("grant"))
    mine = next((grant for grant in grants if _subject(grant) in old_subjects), None)
    if mine is None:
        raise DamagedKeystoreError(f"{place} has no grant for {subject}")
    for grant in grants:
        parent = grant.getparent()
        if grant is not mine and parent is not None:
            parent.remove(grant)
    _set(mine, "subject_name", subject)
    _set(mine, "validity/not_before", f"{validity.not_before:%Y-%m-%dT%H:%M:%S}")
    _set(mine, "validity/not_after", f"{validity.not_after:%Y-%m-%dT%H:%M:%S}")
    return (_DECLARATION + etree.tostring(root, encoding="unicode") + "\n").encode()


def _subject(grant: etree._Element) -> str:
    return (grant.findtext("subject_name") or "").strip()


def _set(grant: etree._Element, path: str, text: str) -> None:
    element = grant.find(path)
    if element is not None:
        element.text = text
