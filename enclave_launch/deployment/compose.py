"""A deployment as a Compose file: one service for each process, with the files of its enclave and no others. Pure.

Keys are ``secrets``, the public files ``configs``, each mounted by itself: the directory of an enclave also holds those
of the enclaves below it. Compose mounts both from files of the host, so the container's user must be able to read
them (compose specification, "secrets": uid, gid and mode are not implemented outside of Swarm).
"""

from __future__ import annotations

from typing import Any

from enclave_launch.deployment.deployment import Deployment, File, runtime_names, source_of
from enclave_launch.deployment.material import EnclaveMaterial
from enclave_launch.deployment.processes import DeployedProcess, label
from enclave_launch.deployment.yaml_text import yaml_text
from keystore.disk import layout

_KEYSTORE = "/keystore"
_PARAMETERS = "/parameters"
_PER_ENCLAVE = (layout.KEY, layout.CERT, layout.PERMISSIONS)


def compose_files(deployment: Deployment, *, image: str, user: str, keystore: str) -> dict[str, File]:
    """File name -> file. ``keystore``: where bundles are imported on the host; ``user``: uid:gid in the containers."""
    content = {
        "name": deployment.name,
        "services": {one.name: _service(deployment, one, image, user) for one in deployment.processes},
        "secrets": _sources(deployment, keystore, private=True),
        "configs": {**_sources(deployment, keystore, private=False), **_parameters(deployment)},
        "networks": {"dds": {"internal": True}},
    }
    owner = user.partition(":")[0]
    note = f"# {keystore}: the imported keystore of this host; uid {owner} must own its key.pem files\n"
    given = {name: part for name, part in content.items() if part}
    files = {"compose.yaml": File(deployment.header() + note + yaml_text(given))}
    for process in deployment.processes:
        files |= deployment.parameter_files(process)
    return files


def _service(deployment: Deployment, process: DeployedProcess, image: str, user: str) -> dict[str, Any]:
    """``command`` only: the image's entrypoint sets up ROS."""
    variables = {**process.variables(_KEYSTORE), "HOME": "/tmp", "ROS_LOG_DIR": "/tmp/log", "TZ": "UTC"}
    service: dict[str, Any] = {
        "image": image,
        "command": [_literal(word) for word in process.words(_PARAMETERS)],
        "environment": {name: _literal(text) for name, text in variables.items()},
        **_files_of(deployment, process),
        **({"working_dir": process.cwd} if process.cwd is not None else {}),
        "user": user,
        "read_only": True,
        "tmpfs": ["/tmp:size=64m,mode=1777"],
        "cap_drop": ["ALL"],
        "security_opt": ["no-new-privileges:true"],
        "init": True,
        "stop_signal": "SIGINT",
        "stop_grace_period": "10s",
        "restart": "always" if process.respawn is not None else "no",
        "networks": ["dds"],
    }
    if process.needs.memory is not None:
        service["mem_limit"] = process.needs.memory.removesuffix("i").lower()
    if process.needs.devices:
        service["devices"] = [f"{device}:{device}" for device in process.needs.devices]
    if process.needs.realtime:
        service["ulimits"] = {"rtprio": 99, "memlock": -1}
    return service


def _files_of(deployment: Deployment, process: DeployedProcess) -> dict[str, Any]:
    material = deployment.enclave_of(process)
    configs = [
        {"source": name.removesuffix(".yaml"), "target": f"{_PARAMETERS}/{name}"}
        for name in process.parameter_texts()
    ]
    if material is None:
        return {"configs": configs} if configs else {}
    place = f"{_KEYSTORE}/{layout.enclave_directory(material.enclave)}"
    mounts = {
        name: {"source": _entry(material, name), "target": f"{place}/{name}"}
        for name in runtime_names(material)
    }
    key = mounts.pop(layout.KEY)
    return {"secrets": [key], "configs": [*mounts.values(), *configs]}


def _sources(deployment: Deployment, keystore: str, *, private: bool) -> dict[str, Any]:
    found = {}
    for material in deployment.material.enclaves.values():
        for name in runtime_names(material):
            if (name == layout.KEY) is private:
                found[_entry(material, name)] = {"file": _literal(f"{keystore}/{source_of(material, name)}")}
    return found


def _parameters(deployment: Deployment) -> dict[str, Any]:
    return {
        name.removesuffix(".yaml"): {"file": f"./parameters/{name}"}
        for process in deployment.processes
        for name in process.parameter_texts()
    }


def _entry(material: EnclaveMaterial, name: str) -> str:
    """Files that all enclaves have in common are one entry."""
    stem = name.replace(".", "-").replace("_", "-")
    return f"{label(material.enclave)}.{stem}" if name in _PER_ENCLAVE else stem


def _literal(text: str) -> str:
    """Compose puts variables in the place of ``$NAME``."""
    return text.replace("$", "$$")
