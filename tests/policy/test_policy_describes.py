"""Who comes from SROS2 has policies and no manifests: a profile describes the node that nothing else describes."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_launch import LaunchPlan, ResolveOptions, resolve
from enclave_launch.plan import InterfaceOrigin
from enclave_launch.report.tree import plan_tree
from keystore.formats.policy import Operation

PACKAGE = """<package format="3"><name>{0}</name><version>1.0.0</version><description>d</description>
<maintainer email="a@example.org">a</maintainer><license>x</license></package>"""


@pytest.fixture
def prefix(tmp_path: Path) -> Path:
    """A workspace with a compiled program of which there is neither source nor manifest."""
    root = tmp_path / "ws"
    index = root / "share/ament_index/resource_index/packages"
    index.mkdir(parents=True)
    (index / "bridging").touch()
    (root / "share/bridging").mkdir()
    (root / "share/bridging/package.xml").write_text(PACKAGE.format("bridging"))
    (root / "lib/bridging").mkdir(parents=True)
    for name in ("bridge", "gateway"):
        program = root / "lib/bridging" / name
        program.write_bytes(Path("/bin/true").read_bytes())
        program.chmod(0o755)
    return root


def profile(node: str, topic: str, ns: str = "/") -> str:
    return (
        f'<profile ns="{ns}" node="{node}"><topics publish="ALLOW"><topic>{topic}</topic></topics></profile>'
    )


def planned(prefix: Path, launched: str, policies: dict[str, str], folder: bool = False) -> LaunchPlan:
    """Plan nodes with a policy of these enclaves, in one file or in a file for each."""
    enclaves = [
        f'<enclave path="{path}"><profiles>{text}</profiles></enclave>' for path, text in policies.items()
    ]
    groups = [[each] for each in enclaves] if folder else [enclaves]
    place = prefix.parent / "policies"
    place.mkdir()
    for number, group in enumerate(groups):
        text = f'<policy version="0.2.0"><enclaves>{"".join(group)}</enclaves></policy>'
        (place / f"{number}.xml").write_text(text)
    file = prefix.parent / "l.launch.xml"
    file.write_text(f"<launch>{launched}</launch>")
    policy = place if folder else place / "0.xml"
    return resolve(file, options=ResolveOptions(prefixes=(prefix,), policy=policy))


def published(plan: LaunchPlan, enclave: str) -> set[str]:
    return {
        rule.expression
        for one in plan.derived.policy.enclaves
        for each in one.profiles
        for rule in each.rules
        if one.path == enclave and rule.operation is Operation.PUBLISH
    }


BRIDGE = '<node pkg="bridging" exec="bridge" name="bridge" enclave="/bridge"/>'


def test_a_profile_describes_the_node_and_the_plan_says_so(prefix: Path) -> None:
    plan = planned(prefix, BRIDGE, {"/bridge": profile("bridge", "words")})
    assert not plan.problems
    assert published(plan, "/bridge") == {"/words", "/rosout", "/parameter_events"}
    assert plan.processes[0].origin is InterfaceOrigin.POLICY and "from policy" in plan_tree(plan)


@pytest.mark.parametrize(
    ("launched", "policies", "why"),
    [
        (BRIDGE, {"/other": profile("bridge", "words")}, "but some in /other"),
        (BRIDGE, {"/bridge": profile("another", "words")}, "profiles of /another in enclave /bridge"),
        (
            BRIDGE.replace("enclave=", 'namespace="/base" enclave='),
            {"/bridge": profile("bridge", "words", "/arm")},
            "profiles of /arm/bridge",
        ),
        (BRIDGE, {"/bridge": profile("bri?", "words")}, "profiles of /bri?"),
    ],
)
def test_another_profile_describes_nothing_and_the_refusal_says_why(
    prefix: Path, launched: str, policies: dict[str, str], why: str
) -> None:
    (problem,) = planned(prefix, launched, policies).problems
    assert why in problem.text


def test_a_program_without_a_name_takes_the_profiles_that_are_left(prefix: Path) -> None:
    launched = BRIDGE + '<node pkg="bridging" exec="gateway" enclave="/bridge"/>'
    profiles = profile("bridge", "words") + profile("gateway_node", "out") + profile("helper", "more")
    plan = planned(prefix, launched, {"/bridge": profiles})
    assert not plan.problems
    assert [[node.fqn for node in item.nodes] for item in plan.processes] == [
        ["/bridge"],
        ["/gateway_node", "/helper"],
    ]


def test_two_programs_without_a_name_are_not_guessed(prefix: Path) -> None:
    launched = "".join(
        f'<node pkg="bridging" exec="{name}" enclave="/bridge"/>' for name in ("bridge", "gateway")
    )
    plan = planned(prefix, launched, {"/bridge": profile("a", "x") + profile("b", "y")})
    assert len(plan.problems) == 2
    assert all("none is surely this node" in each.text for each in plan.problems)


def test_a_folder_of_policies_is_one_policy(prefix: Path) -> None:
    launched = BRIDGE + '<node pkg="bridging" exec="gateway" name="gateway_1" enclave="/gateway"/>'
    policies = {"/bridge": profile("bridge", "words"), "/gateway": profile("gateway_*", "~/state")}
    plan = planned(prefix, launched, policies, folder=True)
    assert not plan.problems
    assert "/words" in published(plan, "/bridge") and "/words" not in published(plan, "/gateway")
    assert "/gateway_*/state" in published(plan, "/gateway"), "as the policy has it, and reported"
    assert any("/gateway_*/state" in each.text for each in plan.warnings)
