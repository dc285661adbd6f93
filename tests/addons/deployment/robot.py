"""A host of a launch: a booted machine, the CA that makes its bundles, and what a user runs on either."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

from enclave_addons.deployment import BundleOptions, HostBundle, export_hosts, load_hosts, pinned
from enclave_addons.deployment.host_bundles import enclaves_of_hosts
from keystore import list_enclaves
from tests.addons.deployment.booted import Machine
from tests.addons.deployment.kit import export, launch_file, provisioned, set_up_ros
from tests.addons.deployment.networks import LOOPBACK, Network

LONGEST = 30.0  # seconds; only what hangs takes so long
KS = "/etc/ros/keystore"
HEARD = "I heard: [Hello World: "


def node(executable: str, name: str, more: str = "", network: Network = LOOPBACK) -> str:
    uri = network.cyclonedds_uri.replace('"', "&quot;").replace("<", "&lt;")
    return (
        f'<node pkg="demo_nodes" exec="{executable}" name="{name}"><env name="CYCLONEDDS_URI" value="{uri}"/>'
        f'<param name="rate" value="10"/><param name="seconds" value="600"/>{more}'
        '<remap from="chatter" to="/talk"/></node>'
    )


def robot(*nodes: str) -> str:
    return f"""<launch>
      <set_env name="RMW_IMPLEMENTATION" value="rmw_cyclonedds_cpp"/>
      {"".join(nodes)}
    </launch>"""


class Host:
    """A booted machine, the CA that makes its bundles, and the launch that it runs.

    Args:
        machine: That is booted.
        folder: That it shares with its CA, and with further hosts of the launch.
        name: As the bundle has it.
        hosts: The hosts file; without one this host has all enclaves.
    """

    def __init__(self, machine: Machine, folder: Path, name: str = "robot", hosts: Path | None = None):
        self.machine = machine
        self.ca = folder / "ca"
        self._folder = folder
        self._name = name
        self._hosts = hosts
        self._number = 0
        self._setup = "/srv/" + Path(set_up_ros(folder)).name

    def launch(self, text: str, *words: str) -> Path:
        """Provision ``text`` and export its units; return where they are."""
        out = self._folder / f"units{len(words)}"
        file = launch_file(self._folder, text)
        provisioned(file, self.ca)
        assert export("systemd", file, self.ca, out, "--setup", self._setup, *words) == 0
        return out

    def bundle(self) -> HostBundle:
        """Return a bundle of what the CA has now."""
        self._number += 1
        output = self._folder / f"bundle-{self._name}-{self._number}"
        enclaves = ["*"]
        if self._hosts is not None:
            enclaves = enclaves_of_hosts(list_enclaves(self.ca), load_hosts(self._hosts))[self._name]
        return export_hosts(self.ca, output, {self._name: enclaves}, options=BundleOptions(durable=False))[0]

    def keystore(self, *words: str | Path, status: int | None = 0) -> str:
        """Run secure-keystore there; no process is watched for longer than is needed here."""
        more = ("--settle", "0.3") if words[0] in ("import", "units") else ()
        command = (Path(sys.executable).parent / "secure-keystore", *words, *more)
        try:
            return self.machine.run("env", f"PATH={os.environ['PATH']}", *command, status=status)
        except AssertionError as error:
            log = self.machine.run("journalctl", "--no-pager", "--unit=ros-*", "--lines=40", status=None)
            raise AssertionError(f"{error}\n{log}") from None

    def first_import(self) -> None:
        """Pin the CAs, as on a host that never had a bundle."""
        bundle = self.bundle()
        pins = [word for pin in pinned(bundle.manifest) for word in ("--require-ca", pin)]
        self.machine.run("mkdir", "-p", "/etc/ros")
        self.keystore("import", KS, bundle.path, "--host", self._name, *pins)

    def take(self, *words: str | Path, status: int = 0) -> str:
        """Bring what the CA has now to the host, and restart what has to be."""
        return self.keystore("import", KS, self.bundle().path, "--restart", *words, status=status)

    def hears(self, unit: str) -> bool:
        return HEARD in self.machine.journal(unit)


def up(printed: str) -> list[str]:
    """Return the units that a restart has found up."""
    return [line.removesuffix(": up") for line in printed.splitlines() if line.endswith(": up")]


def until(what: Callable[[], bool], report: Callable[[], str]) -> None:
    """Wait until ``what`` holds; ``report`` says in an error what was there instead."""
    end = time.monotonic() + LONGEST
    while not what():
        assert time.monotonic() < end, report()
        time.sleep(0.2)
