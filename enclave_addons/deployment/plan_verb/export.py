"""Write what runs the plan without launch: systemd units, a Compose file, or Kubernetes objects.

  secure-plan export --format systemd --keystore ks -o deploy/ PACKAGE LAUNCH_FILE

Every process gets its enclave and nothing else; what the engine cannot express (event handlers, timers, components
that the launcher loads) is named and refused, unless --accept-unexpressed leaves it out. With several hosts there is a
folder for each. Generating again replaces only what was generated (docs/deployment.md).

exit status: 0 written, 1 the plan cannot be expressed or is not provisioned, 2 wrong usage
"""

from __future__ import annotations

import argparse
import os
import re
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

from enclave_addons.deployment.compose import compose_files
from enclave_addons.deployment.deployment import Deployment, File, read_material
from enclave_addons.deployment.kubernetes import kubernetes_files
from enclave_addons.deployment.placement import ONLY_HOST, Placement, in_restart_order, place
from enclave_addons.deployment.plan_verb.hosts import HOSTS, hosts_of
from enclave_addons.deployment.processes import DeployedProcess, deployed_processes, label
from enclave_addons.deployment.semantics import (
    Engine,
    Unexpressed,
    differences,
    ends_launch,
    unexpressed,
    unexpressed_needs,
)
from enclave_addons.deployment.systemd import home_paths, systemd_files
from enclave_addons.deployment.units import MARK
from enclave_addons.review.document import plan_from_document
from enclave_addons.review.information_flow import flow_graph
from enclave_addons.review.verb.plans import read_plan
from enclave_common.command_line import FLAG, PATH, TEXT, TEXTS, FromProject
from enclave_common.terminal import message, printable
from enclave_launch.admission.middleware import ZENOH
from enclave_launch.dry_run import DryRun
from enclave_launch.errors import ManifestError, UsageError
from keystore.disk.store import write_new

_USER = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*(:[A-Za-z0-9_][A-Za-z0-9_.-]*)?")
ENGINES = ("systemd", "compose", "kubernetes")


OPTIONS = {
    "": (
        ("--format", {"choices": ENGINES, "required": True}, "what runs the processes"),
        ("-o --output DIR", {**PATH, "required": True}, "where the files are written"),
        ("--keystore DIR", {"configured": FromProject("keystore")},
         "where the plan is provisioned: what its enclaves hold"),
        HOSTS,
        ("--name", TEXT, "of target, project or namespace (default: ros- and the launch file's name)"),
        ("--accept-unexpressed", FLAG, "leave out what the engine cannot express"),
        ("--host-keystore PATH", {"default": "/etc/ros/keystore"},
         "where bundles are imported on the hosts (/etc/ros/keystore)"),
    ),
    "systemd": (
        ("--setup FILE", TEXTS,
         "the workspace's, such as /opt/robot/install/setup.sh: sourced before each process; repeatable"),
    ),
    "compose and kubernetes": (
        ("--image", TEXT, "of every process; its entrypoint sets up ROS"),
        ("--user", {"default": "10001:10001"}, "uid:gid in Compose's containers (10001:10001)"),
        ("--host-network", FLAG, "Compose: containers share the host's network, as several hosts need"),
    ),
}  # fmt: skip


def run(options: argparse.Namespace) -> int:
    """Write the files. Returns 0."""
    _check(options)
    document = read_plan(options.words, options)
    engine = Engine(options.format)
    _refuse_problems(document)
    hosts = hosts_of(options.hosts)
    processes = [one._replace(needs=hosts.needs_of(one.nodes)) for one in deployed_processes(document)]
    placement = place(processes, hosts)
    lost = (*unexpressed(document, engine), *unexpressed_needs(processes, engine))
    _refuse_lost(lost, engine, options.accept_unexpressed)
    _refuse_nowhere(placement)
    several = list(placement.hosts) != [ONLY_HOST]
    _refuse_separate_networks(placement, engine, options.host_network)
    shared = _deployment(document, placement, lost, options)
    made = {}
    for host, own in placement.hosts.items():
        if own:
            folder = options.output / host if several else options.output
            made[folder] = _files(_on_host(shared, host if several else None, own), options)
    _report(processes, engine, options.setup)
    changed = [str(folder / name) for folder, files in made.items() for name in write_folder(folder, files)]
    sys.stdout.write("".join(f"{printable(name)}\n" for name in changed) or "nothing changed\n")
    return 0


def _check(options: argparse.Namespace) -> None:
    if options.keystore is None:
        raise UsageError("--keystore DIR is needed, or keystore in enclaves.yaml: what the enclaves hold")
    if options.format != "systemd" and not options.image:
        raise UsageError(f"--format {options.format} needs --image")
    if not _USER.fullmatch(options.user):
        raise UsageError(f"--user {options.user!r}: UID:GID or NAME:GROUP is needed")
    paths = [("--host-keystore", options.host_keystore), *(("--setup", file) for file in options.setup)]
    for name, path in paths:
        if not path.startswith("/") or not path.isprintable() or " " in path or ":" in path:
            raise UsageError(
                f"{name} {path!r}: an absolute path on the host without blanks and colons is needed"
            )


def _refuse_problems(document: DryRun) -> None:
    problems = [one.text for one in document.diagnostics if one.severity == "error"]
    if problems:
        raise ManifestError("\n".join((*problems, "the plan is not complete, so nothing was written")))
    zenoh = sorted(one.process for one in document.processes if one.middleware == ZENOH)
    if zenoh:
        raise ManifestError(
            f"{', '.join(zenoh)} on Zenoh ({ZENOH}): without a router and its files they would run unprotected, and "
            "export does not write these yet; nothing was written. Start them with secure-launch (docs/zenoh.md)"
        )


def _refuse_lost(lost: tuple[Unexpressed, ...], engine: Engine, accepted: bool) -> None:
    for one in lost if accepted else ():
        print(f"secure-plan: warning: left out: {message(one)}", file=sys.stderr)
    if lost and not accepted:
        listed = "\n".join(f"  {one}" for one in lost)
        raise ManifestError(
            f"{engine.value} cannot express this part of the launch:\n{listed}\n"
            "nothing was written; change the launch file, or leave it out with --accept-unexpressed"
        )


def _refuse_nowhere(placement: Placement) -> None:
    if placement.nowhere:
        listed = ", ".join(one.shown for one in placement.nowhere)
        raise UsageError(f"on no host: {listed}; name them in the hosts file")
    for enclave, hosts in placement.shared.items():
        print(
            f"secure-plan: warning: enclave {enclave} lives on {', '.join(hosts)}: one private key on several hosts",
            file=sys.stderr,
        )


def _refuse_separate_networks(placement: Placement, engine: Engine, host_network: bool) -> None:
    hosts = [host for host, own in placement.hosts.items() if own]
    if engine is Engine.COMPOSE and len(hosts) > 1 and not host_network:
        raise UsageError(
            f"a network of Compose ends at its host, so processes on {', '.join(hosts)} would not reach each other. "
            "Share the hosts' network with the containers: --host-network (they are then not separated from what "
            "else is on it); or use --format systemd or kubernetes"
        )


def _report(processes: list[DeployedProcess], engine: Engine, setup: list[str]) -> None:
    warnings = []
    for one in processes:
        if one.needs.devices and not one.needs.groups and engine is not Engine.KUBERNETES:
            warnings.append(
                f"{one.shown} may open {', '.join(one.needs.devices)} only if every user may: name the "
                "group of the device in the hosts file (needs: groups: [video])"
            )
        homes = home_paths(one, tuple(setup)) if engine is Engine.SYSTEMD else ()
        if homes:
            warnings.append(f"{one.shown} reads below a home directory: {', '.join(homes)} is left readable")
    for text in warnings:
        print(f"secure-plan: warning: {message(text)}", file=sys.stderr)


def _deployment(
    document: DryRun,
    placement: Placement,
    lost: tuple[Unexpressed, ...],
    options: argparse.Namespace,
) -> Deployment:
    graph = flow_graph(plan_from_document(document))
    notes = differences(document, Engine(options.format))
    file = Path([word for word in options.words if ":=" not in word][-1])
    for note in notes:
        print(f"secure-plan: warning: {note}", file=sys.stderr)
    processes = tuple(one for own in placement.hosts.values() for one in own)
    secured = [one for one in processes if one.enclave is not None]
    return Deployment(
        name=label(options.name or f"ros-{file.name.partition('.')[0]}"),
        source=" ".join(options.words),
        host=None,
        processes=processes,
        order=tuple(one.name for one in in_restart_order(processes, graph)),
        members={
            domain: tuple(sorted(one.name for one in secured if one.entry.domain_id == domain))
            for domain in {one.entry.domain_id for one in secured}
        },
        material=read_material(options.keystore, [one.enclave for one in secured if one.enclave is not None]),
        ends_launch=ends_launch(document),
        lost=lost,
        notes=notes,
    )


def _on_host(shared: Deployment, host: str | None, processes: tuple[DeployedProcess, ...]) -> Deployment:
    names = {one.name for one in processes}
    enclaves = {one.enclave for one in processes}
    return shared._replace(
        host=host,
        processes=processes,
        order=tuple(name for name in shared.order if name in names),
        material={path: one for path, one in shared.material.items() if path in enclaves},
    )


def _files(deployment: Deployment, options: argparse.Namespace) -> dict[str, File]:
    keystore = options.host_keystore
    if options.format == "systemd":
        parameters = f"/etc/ros/{deployment.name}/parameters"
        return systemd_files(deployment, keystore=keystore, parameters=parameters, setup=tuple(options.setup))
    if options.format == "compose":
        return compose_files(
            deployment,
            image=options.image,
            user=options.user,
            keystore=keystore,
            host_network=options.host_network,
        )
    return kubernetes_files(deployment, image=options.image)


_HEAD = 400  # bytes in which the mark stands


def write_folder(folder: Path, files: Mapping[str, File]) -> tuple[str, ...]:
    """Write ``files``, remove generated files that are no longer among them, and return the names that changed.

    Raises UsageError, before anything is changed, for a file that was not generated or cannot be written.
    """
    try:
        stale = [name for name in _generated(folder) if name not in files]
        changed = [name for name, file in files.items() if _differs(folder / name, file, folder)]
        aside = {name: _write_aside(folder / name, files[name]) for name in changed}
        for name, path in aside.items():
            os.replace(path, folder / name)
        for name in stale:
            (folder / name).unlink()
    except OSError as error:
        raise UsageError(f"cannot write {error.filename or folder}: {error.strerror}") from error
    return (*changed, *stale)


def _differs(path: Path, file: File, folder: Path) -> bool:
    if not os.path.lexists(path):
        return True
    if path.is_symlink() or not path.is_file() or not _is_generated(path):
        raise UsageError(f"{path} was not generated by secure-plan export; choose another -o than {folder}")
    return path.read_text(encoding="utf-8") != file.text or path.stat().st_mode & 0o777 != file.mode


def _write_aside(path: Path, file: File) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    aside = path.with_name(f".{path.name}.{os.getpid()}.partial")
    aside.unlink(missing_ok=True)
    write_new(aside, file.text.encode(), file.mode)
    return aside


def _generated(folder: Path) -> Iterator[str]:
    for below in ("", "parameters/"):
        place = folder / below
        if not place.is_dir():
            continue
        for entry in sorted(os.listdir(place)):
            path = place / entry
            if path.is_file() and not path.is_symlink() and _is_generated(path):
                yield below + entry


def _is_generated(path: Path) -> bool:
    with open(path, "rb") as stream:
        return MARK.encode() in stream.read(_HEAD)
