"""The values that a node ends up with, and the files that launch writes for it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from enclave_launch.description.parameters import yaml_text
from enclave_launch.process import Evaluation
from enclave_launch.ros_rules.rcl_parameters import resolve_parameters
from nodl.ros_arguments import ParameterFileArgument, ParameterRule, parse_ros_arguments

Evaluate = Callable[..., Evaluation]


def resolved(tmp_path: Path, line: str, fqn: str = "/ns/n", **files: str) -> dict[str, Any]:
    """Merge ``line`` for the node ``fqn``; ``files``: ``a="..."`` is the text of ``a.yaml``."""
    for name, text in files.items():
        (tmp_path / f"{name}.yaml").write_text(text)
    words = ["--ros-args", *(str(tmp_path / w) if w.endswith(".yaml") else w for w in line.split())]
    tokens = [None if token == "?" else token for token in fqn.split("/") if token]
    return resolve_parameters(tokens, parse_ros_arguments(words).parameters).values


EVERY = "/**: {ros__parameters: {%s}}"
OWN = "/ns/n: {ros__parameters: {%s}}"


def test_later_files_win(tmp_path: Path) -> None:
    line = "--params-file a.yaml --params-file b.yaml"
    assert resolved(tmp_path, line, a=EVERY % "x: 1, y: 1", b=EVERY % "x: 2") == {"x": 2, "y": 1}


def test_rules_and_files_in_command_line_order(tmp_path: Path) -> None:
    assert resolved(tmp_path, "-p x:=1 --params-file a.yaml", a=EVERY % "x: 2") == {"x": 2}
    assert resolved(tmp_path, "--params-file a.yaml -p x:=1", a=EVERY % "x: 2") == {"x": 1}


def test_sections_apply_in_the_order_in_which_they_first_appear(tmp_path: Path) -> None:
    files = {"a": OWN % "x: 1", "b": EVERY % "x: 2", "c": OWN % "x: 3"}
    line = "--params-file a.yaml --params-file b.yaml --params-file c.yaml"
    assert resolved(tmp_path, line, **files) == {"x": 2}


def test_another_type_in_the_same_section_does_not_override(tmp_path: Path) -> None:
    assert resolved(tmp_path, "-p a:=1 -p a:=x") == {"a": 1}
    assert resolved(tmp_path, "-p a:=x -p a:=1") == {"a": 1}
    assert resolved(tmp_path, "-p a:=1.5 -p a:=true") == {"a": True}


@pytest.mark.parametrize(
    ("section", "applies"),
    [
        ("/**", True), ("/ns/n", True), ("ns/n", True), ("/*/n", True), ("/**/n", True), ("/ns/*", True),
        ("/ns/**", True), ("/ns/n/**", True), ("/n", False), ("n", False), ("/*", False), ("/other/n", False),
        ("/ns", False), ("/ns/n/m", False), ("/*/*/n", False),
    ],
)  # fmt: skip
def test_section_names(tmp_path: Path, section: str, applies: bool) -> None:
    found = resolved(tmp_path, "--params-file a.yaml", a=f"{section}: {{ros__parameters: {{x: 1}}}}")
    assert found == ({"x": 1} if applies else {})


def test_nested_sections_and_parameters(tmp_path: Path) -> None:
    text = "ns:\n  n:\n    ros__parameters:\n      a: {b: {c: 1}}\n      l: [1, 2]\n"
    assert resolved(tmp_path, "--params-file a.yaml", a=text) == {"a.b.c": 1, "l": (1, 2)}


def test_only_wildcards_match_a_name_that_nobody_knows(tmp_path: Path) -> None:
    text = f"{OWN % 'x: 1'}\n{EVERY % 'y: 1'}\n/ns/*: {{ros__parameters: {{z: 1}}}}"
    assert resolved(tmp_path, "--params-file a.yaml", "/ns/?", a=text) == {"y": 1, "z": 1}


def test_a_rule_for_a_node(tmp_path: Path) -> None:
    assert resolved(tmp_path, "-p n:x:=1 -p y:=2", "/n") == {"x": 1, "y": 2}
    assert resolved(tmp_path, "-p n:x:=1", "/ns/n") == {}


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1", 1), ("-5", -5), ("0x10", 16), ("010", 8), ("08", 8.0), ("1.5", 1.5), ("1e3", 1000.0), (".5", 0.5),
        ("5.", 5.0), ("true", True), ("y", True), ("Off", False), ("abc", "abc"), ("'1'", "1"), ('"true"', "true"),
        ("null", "null"), ("~", "~"), ("[1, 2]", (1, 2)), ("[a, 'b']", ("a", "b")), ("(1, 2)", "(1, 2)"),
        ("-.inf", float("-inf")), ("99999999999999999999", 1e20), ("1:30", "1:30"), ("2020-01-01", "2020-01-01"),
        ("1_000", "1_000"),
    ],
)  # fmt: skip
def test_scalars_by_rcls_rules(text: str, value: object) -> None:
    found = resolve_parameters(["n"], [ParameterRule("p", text)]).values["p"]
    assert (found, type(found)) == (value, type(value))


@pytest.mark.parametrize("text", ["", "{a: 1}", "[", "a: b", "*a", "[1, x]", "-", "---"])
def test_a_rule_that_rcl_refuses_is_never_nothing(text: str) -> None:
    found = resolve_parameters(["n"], [ParameterRule("p", text), ParameterRule("q", "1")])
    ((what, why),) = found.unread
    assert (found.values, what) == ({"q": 1}, f"-p p:={text}")
    assert why


def test_a_rule_that_is_a_comment_gives_no_value() -> None:
    assert resolve_parameters(["n"], [ParameterRule("p", "# nothing")]) == ({}, ())


# What rcl_parse_yaml_file (jazzy) says of each, with what is left of the message of a refusal in our words.
FILES: dict[str, object] = {
    "": {},
    "# a comment": {},
    "just text": {},
    "/**: {}": {},
    "/**: {ros__parameters: {}}": {},
    "/n: {ros__parameters: {a: 1}}\n---\n/n: {ros__parameters: {b: 2}}": {"a": 1, "b": 2},
    "/n: {ros__parameters: {a: 1, a: x}}": {"a": 1},
    "/n: {ros__parameters: {a: &x 1}}": {"a": 1},
    "/n: {ros__parameters: {a: !!str 1, b: !!int x}}": {"a": "1", "b": "x"},
    "/n:\n  ros__parameters:\n    a: >-\n      1": {"a": 1},
    "/n: {ros__parameters: {a: 1e999, b: 1e-999, c: 0e9}}": {"a": "1e999", "b": "1e-999", "c": 0.0},
    f"/n: {{ros__parameters: {{a: {'9' * 5000}}}}}": {"a": "9" * 5000},
    "/n: {ros__parameters: {a: [{b: 1}]}}": {"a.b": (1,)},
    "/n: {ros__parameters: {a: [1, {b: 2}]}}": {"a.b": (1, 2)},
    "/n: {ros__parameters: {a: {b: 1}, a.b: 2}}": {"a.b": 2},
    "/n: {ros__parameters: {a: 1}}\nb: {}": {"a": 1},
    "/n: {ros__parameters: {a: [], b: [[]], c: [[1]], d: [1, []]}}": {
        "a": (),
        "b": (),
        "c": (1,),
        "d": (1,),
    },
    "- 1": "a list cannot be a key",
    "---": "a key is empty",
    "a: 1": "a value stands before ros__parameters",
    "/**:": "a value stands before ros__parameters",
    "/**: {ros__parameters: 3}": "a value stands before ros__parameters",
    "/n: {ros__parameters: {a: 1}}\nb: {c: 2}": "a value stands before ros__parameters",
    "a: [1]": "a value stands before ros__parameters",
    "ros__parameters: {a: 1}": "no node is named before ros__parameters",
    "/n: {ros__parameters: {a: }}": "a parameter has no value",
    "/n: {ros__parameters: {a: [1, x]}}": "the items of a list must be of one type",
    "/n: {ros__parameters: {a: [1, 2.0]}}": "the items of a list must be of one type",
    "/n: {ros__parameters: {a: [1, {b: x}]}}": "the items of a list must be of one type",
    "/n: {ros__parameters: {a: &x 1, b: *x}}": "rcl does not take aliases",
    '/n: {ros__parameters: {"": 1}}': "a key is empty",
    "/n: {ros__parameters: {? [a] : 1}}": "a list cannot be a key",
    "? [a]\n: {ros__parameters: {a: 1}}": "a list cannot be a key",
    "/n: {ros__parameters: {a: 1}, m: {ros__parameters: {b: 1}}}": "a parameter or a node name is expected",
    "a b: {ros__parameters: {x: 1}}": "names no node",
    "1n: {ros__parameters: {x: 1}}": "names no node",
    "/: {ros__parameters: {x: 1}}": "names no node",
    "//n: {ros__parameters: {x: 1}}": "names no node",
    "/n*: {ros__parameters: {x: 1}}": "names no node",
    "/a-b/n: {ros__parameters: {x: 1}}": "names no node",
}


@pytest.mark.parametrize("text", FILES, ids=lambda text: text[:60])
def test_a_file_is_read_or_refused_as_by_rcl(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.yaml").write_text(text)
    found = resolve_parameters(["n"], [ParameterFileArgument("a.yaml")], directory=str(tmp_path))
    if isinstance(FILES[text], dict):
        assert found == (FILES[text], ())
    else:
        ((_, why),) = found.unread
        assert str(FILES[text]) in why and why.startswith("line ")


@pytest.mark.parametrize("depth", [200, 100_000])
def test_a_file_that_is_nested_without_end_is_refused(tmp_path: Path, depth: int) -> None:
    (tmp_path / "a.yaml").write_text("/n: {ros__parameters: {" + "a: {" * depth + "b: 1" + "}" * depth + "}}")
    found = resolve_parameters(["n"], [ParameterFileArgument("a.yaml")], directory=str(tmp_path))
    assert len(found.values) == (depth < 250)
    assert ["nested" in why for _, why in found.unread] == [True] * (depth > 250)


@pytest.mark.parametrize("text", ["a: [", "\x00", None])
def test_a_file_that_cannot_be_read_is_never_nothing(tmp_path: Path, text: str | None) -> None:
    if text is not None:
        (tmp_path / "a.yaml").write_text(text)
    found = resolve_parameters(
        ["n"], [ParameterRule("p", "1"), ParameterFileArgument("a.yaml")], directory=str(tmp_path)
    )
    assert found.values == {"p": 1}
    ((path, why),) = found.unread
    assert path == str(tmp_path / "a.yaml") and why


def test_a_relative_file_is_read_where_the_process_runs(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text("/**: {ros__parameters: {x: 3}}")
    assert resolve_parameters(["n"], [ParameterFileArgument("a.yaml")], directory=str(tmp_path)).values == {
        "x": 3
    }


def test_a_file_that_changes_is_read_again(tmp_path: Path) -> None:
    assert resolved(tmp_path, "--params-file a.yaml", a=EVERY % "x: 1") == {"x": 1}
    assert resolved(tmp_path, "--params-file a.yaml", a=EVERY % "x: 12") == {"x": 12}


def test_of_a_launched_node(launched: Evaluate, tmp_path: Path) -> None:
    (tmp_path / "f.yaml").write_text(EVERY % "use_sim_time: false, rate: 10")
    text = """
    <set_parameter name="use_sim_time" value="true"/><set_parameter name="l" value="[1, 2]"/>
    <node pkg="pk" exec="e" name="n" namespace="ns" ros_args="-p late:=1 -p rate:=1">
      <param from="$(dirname)/f.yaml"/><param name="s" value="1e3"/><param name="t" value="'1'"/>
      <param name="deep"><param name="x" value="2.5"/></param>
    </node>"""
    (process,) = launched(text, distro="jazzy").processes
    assert process.parameters == {
        "late": 1, "rate": 10, "use_sim_time": False, "l": "(1, 2)", "s": 1000.0, "t": "1", "deep.x": 2.5,
    }  # fmt: skip
    assert [yaml.safe_load(text)["/ns/n"]["ros__parameters"] for text in process.parameter_files.values()] == [
        {"s": "1e3"}, {"t": "1"}, {"deep.x": 2.5},
    ]  # fmt: skip
    assert set(process.parameter_files) <= set(process.cmd)


@pytest.mark.parametrize(
    ("texts", "read"),
    [
        ("x, z", ("x", "z")),
        ("x, y", None),
        ("y, n", (True, False)),
        ("1e3, a", None),
    ],
)
def test_a_list_of_texts_of_which_rcl_reads_some_as_another_type_is_not_known(
    texts: str, read: tuple[object, ...] | None, launched: Evaluate
) -> None:
    """PyYAML writes ``y`` and ``1e3`` without quotes; rcl reads a truth and a number, and refuses a mixed list."""
    text = f'<node pkg="pk" exec="e"><param name="p" value="{texts}" value-sep=", "/></node>'
    (process,) = launched(text, distro="jazzy").processes
    assert process.parameters.get("p") == read
    assert [why for _, why in process.unread_parameter_files] == (
        [] if read else ["line 5: the items of a list must be of one type"]
    )


def test_files_are_written_by_the_host_only(launched: Evaluate) -> None:
    (process,) = launched('<node pkg="pk" exec="e"><param name="a" value="1"/></node>').processes
    assert process.cmd[-2:] == ("--params-file", "<params:1>")
    assert process.parameter_files == {"<params:1>": "/**:\n  ros__parameters:\n    a: 1\n"}


scalars = st.one_of(st.booleans(), st.integers(), st.floats(allow_nan=False), st.text(max_size=12))
values = st.one_of(
    scalars, st.lists(st.integers(), min_size=1).map(tuple), st.lists(st.text(max_size=5)).map(tuple)
)


@given(
    st.dictionaries(st.text(max_size=8), values, max_size=4), st.sampled_from(["/**", "/n", "/a/b_c", "/1"])
)
def test_a_written_file_is_what_pyyaml_writes(parameters: dict[str, Any], section: str) -> None:
    expected = yaml.dump({section: {"ros__parameters": parameters}}, default_flow_style=False)
    assert yaml_text.parameter_file(section, parameters) == expected


def test_an_error_in_a_file_with_substitutions_names_that_file(launched: Evaluate, tmp_path: Path) -> None:
    (tmp_path / "f.yaml").write_text(EVERY % "topic: $(var t x), gains: [1, 2.0]")
    (process,) = launched(
        '<node pkg="pk" exec="e" name="n"><param from="$(dirname)/f.yaml" allow_substs="true"/></node>'
    ).processes
    assert [path for path, _ in process.unread_parameter_files] == [str(tmp_path / "f.yaml")]
