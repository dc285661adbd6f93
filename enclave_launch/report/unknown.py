"""The gaps of a plan: processes and components without interfaces, by enclave. Only reads."""

from __future__ import annotations

from enclave_launch.plan import LaunchPlan, PlannedComponent, PlannedProcess
from enclave_launch.process import UNSPECIFIED_NODE_NAME, UNSPECIFIED_NODE_NAMESPACE

UNKNOWN = "permissions unknown"


def unknown_by_enclave(plan: LaunchPlan) -> dict[str, list[PlannedProcess | PlannedComponent]]:
    """Return the items of each enclave whose interfaces are unknown, in launch order."""
    answered = {enclave.path for enclave in plan.derived.policy.enclaves if enclave.profiles}
    unknown: dict[str, list[PlannedProcess | PlannedComponent]] = {}
    for process in plan.processes:
        if (
            process.enclave
            and is_unknown(process)
            and (process.missing or process.enclave.path not in answered)
        ):
            unknown.setdefault(process.enclave.path, []).append(process)
    for component in plan.components:
        if component.enclave and is_unknown(component):
            unknown.setdefault(component.enclave, []).append(component)
    return unknown


def is_unknown(item: PlannedProcess | PlannedComponent) -> bool:
    """Return True if no interface was found for the item: the plan has no node of it."""
    return not item.nodes


def label(item: PlannedProcess | PlannedComponent) -> str:
    """Return the name that the tree prints."""
    return item.process.process_name if isinstance(item, PlannedProcess) else item.fqn


def shown_fqn(item: PlannedProcess | PlannedComponent) -> str:
    """Return the names of the item's nodes, or what launch knows of the name; empty without one."""
    names = " ".join(dict.fromkeys(node.fqn for node in item.nodes))
    known = "" if UNSPECIFIED_NODE_NAME in (item.fqn or "") else item.fqn or ""
    return names or known.replace(UNSPECIFIED_NODE_NAMESPACE, "")
