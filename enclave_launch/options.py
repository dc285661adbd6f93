"""What callers of the flow may choose, one type for each of its calls. ``None`` and the defaults are what
``secure-launch`` does without options.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from enclave_launch.admission import AdmissionOptions
from enclave_launch.enclave import EnclaveScope
from enclave_launch.errors import UsageError
from enclave_launch.host.protocol import HostOptions
from enclave_launch.plan import PlanOptions
from enclave_launch.policy import PolicyOptions
from enclave_launch.policy.conditions import ALSO

if TYPE_CHECKING:
    from enclave_launch.runtime.companion import LaunchCompanion
    from enclave_launch.runtime.deadline import Deadline
    from keystore.formats.policy_xml import PolicyDocument
    from keystore.steps.options import ProvisionOptions


@dataclass(frozen=True, slots=True)
class ResolveOptions:
    """How to resolve. ``prefixes`` are searched before ``AMENT_PREFIX_PATH``; ``distro`` ``None``: ``ROS_DISTRO``,
    else the newest; ``manifests`` win where NoDL definitions conflict. Nodes without a manifest: ``infer`` lets their
    sources be analysed, ``library`` the library be asked, whose documents in ``library_folders`` come first;
    ``source_folders``: where sources of compiled nodes lie, besides the workspaces of the prefixes; ``progress`` is
    told which program is analysed next."""

    prefixes: tuple[Path, ...] = ()
    manifests: tuple[Path, ...] = ()
    policy: Path | None = None
    distro: str | None = None
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
    progress: Callable[[str], None] | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        """One path or name may be given where several can be: text is not taken letter by letter."""
        for name in ("prefixes", "manifests", "library_folders", "source_folders"):
            object.__setattr__(self, name, tuple(map(Path, _several(getattr(self, name)))))
        for name in ("also", "accept_prefixes", "accept_middlewares"):
            object.__setattr__(self, name, _several(getattr(self, name)))
        if isinstance(self.policy, str):
            object.__setattr__(self, "policy", Path(self.policy))
        object.__setattr__(self, "enclave_scope", EnclaveScope(self.enclave_scope))

    def host_options(self) -> HostOptions:
        """What the evaluation's host is told, in a dry run and live alike."""
        return HostOptions(self.distro, self.allow_missing_packages, self.no_python)

    def plan_options(self) -> PlanOptions:
        """Raises ``UsageError`` for a policy file that cannot be used."""
        document = _read_policy(self.policy) if self.policy else None
        unknown = [name for name in self.also if name not in ALSO]
        if unknown:
            raise UsageError(f"--also {unknown[0]}: choose from {', '.join(ALSO)}")
        policy = PolicyOptions(self.accept_patterns, document, also=frozenset(self.also))
        admission = AdmissionOptions(frozenset(self.accept_prefixes), frozenset(self.accept_middlewares))
        return PlanOptions(self.enclave_scope, policy, admission)


def _several(given: Any) -> tuple[Any, ...]:
    return (given,) if isinstance(given, (str, os.PathLike)) else tuple(given)


def _read_policy(path: Path) -> PolicyDocument:
    from keystore.errors import KeystoreError
    from keystore.formats.policy_xml import read_policy

    try:
        return read_policy(path)
    except KeystoreError as error:
        raise UsageError(str(error)) from error


@dataclass(frozen=True, slots=True)
class SecurityOptions:
    """How to provision: the keystore's own options (``None``: its defaults, for the domain in ``ROS_DOMAIN_ID``), and
    the strategy that the processes are told."""

    strategy: str = "Enforce"
    keystore: ProvisionOptions | None = None


@dataclass(frozen=True, slots=True)
class RunSettings:
    """How to run. ``secrets``: environment variables that no process of the launch sees; ``log_limit``: bytes after
    which a log file becomes ``<name>.1`` and a new one is begun, ``None`` for never; ``deadline``: when to end it, as
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
