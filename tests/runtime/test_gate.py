"""The plan is fixed before the first process: what goes beyond it is refused, or let through and said."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_common.source_location import SourceLocation
from enclave_launch.process import EnclaveRequest, RemapRule, ResolvedComponent, ResolvedProcess
from enclave_launch.runtime.gate import LateProcess, PlannedGate, StartAdditions, identity

PLACE = SourceLocation("demo.launch.py", 12, "node")

TALKER = ResolvedProcess(
    number=1,
    kind="node",
    package="demo_nodes",
    executable="talker",
    process_name="talker-1",
    name="talker",
    namespace="/robot",
    fqn="/robot/talker",
    cmd=("talker", "--ros-args", "-r", "chatter:=news"),
    remaps=(RemapRule("chatter", "news"),),
    parameters={},
    environment={},
    enclave=EnclaveRequest(scope="/robot"),
    location=PLACE,
)

CAMERA = ResolvedComponent(
    container="/robot/box",
    package="camera",
    plugin="camera::Driver",
    name="camera",
    namespace="/robot",
    remaps=(),
    parameters={},
    extra_arguments={},
    location=PLACE,
)


class Keystore:
    """Provisions in memory."""

    def __init__(self) -> None:
        self.done: list[str] = []

    def granted(self, process: ResolvedProcess) -> StartAdditions | None:
        return StartAdditions(("--enclave", "/robot")) if identity(process) == identity(TALKER) else None

    def ensure(self, process: ResolvedProcess) -> StartAdditions:
        self.done.append(f"planned {process.fqn}")
        return StartAdditions(("--enclave", "/robot"))

    def ensure_late(self, process: ResolvedProcess) -> StartAdditions:
        self.done.append(f"late {process.fqn}")
        return StartAdditions(("--enclave", "/robot"))

    def launcher(self) -> StartAdditions | None:
        return None


def gate(*, allow_late: bool = False) -> tuple[PlannedGate, Keystore, list[str]]:
    keystore, said = Keystore(), list[str]()
    return (
        PlannedGate([TALKER], [CAMERA], keystore, allow_late=allow_late, say_late=said.append),
        keystore,
        said,
    )


@pytest.mark.parametrize(
    "same",
    [
        TALKER,
        TALKER._replace(number=7, process_name="talker-7"),
        TALKER._replace(cmd=(*TALKER.cmd, "--params-file", "/tmp/launch_params_x")),
        TALKER._replace(on_event="OnProcessExit a-1"),
        TALKER._replace(remaps=(RemapRule("chatter", "news", PLACE),)),
    ],
    ids=["itself", "another number", "another parameter file", "another event", "rule with its place"],
)
def test_what_the_plan_foresaw_is_provisioned(same: ResolvedProcess) -> None:
    guard, keystore, _ = gate()
    assert guard.granted(same) == guard.ensure(same) == StartAdditions(("--enclave", "/robot"))
    assert keystore.done == ["planned /robot/talker"]


BEYOND = {
    "another name": TALKER._replace(fqn="/robot/talker2"),
    "another program": TALKER._replace(executable="listener"),
    "another package": TALKER._replace(package="evil"),
    "another remap rule": TALKER._replace(cmd=("talker", "--ros-args", "-r", "chatter:=secret")),
    "another enclave": TALKER._replace(enclave=EnclaveRequest(attribute="/root")),
    "its own enclave argument": TALKER._replace(enclave=EnclaveRequest(scope="/robot", argument="/root")),
    "a prefix": TALKER._replace(prefix=("other-program",)),
    "another domain": TALKER._replace(final_environment={"ROS_DOMAIN_ID": "7"}),
    "another middleware": TALKER._replace(final_environment={"RMW_IMPLEMENTATION": "rmw_other"}),
    "simulated time": TALKER._replace(parameters={"use_sim_time": True}),
    "an executable with an enclave": TALKER._replace(
        kind="executable", package=None, fqn=None, enclave=EnclaveRequest(attribute="/root")
    ),
}


@pytest.mark.parametrize("late", BEYOND.values(), ids=BEYOND)
def test_what_goes_beyond_the_plan_is_refused_with_its_place(late: ResolvedProcess) -> None:
    guard, keystore, _ = gate()
    assert guard.granted(late) is None
    with pytest.raises(LateProcess, match=r"refused: .* at demo\.launch\.py:12 .*--allow-late") as refusal:
        guard.ensure(late)
    assert keystore.done == []
    assert refusal.value.exit_status == 1


def test_allow_late_provisions_and_says_so_once() -> None:
    guard, keystore, said = gate(allow_late=True)
    late = BEYOND["another name"]
    guard.ensure(late)
    guard.ensure(late)
    assert keystore.done == ["late /robot/talker2", "planned /robot/talker2"]
    assert len(said) == 1
    assert "demo_nodes/talker (/robot/talker2)" in said[0]


def test_an_executable_without_enclave_has_nothing_to_sign() -> None:
    guard, keystore, _ = gate()
    guard.ensure(TALKER._replace(kind="executable", package=None, fqn=None, enclave=EnclaveRequest()))
    assert keystore.done == ["late None"]


def test_a_component_that_was_not_planned_cannot_be_granted_any_more() -> None:
    guard, _, _ = gate(allow_late=True)
    guard.ensure_components([CAMERA])
    with pytest.raises(LateProcess, match=r"camera/camera::Spy for /robot/box"):
        guard.ensure_components([CAMERA._replace(plugin="camera::Spy")])


@pytest.mark.parametrize(
    "late",
    [
        CAMERA._replace(container="/robot/other"),
        CAMERA._replace(package="evil"),
        CAMERA._replace(name="eye"),
        CAMERA._replace(namespace="/other"),
        CAMERA._replace(parameters={"use_sim_time": True}),
    ],
    ids=["another container", "another package", "another name", "another namespace", "simulated time"],
)
def test_a_component_that_differs_from_the_plan_is_refused(late: ResolvedComponent) -> None:
    guard, _, _ = gate()
    guard.ensure_components([CAMERA._replace(on_event="OnProcessExit a-1")])
    with pytest.raises(LateProcess, match="its container has read its permissions already"):
        guard.ensure_components([CAMERA, late])


def test_the_place_is_told_as_written(tmp_path: Path) -> None:
    guard, _, _ = gate()
    with pytest.raises(LateProcess, match=str(tmp_path)):
        guard.ensure(TALKER._replace(fqn="/x", location=SourceLocation(str(tmp_path / "a.launch.py"))))


@pytest.mark.parametrize(
    ("beyond", "difference"),
    [
        ("another remap rule", "planned remap rules chatter:=news, came chatter:=secret"),
        ("a prefix", "planned launch prefix none, came other-program"),
        ("another domain", "planned domain none, came 7"),
    ],
)
def test_a_refusal_says_what_was_planned_what_came_and_why(beyond: str, difference: str) -> None:
    guard, _, _ = gate()
    with pytest.raises(LateProcess) as refusal:
        guard.ensure(BEYOND[beyond])
    assert difference in str(refusal.value)
    assert "a time, a random value, a file or a program's answer that changed since" in str(refusal.value)


def test_of_what_an_event_starts_the_event_is_the_reason() -> None:
    planned = TALKER._replace(on_event="OnProcessExit a-1")
    guard = PlannedGate([planned], [], Keystore(), allow_late=False, say_late=print)
    with pytest.raises(
        LateProcess, match=r"planned node /robot/talker, came /robot/other .*OnProcessExit a-1"
    ):
        guard.ensure(TALKER._replace(fqn="/robot/other"))


def test_what_the_plan_has_nothing_like_is_said_to_be_that() -> None:
    guard, _, _ = gate()
    with pytest.raises(LateProcess, match="the plan has nothing like it"):
        guard.ensure(TALKER._replace(executable="other", fqn="/x"))


def test_of_a_component_the_difference_is_told_as_well() -> None:
    guard, _, _ = gate()
    with pytest.raises(LateProcess, match=r"planned remap rules none, came image:=other"):
        guard.ensure_components([CAMERA._replace(remaps=(RemapRule("image", "other"),))])
