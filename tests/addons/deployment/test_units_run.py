"""From a launch file to processes that talk, by the files alone: bundles on two hosts, generated units started.

Each host has a network namespace of its own where the machine permits it; what starts the units stands in for systemd.
"""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from xml.sax.saxutils import quoteattr

import pytest

from enclave_addons.deployment import ImportOptions, export_hosts, import_bundle, load_hosts, pinned
from tests.addons.deployment.kit import export, launch_file, provisioned, secure_plan, set_up_ros
from tests.addons.deployment.networks import Network, two_networks
from tests.addons.deployment.systemd_stand_in import StandIn, Unit
from tests.dds.conftest import cyclone as cyclone
from tests.dds.conftest import domain_id as domain_id
from tests.dds.conftest import fastdds as fastdds
from tests.dds.probe import Participant, Probe

pytestmark = pytest.mark.dds

HOSTS = "version: 1\nhosts:\n  arm: {nodes: [/ear, /outsider]}\n  base: {enclaves: ['/front/*']}\n"
LONGEST = 60.0  # seconds; only what hangs takes so long


@pytest.fixture
def networks() -> Iterator[dict[str, Network]]:
    with two_networks() as (one, two):
        yield {"base": one, "arm": two}


def robot(domain: int, networks: dict[str, Network]) -> str:
    def node(executable: str, attributes: str, host: str, more: str) -> str:
        uri = f'<env name="CYCLONEDDS_URI" value={quoteattr(networks[host].cyclonedds_uri)}/>'
        ends = '<param name="seconds" value="40"/><param name="rate" value="10"/>'
        return f'<node pkg="demo_nodes" exec="{executable}" {attributes}>{uri}{ends}{more}</node>'

    talk = '<remap from="chatter" to="/talk"/>'
    return f"""<launch>
      <set_env name="ROS_DOMAIN_ID" value="{domain}"/>
      <set_env name="RMW_IMPLEMENTATION" value="rmw_cyclonedds_cpp"/>
      {node("talker", 'name="speaker" namespace="front"', "base", talk)}
      {node("listener", 'name="ear" on_exit="shutdown"', "arm", talk + '<param name="count" value="3"/>')}
    </launch>"""


def deployed(tmp_path: Path, text: str) -> dict[str, Path]:
    """Host -> folder of its units; on each host its bundle is imported, and nothing else of the keystore is there."""
    (tmp_path / "hosts.yaml").write_text(HOSTS)
    launch = launch_file(tmp_path, text)
    ca = provisioned(launch, tmp_path / "ca")
    enclaves = tmp_path / "placed.yaml"
    hosts = ("--hosts", str(tmp_path / "hosts.yaml"))
    assert secure_plan("hosts", launch, *hosts, "--write-enclaves", str(enclaves)) == 0
    assigned = {host: one.enclaves for host, one in load_hosts(enclaves).hosts.items()}
    for bundle in export_hosts(ca, tmp_path / "bundles", assigned):
        host = bundle.manifest.host
        (tmp_path / host).mkdir()
        pins = ImportOptions(host, pinned(bundle.manifest))
        import_bundle(tmp_path / host / "keystore", bundle.path, options=pins)
        words = ("--host-keystore", str(tmp_path / host / "keystore"), "--setup", set_up_ros(tmp_path))
        assert export("systemd", launch, ca, tmp_path / f"units-{host}", *hosts, *words) == 0
    ca.rename(tmp_path / "far away")
    return {host: tmp_path / f"units-{host}" / host for host in assigned}


def install_parameters(unit: Unit, folder: Path) -> Unit:
    """They belong in /etc/ros; here they are taken from where they were generated."""
    unit.settings["ExecStart"] = [
        unit.one("ExecStart").replace("/etc/ros/ros-robot/parameters", str(folder / "parameters"))
    ]
    return unit


def test_generated_units_talk_securely_between_two_hosts_on_cyclone_dds(
    tmp_path: Path, domain_id: int, networks: dict[str, Network], cyclone: Probe
) -> None:
    folders = deployed(tmp_path, robot(domain_id, networks))
    started = []
    try:
        for host, name in (("base", "ros-robot-front-speaker"), ("arm", "ros-robot-ear")):
            unit = install_parameters(Unit(folders[host] / f"{name}.service"), folders[host])
            running = StandIn(unit, tmp_path / "systemd").start(networks[host].prefix)
            started.append(running)
        speaker, ear = started
        heard, _ = ear.communicate(timeout=LONGEST)
        os.killpg(speaker.pid, signal.SIGINT)  # KillSignal=
        said, _ = speaker.communicate(timeout=LONGEST)
    finally:
        for running in started:
            if running.poll() is None:
                os.killpg(running.pid, signal.SIGKILL)
                running.wait()
    assert "is up, secured by enclave /ear" in heard, heard
    assert "I heard: [Hello World: " in heard, heard
    assert "is up, secured by enclave /front/speaker" in said, said
    assert ear.returncode == 0


def test_a_unit_without_its_credentials_does_not_start_unsecured(
    tmp_path: Path, domain_id: int, cyclone: Probe
) -> None:
    from tests.addons.deployment.networks import LOOPBACK

    folders = deployed(tmp_path, robot(domain_id, {"base": LOOPBACK, "arm": LOOPBACK}))
    unit = install_parameters(Unit(folders["arm"] / "ros-robot-ear.service"), folders["arm"])
    unit.settings["LoadCredential"] = [
        line for line in unit.all("LoadCredential") if not line.startswith("cert.pem")
    ]
    running = StandIn(unit, tmp_path / "systemd").start()
    output, _ = running.communicate(timeout=LONGEST)
    assert running.returncode == 1, output
    assert "is up" not in output


def test_participants_of_imported_bundles_talk_between_two_hosts_on_fast_dds(
    tmp_path: Path, domain_id: int, networks: dict[str, Network], fastdds: Probe
) -> None:
    deployed(tmp_path, robot(domain_id, networks))
    places = {host: tmp_path / host / "keystore/enclaves" for host in networks}
    speaker = Participant(
        "speaker", places["base"] / "front/speaker", publish=("rt/talk",),
        environment=networks["base"].probe_environment,
    )  # fmt: skip
    ear = Participant(
        "ear", places["arm"] / "ear", subscribe=("rt/talk",), environment=networks["arm"].probe_environment
    )
    probes = {host: Probe(host, (*network.prefix, *fastdds.command), 1) for host, network in networks.items()}
    with (
        probes["base"]._running(domain_id, [speaker], LONGEST) as talking,
        probes["arm"]._running(domain_id, [ear], LONGEST) as listening,
    ):
        listening.wait_for_voices({"speaker"})
        time.sleep(0.5)
        assert listening.answers().voices == {"speaker"}, listening.answers().log + talking.answers().log
