"""Two booted hosts that share nothing but a cable: what changes reaches both, also the one that was switched off."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

import pytest

from keystore import RemoveOptions, Role, Step, remove, roll_over
from tests.addons.deployment.booted import booted
from tests.addons.deployment.networks import Network
from tests.addons.deployment.robot import Host, node, robot, until, up
from tests.keystore.kit import options

pytestmark = pytest.mark.dds

SPEAKER, EAR, SPY = (f"ros-robot-{name}.service" for name in ("speaker", "ear", "spy"))
HOSTS = {"base": ("/speaker",), "arm": ("/ear", "/spy")}
NETWORK = Network((), "10.77.0.1", ("10.77.0.1", "10.77.0.2"))  # the configuration is the same on both
ROBOT = robot(
    node("talker", "speaker", network=NETWORK),
    node("listener", "ear", network=NETWORK),
    node("listener", "spy", network=NETWORK),
)


class Robot:
    """Hosts that are switched on and off."""

    def __init__(self, folder: Path):
        self.folder = folder
        (folder / "shared").mkdir()
        self.file = folder / "hosts.yaml"
        self.file.write_text(
            "version: 1\nhosts:\n"
            + "".join(f"  {name}: {{enclaves: {list(has)}}}\n" for name, has in HOSTS.items())
        )
        self._on: dict[str, contextlib.ExitStack] = {}
        self.hosts: dict[str, Host] = {}

    def switch_on(self, *names: str, target: str = "basic.target") -> None:
        for name in names:
            self._on[name] = contextlib.ExitStack()
            machine = self._on[name].enter_context(booted(self.folder / name, self.folder / "shared"))
            self.hosts[name] = Host(machine, self.folder / "shared", name, self.file)
        if len(self.hosts) == len(HOSTS):
            self.hosts["base"].machine.cable(self.hosts["arm"].machine)
        for name in names:  # a host has its network before its units start, as a robot does
            self.hosts[name].machine.run("systemctl", "start", "--no-block", target)

    def switch_off(self, name: str) -> None:
        """Cut its power."""
        self._on.pop(name).close()
        del self.hosts[name]

    def take(self, *names: str) -> str:
        return "".join(self.hosts[name].take() for name in names)

    def listening(self, unit: str = EAR) -> None:
        arm = self.hosts["arm"]
        until(lambda: arm.hears(unit), lambda: arm.machine.journal(unit))


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Robot]:
    """Day one: exported once, installed, imported and started on both."""
    made = Robot(tmp_path_factory.mktemp("two"))
    for parent in (made.folder, *made.folder.parents[:2]):
        parent.chmod(0o755)  # services have users of their own
    try:
        made.switch_on(*HOSTS)
        units = made.hosts["base"].launch(ROBOT, "--hosts", str(made.file))
        for name, host in made.hosts.items():
            host.keystore("units", "install", units / name)
            host.first_import()
            host.keystore("units", "restart")
        yield made
    finally:
        for name in list(made.hosts):
            made.switch_off(name)


def test_a_listener_on_one_host_hears_the_speaker_on_the_other(two: Robot) -> None:
    two.listening()
    two.listening(SPY)
    assert not two.hosts["base"].machine.run("systemctl", "list-units", "--plain", "--no-legend", EAR).strip()


def test_a_revocation_on_both_and_a_roll_over_that_one_of_them_sleeps_through_leave_them_talking(
    two: Robot,
) -> None:
    ca = two.hosts["base"].ca
    remove(ca, ["/spy"], options=RemoveOptions(durable=False))
    printed = two.take("base", "arm")
    assert f"{SPY}: stopped, its enclave is gone" in printed
    assert set(up(printed)) == {SPEAKER, EAR}
    two.listening()

    roll_over(ca, Step.START, tuple(Role), options=options())
    two.take("base", "arm")
    two.listening()
    two.switch_off("arm")
    roll_over(ca, Step.SWITCH, tuple(Role), options=options())
    two.take("base")
    roll_over(ca, Step.FINISH, tuple(Role), options=options())
    two.take("base")

    two.switch_on("arm", target="multi-user.target")
    arm = two.hosts["arm"]
    until(lambda: "secured by enclave /ear" in arm.machine.journal(EAR), lambda: arm.machine.journal(EAR))
    assert not arm.hears(EAR), "its CA is not trusted any more"
    assert up(two.take("arm")) == [EAR]
    two.listening()


def test_what_ran_before_the_power_was_cut_runs_after_the_next_boot(two: Robot) -> None:
    two.switch_off("base")
    two.switch_on("base", target="multi-user.target")
    arm = two.hosts["arm"].machine
    arm.run("systemctl", "restart", EAR)
    two.listening()
    assert two.hosts["base"].machine.property("ros-robot.target", "ActiveState") == "active"
