"""The last step: a planned or provisioned launch becomes processes. Joins the plan with the runtime.

The file is evaluated once more, by a host that starts processes; behind the gate each of them is held against the
plan. Starts processes; nothing comes after.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from enclave_launch.evaluation.programs import check_programs
from enclave_launch.plan import LaunchPlan
from enclave_launch.prefixes import ament_prefixes
from enclave_launch.runtime.gate import EnclaveGate, PlannedGate
from enclave_launch.runtime.service import RunOptions, run_launch, run_launch_async

if TYPE_CHECKING:
    from enclave_launch.flow import RunSettings
    from enclave_launch.secured import ProvisionedLaunch


def run_plan(launch: LaunchPlan | ProvisionedLaunch, settings: RunSettings) -> int:
    """Block until all is over. Before anything was started raises ``RuntimeFailure``, and ``LaunchFileError``
    for a program that is not there."""
    source = _plan(launch).planner.source
    gate, options = _gate(launch, settings), _options(launch, settings)
    with ament_prefixes(source.prefixes):
        check_programs(_plan(launch).evaluation.processes)
        return run_launch(source.launch_file, source.arguments, gate=gate, options=options)


async def run_plan_async(launch: LaunchPlan | ProvisionedLaunch, settings: RunSettings) -> int:
    """The same inside a running event loop."""
    source = _plan(launch).planner.source
    gate, options = _gate(launch, settings), _options(launch, settings)
    with ament_prefixes(source.prefixes):
        check_programs(_plan(launch).evaluation.processes)
        return await run_launch_async(source.launch_file, source.arguments, gate=gate, options=options)


def _plan(launch: LaunchPlan | ProvisionedLaunch) -> LaunchPlan:
    return launch if isinstance(launch, LaunchPlan) else launch.plan


def _gate(launch: LaunchPlan | ProvisionedLaunch, settings: RunSettings) -> EnclaveGate | None:
    """What stands before each process; ``None`` for a launch that was asked to run unsecured."""
    if isinstance(launch, LaunchPlan):
        return None
    from enclave_launch.secured import PlanProvider  # brings the keystore: not for a launch without it

    evaluation = launch.plan.evaluation
    return PlannedGate(
        evaluation.processes,
        evaluation.components,
        PlanProvider(launch),
        allow_late=settings.allow_late,
        say_late=lambda text: print(f"secure-launch: warning: {text}", file=sys.stderr),
    )


def _options(launch: LaunchPlan | ProvisionedLaunch, settings: RunSettings) -> RunOptions:
    plan = _plan(launch)
    return RunOptions(
        noninteractive=settings.noninteractive,
        debug=settings.debug,
        secrets=settings.secrets | (frozenset() if isinstance(launch, LaunchPlan) else launch.secret_variables),
        needs_ros_services=plan.launcher is not None,
        launch_configurations=plan.planner.source.launch_configurations,
        host_options=dict(plan.planner.source.host_options),
    )
