"""The processes of a plan as an engine runs them."""

from __future__ import annotations

import hashlib
import re
from collections import Counter
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import NamedTuple

from enclave_addons.deployment.hosts import Needs
from enclave_launch.dry_run import DryRun, Process
from enclave_launch.process import UNSPECIFIED_NODE_NAME, UNSPECIFIED_NODE_NAMESPACE
from enclave_launch.security_environment import ENABLE, KEYSTORE, NO_KEYSTORE, OVERRIDE, STRATEGY
from nodl.ros_arguments import parse_ros_arguments, words_after_program

LONGEST_NAME = 40
"""With a suffix it stays a DNS label (63 characters, RFC 1123), which Kubernetes requires."""
_SECURITY = (ENABLE, KEYSTORE, OVERRIDE, STRATEGY)


class DeployedProcess(NamedTuple):
    """A process of the plan.

    Attributes:
        name: Unique in the launch, a DNS label.
        entry: The process as the dry run has it.
        fqn: The fully qualified name of its node, None for an executable.
        command: Includes ``--enclave`` if rcl reads it from there.
        environment: What the launch file sets, without the variables of SROS2.
        nodes: Its node and the components that are loaded into it.
    """

    name: str
    entry: Process
    fqn: str | None
    command: tuple[str, ...]
    environment: Mapping[str, str]
    nodes: tuple[str, ...] = ()
    needs: Needs = Needs()

    @property
    def enclave(self) -> str | None:
        return self.entry.enclave

    @property
    def shown(self) -> str:
        """Return the node's name, or that of the process where it has none."""
        return self.fqn or self.entry.process

    def security(self, keystore: str) -> Mapping[str, str]:
        """Return the variables that rcl reads; always Enforce, whatever the plan was saved with."""
        if self.enclave is None:
            return {ENABLE: "true", STRATEGY: "Enforce", KEYSTORE: NO_KEYSTORE}
        override = {OVERRIDE: self.enclave} if self.fqn is None else {}
        return {ENABLE: "true", STRATEGY: "Enforce", KEYSTORE: keystore, **override}

    def variables(self, keystore: str) -> dict[str, str]:
        """Return the environment of the process apart from what the installation sets up, sorted."""
        found = {
            "ROS_DOMAIN_ID": str(self.entry.domain_id),
            "RMW_IMPLEMENTATION": self.entry.middleware,
            **self.environment,
            **self.security(keystore),
        }
        if self.entry.middleware.startswith("rmw_fastrtps"):
            # Each process has its own user or container: shared memory between them loses data without a word.
            found.setdefault("FASTDDS_BUILTIN_TRANSPORTS", "UDPv4")
        return dict(sorted(found.items()))

    def words(self, folder: str) -> tuple[str, ...]:
        """Return the command with its parameter files below ``folder``; a shell gets the words joined, as by launch."""
        names = dict(zip(self.entry.parameter_files, self.parameter_texts(), strict=True))
        words = tuple(f"{folder}/{names[word]}" if word in names else word for word in self.command)
        return ("/bin/sh", "-c", " ".join(words)) if self.entry.shell else words

    def parameter_texts(self) -> dict[str, str]:
        """Return file name -> content of each of ``parameter_files``, in their order."""
        texts = self.entry.parameter_files.values()
        return {f"{self.name}-{number}.yaml": text for number, text in enumerate(texts, 1)}


def deployed_processes(document: DryRun) -> tuple[DeployedProcess, ...]:
    """Return the processes that the launch starts; those that only events or timers start are in ``semantics``."""
    listed = [entry for entry in document.processes if entry.on_event is None]
    names = engine_names([_final_name(entry) or _stem(entry) for entry in listed])
    nodes = _nodes_of(document)
    return tuple(_process(entry, name, nodes) for entry, name in zip(listed, names, strict=True))


def _nodes_of(document: DryRun) -> Mapping[str, tuple[str, ...]]:
    found: dict[str, tuple[str, ...]] = {}
    for entry in document.components:
        container = "/" + entry.container.lstrip("/")
        found[container] = (*found.get(container, ()), entry.fqn)
    return found


def _process(entry: Process, name: str, nodes: Mapping[str, tuple[str, ...]]) -> DeployedProcess:
    fqn = _final_name(entry)
    environment = {key: text for key, text in entry.environment.items() if key not in _SECURITY}
    return DeployedProcess(
        name=name,
        entry=entry,
        fqn=fqn,
        command=_secured(entry),
        environment=MappingProxyType(environment),
        nodes=(*([fqn] if fqn else ()), *nodes.get(fqn or "", ())),
    )


def _final_name(entry: Process) -> str | None:
    # As rcl resolves it: without a name it has the program's own, assumed to be the executable's.
    if entry.fqn is None:
        return None
    named = entry.fqn.replace(UNSPECIFIED_NODE_NAMESPACE, "").replace(UNSPECIFIED_NODE_NAME, entry.executable)
    return "/" + named.lstrip("/")


def _secured(entry: Process) -> tuple[str, ...]:
    """Append ``--enclave`` to the command of a node, which ends inside its ``--ros-args``, unless it is there."""
    command = tuple(entry.cmd)
    if entry.fqn is None or entry.enclave is None:
        return command
    words = words_after_program(command, len(entry.prefix), shell=entry.shell)
    if parse_ros_arguments(words).enclave is not None:
        return command
    return (*command, "--enclave", entry.enclave)


def _stem(entry: Process) -> str:
    return entry.process.rpartition("/")[2].rpartition("-")[0] or "process"


def engine_names(subjects: Iterable[str]) -> list[str]:
    """Return a DNS label for each subject, independent of the other subjects.

    If the label alone would be ambiguous (capitals, ``_``, length) a hash of the subject follows; equal subjects are
    numbered in their order.
    """
    listed = [label(subject) for subject in subjects]
    seen: Counter[str] = Counter()
    names = []
    for name in listed:
        seen[name] += 1
        names.append(name if seen[name] == 1 else f"{name}-{seen[name]}")
    return names


def label(subject: str) -> str:
    """Return ``front-speaker`` for ``/front/speaker``, ``front-left-3f2a90`` for ``/front_left``."""
    plain = subject.strip("/").replace("/", "-")
    name = re.sub(r"[^a-z0-9]+", "-", plain.lower()).strip("-")[:LONGEST_NAME].strip("-")
    if name == plain and name:
        return name
    digest = hashlib.sha256(subject.encode()).hexdigest()[:6]
    return f"{name}-{digest}" if name else f"root-{digest}"
