"""A permissions document, read: ours byte for byte, or another tool's that is taken over; and two of them compared.

DDS implementations read bytes, and not all of them as an XML parser does (encodings, entities, elements that stand
twice, numbers). So what is read counts only if it would be written so. The signature is not checked here.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from datetime import timedelta
from typing import NamedTuple
from xml.etree.ElementTree import Element

from enclave_common.terminal import quoted
from keystore.errors import InvalidInputError
from keystore.formats.domains import Domains, read_domains
from keystore.formats.permissions import HEAD, DdsRules, Permissions, TopicSets
from keystore.formats.permissions_names import is_dds_expression, ros_rules
from keystore.formats.permissions_patterns import Expressions
from keystore.formats.policy import Operation, PolicyError, Qualifier, Rule
from keystore.formats.safe_xml import not_as_written, parse_foreign, parse_own
from keystore.formats.subject import names_enclave
from keystore.formats.validity import ZONES, Validity, parse_time


def parse_permissions(document: bytes, where: str = "permissions.xml") -> Permissions:
    """Read what ``Permissions.document`` wrote. Raises OtherFormError for any other document."""
    root = parse_own(document, HEAD, where)
    with suppress(InvalidInputError, LookupError, ValueError):
        found = _read(root[0][0], [], margin=ZONES)
        if found.document() == document:
            return found
    raise not_as_written(where)


class TakenOver(NamedTuple):
    """A foreign document as it would be written here, and what of it could not be carried over, in words."""

    permissions: Permissions
    lost: tuple[str, ...]


def read_foreign_permissions(document: bytes, enclave: str, where: str) -> TakenOver:
    """Read what another tool signed for ``enclave``: the first grant for it, as far as it can be written here.

    Nothing is granted that the document does not grant. Raises ``InvalidInputError`` (with file:line) for what DDS
    implementations refuse or read in different ways.
    """
    root = parse_foreign(document, "permissions.xsd", where, "DDS permissions document")
    grants = list(root.iter("grant"))
    mine = next((grant for grant in grants if _is_for(grant, enclave)), None)
    if mine is None:
        raise InvalidInputError(f"{where}: no grant for {enclave}")
    lost = [f"the grant for {quoted(_text(grant, 'subject_name'))}" for grant in grants if grant is not mine]
    if _text(mine, "default") != "DENY":
        lost.append("default ALLOW: everything that no rule names")
    found = _read(mine, lost, margin=timedelta(0))
    first, allow = found.rules.first, found.rules.allow
    whole = _topic_sets((*first.publish, *allow.publish), (*first.subscribe, *allow.subscribe))
    found = found._replace(rules=found.rules._replace(allow=whole))
    with suppress(PolicyError):
        found.document()
        return TakenOver(found, tuple(lost))
    raise InvalidInputError(f"{where}: the grant has a name that cannot be written here")


def _is_for(grant: Element, enclave: str) -> bool:
    return names_enclave(_text(grant, "subject_name").strip().removeprefix("CN="), enclave)


def _read(grant: Element, lost: list[str], margin: timedelta) -> Permissions:
    """Read a grant into the order that we write: an allow rule before the deny rule, the deny rule, an allow rule.

    The document begins and ends by ``margin`` outside of its certificate's life.
    """
    rules = [_rule(child, lost) for child in grant if child.tag in ("allow_rule", "deny_rule")]
    domains = next((rule.domains for rule in rules if rule.is_allowed), rules[0].domains)
    denials = [at for at, rule in enumerate(rules) if not rule.is_allowed]
    kept: tuple[list[_Rule], list[_Rule], list[_Rule]] = ([], [], [])
    for at, rule in enumerate(rules):
        if rule.is_allowed and rule.domains != domains:
            lost.append(f"an allow rule for domains {rule.domains}: a grant is for one set of domains")
        elif not rule.is_allowed:
            kept[1].append(rule)
        else:
            kept[0 if denials and at < denials[0] else 2].append(rule)
    if denials and any(rule.is_allowed for rule in rules[denials[0] : denials[-1]]):
        lost.append("an allow rule before a later deny rule: denials come first")
    first, deny, allow = (
        _topic_sets(
            (topic for rule in part for topic in rule.publish),
            (topic for rule in part for topic in rule.subscribe),
        )
        for part in kept
    )
    return Permissions(
        grant.get("name", ""),
        _text(grant, "subject_name").strip(),
        Validity(
            parse_time(_text(grant, "validity/not_before")) + margin,
            parse_time(_text(grant, "validity/not_after")) - margin,
        ),
        domains,
        DdsRules(first, deny, allow),
    )


class _Rule(NamedTuple):
    is_allowed: bool
    domains: Domains
    publish: tuple[str, ...]
    subscribe: tuple[str, ...]


def _rule(element: Element, lost: list[str]) -> _Rule:
    allowed = element.tag == "allow_rule"
    return _Rule(
        allowed,
        read_domains(element[0], lost),
        tuple(_topics(element, "publish", allowed, lost)),
        tuple(_topics(element, "subscribe", allowed, lost)),
    )


def _topics(rule: Element, direction: str, allowed: bool, lost: list[str]) -> Iterator[str]:
    for criteria in rule.iterfind(direction):
        if allowed and any(part.tag != "topics" for part in criteria):
            lost.append(f"{direction} of partitions or data tags, which ROS does not use")
            continue
        for expression in (topic.text or "" for topic in criteria.iterfind("topics/topic")):
            what = f"{direction} {quoted(expression)}: DDS implementations read it in different ways"
            if is_dds_expression(expression):
                yield expression
            elif allowed:
                lost.append(what)
            else:
                raise InvalidInputError(f"a denial of {what}")  # to leave it out would grant it


def _topic_sets(
    publish: Iterator[str] | tuple[str, ...], subscribe: Iterator[str] | tuple[str, ...]
) -> TopicSets:
    return TopicSets(tuple(sorted(set(publish))), tuple(sorted(set(subscribe))))


def _text(element: Element, path: str) -> str:
    return element.findtext(path) or ""


def granted_rules(permissions: Permissions) -> Iterator[Rule]:
    """Yield what is allowed in terms of a policy: DDS topics that are none of ROS by their own names."""
    allow = permissions.rules.allow
    rules, others = ros_rules(allow.publish, allow.subscribe)
    yield from rules
    yield from (Rule(Operation.PUBLISH, Qualifier.ALLOW, topic) for topic in allow.publish if topic in others)
    yield from (
        Rule(Operation.SUBSCRIBE, Qualifier.ALLOW, topic) for topic in allow.subscribe if topic in others
    )


def taken_away(old: Permissions, new: Permissions) -> tuple[str, ...]:
    """Return what ``old`` permits and ``new`` surely or possibly does not, sorted words (``publish rt/chatter``)."""
    return tuple(sorted(set(_lost(old, new))))


def _lost(old: Permissions, new: Permissions) -> Iterator[str]:
    narrower = not new.domains.covers(old.domains)
    for direction in TopicSets._fields:
        allowed, present = (
            getattr(old.rules.allow, direction),
            Expressions(getattr(new.rules.allow, direction)),
        )
        yield from (f"{direction} {topic}" for topic in allowed if narrower or not present.cover(topic))
        before, had = Expressions(getattr(old.rules.deny, direction)), Expressions(allowed)
        for denial in getattr(new.rules.deny, direction):
            if not before.cover(denial):
                yield from (f"{direction} {topic}" for topic in had.meeting(denial))
