"""The NoDL v1 Python API under its old names: code written for nodl_python runs on ours."""

from __future__ import annotations

import inspect
import io
from pathlib import Path

import pytest

import nodl
from nodl import errors, types
from nodl.ament_index import PackageNotFoundError
from tests.programs import install_package

DOCUMENT = """\
<interface version="1">
  <node name="node_1" executable="first">
    <!-- a comment, at which nodl_python stops -->
    <parameter name="verbose" type="bool"/>
    <topic name="/node_1/state" type="std_msgs/msg/String" role="publisher"/>
    <topic name="cmd" type="std_msgs/msg/String" role="publisher"/>
    <topic name="cmd" type="std_msgs/msg/String" role="subscription"/>
  </node>
  <node name="node_2" executable="second">
    <service name="/s" type="std_srvs/srv/Empty" role="client"/>
    <action name="/a" type="example_interfaces/action/Fibonacci" role="both"/>
  </node>
</interface>
"""


@pytest.fixture
def share(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = install_package(tmp_path, "example")
    (folder / "example.nodl.xml").write_text(DOCUMENT)
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    return folder


def test_node_by_executable(share: Path) -> None:
    node = nodl.get_node_by_executable(package_name="example", executable_name="first")
    assert isinstance(node, types.Node)
    assert (node.name, node.executable) == ("node_1", "first")
    assert node.topics["cmd"].role is types.PubSubRole.BOTH  # nodl_python keeps the last role only
    assert node.topics["/node_1/state"].type == "std_msgs/msg/String"
    assert node.parameters["verbose"] == types.Parameter(name="verbose", parameter_type="bool")
    other = nodl.get_node_by_executable(package_name="example", executable_name="second")
    assert other.services["/s"] == types.Service(
        name="/s", service_type="std_srvs/srv/Empty", role=types.ServerClientRole.CLIENT
    )
    assert other.actions["/a"].role is types.ServerClientRole.BOTH
    assert other.topics == {}


def test_the_package_is_not_there(share: Path) -> None:
    with pytest.raises(KeyError) as caught:  # as ament_index_python's PackageNotFoundError
        nodl.get_node_by_executable(package_name="none", executable_name="x")
    assert isinstance(caught.value, PackageNotFoundError)


def test_the_executable_is_not_described(share: Path) -> None:
    with pytest.raises(errors.ExecutableNotFoundError, match="executable 'x'"):
        nodl.get_node_by_executable(package_name="example", executable_name="x")


def test_the_package_has_no_files(share: Path) -> None:
    (share / "example.nodl.xml").unlink()
    with pytest.raises(errors.NoNoDLFilesError, match="example"):
        nodl.get_node_by_executable(package_name="example", executable_name="x")


def test_an_executable_described_twice(share: Path) -> None:
    (share / "more.nodl.xml").write_text(DOCUMENT)
    with pytest.raises(errors.DuplicateNodeError, match="node_1 of executable first"):
        nodl.get_node_by_executable(package_name="example", executable_name="first")


def test_parsing_a_path_or_a_stream(share: Path) -> None:
    path = share / "example.nodl.xml"
    by_path, by_text, by_stream = nodl.parse(path), nodl.parse(str(path)), nodl.parse(io.StringIO(DOCUMENT))
    assert [node.name for node in by_path] == ["node_1", "node_2"]
    assert (
        [str(node) for node in by_path]
        == [str(node) for node in by_text]
        == [str(node) for node in by_stream]
    )


ERRORS = {
    "<interface": errors.InvalidXMLError,
    "<interface version='2'><node/></interface>": errors.UnsupportedInterfaceError,
    "<interface version='1'><node/></interface>": errors.InvalidNoDLDocumentError,
    "<interface version='1'><node name='n' executable='e'><x/></node></interface>": errors.InvalidNodeChildError,
}


@pytest.mark.parametrize("text", ERRORS)
def test_errors_of_parsing(text: str) -> None:
    with pytest.raises(ERRORS[text]) as caught:
        nodl.parse(io.StringIO(text))
    assert isinstance(caught.value, errors.InvalidNoDLError) and isinstance(caught.value, errors.NoDLError)


def test_errors_of_a_file_that_is_not_there() -> None:
    with pytest.raises(errors.NoDLError, match="No such file"):
        nodl.parse("/nonexistent.nodl.xml")


# What the API of nodl_python 0.3 offers: names and the names of their arguments.
SIGNATURES = {
    "nodl.get_node_by_executable": ["package_name", "executable_name"],
    "nodl.parse": ["path"],
    "types.Node": ["name", "executable", "actions", "parameters", "services", "topics"],
    "types.Topic": ["name", "message_type", "role"],
    "types.Service": ["name", "service_type", "role"],
    "types.Action": ["name", "action_type", "role"],
    "types.Parameter": ["name", "parameter_type"],
    "types.NoDLInterface": ["name", "value_type"],
    "errors.NoNoDLFilesError": ["package_name"],
    "errors.DuplicateNodeError": ["node"],
    "errors.ExecutableNotFoundError": ["package_name", "executable_name"],
    "errors.InvalidXMLError": ["err"],
    "errors.InvalidNoDLDocumentError": ["invalid"],
    "errors.InvalidElementError": ["message", "element"],
    "errors.InvalidActionError": ["message", "element"],
    "errors.InvalidParameterError": ["message", "element"],
    "errors.InvalidTopicError": ["message", "element"],
    "errors.InvalidServiceError": ["message", "element"],
    "errors.InvalidNodeChildError": ["element"],
    "errors.UnsupportedInterfaceError": ["version", "max_version"],
}


@pytest.mark.parametrize("name", SIGNATURES)
def test_signatures(name: str) -> None:
    home, _, member = name.partition(".")
    found = getattr({"nodl": nodl, "types": types, "errors": errors}[home], member)
    assert list(inspect.signature(found).parameters) == SIGNATURES[name]


def test_errors_made_by_their_v1_constructors() -> None:
    from lxml import etree

    element = etree.fromstring("<topic/>")
    assert ":1: <topic> is bad" in str(errors.InvalidTopicError("is bad", element))
    assert "not allowed in a node" in str(errors.InvalidNodeChildError(element))
    assert "version 3" in str(errors.UnsupportedInterfaceError(3, 1))
    with pytest.raises(etree.XMLSyntaxError) as caught:
        etree.fromstring("<a>")
    assert "not well-formed" in str(errors.InvalidXMLError(caught.value))
