"""``secure-nodl validate | show | convert``: output and exit status as a person meets them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from nodl.document import read_document
from nodl.document.v1 import parse_v1
from nodl.document.v2 import parse_v2
from nodl.document.write import v1_xml, v2_yaml
from nodl.node_interface import ManifestNode
from nodl.verb import main
from tests.programs import install_package

V1 = """\
<interface version="1">
  <node name="/talker" executable="talker.py">
    <topic name="chatter" type="std_msgs/msg/String" role="both"/>
    <topic name="/talker/state" type="std_msgs/msg/String" role="publisher"/>
    <service name="~/reset" type="std_srvs/srv/Empty" role="server"/>
    <parameter name="rate" type="double"/>
  </node>
  <node name="listener" executable="listener">
    <action name="go" type="nav/action/Go" role="client"/>
  </node>
</interface>
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "demo.nodl.xml").write_text(V1)
    return tmp_path


def test_validating_files(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate", "demo.nodl.xml"]) == 0
    assert capsys.readouterr().out == "demo.nodl.xml: valid NoDL v1: talker, listener\n"


def test_validating_a_folder_tells_every_broken_file(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "bad.nodl.xml").write_text(V1.replace("both", "all"))
    (folder / "bad.nodl.yaml").write_text("nodl_version: 2\nx: 1\n")
    assert main(["validate"]) == 1
    captured = capsys.readouterr()
    assert captured.out.count("valid NoDL") == 1
    assert captured.err.splitlines()[0].startswith("bad.nodl.xml:3: role 'all'")
    assert captured.err.splitlines()[1].startswith("bad.nodl.yaml:2: the document has no key 'x'")


TOPIC = """nodl_version: 2
publishers: [{{name: {}, type: {}, qos: {{history: KEEP_LAST, depth: {}, reliability: RELIABLE}}}}]
"""


@pytest.mark.parametrize("name", ["a//b", "a/1b", "~x"])
def test_a_name_that_the_schema_takes_and_ros_does_not_is_valid_with_a_warning(
    folder: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    (folder / "x.nodl.yaml").write_text(TOPIC.format(f"'{name}'", "std_msgs/msg/String", 1))
    assert main(["validate", "x.nodl.yaml"]) == 0
    printed = capsys.readouterr()
    assert printed.out == "x.nodl.yaml: fits the schema of NoDL v2\n"
    assert "x.nodl.yaml:2" in printed.err and "ROS refuses it" in printed.err


@pytest.mark.parametrize(
    ("name", "type_name", "depth", "status"),
    [
        ("a", "std_msgs/msg/String", "1.0", 0),
        ("a", "std_msgs/msg/String", "1.5", 1),
        ("a", '"std_msgs/msg/String\\n"', "1", 1),
        ("a-b", "std_msgs/msg/String", "1", 1),
    ],
)
def test_numbers_and_types_are_taken_as_by_the_schema(
    folder: Path, name: str, type_name: str, depth: str, status: int
) -> None:
    (folder / "x.nodl.yaml").write_text(TOPIC.format(name, type_name, depth))
    assert main(["validate", "x.nodl.yaml"]) == status


def test_includes_are_resolved_unless_they_shall_not_be(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "x.nodl.yaml").write_text("nodl_version: 2\ninclude: [{ref: 'nodl://nowhere/at_all'}]\n")
    assert main(["validate", "x.nodl.yaml"]) == 1
    assert "nowhere/at_all" in capsys.readouterr().err
    assert main(["validate", "--no-resolve", "x.nodl.yaml", "demo.nodl.xml"]) == 0
    (folder / "x.nodl.yaml").write_text("nodl_version: 2\nbase: x\n")
    assert main(["validate", "--no-resolve", "x.nodl.yaml"]) == 1


def test_validating_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["validate"]) == 2
    assert main(["validate", "none.nodl.xml"]) == 1


def test_showing_a_document(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", "demo.nodl.xml"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "node talker in /, run by talker.py  (demo.nodl.xml:2)",
        "  publishes      chatter  std_msgs/msg/String  (demo.nodl.xml:3)",
        "  subscribes     chatter  std_msgs/msg/String  (demo.nodl.xml:3)",
        "  publishes      /talker/state  std_msgs/msg/String  (demo.nodl.xml:4)",
        "  serves         ~/reset  std_srvs/srv/Empty  (demo.nodl.xml:5)",
        "  parameters     rate",
        "node listener, run by listener  (demo.nodl.xml:8)",
        "  calls action   go  nav/action/Go  (demo.nodl.xml:9)",
    ]


def test_showing_a_package(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    prefix = folder / "install"
    (install_package(prefix, "demo") / "demo.nodl.xml").write_text(V1)
    assert main(["show", "demo", "--prefix", str(prefix), "--format", "json"]) == 0
    nodes = json.loads(capsys.readouterr().out)
    assert [(node["package"], node["name"], len(node["endpoints"])) for node in nodes] == [
        ("demo", "talker", 4),
        ("demo", "listener", 1),
    ]
    assert main(["show", "demo", "listener", "nobody", "--prefix", str(prefix)]) == 1
    captured = capsys.readouterr()
    assert "node listener" in captured.out
    assert f"no NoDL for demo/nobody; looked at {prefix}/share/demo/*.nodl.xml" in captured.err
    assert main(["show", "none", "--prefix", str(prefix)]) == 1


def test_converting_v1_to_v2(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["convert", "demo.nodl.xml", "-o", "out"]) == 0
    captured = capsys.readouterr()
    assert captured.out == "out/talker.py.nodl.yaml\nout/listener.nodl.yaml\n"
    assert captured.err == (
        "note: talker: v1 has no QoS; SYSTEM_DEFAULT was written, replace it with what the code requests\n"
    )
    qos = "{history: SYSTEM_DEFAULT, reliability: SYSTEM_DEFAULT}"
    assert (folder / "out/talker.py.nodl.yaml").read_text() == (
        "nodl_version: 2\n"
        "codegen:\n"
        "  enclave_launch: {executable: talker.py, node: talker}\n"
        "parameters:\n"
        "  rate: {type: double}\n"
        "publishers:\n"
        f"  - {{name: chatter, type: std_msgs/msg/String, qos: {qos}}}\n"
        f"  - {{name: ~/state, type: std_msgs/msg/String, qos: {qos}}}\n"
        "subscriptions:\n"
        f"  - {{name: chatter, type: std_msgs/msg/String, qos: {qos}}}\n"
        "service_servers:\n"
        "  - {name: ~/reset, type: std_srvs/srv/Empty}\n"
    )


def test_converting_there_and_back_keeps_the_meaning(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["convert", "demo.nodl.xml", "-o", "out"]) == 0
    files = [str(path) for path in sorted((folder / "out").iterdir(), reverse=True)]
    assert main(["convert", *files, "-o", "back.nodl.xml"]) == 0
    assert meaning(read_document("back.nodl.xml")) == meaning(read_document("demo.nodl.xml"))
    assert "QoS, descriptions and details of parameters have no place in v1" in capsys.readouterr().err


def test_one_node_goes_to_standard_output(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "x.nodl.yaml").write_text("nodl_version: 2\nservice_clients: [{name: a, type: p/T}]")
    assert main(["convert", "x.nodl.yaml"]) == 0
    assert capsys.readouterr().out == (
        '<?xml version="1.0" encoding="UTF-8"?>\n<interface version="1">\n  <node name="x" executable="x">\n'
        '    <service name="a" type="p/srv/T" role="client"/>\n  </node>\n</interface>\n'
    )


FAILURES = {
    "a folder is needed": (V1, "name a folder with -o"),
    "an unknown parameter type": (V1.replace("double", "matrix"), "parameter type 'matrix' is unknown in v2"),
    "a type that is none": (
        V1.replace("std_srvs/srv/Empty", "Empty"),
        "type 'Empty' is not an interface type",
    ),
    "a name that v2 cannot hold": (V1.replace("chatter", "_x"), "name '_x' cannot be written in NoDL v2"),
    "a broken document": ("<interface>", "not well-formed"),
}


@pytest.mark.parametrize("label", FAILURES)
def test_conversions_that_fail_write_nothing(
    folder: Path, capsys: pytest.CaptureFixture[str], label: str
) -> None:
    text, reason = FAILURES[label]
    (folder / "bad.nodl.xml").write_text(text)
    output = [] if label == "a folder is needed" else ["-o", "out"]
    assert main(["convert", "bad.nodl.xml", *output]) == 1
    captured = capsys.readouterr()
    assert (
        reason in captured.err
        and captured.err.startswith("secure-nodl convert: error: ")
        and captured.out == ""
    )
    assert not (folder / "out").exists()


def test_versions_are_not_mixed(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "x.nodl.yaml").write_text("nodl_version: 2")
    assert main(["convert", "demo.nodl.xml", "x.nodl.yaml"]) == 1
    assert "different versions" in capsys.readouterr().err


def test_a_target_that_cannot_be_written(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "x.nodl.yaml").write_text("nodl_version: 2\nservice_clients: [{name: a, type: p/T}]")
    assert main(["convert", "x.nodl.yaml", "-o", "none/x.nodl.xml"]) == 1
    assert "secure-nodl convert: error: none/x.nodl.xml: No such file" in capsys.readouterr().err


@pytest.mark.parametrize("arguments", [[], ["what"], ["convert"], ["show"]])
def test_wrong_usage(arguments: list[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert caught.value.code == 2


def meaning(nodes: tuple[ManifestNode, ...]) -> object:
    return {
        (
            node.interface.executable,
            node.interface.plugin,
            node.interface.name,
            node.interface.namespace or "/",
        ): (
            frozenset((e.kind, e.name, e.type) for e in node.interface.endpoints),
            dict(node.parameter_types),
        )
        for node in nodes
    }


words = st.from_regex(r"[a-z][a-z0-9_]{0,5}[a-z0-9]", fullmatch=True)
names = st.builds(lambda head, tail: head + tail, st.sampled_from(["", "/", "~/"]), words)
kinds = st.sampled_from([("topic", r) for r in ("publisher", "subscription", "both")]
                        + [(k, r) for k in ("service", "action") for r in ("server", "client", "both")])  # fmt: skip
middles = {"topic": "msg", "service": "srv", "action": "action"}


@settings(max_examples=50, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    words,
    words,
    st.dictionaries(names, kinds, min_size=1, max_size=5),
    st.dictionaries(words, st.just("int")),
)
def test_law_v1_to_v2_to_v1_keeps_the_meaning(
    node: str, executable: str, found: dict[str, tuple[str, str]], parameters: dict[str, str]
) -> None:
    body = "".join(
        f'<{kind} name="{name}" type="pkg/{middles[kind]}/Type" role="{role}"/>'
        for name, (kind, role) in found.items()
    )
    body += "".join(f'<parameter name="{name}" type="{kind}"/>' for name, kind in parameters.items())
    text = f'<interface version="1"><node name="{node}" executable="{executable}">{body}</node></interface>'
    (before,) = parse_v1(text.encode(), "a.nodl.xml")
    between = parse_v2(v2_yaml(before).text.encode(), "a.nodl.yaml", package=None, name=executable)
    assert meaning((between,)) == meaning((before,))
    assert meaning(parse_v1(v1_xml([between]).text.encode(), "b.nodl.xml")) == meaning((before,))
