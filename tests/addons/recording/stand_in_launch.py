"""Launches of programs on the stand-in: a workspace with scripts and manifests, run as a user runs it."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

from tests.dds.conftest import build as build_once
from tests.dds.conftest import missing

ROOT = Path(__file__).parents[3]
SOURCES = Path(__file__).parent / "stand_in"
PACKAGE = "stand_in_nodes"
QOS = "qos: {history: KEEP_LAST, depth: 10, reliability: RELIABLE}"
LISTS = {
    "publisher": "publishers",
    "subscription": "subscriptions",
    "service_server": "service_servers",
    "service_client": "service_clients",
    "action_server": "action_servers",
    "action_client": "action_clients",
}
TYPES = {
    "publisher": "std_msgs/msg/String",
    "subscription": "std_msgs/msg/String",
    "service_server": "std_srvs/srv/Empty",
    "service_client": "std_srvs/srv/Empty",
    "action_server": "test_msgs/action/Fibonacci",
    "action_client": "test_msgs/action/Fibonacci",
}


class Program(NamedTuple):
    """``script`` as of stand_in/rclcpp.c; ``manifest``: pairs of kind and name, ``None`` for no manifest."""

    name: str
    script: str
    manifest: tuple[tuple[str, str], ...] | None = None
    attributes: str = ""
    inside: str = ""
    codegen: str = "library: rclcpp"


class Workspace(NamedTuple):
    folder: Path
    programs: tuple[Program, ...]

    def manifest(self, name: str) -> Path:
        return self.folder / "share/ament_index/resource_index/nodl" / f"{PACKAGE}__{name}"

    def run(
        self, *arguments: str, variables: Mapping[str, str] | None = None, timeout: float = 90
    ) -> subprocess.CompletedProcess[str]:
        command = [
            sys.executable,
            "-m",
            "enclave_launch",
            "--prefix",
            str(self.folder),
            "--distro",
            "jazzy@2024-12",
        ]
        return subprocess.run(
            [*command, *arguments, PACKAGE, "all.launch.xml"],
            cwd=ROOT,
            env={**os.environ, "ROS_LOG_DIR": str(self.folder / "log"), **(variables or {})},
            capture_output=True,
            text=True,
            check=False,
            timeout=timeout,
        )


def build_stand_in(folder: Path) -> Path:
    """``folder`` with the stand-in's libraries and ``program``, as they would lie in an installation."""
    link = [f"-L{folder}", f"-Wl,-rpath,{folder}", "-Wl,--no-as-needed"]

    def build(name: str, source: str, *more: str) -> None:
        command = ["cc", "-g", "-fPIC", str(SOURCES / source), "-o", str(folder / name), *link, *more]
        subprocess.run(command, check=True)

    build("librcutils.so", "rcl.c", "-shared", "-DPART=1")
    build("librcl.so", "rcl.c", "-shared", "-DPART=2", "-lrcutils", "-ldl")
    build("librcl_action.so", "rcl.c", "-shared", "-DPART=3", "-lrcl", "-lrcutils")
    build("librcl_lifecycle.so", "rcl.c", "-shared", "-DPART=4", "-lrcl", "-lrcutils")
    libraries = ("-lrcl", "-lrcl_action", "-lrcl_lifecycle", "-lrcutils")
    build("librclcpp.so", "rclcpp.c", "-shared", "-pthread", *libraries)
    build("program", "program.c", "-lrclcpp")
    return folder


def build_dds(name: str) -> Path:
    """The library by which the stand-in asks a real DDS, ``cyclonedds`` or ``fastdds``; fails in CI without it."""
    if name == "fastdds":
        if not Path("/usr/include/fastdds/dds").is_dir():
            missing("Fast DDS", "apt-get install g++ libfastrtps-dev")
        probe = ROOT / "tests" / "dds" / "fastdds_probe"
        sources = [SOURCES / "fastdds.cpp", *sorted(probe.glob("participant.*")), probe / "string_type.hpp"]
        compiler = ["g++", "-std=c++17", "-shared", "-fPIC", f"-I{probe}"]
        return build_once(sources, compiler, ["-lfastrtps", "-lfastcdr"])
    home = Path(os.environ.get("CYCLONEDDS_HOME", "/usr"))
    folders = [home / "lib", *home.glob("lib/*-linux-gnu")]
    plugins = [found.parent for each in folders for found in each.glob("**/libdds_security_auth.so")]
    if not plugins:
        missing("Cyclone DDS with security", "apt-get install cyclonedds-dev")
    compiler = ["cc", "-shared", "-fPIC", f'-DPLUGINS="{plugins[0]}"', f"-I{home}/include", f"-L{home}/lib"]
    return build_once([SOURCES / "cyclonedds.c"], compiler, ["-lddsc"])


def asks(endpoints: Iterable[tuple[str, str]]) -> str:
    return "".join(f"{kind} {name} {TYPES[kind]}\n" for kind, name in endpoints)


def make_workspace(folder: Path, stand_in: Path, programs: Iterable[Program]) -> Workspace:
    made = tuple(programs)
    index = folder / "share/ament_index/resource_index"
    binaries, share = folder / "lib" / PACKAGE, folder / "share" / PACKAGE / "launch"
    for each in (index / "packages", index / "nodl", binaries, share):
        each.mkdir(parents=True, exist_ok=True)
    (index / "packages" / PACKAGE).touch()
    nodes = []
    for program in made:
        (binaries / program.name).unlink(missing_ok=True)
        (binaries / program.name).symlink_to(stand_in / "program")
        (binaries / f"{program.name}.asks").write_text(program.script)
        if program.manifest is not None:
            text = manifest_text(program.manifest, program.codegen)
            (index / "nodl" / f"{PACKAGE}__{program.name}").write_text(text)
        nodes.append(
            f'<node pkg="{PACKAGE}" exec="{program.name}" {program.attributes}>{program.inside}</node>'
        )
    (share / "all.launch.xml").write_text(f"<launch>\n{chr(10).join(nodes)}\n</launch>\n")
    return Workspace(folder, made)


def manifest_text(endpoints: Iterable[tuple[str, str]], codegen: str) -> str:
    lines = ["nodl_version: 2", f"codegen: {{enclave_launch: {{{codegen}}}}}"]
    for kind, category in LISTS.items():
        names = [name for each, name in endpoints if each == kind]
        quality = f", {QOS}" if kind in ("publisher", "subscription") else ""
        if names:
            lines.append(f"{category}:")
            lines += [f"  - {{name: {name}, type: {TYPES[kind]}{quality}}}" for name in names]
    return "\n".join([*lines, ""])
