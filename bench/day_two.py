"""What a change of the fleet changes: 20 hosts with 20 processes each, an enclave for every process.

    python bench/day_two.py [HOSTS] [PROCESSES]

For each event: bundles that are new, enclaves whose files are new on some host, processes to restart, and what an
export to systemd (unit files) and Kubernetes (objects) changes; of the latter, how many workloads. Then the processor
time of the event and of exporting all bundles. All is done by this very code, on a launch file made for it.
"""

from __future__ import annotations

import contextlib
import io
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import yaml

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from enclave_addons.deployment.host_bundles import BundleOptions, export_hosts, pinned  # noqa: E402
from enclave_addons.deployment.importing import ImportOptions, ImportReport, Restart, import_bundle  # noqa: E402
from enclave_addons.review.verb import main as secure_plan  # noqa: E402
from enclave_launch.enclave import EnclaveScope  # noqa: E402
from enclave_launch.flow import provision, resolve  # noqa: E402
from enclave_launch.options import ResolveOptions, SecurityOptions  # noqa: E402
from keystore.steps.options import ProvisionOptions  # noqa: E402
from keystore.steps.removal import RemoveOptions, remove  # noqa: E402
from keystore.steps.renewal import RenewOptions, renew  # noqa: E402
from keystore.steps.rollover import Step, roll_over  # noqa: E402

WORKSPACE = ROOT / "fixtures/demo_ws"
OPTIONS = ProvisionOptions(durable=False)


class Fleet:
    """A CA, a launch file over several hosts, and the hosts."""

    def __init__(self, folder: Path, hosts: int, processes: int):
        self.folder = folder
        self.ca = folder / "ca"
        self.nodes = [
            (f"host{host}", f"node{number}") for host in range(hosts) for number in range(processes)
        ]
        self.hosts = [f"host{host}" for host in range(hosts)]
        self._launch = folder / "fleet.launch.xml"
        self.present: dict[str, Any] = {}

    def provision(self) -> None:
        """Write the launch file and the hosts file, and bring the keystore to what they want."""
        lines = (
            f'<node pkg="demo_nodes" exec="talker" namespace="{host}" name="{name}"/>'
            for host, name in self.nodes
        )
        self._launch.write_text("<launch>\n" + "\n".join(lines) + "\n</launch>\n")
        hosts = {host: {"nodes": [f"/{host}/*"], "enclaves": [f"/{host}/*"]} for host in self.hosts}
        (self.folder / "hosts.yaml").write_text(yaml.safe_dump({"version": 1, "hosts": hosts}))
        plan = resolve(
            self._launch, options=ResolveOptions(prefixes=(WORKSPACE,), enclave_scope=EnclaveScope.NODE)
        )
        provision(plan, self.ca, options=SecurityOptions(keystore=OPTIONS))

    def bring(self) -> tuple[int, list[ImportReport], float]:
        """Export all bundles and import them; new bundles, what each host says, and seconds of exporting."""
        begin = time.process_time()
        made = export_hosts(
            self.ca, self.folder / "bundles", {host: [f"/{host}/*"] for host in self.hosts},
            options=BundleOptions(durable=False),
        )  # fmt: skip
        spent = time.process_time() - begin
        reports = []
        for one in made:
            host = one.manifest.host
            is_first = not (self.folder / host).is_symlink()
            pins = ImportOptions(host, pinned(one.manifest) if is_first else ())
            reports.append(import_bundle(self.folder / host, one.path, options=pins))
        return sum(one.is_new for one in made), reports, spent

    def deploy(self) -> tuple[int, int, int]:
        """Export units and objects; changed unit files, changed objects, and workloads among these."""
        found: dict[str, Any] = {}
        for engine in ("systemd", "kubernetes"):
            words = ["export", "--format", engine, "--keystore", self.ca, "-o", self.folder / engine]
            words += ["--hosts", self.folder / "hosts.yaml", "--image", "robot:1", "--prefix", WORKSPACE]
            words += ["--enclave-scope", "node", self._launch]
            with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
                assert secure_plan([str(word) for word in words]) == 0
        for path in (self.folder / "systemd").rglob("*.service"):
            found[f"unit {path}"] = path.read_text()
        for path in (self.folder / "kubernetes").rglob("*.yaml"):
            for one in yaml.load_all(path.read_text(), Loader=yaml.CSafeLoader):
                found[f"{one['kind']} {one['metadata']['name']}"] = one
        before, self.present = self.present, found
        changed = [name for name in {*before, *found} if before.get(name) != found.get(name)]
        units = sum(name.startswith("unit ") for name in changed)
        return units, len(changed) - units, sum(name.startswith("Deployment ") for name in changed)


class Row(NamedTuple):
    """What one event changed; seconds of processor time."""

    event: str
    bundles: int
    enclaves: int
    restarts: int
    units: int
    objects: int
    workloads: int
    seconds: float
    export_seconds: float


def after(fleet: Fleet, event: str, change: Callable[[], object]) -> Row:
    """Do ``change`` and bring it to the hosts."""
    begin = time.process_time()
    change()
    spent = time.process_time() - begin
    bundles, reports, export_seconds = fleet.bring()
    enclaves = sum(len(one.changed) + len(one.removed) for one in reports)
    restarts = sum(
        len(one.changed) if one.restart in (Restart.NOBODY, Restart.CHANGED) else len(one.manifest.names)
        for one in reports
    )
    return Row(event, bundles, enclaves, restarts, *fleet.deploy(), spent, export_seconds)


def events(fleet: Fleet) -> list[Row]:
    """All events, one after the other."""
    one, other = (f"/{host}/{name}" for host, name in (fleet.nodes[0], fleet.nodes[-1]))

    def add() -> None:
        fleet.nodes.append((fleet.hosts[0], "added"))
        fleet.provision()

    def revoke() -> None:
        remove(fleet.ca, [other], options=RemoveOptions(durable=False))
        fleet.nodes.remove((fleet.hosts[-1], other.rpartition("/")[2]))
        fleet.provision()

    steps = [
        after(fleet, "all is new", fleet.provision),
        after(fleet, "nothing", lambda: None),
        after(
            fleet,
            "one enclave renewed",
            lambda: renew(fleet.ca, [one], options=RenewOptions(provisioning=OPTIONS)),
        ),
        after(fleet, "a node more", add),
        after(fleet, "a node removed, revoked", revoke),
    ]
    for step in Step:
        steps.append(
            after(fleet, f"new CA: {step.value}", partial(roll_over, fleet.ca, step, options=OPTIONS))
        )
    return steps


def main() -> None:
    hosts, processes = (int(word) for word in (*sys.argv[1:], *("20", "20")[len(sys.argv) - 1 :]))
    print(f"{hosts} hosts with {processes} processes each: what is new after each event")
    print(f"{'event':25}{'bundles':>8}{'enclaves':>9}{'restarts':>9}{'units':>7}{'objects':>8}{'workloads':>10}"
          f"{'event':>9}{'export':>9}")  # fmt: skip
    with tempfile.TemporaryDirectory() as name:
        for row in events(Fleet(Path(name), hosts, processes)):
            counts = "".join(
                f"{count:>{width}}" for count, width in zip(row[1:7], (8, 9, 9, 7, 8, 10), strict=True)
            )
            print(f"{row.event:25}{counts}{row.seconds:>7.1f} s{row.export_seconds:>7.1f} s")


if __name__ == "__main__":
    main()
