"""Launch files of each kind: content decides, the name gives the order, errors list each attempt."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_launch.description.launch_context import LaunchContext
from enclave_launch.description.launch_description import LaunchDescription
from enclave_launch.description.markup.parser import (
    InvalidFrontendLaunchFileError,
    InvalidLaunchFileError,
    Parser,
)
from enclave_launch.description.sources import (
    AnyLaunchDescriptionSource,
    FrontendLaunchDescriptionSource,
    InvalidPythonLaunchFileError,
    PythonLaunchDescriptionSource,
    XMLLaunchDescriptionSource,
    YAMLLaunchDescriptionSource,
    get_launch_description_from_any_launch_file,
    get_launch_description_from_frontend_launch_file,
    get_launch_description_from_python_launch_file,
)
from enclave_launch.frontend.error_location import likeliest, location_of
from enclave_launch.host.current import active_host
from enclave_launch.host.plan_host import PlanHost

XML = '<launch>\n  <let name="a" value="b"/>\n</launch>'
YAML = "launch:\n- let: {name: a, value: b}\n"
PYTHON = """
from enclave_launch.description.launch_description import LaunchDescription

def generate_launch_description():
    return LaunchDescription([])
"""


def write(path: Path, text: str) -> str:
    path.write_text(text)
    return str(path)


@pytest.mark.parametrize("name", ["a.launch.xml", "a.xml", "a.launch", "a.yaml", "a.launch.py", "a.txt", "a"])
@pytest.mark.parametrize("text", [XML, YAML, PYTHON], ids=["xml", "yaml", "python"])
def test_content_decides(tmp_path: Path, name: str, text: str) -> None:
    description = get_launch_description_from_any_launch_file(write(tmp_path / name, text))
    assert isinstance(description, LaunchDescription)
    assert len(description.entities) == (0 if text is PYTHON else 1)


@pytest.mark.parametrize(("text", "line"), [(XML, 2), (YAML, 2)], ids=["xml", "yaml"])
def test_actions_know_file_and_line(tmp_path: Path, text: str, line: int) -> None:
    path = write(tmp_path / "a.launch", text)
    (action,) = get_launch_description_from_any_launch_file(path).entities
    assert str(action.source_location) == f"{path}:{line}"


def attempts(error: BaseException) -> list[str]:
    return str(error).splitlines()


def test_each_attempt_has_its_line(tmp_path: Path) -> None:
    path = write(tmp_path / "a.launch.xml", '<launch>\n  <let nam="a"/>\n</launch>')
    with pytest.raises(InvalidLaunchFileError) as caught:
        get_launch_description_from_any_launch_file(path)
    lines = attempts(caught.value)
    assert lines[0] == "Caught multiple exceptions when trying to load file of format [xml]:"
    assert lines[1] == " - AttributeError: Attribute 'name' of type '<class 'str'>' not found in Entity 'let'"
    assert lines[2].startswith(" - SyntaxError: invalid syntax")
    assert isinstance(caught.value.__cause__, AttributeError)
    assert str(location_of(caught.value)) == f"{path}:2"


def test_malformed_xml_is_placed_at_the_fault(tmp_path: Path) -> None:
    path = write(tmp_path / "a.launch.xml", "<launch>\n  <let\n</launch>")
    with pytest.raises(InvalidLaunchFileError, match=r"\(invalid token\): line 3, column 0") as caught:
        get_launch_description_from_any_launch_file(path)
    assert str(location_of(caught.value)) == f"{path}:3"


@pytest.mark.parametrize("name", ["a.launch.yaml", "a.launch"])
def test_malformed_yaml_is_placed_at_the_fault(tmp_path: Path, name: str) -> None:
    path = write(tmp_path / name, "launch:\n- let: {name: a\n- let: b\n")
    with pytest.raises(InvalidLaunchFileError, match="while parsing a flow mapping") as caught:
        get_launch_description_from_any_launch_file(path)
    assert str(location_of(caught.value)) == f"{path}:3"
    assert "flow mapping" in str(likeliest(caught.value))


def test_a_python_error_is_placed_at_the_users_frame(tmp_path: Path) -> None:
    path = write(tmp_path / "a.launch.py", "def generate_launch_description():\n    return 1 / 0\n")
    with pytest.raises(InvalidLaunchFileError) as caught:
        get_launch_description_from_any_launch_file(path)
    assert attempts(caught.value)[1] == " - ZeroDivisionError: division by zero"
    assert str(location_of(caught.value)) == f"{path}:2"


def test_an_unknown_extension_says_little(tmp_path: Path) -> None:
    with pytest.raises(InvalidLaunchFileError) as caught:
        get_launch_description_from_any_launch_file(write(tmp_path / "a.txt", "%"))
    assert str(caught.value) == "The launch file may have a syntax error, or its format is unknown"


def test_a_missing_file_is_reported_by_each_loader(tmp_path: Path) -> None:
    path = str(tmp_path / "none.launch.xml")
    with pytest.raises(InvalidLaunchFileError) as caught:
        get_launch_description_from_any_launch_file(path)
    line = f" - FileNotFoundError: [Errno 2] No such file or directory: '{path}'"
    assert attempts(caught.value)[1:] == [line, line]


def test_particular_loaders_raise_the_original_error(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        get_launch_description_from_frontend_launch_file(str(tmp_path / "none"))
    with pytest.raises(RuntimeError, match="Unrecognized entity of the type: nope"):
        get_launch_description_from_frontend_launch_file(write(tmp_path / "a", "<launch><nope/></launch>"))
    with pytest.raises(ZeroDivisionError):
        get_launch_description_from_python_launch_file(write(tmp_path / "a.py", "1 / 0"))
    with pytest.raises(InvalidPythonLaunchFileError) as caught:
        get_launch_description_from_python_launch_file(write(tmp_path / "b.py", ""))
    assert str(caught.value) == (
        f"launch file at '{tmp_path / 'b.py'}' does not contain the required function "
        "'generate_launch_description()'"
    )


def test_no_front_end_fits(tmp_path: Path) -> None:
    with pytest.raises(InvalidFrontendLaunchFileError, match="of format \\[xml\\]") as caught:
        get_launch_description_from_frontend_launch_file(write(tmp_path / "a.launch.xml", "[1"))
    lines = attempts(caught.value)
    assert lines[1] == " - ParseError: syntax error: line 1, column 0"
    assert lines[2].startswith(" - ParserError: while parsing a flow sequence")


@pytest.mark.parametrize(
    "source", [FrontendLaunchDescriptionSource, XMLLaunchDescriptionSource, YAMLLaunchDescriptionSource]
)
@pytest.mark.parametrize("text", [XML, YAML], ids=["xml", "yaml"])
def test_front_end_sources_read_either_syntax(
    tmp_path: Path, source: type[FrontendLaunchDescriptionSource], text: str
) -> None:
    description = source(write(tmp_path / "a", text)).get_launch_description(LaunchContext())
    assert len(description.entities) == 1


def test_a_source_loads_once(tmp_path: Path) -> None:
    path = write(tmp_path / "a.launch.xml", XML)
    source, context = AnyLaunchDescriptionSource(path), LaunchContext()
    first = source.get_launch_description(context)
    write(tmp_path / "a.launch.xml", "<launch/>")
    assert source.get_launch_description(context) is first
    assert source.location == path


def test_two_sources_of_one_file_have_their_own_actions(tmp_path: Path) -> None:
    path = write(tmp_path / "a.launch.xml", XML)
    sources = AnyLaunchDescriptionSource(path), AnyLaunchDescriptionSource(path)
    first, second = (source.get_launch_description(LaunchContext()).entities[0] for source in sources)
    assert first is not second


def test_methods_name_the_kind() -> None:
    assert AnyLaunchDescriptionSource("a").method == "interpreted launch file"
    assert PythonLaunchDescriptionSource("a").method == "interpreted python launch file"
    assert FrontendLaunchDescriptionSource("a").method == "interpreted frontend launch file"
    assert XMLLaunchDescriptionSource("a").method == "interpreted XML launch file"
    assert YAMLLaunchDescriptionSource("a").method == "interpreted YAML launch file"


def test_no_python_reads_xml_but_runs_nothing(tmp_path: Path) -> None:
    proof = tmp_path / "proof"
    python = write(tmp_path / "a.launch.py", f"open({str(proof)!r}, 'w')")
    xml = write(tmp_path / "a.launch.xml", XML)
    with active_host(PlanHost(no_python=True)):
        get_launch_description_from_any_launch_file(xml)
        with pytest.raises(InvalidLaunchFileError, match="--no-python"):
            get_launch_description_from_any_launch_file(python)
    assert not proof.exists()


def test_roots() -> None:
    assert Parser.get_available_extensions() == ["xml", "yaml"]
    assert Parser.get_file_extensions_from_parsers() == {
        *("launch.xml", "xml", "launch", "launch.yaml", "launch.yml", "yaml", "yml"),
    }
    assert Parser.is_filename_valid("x.launch") and not Parser.is_filename_valid("x.launch.py")
    assert [parser.__module__.split(".")[-1] for parser in Parser.get_parsers_from_filename("x.launch")] == [
        "xml",
        "yaml",
    ]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<group/>", "Expected 'launch' as root tag"),
        ("nodes: []", "Expected 'launch' as root tag"),
        ("launch: []\nb: 1", "Expected only one root"),
        ("launch: {a: b}", "Expected entity `launch` to have children entities"),
    ],
)
def test_bad_roots(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InvalidLaunchFileError) as caught:
        get_launch_description_from_any_launch_file(write(tmp_path / "a.launch", text))
    assert message in str(caught.value)


@pytest.mark.parametrize(
    "text", ['<launch deprecated="why" other="x"/>', "launch: {deprecated: why, children: []}"]
)
def test_the_root_may_be_deprecated_and_is_not_checked(tmp_path: Path, text: str) -> None:
    description = get_launch_description_from_any_launch_file(write(tmp_path / "a.launch", text))
    assert description.deprecated_reason == "why"


def alias_bomb(levels: int) -> str:
    return "b0: &b0 [x, x]\n" + "".join(f"b{i}: &b{i} [*b{i - 1}, *b{i - 1}]\n" for i in range(1, levels))


HOSTILE = {
    "billion laughs": b'<!DOCTYPE a [<!ENTITY a "'
    + b"x" * 200
    + b'"><!ENTITY b "&a;&a;">]><launch>&b;</launch>',
    "external entity": b'<!DOCTYPE a [<!ENTITY a SYSTEM "file:///etc/passwd">]><launch>&a;</launch>',
    "deep XML": b"<launch>" + b"<group>" * 5000,
    "deep YAML": b"launch: " + b"[" * 5000,
    "alias bomb": alias_bomb(40).encode(),
    "NUL": b"<launch>\0</launch>",
    "invalid UTF-8": b'<launch a="\xff\xfe"/>',
    "UTF-16": "<launch/>".encode("utf-16"),
    "empty": b"",
    "binary": bytes(range(256)),
    "deep template": b'<launch><let name="a" value="' + b"$(var " * 5000 + b'"/></launch>',
}


@pytest.mark.parametrize("content", HOSTILE.values(), ids=HOSTILE.keys())
@pytest.mark.parametrize("name", ["a.launch.xml", "a.launch.yaml"])
def test_hostile_files_end_in_one_error(tmp_path: Path, name: str, content: bytes) -> None:
    (tmp_path / name).write_bytes(content)
    with active_host(PlanHost(no_python=True)), pytest.raises(InvalidLaunchFileError) as caught:
        get_launch_description_from_any_launch_file(str(tmp_path / name))
    assert "root:" not in str(caught.value)
    place = location_of(caught.value)
    assert place is None or place.file == str(tmp_path / name)
