"""Governance from YAML: strict, canonical, signed only when changed."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from keystore import (
    ChangeOptions,
    DomainRule,
    Domains,
    Governance,
    InvalidInputError,
    Protection,
    Requirements,
    TopicRule,
    provision,
    set_governance,
    verify,
)
from keystore.errors import OtherFormError
from keystore.formats.governance import governance_document, parse_governance, read_foreign_governance
from keystore.formats.governance_yaml import parse_governance_yaml
from tests.dds.sros2_style import GOVERNANCE
from tests.keystore.kit import contents, filled, options, policy, snapshot

QUICK = ChangeOptions(durable=False)
CAMERA = b"""
version: 1
domain_rules:
  - domains: 0-10,42
    rtps_protection_kind: NONE
    topic_rules:
      - topic_expression: rt/camera/*
        data_protection_kind: NONE
        enable_read_access_control: false
"""
CAMERA_XML = """<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" \
xsi:noNamespaceSchemaLocation="http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_governance.xsd">
<domain_access_rules>
<domain_rule>
<domains><id_range><min>0</min><max>10</max></id_range><id>42</id></domains>
<allow_unauthenticated_participants>false</allow_unauthenticated_participants>
<enable_join_access_control>true</enable_join_access_control>
<discovery_protection_kind>ENCRYPT</discovery_protection_kind>
<liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>
<rtps_protection_kind>NONE</rtps_protection_kind>
<topic_access_rules>
<topic_rule>
<topic_expression>rt/camera/*</topic_expression>
<enable_discovery_protection>true</enable_discovery_protection>
<enable_liveliness_protection>true</enable_liveliness_protection>
<enable_read_access_control>false</enable_read_access_control>
<enable_write_access_control>true</enable_write_access_control>
<metadata_protection_kind>ENCRYPT</metadata_protection_kind>
<data_protection_kind>NONE</data_protection_kind>
</topic_rule>
<topic_rule>
<topic_expression>*</topic_expression>
<enable_discovery_protection>true</enable_discovery_protection>
<enable_liveliness_protection>true</enable_liveliness_protection>
<enable_read_access_control>true</enable_read_access_control>
<enable_write_access_control>true</enable_write_access_control>
<metadata_protection_kind>ENCRYPT</metadata_protection_kind>
<data_protection_kind>ENCRYPT</data_protection_kind>
</topic_rule>
</topic_access_rules>
</domain_rule>
</domain_access_rules>
</dds>
"""


def test_yaml_to_document() -> None:
    governance = parse_governance_yaml(CAMERA, "camera.yaml")
    assert governance_document(governance).decode() == CAMERA_XML


def test_the_defaults_are_sros2s() -> None:
    """Its default document and ours say the same."""
    theirs, lost = read_foreign_governance(GOVERNANCE.format(domain=0).encode(), "governance.xml")
    assert lost == () and theirs == Governance.for_domains(Domains.single(0))
    assert theirs == parse_governance_yaml(b"version: 1\ndomain_rules: [{}]", "x.yaml")


kinds = st.sampled_from(Protection)
topic_rules = st.builds(
    TopicRule,
    topic_expression=st.from_regex(r"(?:[rt/ab_*?]|\[!?[a-c]+\])+", fullmatch=True),
    enable_read_access_control=st.booleans(),
    metadata_protection_kind=kinds,
    data_protection_kind=st.sampled_from([Protection.NONE, Protection.SIGN, Protection.ENCRYPT]),
)
domains = st.integers(0, 230).map(Domains.single) | st.tuples(st.integers(0, 100), st.integers(101, 230)).map(
    lambda pair: Domains((pair,))
)
domain_rules = st.builds(
    DomainRule,
    domains=domains,
    enable_join_access_control=st.booleans(),
    discovery_protection_kind=kinds,
    rtps_protection_kind=kinds,
    topic_rules=st.lists(topic_rules, max_size=3).map(tuple),
)


@settings(max_examples=30)
@given(st.lists(domain_rules, min_size=1, max_size=3).map(tuple))
def test_documents_are_read_back_as_they_were(rules: tuple[DomainRule, ...]) -> None:
    governance = Governance(rules)
    document = governance_document(governance)
    assert parse_governance(document, "governance.xml") == governance
    assert all(rule.topic_rules[-1].topic_expression == "*" for rule in governance.domain_rules)


BAD_YAML = {
    "version: 2\ndomain_rules: [{}]": "version",
    "version: 1": "domain_rules",
    "version: 1\ndomain_rules: []": "domain_rules",
    "version: 1\ndomain_rules: [{rtps: SIGN}]": r":2: domain_rules\[0\]: unknown key .rtps",
    "version: 1\ndomain_rules: [{rtps_protection_kind: sign}]": "rtps_protection_kind",
    "version: 1\ndomain_rules: [{enable_join_access_control: 'yes'}]": ":2: .*true or false is expected",
    "version: 1\ndomain_rules: [{domains: 231}]": "0..230",
    "version: 1\ndomain_rules: [{domains: 5-3}]": "domain ids",
    "version: 1\ndomain_rules: [{topic_rules: [{}]}]": "topic_expression",
    "version: 1\ndomain_rules: [{topic_rules: [{topic_expression: ''}]}]": "read alike",
    "version: 1\ndomain_rules: [{topic_rules: [{topic_expression: 'rt/[^a]'}]}]": "read alike",
    "version: 1\ndomain_rules: [{topic_rules: [{topic_expression: a, data_protection_kind: "
    "SIGN_WITH_ORIGIN_AUTHENTICATION}]}]": "data_protection_kind",
    "version: 1\ndomain_rules: [{allow_unauthenticated_participants: true}]": "rtps_protection_kind NONE",
    "version: 1\nversion: 1\ndomain_rules: [{}]": r"x\.yaml:2: 'version' is written twice",
    "version: 1\ndomain_rules: [&a {}, *a]": r"x\.yaml:2: aliases are not allowed",
    "version: 1\ndomain_rules: !!python/object:os.system {}": r"x\.yaml:2",
    "- 1\n- 2": "x.yaml",
    "version: [": r"x\.yaml:1",
    "\0": "not YAML",
    "": "x.yaml",
}


@pytest.mark.parametrize(("text", "message"), BAD_YAML.items())
def test_bad_yaml_is_refused_with_its_place(text: str, message: str) -> None:
    with pytest.raises(InvalidInputError, match=message) as caught:
        parse_governance_yaml(text.encode(), "x.yaml")
    assert str(caught.value).startswith("x.yaml")


@pytest.mark.parametrize(
    "damage",
    [
        ("<rtps_protection_kind>NONE</rtps_protection_kind>\n", ""),
        ("NONE</rtps", "none</rtps"),
        ("<topic_expression>*</topic_expression>", "<topic_expression></topic_expression>"),
        ("<domains>", "<domain>"),
        ("<id>42</id>", "<id>-1</id>"),
        ('<?xml version="1.0" encoding="UTF-8"?>', "<!DOCTYPE dds>"),
        ("<data_protection_kind>NONE", "<data_protection_kind>SIGN_WITH_ORIGIN_AUTHENTICATION"),
    ],
)
def test_documents_that_an_implementation_refuses_are_refused(damage: tuple[str, str]) -> None:
    document = CAMERA_XML.replace(*damage).encode()
    with pytest.raises(InvalidInputError):
        read_foreign_governance(document, "governance.xml")
    with pytest.raises(OtherFormError):
        parse_governance(document, "governance.xml")


def test_setting_governance_signs_once(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks")
    governance = parse_governance_yaml(CAMERA, "camera.yaml")
    assert set_governance(root, governance, options=QUICK)
    before = snapshot(root)
    assert not set_governance(root, governance, options=QUICK)
    assert snapshot(root) == before
    assert (root / "enclaves/governance.xml").read_text() == CAMERA_XML
    assert {finding.code for finding in verify(root).findings if finding.severity.fails} == {
        "governance-weak"
    }
    assert verify(root, required=Requirements(governance)).is_good
    assert not verify(root, required=Requirements(Governance())).is_good


@pytest.mark.parametrize(
    ("changed", "is_open"),
    [
        ("", True),
        ("rtps_protection_kind: NONE->SIGN", False),
        ("metadata_protection_kind: NONE->SIGN", False),
        ("data_protection_kind: NONE->SIGN", False),
        ("enable_discovery_protection: false->true", False),
    ],
)
def test_a_governance_that_a_discovery_server_leads_past_is_an_error(
    tmp_path: Path, changed: str, is_open: bool
) -> None:
    text = (
        "version: 1\ndomain_rules:\n- rtps_protection_kind: NONE\n  topic_rules:\n  - topic_expression: rt/rosout\n"
        "    enable_discovery_protection: false\n    metadata_protection_kind: NONE\n    data_protection_kind: NONE\n"
    )
    name, _, values = changed.partition(": ")
    before, _, after = values.partition("->")
    text = text.replace(f" {name}: {before}", f" {name}: {after}") if changed else text
    governance = parse_governance_yaml(text.encode(), "x.yaml")
    root = filled(tmp_path / "ks")
    set_governance(root, governance, options=QUICK)
    for required in (None, Requirements(governance)):
        found = {one.code for one in verify(root, required=required).findings if one.severity.fails}
        assert ("governance-open" in found) is is_open, "also where it is the one that is required"


def test_an_edited_twin_is_found_and_written_back(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks")
    twin = root / "enclaves/governance.xml"
    twin.write_bytes(twin.read_bytes().replace(b">SIGN<", b">NONE<"))
    assert [finding.code for finding in verify(root).findings] == ["twin-differs"]
    assert set_governance(root, Governance(), options=QUICK)
    assert verify(root).findings == ()


def test_only_the_governance_changes(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks")
    before = contents(root)
    set_governance(root, parse_governance_yaml(CAMERA, "camera.yaml"), options=QUICK)
    after = contents(root)
    assert {name for name in after if after[name] != before[name]} == {
        "enclaves/governance.xml", "enclaves/governance.p7s", "private/register.json",
    }  # fmt: skip


def test_a_launch_on_a_domain_without_rule_asks_a_person(tmp_path: Path) -> None:
    two = Governance((DomainRule(domains=Domains.single(0)), DomainRule(domains=Domains.single(1))))
    root = filled(tmp_path / "ks")
    set_governance(root, two, options=QUICK)
    with pytest.raises(InvalidInputError, match="several to choose from"):
        provision(root, [policy("/a")], options=options(domains=Domains.single(2)))
