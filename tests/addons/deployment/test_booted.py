"""Day two on a booted systemd: what is revoked, renewed, rolled over, added or removed reaches the units of a host.

Units are exported once, at the beginning, and never again unless a node comes or goes.
"""

from __future__ import annotations

import os
from datetime import timedelta
from pathlib import Path

import pytest

from enclave_addons.deployment import pinned
from keystore import RemoveOptions, RenewOptions, Role, Step, remove, renew, roll_over
from tests.addons.deployment.booted import booted
from tests.addons.deployment.robot import KS, Host, node, robot, until, up
from tests.keystore.kit import options

pytestmark = pytest.mark.dds

DAY = timedelta(days=1)
SPEAKER, EAR, SPY = (f"ros-robot-{name}.service" for name in ("speaker", "ear", "spy"))


TALKING = (node("talker", "speaker"), node("listener", "ear"), node("listener", "spy"))
GIVEN_UP = "respawned 2 times, as respawn_max_retries allows"
RESPAWNED = (
    '<executable cmd="false" enclave="/flaky" respawn="true" respawn_max_retries="2" respawn_delay="0.1"/>'
)


def started(host: Host) -> None:
    """Day one: units exported from a keystore without a CRL, installed, and a bundle imported."""
    units = host.launch(robot(*TALKING))
    host.keystore("units", "install", units)
    host.first_import()
    for name in (SPEAKER, EAR, SPY):
        assert f"{name}: up" in host.keystore("units", "restart", name)
    until(lambda: host.hears(EAR) and host.hears(SPY), lambda: host.machine.journal(EAR))


def units_talk(running: Host) -> None:
    assert "secured by enclave /ear" in running.machine.journal(EAR)
    assert running.machine.run("systemctl", "is-enabled", "ros-robot.target").strip() == "enabled"


def a_renewal_restarts_the_unit_of_the_renewed_enclave_and_no_other(running: Host) -> None:
    others = {name: running.machine.property(name, "MainPID") for name in (EAR, SPY)}
    renew(running.ca, ["/speaker"], options=RenewOptions(provisioning=options()))
    assert up(running.take()) == [SPEAKER]
    assert {name: running.machine.property(name, "MainPID") for name in others} == others


def a_ca_is_rolled_over_and_the_units_that_were_exported_before_start(running: Host) -> None:
    for step in (Step.START, Step.SWITCH, Step.FINISH):
        roll_over(running.ca, step, tuple(Role), options=options())
        assert {SPEAKER, EAR, SPY} <= set(up(running.take()))
    until(lambda: running.hears(EAR), lambda: running.machine.journal(EAR))


def a_revoked_listener_is_refused_by_units_from_before_any_revocation_and_a_new_ca_follows(
    running: Host,
) -> None:
    """Its host took no part: it goes on with the keystore that it had."""
    machine = running.machine
    stolen = "/etc/ros/stolen"
    machine.run("sh", "-c", f"cp -a $(realpath {KS}) {stolen}")
    unit = machine.run("cat", f"/etc/systemd/system/{SPY}")
    machine.write("/etc/systemd/system/spy.service", unit.replace(f"{KS}/", f"{stolen}/"))
    machine.run("systemctl", "daemon-reload")
    machine.run("systemctl", "start", "spy")
    until(lambda: running.hears("spy"), lambda: machine.journal("spy"))

    remove(running.ca, ["/spy"], options=RemoveOptions(durable=False))
    printed = running.take()
    assert f"{SPY}: stopped, its enclave is gone" in printed
    assert f"{SPY} runs enclave /spy, which this bundle does not have" in printed
    assert {SPEAKER, EAR} <= set(up(printed))
    machine.run("systemctl", "restart", "spy")
    until(lambda: running.hears(EAR), lambda: machine.journal(EAR))
    assert not running.hears("spy"), "who is not revoked has heard the speaker since"
    machine.run("systemctl", "stop", "spy")

    machine.run("mv", f"{KS}/public/crl.pem", "/root")
    running.keystore("units", "restart", "/ear", status=1)
    missing = "was imported and is missing: import the bundle again"
    # systemd goes on starting the unit: the newest start may not have said it yet.
    until(lambda: missing in machine.journal(EAR), lambda: machine.journal(EAR))
    machine.run("mv", "/root/crl.pem", f"{KS}/public")
    for step in (Step.START, Step.SWITCH, Step.FINISH):
        roll_over(running.ca, step, tuple(Role), options=options())
        assert {SPEAKER, EAR} <= set(up(running.take()))
    assert "crl.pem" not in machine.run("ls", f"{KS}/public").split(), (
        "it was the old CA's, and units start without"
    )
    until(lambda: running.hears(EAR), lambda: machine.journal(EAR))


def the_target_that_a_boot_wants_starts_and_stops_all(running: Host) -> None:
    machine = running.machine
    machine.run("systemctl", "stop", "ros-robot.target")
    until(lambda: machine.property(EAR, "ActiveState") == "inactive", lambda: machine.journal(EAR))
    machine.run("systemctl", "start", "multi-user.target")
    until(lambda: machine.property(EAR, "ActiveState") == "active", lambda: machine.journal(EAR))
    until(lambda: running.hears(EAR), lambda: machine.journal(EAR))
    assert machine.property("ros-robot-expiry.timer", "ActiveState") == "active"


def a_node_that_leaves_the_launch_file_is_stopped_and_a_new_one_is_started(running: Host) -> None:
    units = running.launch(robot(*TALKING[:2], node("listener", "new")))
    running.take()
    printed = running.keystore("units", "install", units, "--restart")
    assert f"{SPY}: stopped and removed" in printed
    assert up(printed) == ["ros-robot-new.service"], "and no other was restarted"
    until(lambda: running.hears("ros-robot-new.service"), lambda: running.machine.journal("ros-robot-new"))


def a_unit_is_called_by_its_node_or_enclave_and_unknown_names_are_refused(running: Host) -> None:
    for name in ("/ear", "ros-robot-ear", EAR):
        assert up(running.keystore("units", "restart", name)) == [EAR]
    assert "no installed unit, node or enclave is called" in running.keystore(
        "units", "restart", "ea", status=2
    )


def a_process_is_respawned_as_often_as_the_launch_file_says_however_often_it_is_started_by_hand(
    running: Host,
) -> None:
    running.keystore("units", "install", running.launch(robot(RESPAWNED), "--name", "flaky"))
    name = "flaky-false.service"

    def said(program: str = "false") -> str:
        # By its identifier: of a process that is gone already the journal may not find out the unit.
        return running.machine.run("journalctl", "--no-pager", f"--identifier={program}", status=None)

    machine = running.machine
    machine.write("/etc/systemd/system/alarm.service", "[Service]\nType=oneshot\nExecStart=echo alarmed\n")
    machine.run("mkdir", "/etc/systemd/system/flaky-.service.d")
    machine.write("/etc/systemd/system/flaky-.service.d/alarm.conf", "[Unit]\nOnFailure=alarm.service\n")
    machine.run("systemctl", "daemon-reload")
    printed = running.keystore("units", "restart", name, status=1)
    assert "its enclave is not in the keystore" in printed, "and it is not started again and again, in vain"
    assert running.machine.property(name, "ActiveState") == "inactive"
    running.take(status=1)
    until(lambda: running.machine.property(name, "ActiveState") == "failed", said)
    until(lambda: "alarmed" in said("echo"), said)
    before = said().count(GIVEN_UP)
    running.machine.run("systemctl", "start", name, status=None)
    until(lambda: said().count(GIVEN_UP) > before, said)
    until(lambda: running.machine.property(name, "ActiveState") == "failed", said)
    assert running.machine.property(name, "NRestarts") == "3", "two tries more, then one that only says so"

    printed = running.keystore("units", "restart", "flaky", "ros-robot", status=1)
    assert up(printed) == [], "flaky.target is the first by name, and nothing after it is touched"
    assert "error: flaky-false.service is" in printed
    left = f"go on with\n    secure-keystore units restart flaky-false.service {SPEAKER} {EAR}"
    assert left in printed
    until(lambda: running.machine.property(name, "ActiveState") == "failed", said)  # it was started again
    assert "flaky-false.service is" in running.keystore("units", "status", status=1)
    running.keystore("units", "remove", "flaky")
    assert f"{EAR}: runs" in running.keystore("units", "status", "/ear")


def a_unit_waits_for_a_clock_that_is_earlier_than_the_import(running: Host) -> None:
    """As on a board without a battery; here the import lies in the future."""
    machine = running.machine
    machine.run("touch", "--date=+6 seconds", f"{KS}/enclaves/speaker/cert.pem")
    machine.run("systemctl", "restart", SPEAKER)
    assert "waiting until it is set" in machine.journal(SPEAKER)
    assert machine.property(SPEAKER, "ActiveState") == "active"


def what_expires_soon_makes_the_daily_look_fail_and_what_does_not_leaves_it_well(running: Host) -> None:
    machine = running.machine
    machine.run("systemctl", "start", "ros-robot-expiry.service")
    renew(running.ca, ["/ear"], options=RenewOptions(provisioning=options(lifetime=9 * DAY)))
    running.take()
    machine.run("systemctl", "start", "ros-robot-expiry.service", status=1)
    assert "/ear" in machine.journal("ros-robot-expiry.service")


def a_disk_that_is_full_at_an_import_leaves_the_keystore_and_the_units_as_they_were(
    running: Host,
) -> None:
    machine = running.machine
    place = "/etc/full"
    machine.run("mkdir", place)
    machine.run("mount", "-t", "tmpfs", "-o", "size=100k", "tmpfs", place)
    bundle = running.bundle()
    pins = [word for pin in pinned(bundle.manifest) for word in ("--require-ca", pin)]
    running.keystore("import", f"{place}/keystore", bundle.path, "--host", "robot", *pins)
    before = machine.run("readlink", f"{place}/keystore")
    renew(running.ca, ["/ear"], options=RenewOptions(provisioning=options()))
    machine.run("sh", "-c", f"head -c 200k /dev/zero > {place}/filler", status=None)
    printed = running.keystore("import", f"{place}/keystore", running.bundle().path, status=1)
    assert "No space left on device" in printed
    assert machine.run("readlink", f"{place}/keystore") == before


def removing_stops_and_deletes_what_was_installed_and_nothing_else(running: Host) -> None:
    machine = running.machine
    machine.write("/etc/systemd/system/mine.service", "[Service]\nExecStart=true\n")
    printed = running.keystore("units", "remove", "ros-robot")
    assert f"{SPEAKER}: removed" in printed
    left = machine.run("ls", "/etc/systemd/system").split()
    assert [name for name in left if name.startswith("ros-")] == []
    assert "mine.service" in left
    assert machine.property(SPEAKER, "MainPID") == "0"


DAYS = (
    started,
    units_talk,
    a_renewal_restarts_the_unit_of_the_renewed_enclave_and_no_other,
    a_ca_is_rolled_over_and_the_units_that_were_exported_before_start,
    a_revoked_listener_is_refused_by_units_from_before_any_revocation_and_a_new_ca_follows,
    the_target_that_a_boot_wants_starts_and_stops_all,
    a_node_that_leaves_the_launch_file_is_stopped_and_a_new_one_is_started,
    a_unit_is_called_by_its_node_or_enclave_and_unknown_names_are_refused,
    a_process_is_respawned_as_often_as_the_launch_file_says_however_often_it_is_started_by_hand,
    a_unit_waits_for_a_clock_that_is_earlier_than_the_import,
    what_expires_soon_makes_the_daily_look_fail_and_what_does_not_leaves_it_well,
    a_disk_that_is_full_at_an_import_leaves_the_keystore_and_the_units_as_they_were,
    removing_stops_and_deletes_what_was_installed_and_nothing_else,
)


def test_day_two_on_a_booted_host(tmp_path: Path) -> None:
    """One host goes through all of it: each step begins where the one before it ended."""
    for parent in (tmp_path, *tmp_path.parents[:2]):
        os.chmod(parent, 0o755)  # services have users of their own
    (tmp_path / "shared").mkdir()
    with booted(tmp_path / "root", tmp_path / "shared") as machine:
        host = Host(machine, tmp_path / "shared")
        for step in DAYS:
            step(host)
