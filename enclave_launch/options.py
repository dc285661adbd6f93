"""Options of the flow, one type for each of its calls. ``None`` and the defaults are what
``secure-launch`` does without options.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from enclave_launch.admission import AdmissionOptions
from enclave_launch.enclave import EnclaveScope
from enclave_launch.errors import UsageError, translated
from enclave_launch.host.host import HostOptions
from enclave_launch.plan import PlanOptions
from enclave_launch.policy import PolicyOptions
from enclave_launch.policy.node_permissions import ALSO
from enclave_launch.ros_rules.distro import Versions
from keystore.errors import KeystoreError
from keystore.formats.policy_xml import read_policies
from keystore.steps.options import ProvisionOptions

if TYPE_CHECKING:
    from enclave_launch.runtime.companion import LaunchCompanion


@dataclass(frozen=True, slots=True)
class ResolveOptions:
    """Options of ``resolve``. Of several paths or names any sequence is taken, and a single one alone.

    Args:
        prefixes: Install prefixes, searched before ``AMENT_PREFIX_PATH``.
        manifests: NoDL documents or folders; they win where definitions conflict.
        policy: An SROS2 policy whose rules are granted beside the derived ones.
        distro: The release of ROS; ``None`` is ``ROS_DISTRO``, else the newest.
        versions: Versions of the packages of ``distro``, as ``read_versions`` reads them.
        infer: Analyse the sources of nodes without a manifest.
        library: Use the library for nodes without a manifest.
        library_folders: Folders of library documents, which come first.
        source_folders: Where sources of compiled nodes lie, besides the workspaces of the prefixes.
        progress: Called with each program that is analysed.
    """

    prefixes: tuple[Path, ...] = ()
    manifests: tuple[Path, ...] = ()
    policy: Path | None = None
    distro: str | None = None
    versions: Versions = ()
    enclave_scope: EnclaveScope = EnclaveScope.NAMESPACE
    infer: bool = True
    library: bool = True
    library_folders: tuple[Path, ...] = ()
    source_folders: tuple[Path, ...] = ()
    accept_patterns: bool = False
    allow_missing_packages: bool = False
    also: tuple[str, ...] = ()
    accept_prefixes: tuple[str, ...] = ()
    accept_middlewares: tuple[str, ...] = ()
    no_python: bool = False
    launch_configurations: Mapping[str, str] = field(default_factory=dict)
    progress: Callable[[str], None] | None = None

    def __post_init__(self) -> None:
        for name in ("prefixes", "manifests", "library_folders", "source_folders"):
            object.__setattr__(self, name, tuple(map(Path, _several(getattr(self, name)))))
        for name in ("also", "accept_prefixes", "accept_middlewares"):
            object.__setattr__(self, name, _several(getattr(self, name)))
        object.__setattr__(self, "policy", None if self.policy is None else Path(self.policy))
        object.__setattr__(self, "enclave_scope", EnclaveScope(self.enclave_scope))

    def host_options(self) -> HostOptions:
        """Return the options of the evaluation's host, the same in a dry run and live."""
        return HostOptions(self.distro, self.allow_missing_packages, self.no_python, versions=self.versions)

    def plan_options(self) -> PlanOptions:
        """Return the options of planning; raises ``UsageError`` for a policy file that cannot be used."""
        with translated(KeystoreError, UsageError):
            document = read_policies(self.policy) if self.policy else None
        if unknown := [name for name in self.also if name not in ALSO]:
            raise UsageError(f"--also {unknown[0]}: choose from {', '.join(ALSO)}")
        policy = PolicyOptions(self.accept_patterns, document, also=frozenset(self.also))
        admission = AdmissionOptions(frozenset(self.accept_prefixes), frozenset(self.accept_middlewares))
        return PlanOptions(self.enclave_scope, policy, admission)


def _several(given: Any) -> tuple[Any, ...]:
    return (given,) if isinstance(given, (str, os.PathLike)) else tuple(given)


@dataclass(frozen=True, slots=True)
class SecurityOptions:
    """Options of ``provision``: the keystore's own (``None``: its defaults, for the domain in ``ROS_DOMAIN_ID``), and
    the strategy of the processes (``ROS_SECURITY_STRATEGY``). ``log_folder``: where processes on Fast DDS write their
    security logs."""

    strategy: str = "Enforce"
    keystore: ProvisionOptions | None = None
    log_folder: Path | None = None


class Deadline:
    """A time at which a launch is ended in order, to be started again by the caller.

    ``reached`` once the launch was ended because of it, and for nothing else."""

    def __init__(self, at: datetime, reason: str) -> None:
        self.at = at
        self.reason = reason
        self.reached = False


@dataclass(frozen=True, slots=True)
class RunSettings:
    """Options of ``run``.

    ``secrets``: environment variables that no process of the launch sees; ``log_limit``: bytes after which a log file
    becomes ``<name>.1`` and a new one is begun, ``None`` for never; ``deadline``: when to end it, as
    ``expiry_watch.renewal_deadline`` gives it.

    ``record``: every endpoint that a node makes, or is refused, is an event of the launch. ``None``: of secured
    launches, whose refusals are explained, where that is possible. A ``companion`` of one's own takes its place.
    ``watch``: a further one, which goes along beside either."""

    noninteractive: bool = False
    debug: bool = False
    allow_late: bool = False
    secrets: frozenset[str] = frozenset()
    companion: LaunchCompanion | None = None
    record: bool | None = None
    watch: LaunchCompanion | None = None
    log_limit: int | None = None
    deadline: Deadline | None = None
