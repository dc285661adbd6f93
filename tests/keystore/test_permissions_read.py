"""Reading permissions documents, and refusing what one of the DDS implementations chokes on (section by section)."""

from __future__ import annotations

import re

import pytest

from keystore import Domains, InvalidInputError, Operation, Qualifier
from keystore.formats.permissions_document import parse_permissions
from keystore.formats.permissions_names import ros_rules

RULE = "<allow_rule><domains>{domains}</domains><publish><topics>{topics}</topics></publish></allow_rule>"


def document(
    domains: str = "<id>0</id>", topics: str = "<topic>rt/a</topic>", head: str = "", extra: str = ""
) -> bytes:
    rule = RULE.format(domains=domains, topics=topics)
    return (
        f'{head}<dds><permissions><grant name="/a"><subject_name>CN=/a</subject_name><validity>'
        "<not_before>2024-01-01T00:00:00</not_before><not_after>2034-01-01T00:00:00</not_after></validity>"
        f"{rule}{extra}<default>DENY</default></grant></permissions></dds>"
    ).encode()


def test_a_document_of_another_tool() -> None:
    (grant,) = parse_permissions(
        document(
            domains="<id>3</id><id_range><min>5</min></id_range>", topics="<!-- c --><topic>rt/a</topic>"
        )
    )
    (rule,) = grant.rules
    assert (rule.qualifier, rule.domains, rule.publish) == (Qualifier.ALLOW, ((3, 3), (5, None)), ("rt/a",))
    assert (grant.not_before, grant.default) == ("2024-01-01T00:00:00", Qualifier.DENY)


BROKEN = {
    "an empty topic crashes Cyclone DDS": (document(topics="<topic/>"), "topic"),
    "so does a range without min": (document(domains="<id_range><max>10</max></id_range>"), "max"),
    "unknown elements are refused by both": (document(extra="<what/>"), "what"),
    "extra attributes are refused by Cyclone DDS": (
        document(topics='<topic x="1">rt/a</topic>'),
        "attribute 'x'",
    ),
    "a DOCTYPE": (document(head="<!DOCTYPE dds>"), "DOCTYPE"),
    "an entity": (document(head='<!DOCTYPE dds [<!ENTITY e SYSTEM "file:///etc/passwd">]>'), "DOCTYPE"),
    "not XML": (b"<dds>", "not well-formed"),
    "empty": (b"", "not well-formed"),
    "no topic at all": (document(topics=""), "topics"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_documents_that_must_not_be_accepted(name: str) -> None:
    text, reason = BROKEN[name]
    with pytest.raises(InvalidInputError, match=rf"perm.xml:?\d*: .*{re.escape(reason)}"):
        parse_permissions(text, "perm.xml")


def test_too_large_a_document() -> None:
    with pytest.raises(InvalidInputError, match="larger than"):
        parse_permissions(b" " * 5_000_000)


def test_a_doctype_in_another_encoding_is_found_too() -> None:
    text = '<?xml version="1.0" encoding="UTF-16"?><!DOCTYPE dds><dds/>'.encode("utf-16")
    with pytest.raises(InvalidInputError, match="DOCTYPE"):
        parse_permissions(text)


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
