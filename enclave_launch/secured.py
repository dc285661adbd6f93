"""A provisioned launch: the plan, the keystore it is signed into, and what each process gets from it."""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import NamedTuple

from enclave_launch.add_ons import LaunchRouter, zenoh_start
from enclave_launch.admission.middleware import failing, guid_halves, middleware_of, mixed_pairs
from enclave_launch.admission.variables import domain_of
from enclave_launch.diagnostics import Diagnostic, refusal
from enclave_launch.diagnostics.enclaves import (
    domain_not_served,
    enclave_of_several_launches,
    handshake_fails,
)
from enclave_launch.errors import ManifestError, ProvisionError, keystore_errors
from enclave_launch.plan import (
    LaunchPlan,
    PlannedProcess,
    enclave_domains,
    enclave_processes,
    on_zenoh,
)
from enclave_launch.planner import make_plan
from enclave_launch.process import ResolvedProcess
from enclave_launch.runtime.gate import StartAdditions, identity
from enclave_launch.security_environment import (
    OVERRIDE,
    SecuritySettings,
    enclave_arguments,
    enclave_environment,
    secured_environment,
)
from keystore.disk.share_files import LaunchHold
from keystore.disk.view import KeystoreView
from keystore.errors import KeystoreError
from keystore.formats.domains import Domains
from keystore.formats.governance import NoGovernanceRuleError
from keystore.formats.policy import EnclavePolicy
from keystore.steps.comparison import differences
from keystore.steps.options import ProvisionOptions, ProvisionReport
from keystore.steps.provisioning import provision
from keystore.steps.sharing import shared_enclaves


class ProvisionedLaunch(NamedTuple):
    """A plan whose enclaves have their files.

    ``report`` lists what was done to the keystore, ``settings`` the variables that lead processes to it; ``options``
    are those ``requested``, with what the plan decided."""

    plan: LaunchPlan
    settings: SecuritySettings
    report: ProvisionReport
    options: ProvisionOptions
    requested: ProvisionOptions
    zenoh: LaunchRouter | None = None
    """The router of processes on Zenoh."""

    @property
    def handshakes(self) -> tuple[Diagnostic, ...]:
        """Report processes on two DDS whose present certificates cannot authenticate each other."""
        pairs = mixed_pairs(enclave_processes(self.plan.processes))
        view = KeystoreView(Path(self.settings.keystore))
        subjects = {path: view.common_name(path) for pair in pairs for path in pair}
        known = {path: name for path, name in subjects.items() if name}
        return tuple(handshake_fails(*pair, planned=False) for pair in failing(pairs, known))

    @property
    def secret_variables(self) -> frozenset[str]:
        """Return the environment variables with secrets of the CA: no process may see them."""
        given = (self.options.access.passphrase, self.options.access.pin)
        return frozenset(secret.variable for secret in given if secret is not None and secret.variable)

    def serve_router(self, say: Callable[[str], None]) -> AbstractContextManager[object]:
        """Return a context within which the router of processes on Zenoh answers; raises RuntimeFailure."""
        if self.zenoh is None:
            return nullcontext()
        secret = self.secret_variables
        return self.zenoh.serve({name: os.environ[name] for name in os.environ if name not in secret}, say)


def provision_policies(
    settings: SecuritySettings, plan: LaunchPlan, options: ProvisionOptions, only: EnclavePolicy | None = None
) -> ProvisionReport:
    """Provision all enclaves of ``plan``, or one; raises ProvisionError with the keystore's message."""
    policies = plan.derived.policy.enclaves if only is None else (only,)
    with keystore_errors():
        try:
            return provision(settings.keystore, policies, options=options)
        except NoGovernanceRuleError as error:
            raise ProvisionError(f"{error} ({places(plan, error.domains)})") from error


def provision_plan(
    plan: LaunchPlan, settings: SecuritySettings, requested: ProvisionOptions
) -> ProvisionedLaunch:
    """Provision all enclaves of ``plan`` as ``requested``, with what the plan decides of it.

    Raises ``ManifestError`` for a domain that was not chosen, ``ProvisionError`` as ``provision_policies``.
    """
    requested = requested._replace(
        launch=requested.launch or LaunchHold(settings.keystore, launch_owner(plan)),
        guid_halves=guid_halves(enclave_processes(plan.processes)),
    )
    options = with_domains(plan, requested, os.environ)
    if enclaves := on_zenoh(plan, os.environ):
        options, report, router = _provision_on_zenoh(settings, plan, options, enclaves)
        return ProvisionedLaunch(plan, settings, report, options, requested, router)
    report = provision_policies(settings, plan, options)
    return ProvisionedLaunch(plan, settings, report, options, requested)


def _provision_on_zenoh(
    settings: SecuritySettings, plan: LaunchPlan, options: ProvisionOptions, enclaves: frozenset[str]
) -> tuple[ProvisionOptions, ProvisionReport, LaunchRouter]:
    """Provision all enclaves of ``plan``, and the router of those on Zenoh; return the options used, too."""
    zenoh = zenoh_start()
    options = options._replace(types=zenoh.types(plan, enclaves))
    report = provision_policies(settings, plan, options)
    with keystore_errors():
        return options, report, zenoh.configure(plan, settings.keystore, enclaves, options)


def launch_owner(plan: LaunchPlan) -> str:
    """Return the owner of this launch's shares: the launch file with its arguments, or the program that launches.

    The same file with ``robot:=r1`` and with ``robot:=r2`` is two owners: neither takes anything from the other.
    """
    arguments = dict(plan.inputs.source.arguments)  # of one given twice launch takes the last
    words = (shlex.quote(f"{name}:={value}") for name, value in sorted(arguments.items()))
    return " ".join((_launched_file(plan), *words))


def _launched_file(plan: LaunchPlan) -> str:
    return os.path.realpath(sys.argv[0] if plan.launch_file.startswith("<") else plan.launch_file)


def _is_of_file(owner: str, launch_file: str) -> bool:
    return f"{owner} ".startswith(f"{launch_file} ")


def with_shares_reported(plan: LaunchPlan, keystore: str) -> LaunchPlan:
    """Return the plan with a warning for each enclave that other launches on ``keystore`` share.

    The same file with other arguments is reported only where its share permits more. Raises ``ProvisionError`` if
    shares cannot be read.
    """
    with keystore_errors():
        found = [
            one
            for one in shared_enclaves(keystore, launch_owner(plan), plan.derived.policy.enclaves)
            if one.added or not all(_is_of_file(owner, _launched_file(plan)) for owner in one.others)
        ]
    return plan._replace(warnings=(*plan.warnings, *(enclave_of_several_launches(*one) for one in found)))


class PlanProvider:
    """Lets processes start whose enclave is what was provisioned, and hands out what rcl reads."""

    def __init__(self, launch: ProvisionedLaunch):
        self._launch = launch
        self._options = launch.options  # follow the plan when it is extended
        self._follow(launch.plan)

    @property
    def plan(self) -> LaunchPlan:
        """Return the plan, with what was added late."""
        return self._plan

    def _follow(self, plan: LaunchPlan) -> None:
        self._plan = plan
        identified = [(identity(item.process), item) for item in plan.processes]
        self._by_name = {(item.process.process_name, key): item for key, item in identified}
        self._by_identity = dict(identified)
        self._policies = {enclave.path: enclave for enclave in plan.derived.policy.enclaves}
        self._on_zenoh = on_zenoh(plan, os.environ)

    def granted(self, process: ResolvedProcess) -> StartAdditions | None:
        """Return the grant if the plan has the process and its enclave is the one provisioned (a few file reads)."""
        if self._find(process) is None:
            return None
        try:
            return self.ensure(process)
        except ProvisionError:
            return None  # ``ensure`` says why, where it may take its time

    def ensure(self, process: ResolvedProcess) -> StartAdditions:
        """Check the enclave of a process and return what it needs; raises ``ProvisionError`` if it was changed."""
        planned = self._find(process)
        assert planned is not None, "the gate lets only planned processes come here"
        if planned.enclave is not None:
            self._check(self._policies[planned.enclave.path])
        return self._grant(planned, process.environment)

    def _find(self, process: ResolvedProcess) -> PlannedProcess | None:
        # Equal ones may have enclaves of their own; names distinguish them unless events reordered them.
        key = identity(process)
        return self._by_name.get((process.process_name, key)) or self._by_identity.get(key)

    def ensure_late(self, process: ResolvedProcess) -> StartAdditions:
        """Extend the plan by ``process`` and provision that; raises ``ProvisionError``."""
        if (process.process_name, identity(process)) in self._by_name:
            return self.ensure(process)
        evaluation = self._plan.evaluation
        with_it = evaluation._replace(processes=(*evaluation.processes, process))
        extended = make_plan(with_it, self._plan.inputs)
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
            # What came late may be in another domain.
            self._options = with_domains(self._plan, self._launch.requested, os.environ)
            if self._on_zenoh:
                self._extend_zenoh(process)
            else:
                provision_policies(self._launch.settings, self._plan, self._options, policy)
        return self.ensure(process)

    def _extend_zenoh(self, process: ResolvedProcess) -> None:
        if self._launch.zenoh is None:
            raise ProvisionError(
                f"{process.process_name} is the first process on Zenoh, and no router was started: the plan had none"
            )
        _, _, router = _provision_on_zenoh(self._launch.settings, self._plan, self._options, self._on_zenoh)
        router.wait()

    def launcher(self) -> StartAdditions | None:
        launcher, settings = self._plan.launcher, self._launch.settings
        if launcher is None:
            return None
        self._check(self._policies[launcher.enclave])
        middleware = middleware_of(os.environ)
        variables = enclave_environment(launcher.enclave, middleware, settings)
        return StartAdditions(("--enclave", launcher.enclave), variables)

    def _check(self, policy: EnclavePolicy) -> None:
        """Refuse an enclave whose files changed since they were signed. Nothing is repaired."""
        enclave, keystore = policy.path, self._launch.settings.keystore
        try:
            wrong = differences(keystore, policy, options=self._options)
            if (router := self._launch.zenoh) is not None and enclave in self._on_zenoh:
                wrong = (*wrong, *router.differences(enclave))
        except KeystoreError as error:
            raise ProvisionError(
                f"enclave {enclave} can no longer be read, although it was provisioned for this launch: {error}"
            ) from error
        if wrong:
            raise ProvisionError(
                f"enclave {enclave} in {keystore} is no longer what was provisioned for this launch: "
                f"{'; '.join(wrong)}. Find out who changed it; a new launch provisions it again"
            )

    def _grant(self, planned: PlannedProcess, environment: Mapping[str, str]) -> StartAdditions:
        variables = dict(secured_environment(planned, self._launch.settings))
        if planned.enclave is not None and (OVERRIDE in environment or OVERRIDE in os.environ):
            variables[OVERRIDE] = planned.enclave.path
        return StartAdditions(enclave_arguments(planned), variables)


def with_domains(
    plan: LaunchPlan, options: ProvisionOptions, environment: Mapping[str, str]
) -> ProvisionOptions:
    """Return ``options`` with the domains of ``plan``; raises ManifestError for one that was not chosen."""
    if options.domains is not None:
        refused = list(not_served(plan, options.domains))
        if refused:
            raise ManifestError(refusal(refused))
        return options
    by_enclave = {path: set(domains) for path, domains in enclave_domains(plan.processes).items()}
    if plan.launcher is not None:
        by_enclave.setdefault(plan.launcher.enclave, set()).add(domain_of(environment))
    every = set().union(*by_enclave.values()) or {domain_of(environment)}
    return options._replace(
        domains=_domains(every), enclave_domains={path: _domains(ids) for path, ids in by_enclave.items()}
    )


def not_served(plan: LaunchPlan, domains: Domains) -> Iterator[Diagnostic]:
    """Report each process with an enclave whose domain is not among ``domains``."""
    for item in plan.processes:
        if item.enclave is not None and not domains.covers(Domains.single(item.domain)):
            process = item.process
            yield domain_not_served(process.process_name, item.domain, str(domains), process.location)


def places(plan: LaunchPlan, domains: Domains) -> str:
    """Describe for a reader where ``domains`` come from."""
    asking = (
        f"{item.process.process_name} at {item.process.location} is in domain {item.domain}"
        for item in plan.processes
        if item.enclave is not None and domains.covers(Domains.single(item.domain))
    )
    return "; ".join(asking)


def _domains(ids: set[int]) -> Domains:
    return Domains((number, number) for number in ids)
