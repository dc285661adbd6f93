"""The flow as three calls, usable separately: a launch file → a plan → a keystore → processes.

    plan = resolve("demo.launch.xml")                   decides everything, does nothing
    launch = provision(plan, "keystore")                keys, certificates, signed permissions
    status = run(launch)                                every process starts with its enclave

``run`` also takes a bare plan and then starts it unsecured, as ``secure-launch`` without ``--secure`` does; inside a
running event loop await ``run_async``. Errors are ``EnclaveLaunchError``; ``str(error)`` is for a person.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from enclave_launch.enclave import EnclaveScope
from enclave_launch.errors import ManifestError, UsageError
from enclave_launch.plan import LaunchPlan, LaunchSource, Planner, PlanOptions
from enclave_launch.policy import PolicyOptions
from enclave_launch.prefixes import ament_prefixes

if TYPE_CHECKING:
    from enclave_launch.process import Evaluation
    from enclave_launch.secured import ProvisionedLaunch
    from keystore.policy_xml import PolicyDocument
    from keystore.provisioning import ProvisionOptions


@dataclass(frozen=True, slots=True)
class ResolveOptions:
    """How to resolve. ``prefixes`` are searched before ``AMENT_PREFIX_PATH``; ``distro`` ``None``: ``ROS_DISTRO``,
    else the newest; ``manifests`` win where NoDL definitions conflict."""

    prefixes: tuple[Path, ...] = ()
    manifests: tuple[Path, ...] = ()
    policy: Path | None = None
    distro: str | None = None
    enclave_scope: EnclaveScope = EnclaveScope.NAMESPACE
    infer: bool = True
    accept_patterns: bool = False
    allow_missing_packages: bool = False
    no_python: bool = False
    launch_configurations: Mapping[str, str] = field(default_factory=dict)

    def host_options(self) -> dict[str, object]:
        """What the evaluation's host is told, in a dry run and live alike."""
        return {
            "distro": self.distro,
            "allow_missing_packages": self.allow_missing_packages,
            "no_python": self.no_python,
        }

    def plan_options(self) -> PlanOptions:
        """Raises ``UsageError`` for a policy file that cannot be used."""
        document = _read_policy(self.policy) if self.policy else None
        return PlanOptions(self.enclave_scope, PolicyOptions(self.accept_patterns, document))


def _read_policy(path: Path) -> PolicyDocument:
    from keystore.errors import KeystoreError
    from keystore.policy_xml import read_policy

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


def resolve(
    launch_file: str | os.PathLike[str],
    arguments: Sequence[tuple[str, str]] = (),
    *,
    options: ResolveOptions | None = None,
) -> LaunchPlan:
    """Evaluate ``launch_file`` as launch would and plan it. Starts nothing, writes nothing.

    Raises ``LaunchFileError`` (file, line, element, include chain) and ``ManifestError``. What a secure start must
    refuse is in ``plan.problems``.
    """
    from enclave_launch.evaluation.evaluate import evaluate
    from enclave_launch.evaluation.host import PlanHost
    from enclave_launch.interfaces import InterfaceFinder
    from nodl.ament_index import search_prefixes

    chosen = options or ResolveOptions()
    source = LaunchSource(
        os.path.abspath(launch_file),
        tuple(arguments),
        tuple(map(os.path.abspath, chosen.prefixes)),
        {**chosen.launch_configurations},
        {**chosen.host_options(), "anonymous_seed": int.from_bytes(os.urandom(8), "big")},
    )
    with ament_prefixes(source.prefixes):
        evaluation = evaluate(
            source.launch_file,
            source.arguments,
            host=PlanHost(**source.host_options),
            launch_configurations=source.launch_configurations,
        )
        finder = InterfaceFinder(search_prefixes(), chosen.manifests, chosen.infer)
        plan = Planner(source, finder, chosen.plan_options()).plan(evaluation)
        return replace(plan, warnings=(*plan.warnings, *_missing_programs(evaluation)))


def _missing_programs(evaluation: Evaluation) -> list[str]:
    """``run`` would refuse them. Placeholders of packages that are not installed have their own warning."""
    from enclave_launch.evaluation.host import MISSING_PREFIX
    from enclave_launch.evaluation.programs import missing_programs

    placeholders = f"{MISSING_PREFIX}/"
    real = [item for item in evaluation.processes if not "".join(item.cmd[:1]).startswith(placeholders)]
    return [str(error) for error in missing_programs(real)]


def provision(
    plan: LaunchPlan, keystore: str | os.PathLike[str], *, options: SecurityOptions | None = None
) -> ProvisionedLaunch:
    """Bring every enclave of ``plan`` to exactly its planned permissions; idempotent.

    Raises ``ManifestError`` for a plan with problems (nothing is written then) and ``ProvisionError``.
    """
    from enclave_launch.secured import ProvisionedLaunch, provision_policies
    from enclave_launch.security_environment import SecuritySettings, environment_domains
    from keystore.provisioning import ProvisionOptions

    if plan.problems:
        raise ManifestError("\n".join((*plan.problems, "nothing was started or written")))
    chosen = options or SecurityOptions()
    settings = SecuritySettings(os.path.abspath(keystore), chosen.strategy)
    wanted = chosen.keystore or ProvisionOptions(domains=environment_domains(os.environ))
    report = provision_policies(settings, plan.derived.policy.enclaves, wanted)
    return ProvisionedLaunch(plan, settings, report, wanted)


@dataclass(frozen=True, slots=True)
class RunSettings:
    """How to run. ``secrets``: environment variables that no process of the launch sees."""

    noninteractive: bool = False
    debug: bool = False
    allow_late: bool = False
    secrets: frozenset[str] = frozenset()


def run(launch: LaunchPlan | ProvisionedLaunch, *, options: RunSettings | None = None) -> int:
    """Start what was planned and stay until all has ended; handles SIGINT and SIGTERM. Gives the exit status.

    Before anything is started raises ``RuntimeFailure`` when something it needs is not there, and ``LaunchFileError``
    for a program that cannot be executed.
    """
    from enclave_launch.running import run_plan

    return run_plan(launch, options or RunSettings())


async def run_async(launch: LaunchPlan | ProvisionedLaunch, *, options: RunSettings | None = None) -> int:
    """The same inside a running event loop; signals stay the caller's, cancelling ends every process first."""
    from enclave_launch.running import run_plan_async

    return await run_plan_async(launch, options or RunSettings())
