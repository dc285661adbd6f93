"""A provisioned launch: the plan, the keystore it is signed into, and what each process gets from it.

Stands between the plan and the runtime's gate. ``ensure`` is called before every start: it brings the enclave to
the planned state (a few file reads when it already is) and hands out the arguments and variables that rcl reads.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from enclave_launch.errors import ProvisionError
from enclave_launch.plan import LaunchPlan, PlannedProcess
from enclave_launch.process import ResolvedProcess
from enclave_launch.runtime.gate import Grant, identity
from enclave_launch.security_environment import (
    OVERRIDE,
    SecuritySettings,
    enclave_arguments,
    launcher_environment,
    secured_environment,
)
from keystore import layout
from keystore.errors import KeystoreError
from keystore.policy import EnclavePolicy
from keystore.provisioning import ProvisionOptions, ProvisionReport, provision


@dataclass(frozen=True, slots=True)
class ProvisionedLaunch:
    """``report`` tells what was done to the keystore; ``settings`` how processes are pointed at it."""

    plan: LaunchPlan
    settings: SecuritySettings
    report: ProvisionReport
    options: ProvisionOptions


def provision_policies(
    settings: SecuritySettings, policies: Iterable[EnclavePolicy], options: ProvisionOptions
) -> ProvisionReport:
    """Raises ``ProvisionError`` with the keystore's own message."""
    try:
        return provision(settings.keystore, policies, options=options)
    except KeystoreError as error:
        raise ProvisionError(str(error)) from error


class PlanProvider:
    """Makes enclaves complete as the plan says, and no further."""

    def __init__(self, launch: ProvisionedLaunch):
        self._launch = launch
        self._completed: dict[str, tuple[EnclavePolicy, tuple[tuple[str, int, int, int], ...]]] = {}
        self._follow(launch.plan)

    def _follow(self, plan: LaunchPlan) -> None:
        self._plan = plan
        self._planned = {identity(item.process): item for item in plan.processes}
        self._policies = {enclave.path: enclave for enclave in plan.derived.policy.enclaves}

    def ensure(self, process: ResolvedProcess) -> Grant:
        """Raises ``ProvisionError`` when the enclave cannot be completed."""
        planned = self._planned[identity(process)]
        if planned.enclave is not None:
            self._complete(planned.enclave.path)
        return self._grant(planned, process.environment)

    def ensure_late(self, process: ResolvedProcess) -> Grant:
        """Extend the plan by ``process``. Raises ``ProvisionError`` when its interfaces are not known."""
        evaluation = self._plan.evaluation
        extended = self._plan.planner.plan(replace(evaluation, processes=(*evaluation.processes, process)))
        new = [problem for problem in extended.problems if problem not in self._plan.problems]
        if new:
            raise ProvisionError("\n".join(new))
        self._follow(extended)
        return self.ensure(process)

    def launcher(self) -> Grant | None:
        launcher = self._plan.launcher
        if launcher is None:
            return None
        self._complete(launcher.enclave)
        return Grant(("--enclave", launcher.enclave), launcher_environment(self._launch.settings))

    def _complete(self, enclave: str) -> None:
        """Nodes that share an enclave, and restarts, pay for a look at its files only while nobody touches those."""
        policy = self._policies[enclave]
        if self._completed.get(enclave) == (policy, self._files(enclave)):
            return
        provision_policies(self._launch.settings, [policy], self._launch.options)
        self._completed[enclave] = (policy, self._files(enclave))

    def _files(self, enclave: str) -> tuple[tuple[str, int, int, int], ...]:
        """What any change to the enclave's files changes: name, inode, size and time of each."""
        directory = os.path.join(self._launch.settings.keystore, layout.enclave_directory(enclave))
        try:
            with os.scandir(directory) as entries:
                files = [(entry.name, entry.stat()) for entry in entries if not entry.is_dir(follow_symlinks=False)]
        except OSError:
            return ()
        return tuple(sorted((name, status.st_ino, status.st_size, status.st_mtime_ns) for name, status in files))

    def _grant(self, planned: PlannedProcess, environment: Mapping[str, str]) -> Grant:
        variables = dict(secured_environment(planned, self._launch.settings))
        if planned.enclave is not None and (OVERRIDE in environment or OVERRIDE in os.environ):
            variables[OVERRIDE] = planned.enclave.path
        return Grant(enclave_arguments(planned), variables)
