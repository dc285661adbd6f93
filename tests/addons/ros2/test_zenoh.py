"""``ros2 launch --secure`` with processes on Zenoh, on a real router: it is started, enforces, and ends."""

from __future__ import annotations

import json
import socket

import pytest

from tests.addons.ros2.conftest import Workspace
from tests.addons.zenoh.workspace import Workspace as ZenohWorkspace

pytestmark = pytest.mark.real_launch


def test_a_launch_on_zenoh_is_secured_and_its_router_ends_with_it(workspace: Workspace) -> None:
    zenoh = ZenohWorkspace(workspace.directory / "zenoh")
    host, port = zenoh.at_a_free_port().split(":")
    override = "<env name='ZENOH_CONFIG_OVERRIDE' value='mode=\"peer\"'/>"
    done = workspace.ros2_launch(
        "--secure",
        "--keystore",
        str(zenoh.keystore),
        str(zenoh.launch_file(override)),
        prefixes=(zenoh.prefix,),
    )
    assert done.returncode == 0 and "heard ['hello']" in done.stdout, done.stdout
    assert 'mode "client" enclave /listener' in done.stdout
    assert "[rmw_zenohd] router begins" in done.stdout
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection((host, int(port)), timeout=5.0)
    text = (zenoh.keystore / "zenoh/router.json5").read_text()
    assert {one["id"] for one in json.loads(text)["access_control"]["subjects"]} == {"/talker", "/listener"}


def test_without_a_router_nothing_is_started_and_it_is_said_what_is_missing(workspace: Workspace) -> None:
    zenoh = ZenohWorkspace(workspace.directory / "zenoh", router=False)
    done = workspace.ros2_launch(
        "--secure", "--keystore", str(zenoh.keystore), str(zenoh.launch_file()), prefixes=(zenoh.prefix,)
    )
    assert done.returncode != 0 and "lib/rmw_zenoh_cpp/rmw_zenohd" in done.stdout, done.stdout
    assert "process started" not in done.stdout
    assert not zenoh.keystore.exists()
