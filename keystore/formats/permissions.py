"""The policy of one enclave -> its DDS-Security permissions document, ready to be signed. Performs no I/O.

Exactly the grants that ``ros2 security create_permission`` would write for the same policy, in the one form that
Cyclone DDS and Fast DDS read alike, and without what breaks either of them:

- one grant (of two with one subject only the first is ever used), ``deny_rule`` before ``allow_rule``
  because the first rule that matches decides, ``default`` DENY, always an ``allow_rule``;
- denials decided here wherever possible, see ``_resolve_denials``;
- ASCII, no blanks in values, no comments, ids and full ranges of domains, no empty topic;
- one line per element and no indentation: the whole document travels in each handshake.

Only a document in this form counts (``permissions_document.parse_permissions``), so all of it is decided here.
This is on the way to a start: text is put together directly, lxml is not needed.
Sources: DDS-Security 1.1 section 9.4.1.3, and measurements on Cyclone DDS 0.10.2 and Fast DDS 2.9.1.
"""

from __future__ import annotations

import re
from datetime import datetime
from functools import lru_cache
from typing import NamedTuple

from enclave_common.terminal import quoted
from keystore.formats.domains import Domains
from keystore.formats.permissions_names import DISCOVERY_TOPIC, Topics, add_dds_topics, full_name
from keystore.formats.permissions_patterns import Expressions, any_matches, covers, has_wildcard
from keystore.formats.policy import EnclavePolicy, PolicyError, Qualifier
from keystore.formats.validity import ZONES, Validity

HEAD = (
    b'<?xml version="1.0" encoding="UTF-8"?>\n'
    b'<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:noNamespaceSchemaLocation='
    b'"http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_permissions.xsd">\n<permissions>\n'
)
_PLAIN = re.compile(r"[!#-%'-;=?-~]+\Z")  # nothing that XML would have to escape
_TAIL = "<default>DENY</default>\n</grant>\n</permissions>\n</dds>\n"


class TopicSets(NamedTuple):
    """DDS topic expressions by direction, each sorted and without duplicates."""

    publish: Topics = ()
    subscribe: Topics = ()

    def __bool__(self) -> bool:
        return bool(self.publish or self.subscribe)


class DdsRules(NamedTuple):
    """The rules of a grant in their order: ``first`` and ``allow`` are allow rules, ``deny`` stands between.

    ``first`` holds names that ``allow`` grants as well; they only keep Cyclone DDS before 11.0 from
    blocking a topic whose other direction is denied. ``hazards`` lists denials where that is not
    possible, in words for a person.
    """

    first: TopicSets
    deny: TopicSets
    allow: TopicSets
    hazards: tuple[str, ...] = ()

    def permits(self, direction: str, topic: str) -> bool:
        """Return whether a participant may ``publish`` or ``subscribe`` a DDS topic: the first rule that matches
        decides."""
        for rule, verdict in ((self.first, True), (self.deny, False), (self.allow, True)):
            if any_matches(getattr(rule, direction), topic):
                return verdict
        return False


class Permissions(NamedTuple):
    """Content of a permissions document. ``name`` is the grant's, ``subject`` that of the certificate it is for
    (``CN=/talker``)."""

    name: str
    subject: str
    validity: Validity
    domains: Domains
    rules: DdsRules

    def document(self) -> bytes:
        """Render the document (ASCII, LF). Raises ``PolicyError`` for a name or subject that no grant can have."""
        domains = self.domains.xml()
        parts = [
            f'<grant name="{_plain(self.name)}">\n<subject_name>{_plain(self.subject)}</subject_name>\n',
            _dates(self.validity),
        ]
        for tag, topics in (("allow_rule", self.rules.first), ("deny_rule", self.rules.deny)):
            if topics:
                parts.append(_rule(tag, domains, topics))
        parts.append(_rule("allow_rule", domains, self.rules.allow))
        parts.append(_TAIL)
        return HEAD + "".join(parts).encode("ascii")


def permissions_document(
    subject: str, policy: EnclavePolicy, *, validity: Validity, domains: Domains
) -> bytes:
    """Render the permissions document of a policy for the certificate with this ``subject`` and ``validity``.

    Raises ``PolicyError`` for a name that no ROS node can have and for a wildcard outside the subset that all DDS
    implementations read alike.
    """
    return Permissions(policy.path, subject, validity, domains, dds_rules(policy)).document()


def dds_rules(policy: EnclavePolicy) -> DdsRules:
    """Join all profiles of the enclave to one set of DDS rules; DENY of any beats ALLOW of any."""
    allowed: tuple[set[str], set[str]] = (set(), set())
    denied: tuple[set[str], set[str]] = (set(), set())
    allow = Qualifier.ALLOW
    try:
        for profile in policy.profiles:
            for operation, qualifier, expression in profile.rules:
                publish, subscribe = allowed if qualifier is allow else denied
                add_dds_topics(operation, full_name(expression, profile), publish, subscribe)
    except PolicyError as error:
        raise PolicyError(f"enclave {quoted(policy.path)}: {error}") from None
    # Without it an rmw cannot even create its context; Zenoh, which has none, gets no rule from it.
    if policy.publishes_discovery:
        allowed[0].add(DISCOVERY_TOPIC)
    allowed[1].add(DISCOVERY_TOPIC)
    if not denied[0] and not denied[1]:
        return DdsRules(TopicSets(), TopicSets(), _sorted(allowed))
    return _resolve_denials(allowed, denied)


def _resolve_denials(allowed: tuple[set[str], set[str]], denied: tuple[set[str], set[str]]) -> DdsRules:
    """Take away what is denied, and keep a denial only where a wildcard still grants what it names.

    Cyclone DDS before 11.0 lets the first rule that mentions a topic *in either direction* decide about
    creating it, so a remaining denial would block the other direction too (cyclonedds issues 1922,
    2267). Names granted in the other direction therefore come once more, before the denials.
    """
    refused = (Expressions(denied[0]), Expressions(denied[1]))
    granted = tuple({t for t in a if not d.cover(t)} for a, d in zip(allowed, refused, strict=True))
    given = (Expressions(granted[0]), Expressions(granted[1]))
    kept = tuple(
        {d for d in denials if any(map(has_wildcard, grants.meeting(d)))}
        for grants, denials in zip(given, denied, strict=True)
    )
    first: tuple[set[str], set[str]] = (set(), set())
    hazards: list[str] = []
    for direction in (0, 1):
        other = 1 - direction
        for denial in sorted(kept[direction]):
            again, blocked = _other_direction(denial, given[other], refused[other])
            first[other].update(again)
            if blocked:
                more = f" and {len(blocked) - 1} more" if len(blocked) > 1 else ""
                hazards.append(
                    f"Cyclone DDS before 11.0 will not let this enclave {_VERB[other]} topics of {blocked[0]}{more} "
                    f"that match {denial}, because it may not {_VERB[direction]} them; name the topics one by one"
                )
    return DdsRules(_sorted(first), _sorted(kept), _sorted(granted), tuple(hazards))


_VERB = ("publish", "subscribe to")


def _other_direction(denial: str, granted: Expressions, denied: Expressions) -> tuple[set[str], list[str]]:
    """Return what to grant once more before ``denial`` of the opposite direction, and grants it may still block."""
    again: set[str] = set()
    blocked: list[str] = []
    for grant in granted.meeting(denial):
        if not has_wildcard(grant):
            again.add(grant)
        elif covers(grant, denial) and not denied.meeting(denial):
            again.add(denial)
        elif covers(denial, grant) and not denied.meeting(grant):
            again.add(grant)
        elif not denied.cover(denial):
            blocked.append(grant)
    return again, blocked


def _sorted(topics: tuple[set[str], ...]) -> TopicSets:
    return TopicSets(tuple(sorted(topics[0])), tuple(sorted(topics[1])))


def _rule(tag: str, domains: str, topics: TopicSets) -> str:
    return (
        f"<{tag}>\n{domains}\n{_criteria('publish', topics.publish)}"
        f"{_criteria('subscribe', topics.subscribe)}</{tag}>\n"
    )


def _criteria(tag: str, topics: Topics) -> str:
    if not topics:
        return ""
    lines = "</topic>\n<topic>".join(topics)  # names are [A-Za-z0-9_/*?[]!-] only: nothing to escape
    return f"<{tag}><topics>\n<topic>{lines}</topic>\n</topics></{tag}>\n"


@lru_cache(maxsize=64)  # certificates that were made together have the same
def _dates(validity: Validity) -> str:
    return (
        f"<validity><not_before>{_utc(validity.not_before - ZONES)}</not_before>"
        f"<not_after>{_utc(validity.not_after + ZONES)}</not_after></validity>\n"
    )


def _utc(time: datetime) -> str:
    return time.strftime("%Y-%m-%dT%H:%M:%S")


def _plain(text: str) -> str:
    if not _PLAIN.match(text):
        raise PolicyError(f"{quoted(text)} cannot be the subject or name of a grant")
    return text
