"""From what launch starts to a plan: enclave, role, domain and container of each process and component."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from enclave_common.source_location import SourceLocation
from enclave_launch import EnclaveScope, LaunchPlan
from enclave_launch.diagnostics import Code
from enclave_launch.evaluation.evaluate import evaluate
from enclave_launch.host.plan_host import PlanHost
from enclave_launch.plan import (
    Described,
    Found,
    InterfaceOrigin,
    LaunchSource,
    Missing,
    PlanInputs,
    PlanOptions,
)
from enclave_launch.planner import make_plan
from enclave_launch.process import ResolvedComponent, ResolvedProcess
from keystore import Operation
from nodl.node_interface import RANDOM_ENDING, Gap

from .conftest import make_node

TALKER = make_node("pub chatter", original="talker").interface
UNKNOWN = Missing("pk/engine", "nobody described it")
NODE = '<node pkg="pk" exec="talker" {}/>'
COMPONENT = '<composable_node pkg="pk" plugin="pk::Talker" name="{}"/>'
BOX = '<node_container pkg="rclcpp_components" exec="component_container" name="{}" namespace="" {}>{}</node_container>'
LOAD = '<load_composable_node target="{}">{}</load_composable_node>'
Plan = Callable[..., LaunchPlan]


@pytest.fixture
def plan(tmp_path: Path) -> Plan:
    """``known``: executable or plugin -> what is known of it; a talker, where it does not say."""

    def run(
        text: str,
        known: Mapping[str, Found | Missing] | None = None,
        scope: EnclaveScope = EnclaveScope.NAMESPACE,
    ) -> LaunchPlan:
        def lookup(
            started: ResolvedProcess | ResolvedComponent, container: ResolvedProcess | None
        ) -> Found | Missing:
            what = started.plugin if isinstance(started, ResolvedComponent) else started.executable
            return (known or {}).get(what, Found((TALKER,)))

        file = tmp_path / "test.launch.xml"
        file.write_text(f"<launch>{text}</launch>")
        evaluation = evaluate(file, host=PlanHost(allow_missing_packages=True, distro="jazzy"))
        inputs = PlanInputs(LaunchSource(str(file)), lookup, PlanOptions(enclave_scope=scope))
        return make_plan(evaluation, inputs)

    return run


def enclaves(plan: LaunchPlan) -> list[str | None]:
    return [process.enclave.path if process.enclave else None for process in plan.processes]


ROLES = {
    "a node": (NODE.format(""), "node"),
    "a container": (BOX.format("box", "", ""), "container"),
    "a container of another package": (
        '<node_container pkg="pk" exec="box" name="box" namespace=""/>',
        "container",
    ),
    "the container program, started as a node": (
        '<node pkg="rclcpp_components" exec="component_container_mt" name="box"/>',
        "container",
    ),
}


@pytest.mark.parametrize("case", ROLES)
def test_the_role_decides_what_a_node_has_anyway(case: str, plan: Plan) -> None:
    text, role = ROLES[case]
    (process,) = plan(text).processes
    assert [node.role for node in process.nodes] == [role]


def test_a_node_with_rules_of_its_own_in_a_container_is_not_the_container(plan: Plan) -> None:
    helper = TALKER._replace(own_rules=("__node:=helper",))
    (process,) = plan(BOX.format("box", "", ""), {"component_container": Found((TALKER, helper))}).processes
    assert [(node.name, node.role) for node in process.nodes] == [("box", "container"), ("helper", "node")]


def test_one_enclave_for_each_node_needs_its_name(plan: Plan) -> None:
    """Launch's name first, else the program's, without what it makes up at each start; else there is none."""
    random = Found((TALKER._replace(name=f"relay{RANDOM_ENDING}"),))
    known = {"relay": random, "engine": UNKNOWN}
    text = (
        NODE.format('name="left"')
        + NODE.format('namespace="arm"')
        + NODE.format("").replace("talker", "relay")
        + NODE.format('name="motor"').replace("talker", "engine")
        + NODE.format("").replace("talker", "engine")
    )
    each = plan(text, known, EnclaveScope.NODE)
    assert enclaves(each) == ["/left", "/arm/talker", "/relay", "/motor", None]
    assert enclaves(plan(text, known)) == ["/"] * 5


def test_what_is_unknown_of_a_process_is_part_of_the_plan(plan: Plan) -> None:
    nameless = Found((TALKER._replace(name=None),))
    unknown, unnamed, named = plan(
        NODE.format('enclave="/engine"').replace("talker", "engine")
        + NODE.format("")
        + NODE.format('name="a"'),
        {"engine": UNKNOWN, "talker": nameless},
    ).processes
    assert (unknown.nodes, unknown.missing) == ((), UNKNOWN)
    assert unnamed.nodes == () and unnamed.missing is not None and unnamed.missing.unnamed
    assert "the name of node" in unnamed.missing.why and unnamed.missing.subject == "talker-2"
    assert [node.fqn for node in named.nodes] == ["/a"] and named.missing is None


def test_where_interfaces_come_from_and_what_is_doubted_goes_along(plan: Plan) -> None:
    names = {(Operation.PUBLISH, "/chatter"): "here:1"}
    described = Described(Found((TALKER,), InterfaceOrigin.LIBRARY), names, (), used=True)
    found = Found((TALKER,), InterfaceOrigin.LIBRARY, "made for 1.0", (described,))
    made = plan(BOX.format("box", "", COMPONENT.format("c")) + NODE.format(""), {
        "talker": found, "pk::Talker": found,
    })  # fmt: skip
    for item in (made.processes[1], made.components[0]):
        assert (item.origin, item.doubt, item.descriptions) == found[1:4]


def test_an_enclave_of_which_no_node_is_known_stands_in_the_policy(plan: Plan) -> None:
    made = plan(NODE.format('enclave="/engine"').replace("talker", "engine"), {"engine": UNKNOWN})
    assert [(enclave.path, enclave.profiles) for enclave in made.derived.policy.enclaves] == [("/engine", ())]
    assert [problem.code for problem in made.problems] == [Code.NO_MANIFEST]


def test_what_the_policy_cannot_say_is_a_problem_of_the_plan(plan: Plan) -> None:
    gap = Gap(SourceLocation("talker.py", 3), "one more name, from the network")
    made = plan(NODE.format(""), {"talker": Found((TALKER._replace(gaps=(gap,)),))})
    assert ["from the network" in problem.text for problem in made.problems] == [True]


DOMAINS = {
    "none": ("", 0, False),
    "the launch file's": ('<set_env name="ROS_DOMAIN_ID" value="7"/>', 7, False),
    "one that rcl refuses": ('<set_env name="ROS_DOMAIN_ID" value="seven"/>', 0, True),
}


@pytest.mark.parametrize("case", DOMAINS)
def test_the_domain_of_a_process_is_its_environments(
    case: str, plan: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    setting, domain, refused = DOMAINS[case]
    text = f'{setting}{NODE.format("")}<executable cmd="date"/><executable cmd="date" enclave="/clock"/>'
    node, program, secured = plan(text).processes
    assert (node.domain, [each.code for each in node.refusals]) == (domain, [Code.DOMAIN_INVALID] * refused)
    assert (secured.domain, len(secured.refusals)) == (node.domain, len(node.refusals))
    assert (program.domain, program.refusals, program.nodes) == (0, (), ()), (
        "without an enclave nothing is asked of it"
    )


def test_the_middleware_of_each_process_is_told(plan: Plan) -> None:
    text = '<group><set_env name="RMW_IMPLEMENTATION" value="rmw_cyclonedds_cpp"/>{0}{1}</group>{0}'
    made = plan(text.format(NODE.format(""), '<executable cmd="date"/>'))
    first, program, last = made.processes
    assert first.middleware == program.middleware == "rmw_cyclonedds_cpp" != last.middleware
    assert last.middleware == plan(NODE.format("")).processes[0].middleware


def component(plan: LaunchPlan) -> tuple[str | None, list[str]]:
    (item,) = plan.components
    return item.enclave, [node.fqn for node in item.nodes]


def test_a_component_gets_the_enclave_of_its_container(plan: Plan) -> None:
    inside = BOX.format("box", 'enclave="/cell"', COMPONENT.format("c"))
    assert component(plan(inside)) == ("/cell", ["/c"])
    later = BOX.format("box", 'enclave="/cell"', "") + LOAD.format("{}", COMPONENT.format("c"))
    assert component(plan(later.format("/box"))) == component(plan(later.format("box"))) == ("/cell", ["/c"])


def test_of_containers_with_one_name_the_first_counts(plan: Plan) -> None:
    two = BOX.format("box", 'enclave="/first"', "") + BOX.format("box", 'enclave="/second"', "")
    assert component(plan(two + LOAD.format("box", COMPONENT.format("c")))) == ("/first", ["/c"])


def test_a_container_of_which_nothing_is_known_holds_components(plan: Plan) -> None:
    box = '<node pkg="pk" exec="engine" name="box" {}/>' + LOAD.format("box", COMPONENT.format("c"))
    made = plan(box.format('enclave="/cell"'), {"engine": UNKNOWN})
    assert component(made) == ("/cell", ["/c"])


def test_a_component_of_a_container_that_is_not_here_is_told_and_gets_nothing(plan: Plan) -> None:
    made = plan(BOX.format("box", "", "") + LOAD.format("/other/box", COMPONENT.format("c")))
    assert component(made) == (None, [])
    assert made.components[0].origin is InterfaceOrigin.PACKAGE
    assert any(
        "'/other/box'" in warning.text and "not started by this" in warning.text for warning in made.warnings
    )


def test_what_is_unknown_of_a_component_is_part_of_the_plan(plan: Plan) -> None:
    made = plan(BOX.format("box", 'enclave="/cell"', COMPONENT.format("c")), {"pk::Talker": UNKNOWN})
    assert (component(made), made.components[0].missing) == (("/cell", []), UNKNOWN)


def test_only_what_the_launcher_calls_gives_it_a_node(plan: Plan) -> None:
    assert plan(NODE.format("")).launcher is None
    loading = plan(BOX.format("box", "", COMPONENT.format("c"))).launcher
    assert loading is not None and loading.fqn == "/launcher"


def test_what_is_known_of_a_talker_is_granted_once_in_its_enclave(plan: Plan) -> None:
    """The neighbour: nothing of it in any other enclave."""
    made = plan(NODE.format('enclave="/a"') + NODE.format('enclave="/b"').replace("talker", "engine"), {
        "engine": UNKNOWN,
    })  # fmt: skip
    rules: dict[str, list[str]] = {
        path: [rule.expression for rule in reasons] for path, reasons in made.derived.reasons.items()
    }
    assert "/chatter" in rules["/a"] and "/chatter" not in rules.get("/b", [])
