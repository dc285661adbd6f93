"""A provisioned launch: the plan, the keystore it is signed into, and what each process gets from it.

Stands between the plan and the runtime's gate. ``ensure`` is called before every start: it holds the enclave against
what was provisioned (a few file reads) and hands out the arguments and variables that rcl reads.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from enclave_launch.admission.handshakes import failing
from enclave_launch.diagnostics import Diagnostic, enclave_of_several_launches, handshake_fails
from enclave_launch.errors import ProvisionError
from enclave_launch.plan import LaunchPlan, PlannedProcess, mixed_enclaves
from enclave_launch.process import ResolvedProcess
from enclave_launch.runtime.gate import Grant, identity
from enclave_launch.security_environment import (
    OVERRIDE,
    SecuritySettings,
    enclave_arguments,
    launcher_environment,
    secured_environment,
)
from enclave_launch.served_domains import places, with_domains
from keystore.errors import KeystoreError
from keystore.formats.governance import NoGovernanceRuleError
from keystore.formats.policy import EnclavePolicy
from keystore.steps.options import ProvisionOptions
from keystore.steps.provisioning import provision
from keystore.steps.report import ProvisionReport


class ProvisionedLaunch(NamedTuple):
    """``report`` tells what was done to the keystore; ``settings`` how processes are pointed at it;
    ``options`` are those ``asked`` for, with what the plan decided."""

    plan: LaunchPlan
    settings: SecuritySettings
    report: ProvisionReport
    options: ProvisionOptions
    asked: ProvisionOptions

    @property
    def handshakes(self) -> tuple[Diagnostic, ...]:
        """Of processes on two DDS implementations, those that cannot authenticate each other with the certificates
        they have now."""
        from keystore.disk.view import KeystoreView

        pairs = mixed_enclaves(self.plan.processes)
        view = KeystoreView(Path(self.settings.keystore))
        subjects = {path: view.common_name(path) for pair in pairs for path in pair}
        known = {path: name for path, name in subjects.items() if name}
        return tuple(handshake_fails(*pair, planned=False) for pair in failing(pairs, known))

    @property
    def secret_variables(self) -> frozenset[str]:
        """Environment variables with secrets of the CA: no process may see them."""
        given = (self.options.access.passphrase, self.options.access.pin)
        return frozenset(secret.variable for secret in given if secret is not None and secret.variable)


def provision_policies(
    settings: SecuritySettings,
    plan: LaunchPlan,
    options: ProvisionOptions,
    only: EnclavePolicy | None = None,
) -> ProvisionReport:
    """All enclaves of ``plan``, or one. Raises ``ProvisionError`` with the keystore's own message, and where the plan
    asks for what it cannot give."""
    policies = plan.derived.policy.enclaves if only is None else (only,)
    try:
        return provision(settings.keystore, policies, options=options)
    except NoGovernanceRuleError as error:
        raise ProvisionError(f"{error} ({places(plan, error.domains)})") from error
    except KeystoreError as error:
        raise ProvisionError(str(error)) from error


def launch_owner(plan: LaunchPlan) -> str:
    """Whose share of an enclave this launch's permissions are: the launch file, whatever its arguments, or the program
    that made the launch description itself."""
    return os.path.realpath(sys.argv[0] if plan.launch_file.startswith("<") else plan.launch_file)


def told_of_shares(plan: LaunchPlan, keystore: str) -> LaunchPlan:
    """The plan with a warning for each enclave that other launches on ``keystore`` have shares of. Reads only.

    Raises ``ProvisionError`` for shares that cannot be read.
    """
    from keystore.steps.sharing import shared_enclaves

    try:
        found = list(shared_enclaves(keystore, launch_owner(plan), plan.derived.policy.enclaves))
    except KeystoreError as error:
        raise ProvisionError(str(error)) from error
    return plan._replace(warnings=(*plan.warnings, *(enclave_of_several_launches(*one) for one in found)))


class PlanProvider:
    """Lets processes start whose enclave is what was provisioned, and hands out what rcl reads."""

    def __init__(self, launch: ProvisionedLaunch):
        self._launch = launch
        self._options = launch.options  # follow the plan when it is extended
        self._follow(launch.plan)

    @property
    def plan(self) -> LaunchPlan:
        """The launch's, with what came late."""
        return self._plan

    def _follow(self, plan: LaunchPlan) -> None:
        self._plan = plan
        identified = [(identity(item.process), item) for item in plan.processes]
        self._by_name = {(item.process.process_name, key): item for key, item in identified}
        self._by_identity = dict(identified)
        self._policies = {enclave.path: enclave for enclave in plan.derived.policy.enclaves}

    def _follow_domains(self) -> None:
        """What came late may be in another domain."""
        self._options = with_domains(self._plan, self._launch.asked, os.environ)

    def granted(self, process: ResolvedProcess) -> Grant | None:
        """The grant, if the plan has the process and its enclave is the one provisioned (a few file reads)."""
        if self._find(process) is None:
            return None
        try:
            return self.ensure(process)
        except ProvisionError:
            return None  # ``ensure`` says why, where it may take its time

    def ensure(self, process: ResolvedProcess) -> Grant:
        """Raises ``ProvisionError`` when its enclave is no longer what was provisioned."""
        planned = self._find(process)
        assert planned is not None, "the gate lets only planned processes come here"
        if planned.enclave is not None:
            self._check(self._policies[planned.enclave.path])
        return self._grant(planned, process.environment)

    def _find(self, process: ResolvedProcess) -> PlannedProcess | None:
        """Equal processes may have enclaves of their own; their names tell them apart unless events reordered them."""
        key = identity(process)
        return self._by_name.get((process.process_name, key)) or self._by_identity.get(key)

    def ensure_late(self, process: ResolvedProcess) -> Grant:
        """Extend the plan by ``process`` and provision that; what the plan has already is only held against it.

        Raises ``ProvisionError`` when its interfaces are not known, or its enclave is no longer what was provisioned.
        """
        if (process.process_name, identity(process)) in self._by_name:
            return self.ensure(process)
        evaluation = self._plan.evaluation
        extended = self._plan.planner.plan(evaluation._replace(processes=(*evaluation.processes, process)))
        new = [problem for problem in extended.problems if problem not in self._plan.problems]
        if new:
            raise ProvisionError("\n".join(map(str, new)))
        before = self._policies
        self._follow(extended)
        planned = self._find(process)
        if planned is not None and planned.enclave is not None:
            policy = self._policies[planned.enclave.path]
            if policy.path in before:  # to extend is not to repair
                self._check(before[policy.path])
            self._follow_domains()
            provision_policies(self._launch.settings, self._plan, self._options, policy)
        return self.ensure(process)

    def launcher(self) -> Grant | None:
        launcher = self._plan.launcher
        if launcher is None:
            return None
        self._check(self._policies[launcher.enclave])
        return Grant(("--enclave", launcher.enclave), launcher_environment(self._launch.settings))

    def _check(self, policy: EnclavePolicy) -> None:
        """Nothing is repaired here: what changed since it was signed was changed by somebody else."""
        from keystore.steps.comparison import differences

        enclave, keystore = policy.path, self._launch.settings.keystore
        try:
            wrong = differences(keystore, policy, options=self._options)
        except KeystoreError as error:
            raise ProvisionError(
                f"enclave {enclave} cannot be looked at any more, though it was provisioned for this launch: {error}"
            ) from error
        if wrong:
            raise ProvisionError(
                f"enclave {enclave} in {keystore} is no longer what was provisioned for this launch: "
                f"{'; '.join(wrong)}. Find out who changed it; a new launch provisions it again"
            )

    def _grant(self, planned: PlannedProcess, environment: Mapping[str, str]) -> Grant:
        variables = dict(secured_environment(planned, self._launch.settings))
        if planned.enclave is not None and (OVERRIDE in environment or OVERRIDE in os.environ):
            variables[OVERRIDE] = planned.enclave.path
        return Grant(enclave_arguments(planned), variables)
