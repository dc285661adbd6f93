"""``secure-launch --secure`` with RMW_IMPLEMENTATION=rmw_zenoh_cpp, on a real router."""

from __future__ import annotations

import contextlib
import json
import re
import socket
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from tests.addons.zenoh.workspace import Workspace


@pytest.fixture(scope="module")
def launched(tmp_path_factory: pytest.TempPathFactory) -> tuple[Workspace, str]:
    """One launch with a talker that also sends what it may not, everything set in its way that could help it."""
    workspace = Workspace(tmp_path_factory.mktemp("zenoh"))
    workspace.at_a_free_port()
    override = 'mode="peer"'
    own = f"<env name='ZENOH_CONFIG_OVERRIDE' value='{override}'/><env name='ROS_STATIC_PEERS' value='127.0.0.1'/>"
    done = workspace.secure_launch(
        workspace.launch_file(own), ZENOH_CONFIG_OVERRIDE='mode="router"', ZENOH_SESSION_CONFIG_URI="/nowhere",
        ROS_AUTOMATIC_DISCOVERY_RANGE="SUBNET",
    )  # fmt: skip
    assert done.returncode == 0, done.stdout
    return workspace, done.stdout


def test_the_planned_topic_arrives_and_nothing_else(launched: tuple[Workspace, str]) -> None:
    assert "heard ['hello']" in launched[1]


def test_no_variable_leads_a_process_past_its_configuration(launched: tuple[Workspace, str]) -> None:
    assert 'mode "client" enclave /listener' in launched[1]
    for variable in ("ZENOH_CONFIG_OVERRIDE", "ROS_STATIC_PEERS"):
        assert re.search(
            f"{variable}=.* of the launch file has no effect on talker-1 under --secure", launched[1]
        )


def test_the_router_is_started_and_ended_with_the_launch(launched: tuple[Workspace, str]) -> None:
    workspace, output = launched
    assert "[rmw_zenohd] router begins" in output
    host, port = json.loads((workspace.keystore / "zenoh/router.json5").read_text())["metadata"][
        "address"
    ].split(":")
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection((host, int(port)), timeout=5.0)


def test_rules_name_the_types_that_the_launch_knows(launched: tuple[Workspace, str]) -> None:
    text = (launched[0].keystore / "zenoh/router.json5").read_text()
    assert '"0/chatter/std_msgs::msg::dds_::String_/*"' in text and '"0/chatter/*/*"' not in text
    assert '"0/rosout/rcl_interfaces::msg::dds_::Log_/*"' in text


def test_a_second_launch_writes_nothing_and_verify_finds_nothing(launched: tuple[Workspace, str]) -> None:
    workspace, _ = launched
    before = (workspace.keystore / "zenoh/router.json5").stat().st_mtime_ns
    done = workspace.secure_launch(workspace.launch_file())
    assert done.returncode == 0 and "heard ['hello']" in done.stdout, done.stdout
    assert (workspace.keystore / "zenoh/router.json5").stat().st_mtime_ns == before
    assert "0 findings" in workspace.keystore_command("verify")


def test_each_process_is_in_the_domain_of_its_own_environment(tmp_path: Path) -> None:
    workspace = Workspace(tmp_path)
    workspace.at_a_free_port()
    done = workspace.secure_launch(workspace.launch_file(), ROS_DOMAIN_ID="7")
    assert done.returncode == 0 and "heard ['hello']" in done.stdout, done.stdout
    text = (workspace.keystore / "zenoh/router.json5").read_text()
    assert '"7/chatter/' in text and '"0/chatter/' not in text


def test_without_an_installed_router_it_is_said_what_is_missing_and_nothing_is_written(
    tmp_path: Path,
) -> None:
    workspace = Workspace(tmp_path, router=False)
    done = workspace.secure_launch(workspace.launch_file())
    assert done.returncode == 1 and "Traceback" not in done.stdout
    assert "lib/rmw_zenoh_cpp/rmw_zenohd" in done.stdout and "ros-$ROS_DISTRO-rmw-zenoh-cpp" in done.stdout
    assert not workspace.keystore.exists()


def test_what_only_looks_at_dds_is_not_taken_for_a_watch_of_zenoh(tmp_path: Path) -> None:
    workspace = Workspace(tmp_path)
    workspace.at_a_free_port()
    done = workspace.secure_launch("--watch", workspace.launch_file())
    assert (
        done.returncode == 2 and "--watch looks at DDS only, and talker-1, listener-2 on Zenoh" in done.stdout
    )
    assert "process started" not in done.stdout


def test_drift_of_a_plan_on_zenoh_is_refused_and_not_told_as_missing_nodes(tmp_path: Path) -> None:
    workspace = Workspace(tmp_path)
    done = subprocess.run(
        [sys.executable, "-m", "enclave_addons.review.verb", "drift", "--prefix", str(workspace.prefix),
         str(workspace.launch_file())],
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=90,
    )  # fmt: skip
    assert done.returncode == 2 and "only DDS is observed" in done.stdout, done.stdout
    assert "talker-1, listener-2" in done.stdout and "missing" not in done.stdout


def test_a_stranger_in_the_place_of_the_router_is_not_taken_for_it(tmp_path: Path) -> None:
    workspace = Workspace(tmp_path)
    address = workspace.at_a_free_port()
    with socket.create_server(("127.0.0.1", int(address.split(":")[1]))) as server:
        threading.Thread(target=_hang_up, args=(server,), daemon=True).start()
        done = workspace.secure_launch(workspace.launch_file())
    assert done.returncode == 1 and "not this keystore's router answers" in done.stdout, done.stdout


def _hang_up(server: socket.socket) -> None:
    with contextlib.suppress(OSError):  # closed by the test
        while True:
            server.accept()[0].close()
