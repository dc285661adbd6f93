"""A deployment as a Compose file: one service for each process, with the files of its enclave and no others.

``secure-keystore import --owner`` writes each enclave once more, as a directory that stands alone and belongs to the
containers' user. A service mounts that directory, read-only, so what an enclave holds is read when the service starts.
Bind mounts, because podman-compose ignores ``configs`` and Compose ignores owner and mode of ``secrets`` outside Swarm.
"""

from __future__ import annotations

import shlex
from typing import Any

from enclave_addons.deployment.deployment import Deployment, File
from enclave_addons.deployment.processes import DeployedProcess
from enclave_addons.deployment.yaml_text import yaml_text
from keystore.disk import layout

_KEYSTORE = "/keystore"
_PARAMETERS = "/parameters"


def compose_files(
    deployment: Deployment, *, image: str, user: str, keystore: str, host_network: bool = False
) -> dict[str, File]:
    """Return file name -> file; ``user`` is uid:gid, ``keystore`` where bundles are imported on the host."""
    services = {}
    for process in deployment.processes:
        network: dict[str, Any] = {"network_mode": "host"} if host_network else {"networks": ["dds"]}
        services[process.name] = {**_service(process, image, user, keystore), **network}
    content: dict[str, Any] = {"name": deployment.name, "services": services}
    if not host_network:
        content["networks"] = {"dds": {"internal": True}}
    note = f"# Before: secure-keystore import {shlex.quote(keystore)} HOST.bundle --owner {user}\n"
    files = {"compose.yaml": File(deployment.header() + note + yaml_text(content))}
    for process in deployment.processes:
        files |= deployment.parameter_files(process)
    return files


def _service(process: DeployedProcess, image: str, user: str, keystore: str) -> dict[str, Any]:
    """Return a service without its network. It has ``command`` only: the image's entrypoint sets up ROS."""
    variables = {**process.variables(_KEYSTORE), "HOME": "/tmp", "ROS_LOG_DIR": "/tmp/log", "TZ": "UTC"}
    service: dict[str, Any] = {
        "image": image,
        "command": [_literal(word) for word in process.words(_PARAMETERS)],
        "environment": {name: _literal(text) for name, text in variables.items()},
        **({"working_dir": process.entry.cwd} if process.entry.cwd is not None else {}),
        "user": user,
        "read_only": True,
        "tmpfs": ["/tmp:size=64m,mode=1777"],
        "cap_drop": ["ALL"],
        "security_opt": ["no-new-privileges:true"],
        "init": True,
        "stop_signal": "SIGINT",
        "stop_grace_period": "10s",
        "restart": "always" if process.entry.respawn is not None else "no",
    }
    if volumes := _volumes(process, keystore):
        service["volumes"] = volumes
    if process.needs.memory is not None:
        service["mem_limit"] = process.needs.memory.removesuffix("i").lower()
    if process.needs.devices:
        service["devices"] = [f"{device}:{device}" for device in process.needs.devices]
    if process.needs.groups:
        service["group_add"] = list(process.needs.groups)
    if process.needs.realtime:
        service["ulimits"] = {"rtprio": 99, "memlock": -1}
    return service


def _volumes(process: DeployedProcess, keystore: str) -> list[dict[str, Any]]:
    volumes = []
    if process.enclave is not None:
        source = f"{keystore}/{layout.container_directory(process.enclave)}"
        volumes.append(_mount(source, f"{_KEYSTORE}/{layout.enclave_directory(process.enclave)}"))
    volumes += [_mount(f"./parameters/{name}", f"{_PARAMETERS}/{name}") for name in process.parameter_texts()]
    return volumes


def _mount(source: str, target: str) -> dict[str, Any]:
    """Return a mount whose missing source is an error: the default is to create an empty directory."""
    return {
        "type": "bind",
        "source": _literal(source),
        "target": target,
        "read_only": True,
        "bind": {"create_host_path": False},
    }


def _literal(text: str) -> str:
    """Escape ``$``: Compose expands ``$NAME``."""
    return text.replace("$", "$$")
