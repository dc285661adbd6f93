"""XML text -> elements: ElementTree's dialect, with lines, without what only an attacker writes."""

from __future__ import annotations

import contextlib
import io
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from enclave_common.xml_tree import MAX_NESTING, RefusedXml, XmlElement
from enclave_launch.description.markup.xml import MAX_ENTITY_LENGTH, parse_launch_xml


def shape(element: XmlElement | ET.Element) -> tuple[object, ...]:
    return (element.tag, dict(element.attrib), [shape(child) for child in element])


def test_elements_know_their_lines() -> None:
    root = parse_launch_xml('<launch>\n  <arg\n    name="a"/>\n\n  <group><node/></group>\n</launch>')
    assert [(child.tag, child.sourceline) for child in root] == [("arg", 2), ("group", 5)]
    assert root.children[1].children[0].sourceline == 5


def test_lines_beyond_65535_are_right() -> None:
    assert parse_launch_xml("<launch>" + "\n" * 70_000 + "<arg/></launch>").children[0].sourceline == 70_001


AS_ELEMENTTREE = {
    "comments, text and instructions": "<a>text<!-- c --><?pi x?><b/>tail<![CDATA[ <c/> ]]></a>",
    "attribute normalisation": '<a b="x&#10;y\n z\tw" c=" &lt;&quot;&apos;&amp;&#65; "/>',
    "newlines of windows": '<a\r\n b="1\r\n2"/>',
    "namespaces": '<x:a xmlns:x="u" x:b="1" c="2"><x:d/><e xmlns="v"/></x:a>',
    "declared encoding": '<?xml version="1.0" encoding="utf-8"?><a b="é"/>',
    "byte order mark": '\ufeff<a b="é"/>',
    "mojibake of another declared encoding": '<?xml version="1.0" encoding="latin-1"?><a b="é"/>',
    "an entity made of others": '<!DOCTYPE a [<!ENTITY e "x &lt;"><!ENTITY f "&e; y &e;">]><a b="&f;"/>',
    "own short entity": '<!DOCTYPE a [<!ENTITY e "x y">]><a b="&e;"/>',
    "default attribute": '<!DOCTYPE a [<!ATTLIST a b CDATA "d">]><a/>',
    "document type with address": '<!DOCTYPE launch SYSTEM "http://example.invalid/l.dtd"><launch/>',
}


@pytest.mark.parametrize("text", AS_ELEMENTTREE.values(), ids=AS_ELEMENTTREE.keys())
def test_same_elements_as_elementtree(text: str) -> None:
    assert shape(parse_launch_xml(text)) == shape(ET.parse(io.StringIO(text)).getroot())


MALFORMED = {
    "empty": "",
    "only space": "  \n",
    "unclosed": "<a>\n<b",
    "mismatched": "<a>\n <b></c>\n</a>",
    "two roots": "<a/><b/>",
    "duplicate attribute": '<a b="1" b="2"/>',
    "undefined entity": "<a>\n&foo;</a>",
    "undefined entity, external document type": '<!DOCTYPE a SYSTEM "http://x"><a>&foo;</a>',
    "unbound prefix": '<a x:b="1"/>',
    "NUL": '<a b="\0"/>',
    "bare ampersand": '<a b="x & y"/>',
    "wrong encoding declaration": '<?xml version="1.0" encoding="utf-16"?><a/>',
    "not XML at all": "launch:\n- node: {pkg: p}",
}


@pytest.mark.parametrize("text", MALFORMED.values(), ids=MALFORMED.keys())
def test_malformed_text_has_elementtrees_error_and_position(text: str) -> None:
    with pytest.raises(ET.ParseError) as theirs:
        ET.parse(io.StringIO(text))
    with pytest.raises(ET.ParseError) as ours:
        parse_launch_xml(text)
    assert str(ours.value) == str(theirs.value)
    assert ours.value.position == theirs.value.position
    assert ours.value.code == theirs.value.code


def test_an_external_entity_is_refused_and_not_read(tmp_path: Path) -> None:
    secret = tmp_path / "secret"
    secret.write_text("do not leak")
    with pytest.raises(RefusedXml, match="external: nothing outside the file is read") as caught:
        parse_launch_xml(f'<!DOCTYPE a [\n<!ENTITY e SYSTEM "file://{secret}">]><a b="1">&e;</a>')
    assert caught.value.line == 2
    assert "do not leak" not in str(caught.value)


def test_billion_laughs_end_in_an_error() -> None:
    entities = '<!ENTITY l0 "lol">' + "".join(f'<!ENTITY l{i} "{f"&l{i - 1};" * 10}">' for i in range(1, 10))
    with pytest.raises(RefusedXml, match="entity 'l2' has more than 256 characters"):
        parse_launch_xml(f"<!DOCTYPE a [{entities}]><a>&l9;</a>")


def test_a_long_entity_is_refused() -> None:
    parse_launch_xml(f'<!DOCTYPE a [<!ENTITY e "{"x" * MAX_ENTITY_LENGTH}">]><a b="&e;"/>')
    with pytest.raises(RefusedXml, match=f"more than {MAX_ENTITY_LENGTH} characters"):
        parse_launch_xml(f'<!DOCTYPE a [<!ENTITY e "{"x" * (MAX_ENTITY_LENGTH + 1)}">]><a b="&e;"/>')


def test_parameter_entities_are_refused() -> None:
    with pytest.raises(RefusedXml, match="entity 'p' is more than plain text"):
        parse_launch_xml('<!DOCTYPE a [<!ENTITY % p "x">%p;]><a/>')


def test_deep_nesting_is_refused() -> None:
    parse_launch_xml("<a>" * (MAX_NESTING - 1) + "</a>" * (MAX_NESTING - 1))
    with pytest.raises(RefusedXml, match=f"nested more than {MAX_NESTING} deep"):
        parse_launch_xml("<a>" * 100_000)


def test_a_huge_attribute_is_fine() -> None:
    assert len(parse_launch_xml(f'<a b="{"x" * 20_000_000}"/>').attrib["b"]) == 20_000_000


@given(st.text())
def test_any_text_parses_or_is_an_error(text: str) -> None:
    with contextlib.suppress(ET.ParseError, RefusedXml):
        parse_launch_xml(text)


NAMES = st.sampled_from(["launch", "node", "arg"])
VALUES = st.text(st.characters(codec="utf-8", exclude_characters="\r\n\t", exclude_categories=["Cc", "Cs"]))


def _family(tag: str, attributes: dict[str, str], children: list[ET.Element]) -> ET.Element:
    element = ET.Element(tag, attributes)
    element.extend(children)
    return element


ATTRIBUTES = st.dictionaries(NAMES, VALUES, max_size=3)
ELEMENTS = st.recursive(
    st.builds(ET.Element, NAMES, ATTRIBUTES),
    lambda inner: st.builds(_family, NAMES, ATTRIBUTES, st.lists(inner, max_size=3)),
    max_leaves=10,
)


@given(ELEMENTS)
def test_what_elementtree_writes_is_read_back(element: ET.Element) -> None:
    assert shape(parse_launch_xml(ET.tostring(element, encoding="unicode"))) == shape(element)
