"""What a component is granted: its own rules and namespace, what its container forwards, its role. Each grant beside
the neighbour that is refused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from enclave_launch import LaunchPlan
from enclave_launch.evaluation.evaluate import evaluate
from enclave_launch.host.plan_host import PlanHost
from enclave_launch.interfaces import InterfaceFinder
from enclave_launch.plan import Found, LaunchSource, Missing, PlanInputs, PlanOptions
from enclave_launch.planner import make_plan
from enclave_launch.policy import PolicyOptions
from enclave_launch.process import ResolvedComponent, ResolvedProcess
from nodl.name_template import NameTemplate, ParameterPart

from .conftest import make_node

CAMERA = make_node("pub image", "pub ~/info", "sub /all", "serve reset", original="camera").interface
BOX = """<launch>
<node_container pkg="rclcpp_components" exec="component_container" name="box" namespace="{namespace}"
                ros_args="{rules}">
  <remap from="image" to="of_container"/>
  <composable_node pkg="pk" plugin="pk::Camera" name="{name}" {attributes}>{children}</composable_node>
</node_container></launch>"""
FORWARD = '<extra_arg name="forward_global_arguments" value="{}"/>'
Box = Callable[..., LaunchPlan]


@pytest.fixture
def box(tmp_path: Path) -> Box:
    """A container with one camera: ``rules`` of the container, ``attributes`` and ``children`` of the component."""
    finder = InterfaceFinder([])

    def lookup(
        started: ResolvedProcess | ResolvedComponent, container: ResolvedProcess | None
    ) -> Found | Missing:
        return Found((CAMERA,)) if isinstance(started, ResolvedComponent) else finder(started, container)

    def plan(
        name: str = "camera",
        attributes: str = "",
        children: str = "",
        rules: str = "",
        namespace: str = "",
        options: PolicyOptions = PolicyOptions(),  # noqa: B008  # a frozen value
    ) -> LaunchPlan:
        file = tmp_path / "box.launch.xml"
        text = BOX.format(
            name=name, attributes=attributes, children=children, rules=rules, namespace=namespace
        )
        file.write_text(text)
        evaluation = evaluate(file, host=PlanHost(allow_missing_packages=True, distro="jazzy"))
        inputs = PlanInputs(LaunchSource(str(file)), lookup, PlanOptions(policy=options))
        return make_plan(evaluation, inputs)

    return plan


def granted(plan: LaunchPlan) -> set[str]:
    """What the component's own profile permits."""
    (component,) = plan.components
    (node,) = component.nodes
    profiles = plan.derived.policy.enclaves[0].profiles
    (profile,) = (each for each in profiles if (each.ns, each.node) == (node.namespace, node.name))
    return {f"{rule.operation.value} {rule.expression}" for rule in profile.rules}


PLAIN = {"publish /image", "publish /camera/info", "subscribe /all", "reply /reset"}
TABLE: dict[str, tuple[dict[str, str], set[str], set[str]]] = {
    "as it is": ({}, PLAIN, {"publish /of_container", "publish /box/info"}),
    "a remap of its own": (
        {"children": '<remap from="image" to="picture"/>'},
        {"publish /picture"},
        {"publish /image", "publish /of_container"},
    ),
    "a remap of a service": (
        {"children": '<remap from="reset" to="/again"/>'},
        {"reply /again", "publish /image"},
        {"reply /reset"},
    ),
    "a private remap": (
        {"children": '<remap from="~/info" to="/camera_info"/>'},
        {"publish /camera_info"},
        {"publish /camera/info"},
    ),
    "a namespace": (
        {"attributes": 'namespace="/left"'},
        {"publish /left/image", "publish /left/camera/info", "subscribe /all", "reply /left/reset"},
        {"publish /image", "reply /reset", "subscribe /left/all"},
    ),
    "a name": (
        {"name": "eye"},
        {"publish /eye/info", "reply /eye/get_parameters", "publish /image"},
        {"publish /camera/info", "reply /camera/get_parameters"},
    ),
    "a name, a namespace and a remap": (
        {"name": "eye", "attributes": 'namespace="/left"', "children": '<remap from="image" to="picture"/>'},
        {"publish /left/picture", "publish /left/eye/info"},
        {"publish /left/image", "publish /picture"},
    ),
    "the container's rules are not its own": (
        {"rules": "-r image:=by_command_line"},
        {"publish /image", "reply /reset"},
        {"publish /by_command_line", "publish /of_container"},
    ),
    "rules that are forwarded": (
        {"rules": "-r image:=by_command_line", "children": FORWARD.format("true")},
        {"publish /by_command_line"},
        {"publish /image"},
    ),
    "a namespace that is forwarded": (
        {"namespace": "/cell", "children": FORWARD.format("true")},
        {"publish /cell/of_container", "reply /cell/reset"},
        {"publish /image", "publish /cell/image"},
    ),
    "forwarding that is switched off": (
        {"rules": "-r image:=by_command_line", "children": FORWARD.format("false")},
        {"publish /image"},
        {"publish /by_command_line"},
    ),
    "its own rule before a forwarded one": (
        {
            "rules": "-r image:=by_command_line",
            "children": FORWARD.format("true") + '<remap from="image" to="picture"/>',
        },
        {"publish /picture"},
        {"publish /by_command_line", "publish /of_container"},
    ),
    "its own namespace before a forwarded one": (
        {
            "attributes": 'namespace="/left"',
            "namespace": "/cell",
            "children": FORWARD.format("true"),
        },
        {"reply /left/reset"},
        {"reply /cell/reset"},
    ),
}


@pytest.mark.parametrize("case", TABLE)
def test_a_component_is_granted_its_final_names_and_no_others(case: str, box: Box) -> None:
    given, allowed, refused = TABLE[case]
    found = granted(box(**given))
    assert allowed <= found
    assert not refused & found


LIFECYCLE = {"reply /camera/change_state", "reply /camera/get_state", "publish /camera/transition_event"}


def test_a_lifecycle_component_is_granted_its_services(box: Box, monkeypatch: pytest.MonkeyPatch) -> None:
    assert not LIFECYCLE & granted(box())
    monkeypatch.setitem(globals(), "CAMERA", CAMERA._replace(lifecycle=True))
    assert granted(box()) >= LIFECYCLE


def test_simulated_time_of_a_component_grants_the_clock_to_it_alone(box: Box) -> None:
    assert "subscribe /clock" not in granted(box())
    assert "subscribe /clock" in granted(box(children='<param name="use_sim_time" value="true"/>'))
    assert "subscribe /clock" not in granted(box(rules="-p use_sim_time:=true"))


def of_container(plan: LaunchPlan) -> set[str]:
    profiles = plan.derived.policy.enclaves[0].profiles
    (profile,) = (each for each in profiles if each.node == "box")
    return {f"{rule.operation.value} {rule.expression}" for rule in profile.rules}


def test_a_container_is_granted_exactly_what_its_manager_makes(box: Box) -> None:
    """rclcpp_components component_manager.hpp: no parameter services, no publisher of parameter events."""
    assert of_container(box()) == {
        "publish /rosout",
        "subscribe /parameter_events",
        "reply /box/get_type_description",
        "reply /box/_container/load_node",
        "reply /box/_container/unload_node",
        "reply /box/_container/list_nodes",
    }


# -- rows that depend on what a node does, or that somebody asks for ---------------------------------------------------

LISTENER = make_node("sub /tf", original="camera", library=CAMERA.library).interface


@pytest.mark.parametrize(
    ("given", "namespace"),
    [({}, ""), ({"namespace": "/cell"}, "/cell"), ({"attributes": 'namespace="/left"'}, "")],
)
def test_the_helper_of_a_tf_listener_is_granted_below_the_namespace_of_its_process(
    given: dict[str, str], namespace: str, box: Box, monkeypatch: pytest.MonkeyPatch
) -> None:
    from nodl.node_interface import ClientLibrary

    helper = f"reply {namespace}/transform_listener_impl_*/get_type_description"
    monkeypatch.setitem(globals(), "CAMERA", LISTENER._replace(library=ClientLibrary.RCLCPP))
    plan = box(**given)
    assert [name for name in granted(plan) if "*" in name] == [helper]
    assert not any("pattern" in str(warning) for warning in plan.warnings), "nobody could list the name"
    reasons = [
        why
        for rules in plan.derived.reasons.values()
        for rule, why in rules.items()
        if "*" in rule.expression
    ]
    assert reasons and all("the program makes up the name" in why.note for each in reasons for why in each)
    monkeypatch.setitem(globals(), "CAMERA", LISTENER._replace(library=ClientLibrary.RCLPY))
    assert not any("*" in name for name in granted(box(**given)))


ALSO = {
    "clock": {"subscribe /clock"},
    "logger-services": {"reply /camera/get_logger_levels", "reply /camera/set_logger_levels"},
    "service-events": {"publish /reset/_service_event"},
}


@pytest.mark.parametrize("what", ALSO)
def test_rows_that_are_off_are_granted_to_who_asks(what: str, box: Box) -> None:
    asked = granted(box(options=PolicyOptions(also=frozenset({what}))))
    assert asked - granted(box()) == ALSO[what]


def test_the_programs_own_namespace_holds_until_launch_gives_one(
    box: Box, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(globals(), "CAMERA", CAMERA._replace(namespace="/own"))
    assert {"publish /own/image", "reply /own/camera/get_parameters"} <= granted(box())
    assert not any("/own" in name for name in granted(box(attributes='namespace="/left"')))


def test_a_component_finds_the_environment_of_its_container(
    box: Box, monkeypatch: pytest.MonkeyPatch
) -> None:
    topic = CAMERA.endpoints[0]._replace(name=NameTemplate((ParameterPart("$TOPIC", "image"),)))
    monkeypatch.setitem(globals(), "CAMERA", CAMERA._replace(endpoints=(topic,)))
    assert "publish /image" in granted(box())
    monkeypatch.setenv("TOPIC", "picture")
    assert "publish /picture" in granted(box()) and "publish /image" not in granted(box())
