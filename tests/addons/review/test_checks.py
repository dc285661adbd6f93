"""Each check with an example that triggers it and the neighbour that does not."""

from __future__ import annotations

import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest

from enclave_addons.review.checks import RULES, check_plan
from enclave_addons.review.checks.rules import finding
from enclave_addons.review.verb.judging import Expectations, expectations, rule_findings
from enclave_launch import DryRun, UsageError
from enclave_launch.dry_run import Diagnostic
from tests.addons.review.conftest import ROBOT, Asked, document, process


def two(one: Asked, other: Asked) -> dict[str, Any]:
    return document({"/one": {"/n1": one}, "/two": {"/n2": other}})


def checks(checked: dict[str, Any]) -> list[Diagnostic]:
    return check_plan(DryRun(**checked))


def codes(checked: dict[str, Any]) -> set[str]:
    found = {told.code for told in checks(checked)}
    assert found <= RULES.keys()
    return found


@pytest.mark.parametrize(
    ("code", "triggers", "does_not"),
    [
        ("no-publisher", ({"subscribe": ["/x"]}, {}), ({"subscribe": ["/x"]}, {"publish": ["/x"]})),
        (
            "no-publisher",
            ({"subscribe": ["/x"]}, {"publish": ["/a/*"]}),
            ({"subscribe": ["/a/x"]}, {"publish": ["/a/*"]}),
        ),
        ("no-subscriber", ({"publish": ["/x"]}, {}), ({"publish": ["/x"]}, {"subscribe": ["/x"]})),
        (
            "no-server",
            ({"call_services": ["/x"]}, {}),
            ({"call_services": ["/x"]}, {"serve_services": ["/x"]}),
        ),
        ("no-server", ({"call_actions": ["/x"]}, {}), ({"call_actions": ["/x"]}, {"serve_actions": ["/x"]})),
        (
            "nearly-the-same-name",
            ({"publish": ["/robot/cmd_vel"]}, {"subscribe": ["/robotcmd_vel"]}),
            ({"publish": ["/robot/cmd_vel"]}, {"subscribe": ["/robot/odometry"]}),
        ),
        (
            "nearly-the-same-name",
            ({"publish": ["/cmd_vel_nav"]}, {"subscribe": ["/cmd_vel_nv"]}),
            ({"publish": ["/robot1/cmd_vel"]}, {"subscribe": ["/robot2/cmd_vel"]}),
        ),
        (
            "nearly-the-same-name",
            ({"publish": ["/camera/image"]}, {"subscribe": ["/image"]}),
            ({"publish": ["/camera/image"]}, {"subscribe": ["/left/image"]}),
        ),
        (
            "nearly-the-same-name",
            ({"serve_services": ["/reset"]}, {"call_services": ["/robot/reset"]}),
            ({"serve_services": ["/reset"], "call_services": ["/robot/reset"]}, {}),
        ),
        (
            "nearly-the-same-name",
            ({"publish": ["/lora/rxt"]}, {"subscribe": ["/lora/txt"]}),
            ({"publish": ["/lora/rx"]}, {"subscribe": ["/lora/tx"]}),
        ),
        (
            "types-differ",
            ({"publish": ["/x std_msgs/msg/String"]}, {"subscribe": ["/x std_msgs/msg/Int32"]}),
            ({"publish": ["/x std_msgs/msg/String"]}, {"subscribe": ["/x std_msgs/msg/String"]}),
        ),
        ("wildcard", ({"publish": ["/x*"]}, {}), ({"publish": ["/x"]}, {})),
    ],
)
def test_a_check_finds_what_it_is_for_and_not_its_neighbour(
    code: str, triggers: tuple[Asked, Asked], does_not: tuple[Asked, Asked]
) -> None:
    assert code in codes(two(*triggers))
    assert code not in codes(two(*does_not))


def test_several_types_at_one_place_are_alternatives() -> None:
    string, number = "std_msgs/msg/String", "std_msgs/msg/Int32"
    published = [(string, "logger.py:8"), (number, "logger.py:8")]
    assert "types-differ" not in codes(_of_types([*published, (string, "driver.py:3")]))
    assert "types-differ" in codes(_of_types([*published, ("std_msgs/msg/Bool", "driver.py:3")]))
    assert "types-differ" in codes(_of_types([(string, "logger.py:8"), (number, "logger.py:9")]))


def _of_types(given: list[tuple[str, str]]) -> dict[str, Any]:
    """One node that publishes ``/x`` with these types at these places."""
    checked = document({"/a": {"/n": {"publish": [f"/x {kind}" for kind, _ in given]}}})
    interfaces = [each for each in checked["nodes"][0]["interfaces"] if not each["built_in"]]
    for interface, (_, place) in zip(interfaces, given, strict=True):
        interface["place"] = place
    return checked


def test_a_node_name_that_two_nodes_have() -> None:
    assert "node-name-twice" in codes(document({"/a": {"/n": {}}, "/b": {"/n": {}}}))
    assert "node-name-twice" not in codes(document({"/a": {"/n": {}}, "/b": {"/m": {}}}))


def test_an_enclave_whose_nodes_gain_by_sharing() -> None:
    assert "enclave-shared" in codes(document({"/a": {"/n": {"publish": ["/x"]}, "/m": {}}}))
    assert "enclave-shared" not in codes(document({"/a": {"/n": {"publish": ["/x"]}}, "/b": {"/m": {}}}))


def test_a_permission_that_no_node_asks_for() -> None:
    checked = document({"/a": {"/n": {"publish": ["/x"]}}})
    assert "permission-unasked" not in codes(checked)
    checked["enclaves"]["/a"]["publish"].append("/of_policy")
    (told,) = [told for told in checks(checked) if told.code == "permission-unasked"]
    assert told.text == "enclave /a may publish /of_policy, and none of its nodes requests that"
    checked["enclaves"]["/a"]["permissions_unknown"] = ["/helper"]
    assert "permission-unasked" not in codes(checked), "the policy speaks for a program that nobody describes"


def told(code: str, subject: str, text: str = "") -> dict[str, Any]:
    return {
        "severity": "error",
        "code": code,
        "subject": subject,
        "file": None,
        "line": 0,
        "text": text,
        "remedy": "",
    }


def test_missing_ends_are_one_finding_where_not_all_is_known() -> None:
    checked = two({"subscribe": ["/x"], "publish": ["/y"]}, {})
    assert {"no-publisher", "no-subscriber"} <= codes(checked)
    checked["diagnostics"] = [told("no-manifest", "demo/driver")]
    (found,) = [each for each in checks(checked) if each.code in RULES]
    assert found.code == "ends-not-judged"
    assert found.text == "/x, /y have one end only among what is known, but not all is known of demo/driver"
    for of_an_executable in ("executable-without-enclave", "enclave-ungranted"):
        checked["diagnostics"] = [told(of_an_executable, "gazebo-1")]
        assert {each.code for each in checks(checked) if each.code in RULES} == {"ends-not-judged"}
    checked["diagnostics"] = [told("pattern-accepted", "/n")]
    assert "no-publisher" in {each.code for each in checks(checked)}, "no gap: the name is a known pattern"


@pytest.mark.parametrize(
    ("types", "found"),
    [(("A", "A"), True), (("A", ""), True), (("", ""), True), (("A", "B"), False)],
)
def test_names_that_differ_by_a_namespace_may_be_one_only_if_their_types_are(
    types: tuple[str, str], found: bool
) -> None:
    checked = two({"publish": ["/camera/image"]}, {"subscribe": ["/image"]})
    for node, written in zip(checked["nodes"], types, strict=True):
        for each in node["interfaces"]:
            each["type"] = written
    assert ("nearly-the-same-name" in codes(checked)) is found


def test_a_wildcard_that_planning_told_of_is_not_told_again() -> None:
    checked = document({"/a": {"/n": {"publish": ["/x*", "/y*"]}}})
    checked["diagnostics"] = [told("pattern-accepted", "/n", "node /n may publish /x*: a pattern")]
    assert [each.subject for each in checks(checked) if each.code == "wildcard"] == ["/y*"]


def test_an_enclave_is_shared_by_processes_not_by_the_nodes_in_one() -> None:
    checked = document({"/a": {"/n": {"publish": ["/x"]}, "/helper_of_n": {"subscribe": ["/tf"]}}})
    checked["processes"] = [process(fqn="/n")]
    assert "enclave-shared" not in codes(checked)
    checked["processes"] = [process(fqn="/n"), process(fqn="/helper_of_n")]
    assert "enclave-shared" in codes(checked)


@pytest.mark.parametrize(
    ("code", "triggers", "does_not"),
    [
        (
            "security-variable-set",
            {"environment": {"ROS_SECURITY_ENABLE": "false"}},
            {"environment": {"ROS_HOME": "/x"}},
        ),
        (
            "secret-in-parameters",
            {"parameters": {"mqtt.password": "x"}},
            {"parameters": {"mqtt.password": ""}},
        ),
        ("secret-in-parameters", {"parameters": {"api_key": "x"}}, {"parameters": {"keyboard": "x"}}),
    ],
)
def test_what_a_process_is_given(code: str, triggers: dict[str, Any], does_not: dict[str, Any]) -> None:
    found = checks({**document({}), "processes": [process(**triggers)]})
    assert [(told.code, told.file, told.line) for told in found] == [(code, "f.launch.xml", 3)]
    assert checks({**document({}), "processes": [process(**does_not)]}) == []


def expected(content: Any) -> Expectations:
    with TemporaryDirectory() as folder:
        file = Path(folder, "r.yaml")
        file.write_text(json.dumps(content))
        return expectations(file)


def rules(**entry: str) -> Any:
    return expected({"never": [{key.rstrip("_"): value for key, value in entry.items()}]}).never


@pytest.mark.parametrize("target", ["/base", "/drive", "/ba*"])
def test_a_forbidden_flow_is_an_error_that_shows_the_way(target: str) -> None:
    (told,) = rule_findings(
        DryRun(**document(ROBOT)), rules(from_="/camera", to=target, why="vendor's binary")
    )
    assert (told.severity, told.code) == ("error", "flow-forbidden")
    assert told.text == (
        f"/camera must never reach {target} (vendor's binary): "
        "/camera -> /planner by topic /image; /planner -> /base by action /drive"
    )


def test_what_may_be_sent_on_a_forbidden_name_is_an_error_though_nobody_here_receives_it() -> None:
    """The receiver may be in another launch."""
    planner = {"subscribe": ["/image"], "publish": ["/joints", "/speed"]}
    enclaves = {
        "/camera": {"/camera": {"publish": ["/image"]}},
        "/planner": {"/planner": planner},
        "/base": {"/base": {"subscribe": ["/speed"]}},
    }

    def told(**entry: str) -> list[str]:
        return [each.text for each in rule_findings(DryRun(**document(enclaves)), rules(**entry))]

    assert told(from_="/camera", to="/joints") == [
        "/camera must never reach /joints: /camera -> /planner by topic /image; "
        "/planner may send on topic /joints, whoever receives it"
    ]
    assert told(from_="/planner", to="/join*") == [
        "/planner must never reach /join*: /planner may send on topic /joints, whoever receives it"
    ]
    assert told(from_="/base", to="/joints") == []
    assert told(from_="/base", to="/*joints") == []


def test_a_flow_that_does_not_exist_is_not_told() -> None:
    assert rule_findings(DryRun(**document(ROBOT)), rules(from_="/logger", to="/base")) == []


def test_a_rule_that_names_nothing_is_told_since_it_protects_nothing() -> None:
    for entry in ({"from_": "/camra", "to": "/base"}, {"from_": "/camera", "to": "/bas"}):
        (told,) = rule_findings(DryRun(**document(ROBOT)), rules(**entry))
        assert (told.severity, told.code) == ("warning", "rule-idle")


def test_an_accepted_finding_is_the_one_that_was_named() -> None:
    accept = expected({"accept": [{"code": "wildcard", "subject": "/x*", "why": "driver"}]})
    assert accept.reason_to_accept(finding("wildcard", "/x*", "")) == "driver"
    assert accept.reason_to_accept(finding("wildcard", "/y*", "")) is None
    assert accept.reason_to_accept(finding("no-server", "/x*", "")) is None


@pytest.mark.parametrize(
    "content",
    [
        [],
        {"nevr": []},
        {"never": "x"},
        {"never": [{"from": "/a"}]},
        {"never": [{"from": "/a", "to": 3}]},
        {"accept": [{"code": "wildcard"}]},
        {"accept": [{"code": "wildcard", "why": "x", "until": "y"}]},
    ],
)
def test_rules_that_are_not_understood_are_wrong_usage(content: Any) -> None:
    with pytest.raises(UsageError, match=r"r\.yaml:"):
        expected(content)
