"""What the tests of deployment share: a launch written down, provisioned, and exported as a user would."""

from __future__ import annotations

import os
import shlex
import shutil
import sys
from pathlib import Path

import pytest

from enclave_addons.deployment.bundle_file import sealed_bundle
from enclave_addons.review.verb import main
from enclave_launch import EnclaveScope, ResolveOptions, SecurityOptions, provision, resolve
from keystore import ProvisionOptions
from keystore.disk import layout
from keystore.disk.deployed import read_manifest

DEMO_WS = Path(__file__).parents[3] / "fixtures" / "demo_ws"

TALK = """<launch>
  <node pkg="demo_nodes" exec="talker" name="speaker" namespace="front"><remap from="chatter" to="/talk"/></node>
  <node pkg="demo_nodes" exec="listener" name="ear"><remap from="chatter" to="/talk"/></node>
</launch>
"""


def launch_file(folder: Path, text: str = TALK, name: str = "robot.launch.xml") -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_text(text)
    return folder / name


def provisioned(launch: Path, keystore: Path) -> Path:
    """An enclave for each node."""
    options = ResolveOptions(prefixes=(DEMO_WS,), enclave_scope=EnclaveScope.NODE)
    given = SecurityOptions(keystore=ProvisionOptions(durable=False))
    provision(resolve(launch, options=options), keystore, options=given)
    return keystore


def secure_plan(verb: str, launch: Path, *words: str) -> int:
    resolving = () if launch.suffix == ".json" else ("--prefix", str(DEMO_WS), "--enclave-scope", "node")
    return main([verb, *words, *resolving, str(launch)])


def export(engine: str, launch: Path, keystore: Path, output: Path, *words: str) -> int:
    image = () if engine == "systemd" else ("--image", "registry.example/robot:1.0")
    given = ("--format", engine, "--keystore", str(keystore), "-o", str(output), *image, *words)
    return secure_plan("export", launch, *given)


def made(engine: str, folder: Path, text: str = TALK, *words: str) -> Path:
    """The folder of what an export of ``text`` wrote."""
    launch = launch_file(folder, text)
    assert export(engine, launch, provisioned(launch, folder / "ks"), folder / "out", *words) == 0
    return folder / "out"


def tool(name: str, how: str, path: str | None = None) -> str:
    """Its path; without it the test is skipped, or fails where nothing may be missing."""
    beside = Path(sys.executable).parent / name
    found = str(beside) if beside.exists() else shutil.which(name, path=path)
    if found is None:
        if os.environ.get("CI") == "true":
            pytest.fail(f"{name} is not available: {how}")
        pytest.skip(f"{name} is not available: {how}")
    return found


def fleet_of_fifty() -> str:
    """A launch of 50 processes, in pairs that talk to each other."""
    pairs = "".join(
        f'<node pkg="demo_nodes" exec="talker" name="speaker" namespace="part_{number}"/>'
        f'<node pkg="demo_nodes" exec="listener" name="ear" namespace="part_{number}"/>\n'
        for number in range(25)
    )
    return f"<launch>{pairs}</launch>"


def set_up_ros(folder: Path) -> str:
    """What /opt/ros/.../setup.sh is on a robot. It tries to take security away, as a careless one might."""
    file = folder / "setup.sh"
    path = f"{Path(sys.executable).parent}:$PATH"
    lines = [f'export PATH="{path}"', "export ROS_SECURITY_ENABLE=false ROS_SECURITY_ENCLAVE_OVERRIDE=/other"]
    if home := os.environ.get("CYCLONEDDS_HOME"):
        lines.append(f"export CYCLONEDDS_HOME={shlex.quote(home)}")
    file.write_text("\n".join(lines) + "\n")
    return str(file)


def files_of_bundle(content: bytes) -> dict[str, bytes]:
    """Every file that a bundle carries, the manifest too."""
    sealed = sealed_bundle(content, "bundle")
    return {layout.BUNDLE: sealed.signed, **sealed.opened(read_manifest(sealed.signed, "bundle"))}
