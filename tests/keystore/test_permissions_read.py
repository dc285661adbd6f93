"""A signed document counts only byte for byte as we write it; another tool's is taken over, or refused.

One table of spellings: DDS implementations read each of them in another way than an XML parser, or than each other.
"""

from __future__ import annotations

from datetime import datetime, timezone

import pytest

from keystore import Domains, EnclavePolicy, InvalidInputError, Operation, Profile, Qualifier, Rule, Validity
from keystore.errors import OtherFormError
from keystore.formats.governance import (
    Governance,
    governance_document,
    parse_governance,
    read_foreign_governance,
)
from keystore.formats.permissions import permissions_document
from keystore.formats.permissions_document import parse_permissions, read_foreign_permissions
from keystore.formats.permissions_names import ros_rules

VALIDITY = Validity(datetime(2026, 1, 1, tzinfo=timezone.utc), datetime(2036, 1, 1, tzinfo=timezone.utc))
RULES = (
    Rule(Operation.PUBLISH, Qualifier.ALLOW, "/a/*"),
    Rule(Operation.PUBLISH, Qualifier.DENY, "/a/b"),
    Rule(Operation.SUBSCRIBE, Qualifier.ALLOW, "/c"),
)
PERMISSIONS = permissions_document(
    "CN=ros.a",
    EnclavePolicy("/a", (Profile("/", "n", RULES),)),
    validity=VALIDITY,
    domains=Domains.parse("8-9,12"),
)
GOVERNANCE = governance_document(Governance.for_domains(Domains.parse("8-9,12")))
GRANT = PERMISSIONS[PERMISSIONS.index(b"<grant") : PERMISSIONS.index(b"</permissions>")]
OTHER_GRANT = GRANT.replace(b"ros.a", b"ros.z")
DATES = b"<not_before>2025-12-31T10:00:00<"
CRITERIA = b"<publish><topics>\n<topic>rt/z</topic>\n</topics>%s</publish>"

TAKEN, REFUSED = "taken over", "refused"
SPELLINGS: dict[str, tuple[bytes, bytes, str]] = {
    # In both documents
    "CRLF": (b"\n", b"\r\n", TAKEN),
    "no line ends": (b"\n", b"", TAKEN),
    "a trailing line": (b"</dds>\n", b"</dds>\n\n", TAKEN),
    "no declaration": (b'<?xml version="1.0" encoding="UTF-8"?>\n', b"", TAKEN),
    "US-ASCII": (b'"UTF-8"', b'"us-ascii"', TAKEN),
    "UTF-7": (b'"UTF-8"', b'"UTF-7"', REFUSED),
    "ISO-2022-JP": (b'"UTF-8"', b'"ISO-2022-JP"', REFUSED),
    "JAVA": (b'"UTF-8"', b"'JAVA'", REFUSED),
    "Latin-1": (b'"UTF-8"', b'"ISO-8859-1"', REFUSED),
    "UTF-16, in name": (b'"UTF-8"', b'"UTF-16"', REFUSED),
    "a byte order mark": (b"<?xml", b"\xef\xbb\xbf<?xml", TAKEN),
    "a DOCTYPE": (b"<dds", b"<!DOCTYPE dds><dds", REFUSED),
    "an entity": (b"<dds", b"<!DOCTYPE dds [<!ENTITY e SYSTEM 'file:///etc/passwd'>]><dds", REFUSED),
    "a processing instruction": (b"<domains>", b"<?x y?><domains>", REFUSED),
    "a comment between elements": (b"<domains>", b"<!-- note -->\n<domains>", TAKEN),
    "a comment in a number": (b"<id>12<", b"<id>1<!-- -->2<", REFUSED),
    "character data": (b"<id>12<", b"<id><![CDATA[12]]><", REFUSED),
    "a reference": (b"<id>12<", b"<id>1&#50;<", REFUSED),
    "an octal domain": (b"<id>12<", b"<id>012<", REFUSED),
    "a signed domain": (b"<id>12<", b"<id>+12<", REFUSED),
    "a hexadecimal domain": (b"<id>12<", b"<id>0xc<", REFUSED),
    "a blank beside a domain": (b"<id>12<", b"<id> 12 <", TAKEN),
    "a domain of no ROS": (b"<id>12<", b"<id>12</id><id>231<", TAKEN),
    "an open range": (b"<max>9</max>", b"", TAKEN),
    "a range without a beginning": (b"<min>8</min>", b"", REFUSED),
    "domains in another order": (
        b"<id_range><min>8</min><max>9</max></id_range><id>12</id>",
        b"<id>12</id><id_range><min>8</min><max>9</max></id_range>",
        TAKEN,
    ),
    "ids in place of a range": (
        b"<id_range><min>8</min><max>9</max></id_range>", b"<id>8</id><id>9</id>", TAKEN,
    ),
    "domains twice": (b"</domains>", b"</domains><domains><id>3</id></domains>", REFUSED),
    "an unknown element": (b"</dds>", b"<what/></dds>", REFUSED),
    "not XML": (b"</dds>", b"", REFUSED),
    "text after the end": (b"</dds>", b"</dds>x", REFUSED),
    "a byte of Latin-1": (b"<domains>", b"<!-- \xe9 --><domains>", REFUSED),
    # In a governance
    "a boolean as a number": (b">true<", b">1<", TAKEN),
    "a boolean in capitals": (b">true<", b">True<", REFUSED),
    "a blank beside a kind": (b">ENCRYPT<", b"> ENCRYPT <", REFUSED),
    "an expression that one of them negates": (b">*<", b">[^a]*<", REFUSED),
    "no rule for every topic": (b">*<", b">rt/a<", TAKEN),
    "a rule after the one for every topic": (
        b"</topic_access_rules>",
        GOVERNANCE[GOVERNANCE.index(b"<topic_rule>") : GOVERNANCE.index(b"</topic_access_rules>")]
        + b"</topic_access_rules>", "as we write it",
    ),
    # In permissions
    "two grants": (b"</permissions>", OTHER_GRANT + b"</permissions>", TAKEN),
    "the grant of somebody else first": (b"<permissions>\n", b"<permissions>\n" + OTHER_GRANT, TAKEN),
    "default ALLOW": (b"<default>DENY", b"<default>ALLOW", TAKEN),
    "default twice": (b"<default>DENY</default>", b"<default>DENY</default><default>ALLOW</default>", REFUSED),
    "a rule for other domains": (
        b"<default>", b"<allow_rule><domains><id>3</id></domains></allow_rule><default>", TAKEN,
    ),
    "an empty topic": (b"<topic>rt/c<", b"<topic><", REFUSED),
    "a blank beside a topic": (b"<topic>rt/c<", b"<topic> rt/c<", TAKEN),
    "a topic that one of them negates": (b"<topic>rt/c<", b"<topic>rt/[^c]<", TAKEN),
    "a denial that one of them negates": (b"<topic>rt/a/b<", b"<topic>rt/a/[^b]<", REFUSED),
    "topics in another order": (
        b"<topic>ros_discovery_info</topic>\n<topic>rt/c</topic>",
        b"<topic>rt/c</topic>\n<topic>ros_discovery_info</topic>",
        TAKEN,
    ),
    "publish twice": (b"<subscribe>", CRITERIA % b"" + b"<subscribe>", TAKEN),
    "partitions": (
        b"<subscribe>", CRITERIA % b"<partitions><partition>p</partition></partitions>" + b"<subscribe>", TAKEN,
    ),
    "an attribute": (b"<topic>rt/c<", b'<topic x="1">rt/c<', REFUSED),
    "a date with a zone": (DATES, b"<not_before>2025-12-31T10:00:00+09:00<", TAKEN),
    "a date with a fraction": (DATES, b"<not_before>2025-12-31T10:00:00.500<", TAKEN),
    "a blank beside a date": (DATES, b"<not_before> 2025-12-31T10:00:00<", REFUSED),
    "an end too late for Cyclone DDS": (b"<not_after>2036", b"<not_after>2300", TAKEN),
}  # fmt: skip


def test_what_is_as_we_write_it_counts() -> None:
    permissions = parse_permissions(PERMISSIONS)
    assert permissions.document() == PERMISSIONS and permissions.subject == "CN=ros.a"
    assert permissions.rules.deny.publish == ("rt/a/b",) and str(permissions.domains) == "8-9,12"
    assert permissions.rules.permits("publish", "rt/a/c") and not permissions.rules.permits(
        "publish", "rt/a/b"
    )
    assert parse_governance(GOVERNANCE, "g").domains() == Domains.parse("8-9,12")


@pytest.mark.parametrize("name", SPELLINGS)
def test_any_other_spelling_does_not_count_and_is_taken_over_or_refused(name: str) -> None:
    old, new, expected = SPELLINGS[name]
    assert old in PERMISSIONS or old in GOVERNANCE
    if old in PERMISSIONS:
        spelled = PERMISSIONS.replace(old, new)
        with pytest.raises(OtherFormError, match=r"^p\.xml .*byte for byte"):
            parse_permissions(spelled, "p.xml")
        assert permissions_taken(spelled) == expected
    if old in GOVERNANCE and expected != "as we write it":
        spelled = GOVERNANCE.replace(old, new)
        with pytest.raises(OtherFormError, match=r"^g\.xml .*byte for byte"):
            parse_governance(spelled, "g.xml")
        assert governance_taken(spelled) == expected


def permissions_taken(document: bytes) -> str:
    try:
        found = read_foreign_permissions(document, "/a", "p.xml")
    except InvalidInputError as error:
        assert str(error).startswith(("p.xml", "domain id", "a denial")), error
        return REFUSED
    written = found.permissions.document()
    assert parse_permissions(written) == found.permissions
    assert b"ros.z" not in written and b"ALLOW<" not in written
    return TAKEN


def governance_taken(document: bytes) -> str:
    try:
        governance, _ = read_foreign_governance(document, "g.xml")
    except InvalidInputError:
        return REFUSED
    assert parse_governance(governance_document(governance), "g.xml") == governance
    return TAKEN


LOST = {
    "two grants": "grant for 'CN=ros.z'",
    "default ALLOW": "default ALLOW",
    "a rule for other domains": "domains 3",
    "a topic that one of them negates": r"rt/[^c]",
    "a blank beside a topic": "' rt/c'",
    "partitions": "partitions",
    "a domain of no ROS": "domain ids from 231",
    "publish twice": "",
    "CRLF": "",
}


@pytest.mark.parametrize("name", LOST)
def test_what_cannot_be_carried_over_is_named(name: str) -> None:
    old, new, _ = SPELLINGS[name]
    permissions, lost = read_foreign_permissions(PERMISSIONS.replace(old, new), "/a", "p.xml")
    assert permissions.rules.permits("publish", "rt/z") == (name == "publish twice")
    assert LOST[name] in " ".join(lost) and bool(lost) == bool(LOST[name])


def test_a_document_of_nobody_here() -> None:
    with pytest.raises(InvalidInputError, match="no grant for /b"):
        read_foreign_permissions(PERMISSIONS, "/b", "p.xml")


def test_too_large_a_document() -> None:
    with pytest.raises(InvalidInputError, match="larger than"):
        read_foreign_permissions(b" " * 5_000_000, "/a", "p.xml")


def test_back_to_ros_names() -> None:
    publish = ["rt/a", "rr/sReply", "rq/c/_action/send_goalRequest", "rt/half/_action/status", "raw"]
    subscribe = ["rq/sRequest", "ros_discovery_info"]
    rules, unknown = ros_rules(publish, subscribe)
    assert {(rule.operation, rule.expression) for rule in rules} == {
        (Operation.PUBLISH, "/a"),
        (Operation.REPLY, "/s"),
        (Operation.PUBLISH, "/half/_action/status"),
    }
    assert unknown == ("raw", "rq/c/_action/send_goalRequest")  # no role of the action is complete


DOMAINS = {
    "0": ((0, 0),),
    "0-10": ((0, 10),),
    "7,0,5-6": ((0, 0), (5, 7)),
    " 3 , 4 ": ((3, 4),),
    "all": ((0, 230),),
    "1-5,2-3": ((1, 5),),
}


@pytest.mark.parametrize("text", DOMAINS)
def test_domain_lists(text: str) -> None:
    assert Domains.parse(text).ranges == DOMAINS[text]


@pytest.mark.parametrize("text", ["", "a", "-1", "231", "0-231", "5-3", "0,", "0x0", "1 2", "1-2-3", "1000"])
def test_domain_lists_that_are_refused(text: str) -> None:
    with pytest.raises(InvalidInputError):
        Domains.parse(text)


def test_domains_as_text_and_what_they_cover() -> None:
    domains = Domains.parse("9,0-3")
    assert str(domains) == "0-3,9"
    assert domains.covers(Domains.parse("1-2,9")) and not domains.covers(Domains.single(5))
