"""podman runs what was exported: a Compose file and Kubernetes objects, in containers of a booted machine.

The image holds nothing but an entrypoint; the programs, the workspace and Cyclone DDS are this machine's, mounted
read-only by an override file, as a test cannot download an image.
"""

from __future__ import annotations

import json
import os
import sys
import tarfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
import yaml

from enclave_addons.deployment import BundleOptions, export_hosts, pinned
from keystore import RenewOptions, renew
from tests.addons.deployment.booted import Machine, booted, repository_folders
from tests.addons.deployment.kit import export, launch_file, provisioned, tool
from tests.addons.deployment.robot import HEARD, until
from tests.keystore.kit import options

pytestmark = pytest.mark.dds

IMAGE = "localhost/robot:1"
USER = "10001:10001"
FOLDERS = tuple(dict.fromkeys(("/usr", *repository_folders(), "/etc/ld.so.cache")))
URI = (
    "&lt;CycloneDDS>&lt;Domain Id='any'>&lt;Discovery>&lt;ParticipantIndex>auto&lt;/ParticipantIndex>"
    "&lt;/Discovery>&lt;/Domain>&lt;/CycloneDDS>"
)
ROBOT = f"""<launch>
  <set_env name="RMW_IMPLEMENTATION" value="rmw_cyclonedds_cpp"/>
  <set_env name="CYCLONEDDS_URI" value="{URI}"/>
  <node pkg="demo_nodes" exec="talker" name="speaker" namespace="front">
    <param name="rate" value="10"/><param name="seconds" value="600"/><remap from="chatter" to="/talk"/>
  </node>
  <node pkg="demo_nodes" exec="listener" name="ear">
    <param name="seconds" value="600"/><remap from="chatter" to="/talk"/>
  </node>
</launch>
"""
# Cgroups and limits as far as a machine without CAP_SYS_RESOURCE has them: not what is tested.
CONFIGURATION = {
    "containers.conf": """[containers]
cgroups = "disabled"
default_ulimits = ["nofile=1000:1000", "nproc=1000:1000"]
[engine]
cgroup_manager = "cgroupfs"
events_logger = "file"
""",
    "storage.conf": '[storage]\ndriver = "vfs"\nrunroot = "/run/containers"\ngraphroot = "/run/images"\n',
    "policy.json": '{"default": [{"type": "insecureAcceptAnything"}]}',
    "registries.conf": "",
}


@dataclass(frozen=True)
class Podman:
    """A booted machine with podman, an image, and a folder that both sides see."""

    machine: Machine
    folder: Path

    def run(self, *words: str | Path, status: int | None = 0) -> str:
        path = "PATH=/usr/local/bin:/usr/bin:/bin:/usr/sbin:/sbin"
        return self.machine.run("env", "--chdir", self.folder / "out", path, *words, status=status)

    def compose(self, *words: str, status: int | None = 0) -> str:
        files = ("-f", "compose.yaml", "-f", str(self.folder / "override.yaml"))
        return self.run("podman-compose", "-p", "robot", *files, *words, status=status)

    def log(self, container: str) -> str:
        return self.run("podman", "logs", container, status=None)

    def hears(self, container: str) -> None:
        until(lambda: HEARD in self.log(container), lambda: self.log(container))


def image(path: Path) -> Path:
    """An archive with the folders to mount at and an entrypoint, as an image of ROS has."""
    root = path / "image"
    for folder in ("etc", "proc", "sys", "dev", "tmp"):
        (root / folder).mkdir(parents=True)
    for name in ("bin", "lib", "lib64", "sbin"):
        if os.path.islink(f"/{name}"):
            (root / name).symlink_to(os.readlink(f"/{name}"))
    environment = f"PATH={Path(sys.executable).parent}:/usr/bin:/bin"
    home = f" CYCLONEDDS_HOME={os.environ['CYCLONEDDS_HOME']}" if "CYCLONEDDS_HOME" in os.environ else ""
    (root / "entrypoint").write_text(f'#!/bin/sh\nexport {environment}{home}\nexec "$@"\n')
    (root / "entrypoint").chmod(0o755)
    with tarfile.open(path / "image.tar", "w") as archive:
        archive.add(root, arcname=".")
    return path / "image.tar"


@pytest.fixture(scope="module")
def podman(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Podman]:
    for name in ("podman", "podman-compose", "netavark", "catatonit"):
        tool(name, f"apt-get install {name}", "/usr/lib/podman:/usr/bin:/usr/libexec/podman")
    folder = tmp_path_factory.mktemp("podman")
    shared = folder / "shared"
    shared.mkdir()
    with booted(folder / "root", shared) as machine:
        machine.run("mkdir", "-p", "/etc/containers", "/var/lib", "/var/tmp")
        for name, text in CONFIGURATION.items():
            machine.write(f"/etc/containers/{name}", text)
        machine.run("podman", "import", "--change", 'ENTRYPOINT ["/entrypoint"]', image(shared), IMAGE)
        yield Podman(machine, shared)


def brought(podman: Podman) -> None:
    """Bring a bundle of what the CA has now, as its host would import it."""
    host = podman.folder / "host"
    bundle = export_hosts(
        podman.folder / "ks",
        podman.folder / "bundles",
        {"robot": ["*"]},
        options=BundleOptions(durable=False),
    )[0]
    pins = [word for pin in pinned(bundle.manifest) for word in ("--require-ca", pin)]
    first = () if host.exists() else ("--host", "robot", "--owner", USER, *pins)
    command = Path(sys.executable).parent / "secure-keystore"
    podman.machine.run(command, "import", host, bundle.path, *first)


def exported(podman: Podman, engine: str) -> None:
    file = launch_file(podman.folder, ROBOT)
    keystore = podman.folder / "ks"
    if not keystore.exists():
        provisioned(file, keystore)
    words = (
        "--image",
        IMAGE,
        *(("--host-keystore", str(podman.folder / "host")) if engine == "compose" else ()),
    )
    assert export(engine, file, keystore, podman.folder / "out", *words) == 0


def test_an_exported_compose_file_runs_secured_and_a_renewed_enclave_is_read_when_its_container_is_made_again(
    podman: Podman,
) -> None:
    exported(podman, "compose")
    mounts = [f"{folder}:{folder}:ro" for folder in FOLDERS]
    override = {"services": {name: {"volumes": mounts} for name in ("front-speaker", "ear")}}
    (podman.folder / "override.yaml").write_text(yaml.safe_dump(override))
    brought(podman)
    podman.compose("up", "--detach")
    podman.hears("robot_ear_1")
    assert "secured by enclave /ear" in podman.log("robot_ear_1")

    renew(podman.folder / "ks", ["/ear"], options=RenewOptions(provisioning=options()))
    brought(podman)
    podman.compose("up", "--detach", "--force-recreate")
    podman.hears("robot_ear_1")
    podman.compose("down")


def test_podman_makes_a_pod_of_each_exported_deployment_with_its_enclave_and_no_other(podman: Podman) -> None:
    """They are made and not started: a pod wants cgroups, see CONFIGURATION."""
    exported(podman, "kubernetes")
    for name in ("secrets.yaml", "launch.yaml"):
        podman.run(
            "env",
            "CONTAINERS_CONF=/dev/null",
            "podman",
            "kube",
            "play",
            "--start=false",
            podman.folder / "out" / name,
        )
    for container, enclave in (("ear", "/ear"), ("front-speaker", "/front/speaker")):
        found = json.loads(podman.run("podman", "inspect", f"{container}-pod-0-{container}"))[0]
        mounted = [
            mount["Destination"] for mount in found["Mounts"] if mount["Destination"].startswith("/keystore")
        ]
        assert mounted == [f"/keystore/enclaves{enclave}"]
        assert found["Config"]["User"] == USER
