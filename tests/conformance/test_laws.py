"""Laws over generated launch files: XML and YAML twins evaluate alike, any text survives."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from enclave_launch.description.markup.parse_substitution import parse_substitution
from enclave_launch.evaluation.evaluate import EvaluationError, evaluate
from enclave_launch.frontend.error_location import likeliest
from enclave_launch.host.plan_host import PlanHost

Action = tuple[str, Mapping[str, Any], list[Any]]  # tag, attributes, child actions

names = st.sampled_from(["a", "b", "c"])
words = st.text(alphabet="ab /\\'\"$(). -_é\n", max_size=8)
templates = st.one_of(
    words,
    names.map("$(var {} none)".format),
    st.tuples(names, names).map("$(var {0[0]} $(var {0[1]} deep))x".format),
    st.just("$(eval '1 + 1')"),
    st.just("$(env HOME_OF_NOBODY '')"),
    st.sampled_from(["true", "false", "1", "/abs", "rel/x"]),
)
conditions = st.sampled_from([{}, {}, {"if": "true"}, {"if": "$(var a 0)"}, {"unless": "1"}])


def action(tag: str, **attributes: st.SearchStrategy[Any]) -> st.SearchStrategy[Action]:
    return st.tuples(
        st.just(tag),
        st.tuples(st.fixed_dictionaries(attributes), conditions).map(lambda pair: {**pair[0], **pair[1]}),
        st.just([]),
    )


leaves = st.one_of(
    action("let", name=names, value=templates),
    action("arg", name=names, default=templates),
    action("set_env", name=names.map(str.upper), value=templates.filter(lambda text: "\0" not in text)),
    action("append_env", name=names.map(str.upper), value=templates),
    action("unset_env", name=names.map(str.upper)),
    action("executable", cmd=templates),
    action("node", exec=st.just("/bin/e"), name=names, namespace=templates, args=templates),
    action(
        "node",
        exec=st.just("/bin/e"),
        remap=st.lists(st.fixed_dictionaries({"from": names, "to": templates})),
    ),
    action("push_ros_namespace", namespace=templates),
    action("push_ros_namespace", namespace=names, enclave=templates),
    action("push_ros_enclave", enclave=templates),
    action("set_remap", **{"from": names, "to": templates}),
    action("set_parameter", name=names, value=templates),
    action("log", message=templates),
)
trees = st.recursive(
    st.lists(leaves, min_size=1, max_size=5),
    lambda below: st.lists(
        st.one_of(leaves, st.tuples(st.just("group"), st.just({}), below)), min_size=1, max_size=5
    ),
    max_leaves=12,
)


def as_xml(actions: list[Action]) -> str:
    return "".join(_element(*item) for item in actions)


def _element(tag: str, attributes: Mapping[str, Any], children: list[Action]) -> str:
    plain = {name: value for name, value in attributes.items() if isinstance(value, str)}
    nested = "".join(
        _element(name, child, [])
        for name, value in attributes.items()
        if isinstance(value, list)
        for child in value
    )
    text = "".join(f" {name}={quoteattr(value)}" for name, value in plain.items())
    return f"<{tag}{text}>{nested}{as_xml(children)}</{tag}>\n"


def as_yaml(actions: list[Action]) -> list[dict[str, Any]]:
    """JSON is YAML."""
    return [{tag: _mapping(attributes, children)} for tag, attributes, children in actions]


def _mapping(attributes: Mapping[str, Any], children: list[Action]) -> dict[str, Any]:
    mapping = {name: value for name, value in attributes.items() if value != []}
    return {**mapping, "children": as_yaml(children)} if children else mapping


def outcome(file: Path, text: str) -> tuple[list[object], type[BaseException] | None]:
    """What would be launched, and the type of the error that ended it."""
    file.write_text(text, encoding="utf-8")
    host = PlanHost()
    try:
        result = evaluate(file, host=host)
    except EvaluationError as error:
        result = error.partial
        assert error.cause is not None
        failure = likeliest(error.cause)
        return [_shown(item) for item in result.processes], type(failure)
    return [_shown(item) for item in result.processes], None


def _shown(process: Any) -> object:
    rules = [(rule.source, rule.target) for rule in process.remaps]
    return process.cmd, process.fqn, rules, dict(process.environment), process.enclave, process.parameters


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(actions=trees)
def test_xml_and_yaml_twins_evaluate_alike(actions: list[Action], tmp_path: Path) -> None:
    xml = outcome(tmp_path / "twin.launch.xml", f"<launch>{as_xml(actions)}</launch>")
    yaml = outcome(tmp_path / "twin.launch.yaml", json.dumps({"launch": as_yaml(actions)}))
    assert xml == yaml


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(actions=trees)
def test_a_scope_restores_what_it_found(actions: list[Action], tmp_path: Path) -> None:
    """After a group nothing that it set is left, so the node after it is the node without it.

    Remaps and parameters are let out by launch when their list was there before; here it is not.
    """
    after = '<node exec="/bin/e" name="$(var a x)" args="$(env A -)"/>'
    alone, _ = outcome(tmp_path / "one.launch.xml", f"<launch>{after}</launch>")
    grouped = f"<launch><group>{as_xml(actions)}</group>{after}</launch>"
    processes, failure = outcome(tmp_path / "two.launch.xml", grouped)
    assert failure is not None or processes[-1] == alone[0]


@settings(max_examples=300, deadline=None)
@given(st.text(max_size=30) | st.text(alphabet="$()'\" \\ab", max_size=30))
def test_any_text_is_parsed_or_refused(text: str) -> None:
    try:
        substitutions = parse_substitution(text)
    except ValueError as error:  # what the grammar raises; anything else is a crash
        assert type(error).__name__ in ("UnexpectedCharacters", "UnexpectedEOF", "VisitError")
    else:
        assert substitutions


@pytest.mark.parametrize("text", ["a", "é", "$", "$x", "a$b", "1 2", "'", '"', "(", ")"])
def test_text_without_substitutions_is_itself(text: str) -> None:
    assert "".join(part.text for part in parse_substitution(text)) == text  # type: ignore[attr-defined]


def test_evaluation_leaves_no_trace(tmp_path: Path) -> None:
    import sys

    before, modules = dict(os.environ), {name for name in sys.modules if name.startswith("launch")}
    outcome(
        tmp_path / "x.launch.xml", '<launch><set_env name="TRACE" value="1"/><executable cmd="a"/></launch>'
    )
    assert dict(os.environ) == before
    assert {name for name in sys.modules if name.startswith("launch")} == modules
