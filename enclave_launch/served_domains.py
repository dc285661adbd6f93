"""Choose the DDS domains of each enclave's permissions: those of its own processes. Performs no I/O."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from enclave_launch.admission.variables import domain_of
from enclave_launch.diagnostics import Diagnostic, refusal
from enclave_launch.diagnostics.enclaves import domain_not_served
from enclave_launch.errors import ManifestError
from enclave_launch.plan import LaunchPlan, enclave_domains
from keystore.formats.domains import Domains
from keystore.steps.options import ProvisionOptions


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
