"""NoDL v1 documents: what the schema of nodl_python allows, told with file and line where it is not met."""

from __future__ import annotations

import contextlib
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nodl import errors
from nodl.document.v1 import parse_v1
from nodl.node_interface import ManifestNode, NodeInterface


def parse(text: str) -> tuple[ManifestNode, ...]:
    return parse_v1(text.encode(), "demo.nodl.xml", "demo")


def one(body: str, *, name: str = "talker", executable: str = "talker.py") -> NodeInterface:
    (node,) = parse(
        f'<interface version="1">\n<node name="{name}" executable="{executable}">\n{body}\n</node>\n</interface>'
    )
    return node.interface


def endpoints(interface: NodeInterface) -> list[str]:
    return [f"{e.kind.value} {e.name} {e.type} :{e.source.line}" for e in interface.endpoints]


def test_every_element_and_role() -> None:
    interface = one(
        '<topic name="a" type="std_msgs/msg/String" role="publisher"/>\n'
        '<topic name="~/b" type="T" role="both"/>\n'
        '<service name="/c" type="S" role="server"/>\n'
        '<service name="d" type="S" role="both"/>\n'
        '<action name="e" type="A" role="client"/>\n'
        '<parameter name="rate" type="int"/>'
    )
    assert endpoints(interface) == [
        "publisher a std_msgs/msg/String :3",
        "publisher ~/b T :4",
        "subscription ~/b T :4",
        "service_server /c S :5",
        "service_server d S :6",
        "service_client d S :6",
        "action_client e A :7",
    ]
    assert (interface.package, interface.executable, interface.name) == ("demo", "talker.py", "talker")
    assert interface.parameters == ("rate",)
    assert str(interface.source) == "demo.nodl.xml:2"


def test_one_name_in_two_roles_keeps_both() -> None:
    """The parser of nodl_python keeps the last one only."""
    interface = one(
        '<topic name="a" type="T" role="publisher"/><topic name="a" type="T" role="subscription"/>'
    )
    assert endpoints(interface) == ["publisher a T :3", "subscription a T :3"]


def test_comments_and_instructions_are_ignored_everywhere() -> None:
    """A comment inside a node is an error of nodl_python's parser."""
    text = '<!-- a --><interface version="1"><!-- b --><node name="n" executable="e"><!-- c --><?pi?>'
    (node,) = parse(text + '<topic name="a" type="T" role="publisher"/></node><!-- d --></interface>')
    assert len(node.interface.endpoints) == 1


NODE_NAMES = {"/talker": ("/", "talker"), "/ns/talker": ("/ns", "talker"), "ns/talker": ("/ns", "talker")}


@pytest.mark.parametrize("written", NODE_NAMES)
def test_node_names_with_a_namespace(written: str) -> None:
    interface = one('<parameter name="p" type="int"/>', name=written)
    assert (interface.namespace, interface.name) == NODE_NAMES[written]


def test_a_document_may_name_its_schema() -> None:
    schema = 'xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:noNamespaceSchemaLocation="v1.xsd"'
    (node,) = parse(f'<interface version="1" {schema}>{NODE}</interface>')
    assert node.interface.name == "n"


def test_names_below_the_nodes_own_name_are_private() -> None:
    interface = one('<topic name="/talker/state" type="T" role="publisher"/>')
    (endpoint,) = interface.endpoints
    assert (str(endpoint.name), endpoint.written) == ("~/state", "/talker/state")
    (other,) = one('<topic name="/talker2/state" type="T" role="publisher"/>').endpoints
    assert (str(other.name), other.written) == ("/talker2/state", "")
    (placed,) = one('<topic name="/ns/talker/x" type="T" role="publisher"/>', name="/ns/talker").endpoints
    assert str(placed.name) == "~/x"


def test_a_plugin_is_described_under_its_name() -> None:
    interface = one('<parameter name="p" type="int"/>', executable="demo::Talker")
    assert (interface.plugin, interface.executable) == ("demo::Talker", None)


TOPIC = '<topic name="a" type="T" role="publisher"/>'
NODE = f'<node name="n" executable="e">\n{TOPIC}\n</node>'
BROKEN = {
    "not well-formed": ("<interface>\n<node>", errors.InvalidXMLError, 2),
    "empty": ("", errors.InvalidXMLError, None),
    "DOCTYPE": (f"<!DOCTYPE x>\n{NODE}", errors.InvalidXMLError, None),
    "entity bomb": (
        '<!DOCTYPE x [<!ENTITY a "aa"><!ENTITY b "&a;&a;">]><interface version="1">&b;</interface>',
        errors.InvalidXMLError,
        None,
    ),
    "external entity": (
        '<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/passwd">]><interface version="1">&a;</interface>',
        errors.InvalidXMLError,
        None,
    ),
    "undeclared entity": ('<interface version="1">\n&b;</interface>', errors.InvalidXMLError, 2),
    "elements in elements": ("<a>\n" * 300, errors.InvalidXMLError, 250),
    "an encoding that nobody knows": (
        '<?xml version="1.0" encoding="klingon"?><interface version="1"/>',
        errors.InvalidXMLError,
        1,
    ),
    "another namespace": (
        f'<interface version="1" xmlns="urn:x">{NODE}</interface>',
        errors.InvalidNoDLDocumentError,
        1,
    ),
    "text after a child": (
        f'<interface version="1">\n<node name="n" executable="e">{TOPIC}topic</node></interface>',
        errors.InvalidNoDLDocumentError,
        2,
    ),
    "another root": ("<nodes/>", errors.InvalidNoDLDocumentError, 1),
    "no version": (f"<interface>{NODE}</interface>", errors.InvalidNoDLDocumentError, 1),
    "version 2": (f'<interface version="2">{NODE}</interface>', errors.UnsupportedInterfaceError, 1),
    "no node": ('<interface version="1"/>', errors.InvalidNoDLDocumentError, 1),
    "a node without interfaces": (
        '<interface version="1">\n<node name="n" executable="e"/></interface>',
        errors.InvalidNoDLDocumentError,
        2,
    ),
    "a node without executable": (
        f'<interface version="1">\n<node name="n">{TOPIC}</node></interface>',
        errors.InvalidNoDLDocumentError,
        2,
    ),
    "an empty executable": (
        f'<interface version="1">\n<node name="n" executable="">{TOPIC}</node></interface>',
        errors.InvalidElementError,
        2,
    ),
    "a bad node name": (
        f'<interface version="1">\n<node name="n n" executable="e">{TOPIC}</node></interface>',
        errors.InvalidElementError,
        2,
    ),
    "text that has no meaning": (
        f'<interface version="1">\n<node name="n" executable="e">topic{TOPIC}</node></interface>',
        errors.InvalidNoDLDocumentError,
        2,
    ),
}
for _label, _element, _error in (
    ("an unknown element", "<topics/>", errors.InvalidNodeChildError),
    ("an unknown attribute", TOPIC.replace("/>", ' qos="x"/>'), errors.InvalidNoDLDocumentError),
    ("an element in a topic", TOPIC.replace("/>", "><qos/></topic>"), errors.InvalidNoDLDocumentError),
    (
        "a topic in a service",
        f'<service name="a" type="T" role="both">{TOPIC}</service>',
        errors.InvalidNoDLDocumentError,
    ),
    (
        "a topic in a parameter",
        f'<parameter name="a" type="T">{TOPIC}</parameter>',
        errors.InvalidNoDLDocumentError,
    ),
    ("an unknown role", TOPIC.replace("publisher", "server"), errors.InvalidNoDLDocumentError),
    ("no role", '<service name="a" type="T"/>', errors.InvalidNoDLDocumentError),
    ("an empty name", TOPIC.replace('"a"', '""'), errors.InvalidElementError),
    ("blanks in a name", TOPIC.replace('"a"', '" a "'), errors.InvalidElementError),
    ("a wildcard", TOPIC.replace('"a"', '"/*"'), errors.InvalidElementError),
    ("a character class", TOPIC.replace('"a"', '"[ab]"'), errors.InvalidElementError),
    ("tilde without slash", TOPIC.replace('"a"', '"~a"'), errors.InvalidElementError),
    ("an empty part", TOPIC.replace('"a"', '"a//b"'), errors.InvalidElementError),
    ("a trailing slash", TOPIC.replace('"a"', '"a/"'), errors.InvalidElementError),
    ("a digit first", TOPIC.replace('"a"', '"1a"'), errors.InvalidElementError),
    ("an unknown substitution", TOPIC.replace('"a"', '"{robot}/a"'), errors.InvalidElementError),
):
    BROKEN[_label] = (
        NODE.replace(TOPIC, _element).join(('<interface version="1">\n', "</interface>")),
        _error,
        3,
    )


@pytest.mark.parametrize("label", BROKEN)
def test_broken_documents_are_told_with_their_line(label: str) -> None:
    text, error, line = BROKEN[label]
    with pytest.raises(error) as caught:
        parse(text)
    place = "demo.nodl.xml" if line is None else f"demo.nodl.xml:{line}"
    assert re.match(rf"{re.escape(place)}(:\d+)?: .", str(caught.value))
    assert isinstance(caught.value, errors.InvalidNoDLError)


def test_too_large_a_document() -> None:
    with pytest.raises(errors.InvalidXMLError, match="larger than"):
        parse(" " * 4_000_001)


@settings(max_examples=80, deadline=None)
@given(
    st.text(max_size=60), st.sampled_from(["", "<interface version='1'>", "<interface version='1'><node "])
)
def test_any_text_is_nodes_or_an_error_of_ours(text: str, start: str) -> None:
    with contextlib.suppress(errors.InvalidNoDLError):
        assert parse_v1((start + text).encode("utf-8", "surrogatepass"), "x")
