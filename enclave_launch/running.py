"""The last step: a planned or provisioned launch becomes processes.

The file is visited by a host that starts processes, with the recorded results of the user's code; behind the gate each
process is compared with the plan."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from functools import partial

from enclave_common.add_ons import add_on
from enclave_common.dependencies import absence
from enclave_common.terminal import warn
from enclave_launch.errors import UsageError
from enclave_launch.evaluation.programs import check_programs
from enclave_launch.expiry_watch import watched
from enclave_launch.options import RunSettings
from enclave_launch.plan import EvaluatedLaunch, LaunchPlan, LaunchSource
from enclave_launch.runtime.companion import LaunchCompanion, Together
from enclave_launch.runtime.gate import EnclaveGate, PlannedGate
from enclave_launch.runtime.live_launch import LiveLaunch, run_launch
from enclave_launch.runtime.run_events import Observer
from enclave_launch.runtime.running_launch import RunningLaunch
from enclave_launch.runtime.warden_process import WardenProcess
from enclave_launch.secured import PlanProvider, ProvisionedLaunch

UnsecuredLaunch = LaunchSource | EvaluatedLaunch | LaunchPlan
"""Launches that can start without enclaves."""
_Launch = UnsecuredLaunch | ProvisionedLaunch


def check_provisioned(launch: object, caller: str) -> None:
    """Raise UsageError unless ``launch`` was provisioned, so that nothing starts unsecured by a forgotten step."""
    if not isinstance(launch, ProvisionedLaunch):
        raise UsageError(
            f"{caller}() starts what provision() returned, and this {type(launch).__name__} has no keystore; "
            f"secured: {caller}(provision(resolve(launch_file), keystore)), "
            f"without enclaves: {caller}_unsecured(...)"
        )


def check_unsecured(launch: object, caller: str) -> None:
    """Raise UsageError if ``launch`` was provisioned, or is nothing that can be started."""
    if not isinstance(launch, UnsecuredLaunch):
        raise UsageError(
            f"{caller}() starts what launch_source(), evaluate_launch() or resolve() returned, not this "
            f"{type(launch).__name__}; what provision() returned: {caller.replace('_unsecured', '')}(...)"
        )


def run_launched(launch: _Launch, settings: RunSettings) -> int:
    """Block until all is over. Raises ``RuntimeFailure`` and, provisioned, ``LaunchFileError`` before the start."""
    live = _live(launch, settings)
    with _expiry_watch(launch):
        _check_programs(launch)
        with _zenoh_router(launch), WardenProcess(interactive=not settings.noninteractive) as warden:
            return run_launch(live(warden=warden))


async def run_launched_async(launch: _Launch, settings: RunSettings) -> int:
    """Run inside a running event loop."""
    live = _live(launch, settings)
    with _expiry_watch(launch):
        _check_programs(launch)
        with _zenoh_router(launch):
            return await live().run()


def start_launched(launch: _Launch, settings: RunSettings) -> RunningLaunch:
    """Start in a thread of its own; raises EnclaveLaunchError before anything was started."""
    live = _live(launch, settings)
    _check_programs(launch)

    async def main(observe: Observer, hold: Callable[[LiveLaunch], None]) -> int:
        with _expiry_watch(launch), _zenoh_router(launch):
            service = live(observe=observe)
            hold(service)
            return await service.run()

    return RunningLaunch(main)


def _live(launch: _Launch, settings: RunSettings) -> partial[LiveLaunch]:
    own = frozenset[str]() if isinstance(launch, UnsecuredLaunch) else launch.secret_variables
    needed = None if isinstance(launch, LaunchSource) else bool(_evaluated(launch).evaluation.launcher_calls)
    return partial(
        LiveLaunch,
        _source(launch),
        replace(settings, secrets=settings.secrets | own, companion=_companion(launch, settings)),
        gate=_gate(launch, settings),
        needs_ros_services=needed,
    )


def _expiry_watch(launch: _Launch) -> AbstractContextManager[None]:
    if isinstance(launch, UnsecuredLaunch):
        return nullcontext()

    return watched(launch, warn)


def _zenoh_router(launch: _Launch) -> AbstractContextManager[object]:
    return nullcontext() if isinstance(launch, UnsecuredLaunch) else launch.serve_router(warn)


def _check_programs(launch: _Launch) -> None:
    # Unsecured, those that can be executed are started, as launch does.
    if not isinstance(launch, UnsecuredLaunch):
        check_programs(launch.plan.evaluation.processes)


def _source(launch: _Launch) -> LaunchSource:
    return launch if isinstance(launch, LaunchSource) else _evaluated(launch).source


def _evaluated(launch: EvaluatedLaunch | LaunchPlan | ProvisionedLaunch) -> EvaluatedLaunch:
    if isinstance(launch, EvaluatedLaunch):
        return launch
    return (launch if isinstance(launch, LaunchPlan) else launch.plan).evaluated


def _gate(launch: _Launch, settings: RunSettings) -> EnclaveGate | None:
    if isinstance(launch, UnsecuredLaunch):
        return None

    evaluation = launch.plan.evaluation
    return PlannedGate(
        evaluation.processes,
        evaluation.components,
        PlanProvider(launch),
        allow_late=settings.allow_late,
        say_late=warn,
    )


def _companion(launch: _Launch, settings: RunSettings) -> LaunchCompanion | None:
    companion = settings.companion or _recording(launch, settings)
    if companion is None or settings.watch is None:
        return companion or settings.watch
    return Together(companion, settings.watch)


def _recording(launch: _Launch, settings: RunSettings) -> LaunchCompanion | None:
    secured = not isinstance(launch, UnsecuredLaunch)
    if settings.record is False or (settings.record is None and not secured):
        return None
    explaining = add_on("enclave_launch.companion", "recording")
    if explaining is None:
        if settings.record:
            raise UsageError(f"RunSettings.record: {absence('enclave_addons.recording')}")
        return None
    source = _source(launch)
    plan = None if isinstance(launch, UnsecuredLaunch) else launch.plan
    distro = (source.host_options.distro or os.environ.get("ROS_DISTRO", "")).partition("@")[0]
    companion: LaunchCompanion = explaining(
        source.launch_file, distro, plan, optional=settings.record is None
    )
    return companion
