"""Processes on Zenoh: planned, told what is different there, and refused where nothing could ever arrive."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from enclave_launch import LaunchPlan, provision
from enclave_launch.diagnostics import Code
from enclave_launch.report.explained import explained
from enclave_launch.security_environment import SecuritySettings, secured_environment

Plan = Callable[..., LaunchPlan]
ZENOH = '<env name="RMW_IMPLEMENTATION" value="rmw_zenoh_cpp"/>'
TALKER = '<node pkg="demo_nodes" exec="talker" name="talker" enclave="/talker">{}</node>'
LISTENER = '<node pkg="demo_nodes" exec="listener" name="listener" enclave="/listener">{}</node>'
SETTINGS = SecuritySettings("/ks")


def told(plan: LaunchPlan, code: Code) -> list[str]:
    return [str(one) for one in (*plan.problems, *plan.warnings) if one.code is code]


def variables(plan: LaunchPlan, number: int = 0) -> dict[str, str]:
    return dict(secured_environment(plan.processes[number], SETTINGS))


def test_a_process_on_zenoh_gets_its_enclaves_session_and_nothing_that_overrides_it(plan: Plan) -> None:
    found = plan(TALKER.format(ZENOH) + LISTENER.format(""))
    assert not found.problems
    given = variables(found)
    assert given["ZENOH_SESSION_CONFIG_URI"] == "/ks/enclaves/talker/zenoh.json5"
    for name in ("ZENOH_CONFIG_OVERRIDE", "ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_STATIC_PEERS"):
        assert given[name] == ""
    assert given["ROS_SECURITY_ENABLE"] == "true"  # rcl ends it without its enclave
    assert not [name for name in variables(found, 1) if "ZENOH" in name or "PEERS" in name]


@pytest.mark.parametrize("name", ["ZENOH_SESSION_CONFIG_URI", "ZENOH_CONFIG_OVERRIDE", "ROS_STATIC_PEERS"])
def test_what_would_lead_past_the_session_is_told_to_have_no_effect(name: str, plan: Plan) -> None:
    found = plan(TALKER.format(ZENOH + f'<env name="{name}" value="x"/>'))
    (text,) = told(found, Code.VARIABLE_OVERRIDDEN)
    assert f"{name}=x" in text and variables(found)[name] != "x"


def test_the_middleware_of_the_launchers_environment_counts(
    plan: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_zenoh_cpp")
    assert "ZENOH_SESSION_CONFIG_URI" in variables(plan(TALKER.format("")))


def test_an_executable_without_an_enclave_is_led_nowhere(plan: Plan) -> None:
    found = plan(f'<executable cmd="true">{ZENOH}</executable>')
    assert variables(found)["ZENOH_SESSION_CONFIG_URI"].startswith("/dev/null/")


def test_what_is_different_on_zenoh_is_told_once_and_only_there(plan: Plan) -> None:
    (text,) = told(plan(TALKER.format(ZENOH) + LISTENER.format(ZENOH)), Code.ZENOH_ROUTER_TRUSTED)
    assert (
        "talker-1, listener-2 on Zenoh: encryption ends at the router" in text
        and "types are enforced" in text
    )
    assert not told(plan(TALKER.format("")), Code.ZENOH_ROUTER_TRUSTED)


def test_two_ends_that_never_meet_are_told(plan: Plan) -> None:
    (text,) = told(plan(TALKER.format(ZENOH) + LISTENER.format("")), Code.MIDDLEWARES_APART)
    assert "topic /chatter: /listener is on DDS and /talker on Zenoh" in text
    assert not told(plan(TALKER.format(ZENOH) + LISTENER.format(ZENOH)), Code.MIDDLEWARES_APART)
    other = '<env name="ROS_DOMAIN_ID" value="9"/>'
    assert not told(plan(TALKER.format(ZENOH + other) + LISTENER.format("")), Code.MIDDLEWARES_APART)


def test_an_enclave_with_processes_on_both_is_told(plan: Plan) -> None:
    shared = LISTENER.replace("/listener", "/talker")
    texts = told(plan(TALKER.format(ZENOH) + shared.format("")), Code.MIDDLEWARES_APART)
    assert any("enclave /talker has processes on DDS and on Zenoh" in text for text in texts)


CONTAINER = (
    '<node_container pkg="demo_nodes" exec="component_container" name="box" namespace="">{}'
    '<composable_node pkg="demo_nodes" plugin="demo_nodes::Talker" name="talker"/></node_container>'
)


def test_a_launcher_that_cannot_reach_its_container_is_refused(
    plan: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    (problem,) = plan(CONTAINER.format(ZENOH)).problems
    assert problem.code is Code.MIDDLEWARES_APART and "/box/_container/load_node" in problem.text
    assert "RMW_IMPLEMENTATION=rmw_zenoh_cpp" in problem.remedy
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_zenoh_cpp")
    assert not plan(CONTAINER.format("")).problems


def test_a_wildcard_that_zenoh_cannot_say_is_told_and_not_widened(plan: Plan, tmp_path: Path) -> None:
    policy = tmp_path / "policy.xml"
    policy.write_text(
        '<policy version="0.2.0"><enclaves><enclave path="/talker"><profiles><profile ns="/" node="talker">'
        '<topics publish="ALLOW"><topic>/cam?</topic><topic>/lidar*</topic></topics>'
        "</profile></profiles></enclave></enclaves></policy>"
    )
    found = plan(TALKER.format(ZENOH), policy=policy)
    (text,) = told(found, Code.ZENOH_CANNOT_GRANT)
    assert "/cam?" in text and "denied" in text
    assert not told(plan(TALKER.format(""), policy=policy), Code.ZENOH_CANNOT_GRANT)
    (line,) = [line for line in explained(found, "/talker") if "0/lidar" in line]
    assert line.endswith("may publish 0/lidar$*/*/*/**")


def test_explanations_show_the_keys_of_a_permission(plan: Plan) -> None:
    found = plan(TALKER.format(ZENOH))
    expected = "  on Zenoh enclave /talker may publish 0/chatter/std_msgs::msg::dds_::String_/*"
    assert expected in explained(found, "/chatter") and expected in explained(found, "/talker")
    assert not any("Zenoh" in line for line in explained(plan(TALKER.format("")), "/chatter"))


def test_only_enclaves_on_zenoh_are_served_by_the_router(plan: Plan, tmp_path: Path) -> None:
    launch: Any = provision(plan(TALKER.format(ZENOH) + LISTENER.format("")), tmp_path / "ks")
    assert launch.zenoh.report.enclaves == ("/talker",)
    assert (tmp_path / "ks/enclaves/talker/zenoh.json5").exists()
    assert not (tmp_path / "ks/enclaves/listener/zenoh.json5").exists()
    assert "/listener" not in (tmp_path / "ks/zenoh/router.json5").read_text()
