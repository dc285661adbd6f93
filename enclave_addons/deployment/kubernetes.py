"""A deployment as Kubernetes objects: one Deployment for each process, the files of its enclave in a Secret.

Names of Secrets stay the same, so new material changes the enclave's Secret and no workload; the process reads it at
its next start (``kubectl rollout restart``). Multicast does not cross most networks of clusters, so peers are named
(``ROS_STATIC_PEERS``, from Iron on): they stand in one ConfigMap, and each is a headless Service. No object has a
namespace: ``kubectl -n`` or kustomize says it. Only volumes that ``podman kube play`` 4.3 takes are used.
"""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Iterator
from typing import Any

from enclave_addons.deployment.deployment import Deployment, EnclaveMaterial, File
from enclave_addons.deployment.processes import DeployedProcess, label
from enclave_addons.deployment.yaml_text import yaml_documents
from keystore.disk import layout

_KEYSTORE = "/keystore"
_PARAMETERS = "/parameters"
_USER = 10001
_SPDP_PORT = 7410  # unicast discovery of a Pod's only participant in domain 0 (DDSI-RTPS section 9.6.2)
_DOMAIN_GAIN = 250
_MEMORY_LIMIT = "512Mi"  # where the hosts file says nothing
_REQUESTS = {"memory": "64Mi", "cpu": "50m"}
_PART_OF, _NAME = "app.kubernetes.io/part-of", "app.kubernetes.io/name"
_DOMAIN = "ros-domain"
_PEERS = "ROS_STATIC_PEERS"


def kubernetes_files(deployment: Deployment, *, image: str) -> dict[str, File]:
    """Return file name -> file; ``secrets.yaml`` is the one with keys, the rest can be shown to anybody."""
    files = {"launch.yaml": File(deployment.header() + yaml_documents(_objects(deployment, image)))}
    secrets = [_secret(deployment, one) for one in deployment.material.values()]
    if secrets:
        files["secrets.yaml"] = File(deployment.mark() + yaml_documents(secrets), 0o600)
    return files


def _objects(deployment: Deployment, image: str) -> Iterator[dict[str, Any]]:
    for process in deployment.processes:
        if process.entry.parameter_files:
            yield _parameters(deployment, process)
        yield _deployment(deployment, process, image)
        if process.enclave is not None:
            yield _service(deployment, process)
    for domain in sorted({one.entry.domain_id for one in deployment.processes if one.enclave is not None}):
        yield _peers(deployment, domain)
        yield _network_policy(deployment, domain)


def _object(
    deployment: Deployment, kind: str, name: str, *, api: str = "v1", **labels: str
) -> dict[str, Any]:
    own = {_NAME: name, _PART_OF: deployment.name, "app.kubernetes.io/managed-by": "enclave-launch", **labels}
    return {"apiVersion": api, "kind": kind, "metadata": {"name": name, "labels": own}}


def secret_name(enclave: str) -> str:
    """Return the name of the Secret with the files of ``enclave``."""
    return f"enclave-{label(enclave)}"


def _secret(deployment: Deployment, material: EnclaveMaterial) -> dict[str, Any]:
    """Return the Secret; without the key if it was made on its host, where it has to be added."""
    files = {**material.public, **({layout.KEY: material.key} if material.key is not None else {})}
    data = {name: base64.b64encode(content).decode() for name, content in sorted(files.items())}
    return {**_object(deployment, "Secret", secret_name(material.enclave)), "type": "Opaque", "data": data}


def _parameters(deployment: Deployment, process: DeployedProcess) -> dict[str, Any]:
    data = process.parameter_texts()
    return {**_object(deployment, "ConfigMap", _parameters_name(process)), "data": data}


def _parameters_name(process: DeployedProcess) -> str:
    """Return a name with the content's digest, so that new parameters replace the Pod."""
    digest = hashlib.sha256("\0".join(process.entry.parameter_files.values()).encode()).hexdigest()
    return f"{process.name}-{digest[:10]}"


def _deployment(deployment: Deployment, process: DeployedProcess, image: str) -> dict[str, Any]:
    domain = str(process.entry.domain_id) if process.enclave is not None else "none"
    made = _object(deployment, "Deployment", process.name, api="apps/v1", **{_DOMAIN: domain})
    labels = made["metadata"]["labels"]
    template = {"metadata": {"labels": labels}, "spec": _pod(deployment, process, image)}
    spec = {
        "replicas": 1,
        "strategy": {"type": "Recreate"},
        "selector": {"matchLabels": _selector(deployment, process)},
    }
    return {**made, "spec": {**spec, "template": template}}


def _selector(deployment: Deployment, process: DeployedProcess) -> dict[str, str]:
    return {_NAME: process.name, _PART_OF: deployment.name}


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
        "volumes": list(_volumes(process)),
    }


def _container(deployment: Deployment, process: DeployedProcess, image: str) -> dict[str, Any]:
    """Return the container; it has ``args`` only: the image's entrypoint sets up ROS."""
    variables = {**process.variables(_KEYSTORE), "HOME": "/tmp", "ROS_LOG_DIR": "/tmp/log", "TZ": "UTC"}
    environment: list[dict[str, Any]] = [
        {"name": name, "value": _literal(text)} for name, text in sorted(variables.items())
    ]
    if process.enclave is not None and _PEERS not in variables:
        source = {"name": _peers_name(deployment, process.entry.domain_id), "key": _PEERS}
        environment.append({"name": _PEERS, "valueFrom": {"configMapKeyRef": source}})
    return {
        "name": process.name,
        "image": image,
        "args": [_literal(word) for word in process.words(_PARAMETERS)],
        **({"workingDir": process.entry.cwd} if process.entry.cwd is not None else {}),
        "env": environment,
        "securityContext": {
            "allowPrivilegeEscalation": False,
            "readOnlyRootFilesystem": True,
            "capabilities": {"drop": ["ALL"]},
        },
        "resources": {"limits": {"memory": process.needs.memory or _MEMORY_LIMIT}, "requests": _REQUESTS},
        "volumeMounts": list(_mounts(process)),
    }


def _peers(deployment: Deployment, domain: int) -> dict[str, Any]:
    """List all secured processes of the domain, on any host.

    Who is started later names those before it, so one more process needs no restart of the others.
    """
    peers = {_PEERS: ";".join(deployment.members[domain])}
    return {**_object(deployment, "ConfigMap", _peers_name(deployment, domain)), "data": peers}


def _peers_name(deployment: Deployment, domain: int) -> str:
    return f"{deployment.name}-peers-{domain}"


def _mounts(process: DeployedProcess) -> Iterator[dict[str, Any]]:
    if process.enclave is not None:
        place = f"{_KEYSTORE}/{layout.enclave_directory(process.enclave)}"
        yield {"name": "enclave", "mountPath": place, "readOnly": True}
    if process.entry.parameter_files:
        yield {"name": "parameters", "mountPath": _PARAMETERS, "readOnly": True}
    yield {"name": "tmp", "mountPath": "/tmp"}


def _volumes(process: DeployedProcess) -> Iterator[dict[str, Any]]:
    if process.enclave is not None:
        # podman 4.3 reads "optional" whether it is there or not, and crashes.
        secret = {"secretName": secret_name(process.enclave), "defaultMode": 0o440, "optional": False}
        yield {"name": "enclave", "secret": secret}
    if process.entry.parameter_files:
        yield {"name": "parameters", "configMap": {"name": _parameters_name(process)}}
    yield {"name": "tmp", "emptyDir": {"medium": "Memory", "sizeLimit": "64Mi"}}


def _service(deployment: Deployment, process: DeployedProcess) -> dict[str, Any]:
    port = _SPDP_PORT + _DOMAIN_GAIN * process.entry.domain_id
    spec = {
        "clusterIP": "None",
        "publishNotReadyAddresses": True,
        "selector": _selector(deployment, process),
        "ports": [{"name": "spdp", "protocol": "UDP", "port": port}],
    }
    return {**_object(deployment, "Service", process.name), "spec": spec}


def _network_policy(deployment: Deployment, domain: int) -> dict[str, Any]:
    """Allow UDP among the processes of a domain, and DNS.

    All ports: Cyclone DDS takes any for unicast unless it is configured otherwise.
    """
    own = {"podSelector": {"matchLabels": {_PART_OF: deployment.name, _DOMAIN: str(domain)}}}
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
        **_object(deployment, "NetworkPolicy", f"{deployment.name}-dds-{domain}", api="networking.k8s.io/v1"),
        "spec": spec,
    }


def _literal(text: str) -> str:
    """Escape ``$``: Kubernetes expands ``$(NAME)``, and takes ``$$`` for one ``$``."""
    return text.replace("$", "$$")
