"""A deployment as Kubernetes objects: one Deployment for each process, keys in Secrets and nowhere else. Pure.

Secret and ConfigMap of an enclave carry their version in the name and are immutable: new material is a new name, so the
Pods that use it are replaced, and only those. The readiness probe fails once the first of it has ended: on Cyclone DDS
a process whose certificate ended goes on and is heard by nobody. Multicast does not cross most networks of clusters, so
peers are named (``ROS_STATIC_PEERS``, from Iron on).
"""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Iterator, Mapping
from typing import Any

from enclave_launch.deployment.deployment import Deployment, File
from enclave_launch.deployment.material import EnclaveMaterial
from enclave_launch.deployment.processes import DeployedProcess, label
from enclave_launch.deployment.yaml_text import yaml_documents
from keystore.disk import layout

_KEYSTORE = "/keystore"
_PARAMETERS = "/parameters"
_USER = 10001
_SPDP_PORT = 7410  # unicast discovery of a Pod's only participant in domain 0 (DDSI-RTPS section 9.6.2)
_DOMAIN_GAIN = 250
_MEMORY = "512Mi"  # requests and limits, where the hosts file says nothing


def kubernetes_files(deployment: Deployment, *, image: str) -> dict[str, File]:
    """File name -> file; ``secrets.yaml`` is the one with keys, the rest can be shown to anybody."""
    files = {"launch.yaml": File(deployment.header() + yaml_documents(_objects(deployment, image)))}
    secrets = list(_secrets(deployment))
    if secrets:
        files["secrets.yaml"] = File(deployment.header() + yaml_documents(secrets), 0o600)
    return files


def _objects(deployment: Deployment, image: str) -> Iterator[dict[str, Any]]:
    labels = {"pod-security.kubernetes.io/enforce": "restricted"}
    yield {"apiVersion": "v1", "kind": "Namespace", "metadata": {"name": deployment.name, "labels": labels}}
    for material in deployment.material.enclaves.values():
        yield _config_map(deployment, material)
    for process in deployment.processes:
        if process.parameter_files:
            yield _parameters(deployment, process)
        yield _deployment(deployment, process, image)
        if process.enclave is not None:
            yield _service(deployment, process)
    for domain in sorted({one.domain for one in deployment.processes if one.enclave is not None}):
        yield _network_policy(deployment, domain)


def _object(deployment: Deployment, kind: str, name: str, *, api: str = "v1") -> dict[str, Any]:
    return {"apiVersion": api, "kind": kind, "metadata": {"name": name, "namespace": deployment.name}}


def material_name(material: EnclaveMaterial) -> str:
    """Of its Secret and its ConfigMap."""
    return f"enclave-{label(material.enclave)}-{material.version}"


def _secrets(deployment: Deployment) -> Iterator[dict[str, Any]]:
    for material in deployment.material.enclaves.values():
        if material.key is not None:
            data = {layout.KEY: base64.b64encode(material.key).decode()}
            named = _object(deployment, "Secret", material_name(material))
            yield {**named, "type": "Opaque", "immutable": True, "data": data}


def _config_map(deployment: Deployment, material: EnclaveMaterial) -> dict[str, Any]:
    data = {name: content.decode().replace("\r\n", "\n") for name, content in material.public.items()}
    return {**_object(deployment, "ConfigMap", material_name(material)), "immutable": True, "data": data}


def _parameters(deployment: Deployment, process: DeployedProcess) -> dict[str, Any]:
    data = process.parameter_texts()
    return {**_object(deployment, "ConfigMap", _parameters_name(process)), "immutable": True, "data": data}


def _parameters_name(process: DeployedProcess) -> str:
    digest = hashlib.sha256("\0".join(process.parameter_files.values()).encode()).hexdigest()
    return f"{process.name}-{digest[:10]}"


def _deployment(deployment: Deployment, process: DeployedProcess, image: str) -> dict[str, Any]:
    domain = str(process.domain) if process.enclave is not None else "none"
    labels = {"app": process.name, "ros-launch": deployment.name, "ros-domain": domain}
    made = _object(deployment, "Deployment", process.name, api="apps/v1")
    made["metadata"]["labels"] = labels
    made["metadata"]["annotations"] = {"launch-file": process.place}
    template = {"metadata": {"labels": labels}, "spec": _pod(deployment, process, image)}
    spec = {
        "replicas": 1,
        "strategy": {"type": "Recreate"},
        "selector": {"matchLabels": {"app": process.name}},
    }
    return {**made, "spec": {**spec, "template": template}}


def _pod(deployment: Deployment, process: DeployedProcess, image: str) -> dict[str, Any]:
    host = {"nodeSelector": {"kubernetes.io/hostname": deployment.host}} if deployment.host else {}
    return {
        **host,
        "automountServiceAccountToken": False,
        "enableServiceLinks": False,
        "terminationGracePeriodSeconds": 10,
        "securityContext": {
            "runAsNonRoot": True,
            "runAsUser": _USER,
            "runAsGroup": _USER,
            "fsGroup": _USER,
            "seccompProfile": {"type": "RuntimeDefault"},
        },
        "containers": [_container(deployment, process, image)],
        "volumes": list(_volumes(deployment, process)),
    }


def _container(deployment: Deployment, process: DeployedProcess, image: str) -> dict[str, Any]:
    """``args`` only: the image's entrypoint sets up ROS."""
    variables = {
        **process.variables(_KEYSTORE), "HOME": "/tmp", "ROS_LOG_DIR": "/tmp/log", "TZ": "UTC",
        **_peers(deployment, process),
    }  # fmt: skip
    memory = process.needs.memory or _MEMORY
    return {
        "name": process.name,
        "image": image,
        "args": [_literal(word) for word in process.words(_PARAMETERS)],
        **({"workingDir": process.cwd} if process.cwd is not None else {}),
        "env": [{"name": name, "value": _literal(text)} for name, text in sorted(variables.items())],
        "securityContext": {
            "allowPrivilegeEscalation": False,
            "readOnlyRootFilesystem": True,
            "capabilities": {"drop": ["ALL"]},
        },
        "resources": {"limits": {"memory": memory}, "requests": {"memory": memory, "cpu": "50m"}},
        **_probe(deployment, process),
        "volumeMounts": list(_mounts(process)),
    }


def _peers(deployment: Deployment, process: DeployedProcess) -> Mapping[str, str]:
    peers = [
        f"{one.name}.{deployment.name}.svc" for one in deployment.processes
        if one.domain == process.domain and one.name != process.name and one.enclave is not None
    ]  # fmt: skip
    if not peers or process.enclave is None or "ROS_STATIC_PEERS" in process.environment:
        return {}
    return {"ROS_STATIC_PEERS": ";".join(peers)}


def _probe(deployment: Deployment, process: DeployedProcess) -> dict[str, Any]:
    """The container's life is that of its process; what can be asked besides is whether its enclave has ended."""
    if process.enclave is None:
        return {}
    end = int(deployment.material.ends.timestamp())
    command = ["/bin/sh", "-c", f'test "$(date +%s)" -lt {end}']
    return {"readinessProbe": {"exec": {"command": command}, "periodSeconds": 60}}


def _mounts(process: DeployedProcess) -> Iterator[dict[str, Any]]:
    if process.enclave is not None:
        place = f"{_KEYSTORE}/{layout.enclave_directory(process.enclave)}"
        yield {"name": "enclave", "mountPath": place, "readOnly": True}
    if process.parameter_files:
        yield {"name": "parameters", "mountPath": _PARAMETERS, "readOnly": True}
    yield {"name": "tmp", "mountPath": "/tmp"}


def _volumes(deployment: Deployment, process: DeployedProcess) -> Iterator[dict[str, Any]]:
    material = deployment.enclave_of(process)
    if material is not None:
        name = material_name(material)
        key = {"key": layout.KEY, "path": layout.KEY, "mode": 0o400}
        sources = [{"secret": {"name": name, "items": [key]}}, {"configMap": {"name": name}}]
        yield {"name": "enclave", "projected": {"defaultMode": 0o400, "sources": sources}}
    if process.parameter_files:
        yield {"name": "parameters", "configMap": {"name": _parameters_name(process)}}
    yield {"name": "tmp", "emptyDir": {"medium": "Memory", "sizeLimit": "64Mi"}}


def _service(deployment: Deployment, process: DeployedProcess) -> dict[str, Any]:
    """A name for the Pod: peers find each other by it, in whatever order they start."""
    port = _SPDP_PORT + _DOMAIN_GAIN * process.domain
    spec = {
        "clusterIP": "None",
        "publishNotReadyAddresses": True,
        "selector": {"app": process.name},
        "ports": [{"name": "spdp", "protocol": "UDP", "port": port}],
    }
    return {**_object(deployment, "Service", process.name), "spec": spec}


def _network_policy(deployment: Deployment, domain: int) -> dict[str, Any]:
    """Who is in a domain talks UDP with who else is in it, and asks the cluster's DNS. Ports are left open among them:
    Cyclone DDS takes any for unicast unless it is configured otherwise."""
    own = {"podSelector": {"matchLabels": {"ros-launch": deployment.name, "ros-domain": str(domain)}}}
    udp = [{"protocol": "UDP"}]
    dns = {
        "to": [{
            "namespaceSelector": {"matchLabels": {"kubernetes.io/metadata.name": "kube-system"}},
            "podSelector": {"matchLabels": {"k8s-app": "kube-dns"}},
        }],
        "ports": [{"protocol": "UDP", "port": 53}, {"protocol": "TCP", "port": 53}],
    }  # fmt: skip
    spec = {
        **own,
        "policyTypes": ["Ingress", "Egress"],
        "ingress": [{"from": [own], "ports": udp}],
        "egress": [{"to": [own], "ports": udp}, dns],
    }
    return {
        **_object(deployment, "NetworkPolicy", f"dds-domain-{domain}", api="networking.k8s.io/v1"),
        "spec": spec,
    }


def _literal(text: str) -> str:
    """Kubernetes puts variables in the place of ``$(NAME)``."""
    return text.replace("$(", "$$(")
