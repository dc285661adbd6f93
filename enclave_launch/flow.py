"""The flow as three calls, usable separately: a launch file → a plan → a keystore → processes.

    plan = resolve("demo.launch.xml")                   decides everything, does nothing
    launch = provision(plan, "keystore")                keys, certificates, signed permissions
    status = run(launch)                                every process starts with its enclave

``run_unsecured`` starts a bare plan, the result of ``evaluate_launch`` or a ``launch_source`` without enclaves.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

from enclave_launch.add_ons import zenoh_planning
from enclave_launch.admission.middleware import middleware_of, why_not
from enclave_launch.diagnostics import Diagnostic, refusal
from enclave_launch.diagnostics.enclaves import middleware_refused
from enclave_launch.diagnostics.evaluation import program_not_executable
from enclave_launch.errors import LaunchFileError, ManifestError, UsageError
from enclave_launch.evaluation.evaluate import evaluate
from enclave_launch.evaluation.programs import missing_programs
from enclave_launch.host.plan_host import PlanHost
from enclave_launch.host.user_code_results import RecordedResults
from enclave_launch.interfaces import InterfaceFinder
from enclave_launch.options import ResolveOptions, RunSettings, SecurityOptions
from enclave_launch.plan import (
    EvaluatedLaunch,
    LaunchPlan,
    LaunchSource,
    PlanInputs,
    on_zenoh,
)
from enclave_launch.planner import make_plan
from enclave_launch.prefixes import ament_prefixes
from enclave_launch.process import Evaluation
from enclave_launch.security_environment import SecuritySettings
from keystore.steps.options import ProvisionOptions
from nodl.ament_index import MISSING_PREFIX, launch_file_path, search_prefixes

if TYPE_CHECKING:
    from enclave_launch.running import UnsecuredLaunch
    from enclave_launch.runtime.running_launch import RunningLaunch
    from enclave_launch.secured import ProvisionedLaunch


def find_launch_file(package: str, file_name: str, *, prefixes: Sequence[str | os.PathLike[str]] = ()) -> str:
    """Return the path of a launch file of an installed package, as ``ros2 launch PACKAGE FILE`` finds it.

    ``prefixes`` are searched before ``AMENT_PREFIX_PATH``. Raises LaunchFileError."""
    try:
        return launch_file_path(
            package, file_name, search_prefixes([os.fspath(prefix) for prefix in prefixes])
        )
    except (LookupError, OSError, ValueError) as error:
        raise LaunchFileError(str(error)) from error


def resolve(
    launch_file: str | os.PathLike[str],
    arguments: Sequence[tuple[str, str]] = (),
    *,
    options: ResolveOptions | None = None,
) -> LaunchPlan:
    """Evaluate ``launch_file`` as launch would and plan it; ``plan.problems``: what a secured start refuses.

    Raises ``LaunchFileError`` and ``ManifestError``. Starts nothing, writes nothing."""
    chosen = options or ResolveOptions()
    evaluated = evaluate_launch(launch_file, arguments, options=chosen)
    source, evaluation = evaluated.source, evaluated.evaluation
    prefixes = search_prefixes(source.prefixes)
    finder = InterfaceFinder(prefixes, chosen, evaluation.distro, evaluation)
    plan = make_plan(evaluation, PlanInputs(source, finder, chosen.plan_options()))
    plan = plan._replace(
        problems=(*plan.problems, *_launcher_refusals(plan)),
        warnings=(*plan.warnings, *_missing_programs(evaluated.evaluation)),
    )
    if on_zenoh(plan, os.environ) and (zenoh := zenoh_planning()):
        return zenoh.report(plan, os.environ)
    return plan


def _launcher_refusals(plan: LaunchPlan) -> list[Diagnostic]:
    """Return why our own node cannot run: it runs in our environment, not in one of the launch file's."""
    if plan.launcher is None:
        return []
    middleware = middleware_of(os.environ)
    why = why_not(middleware, plan.inputs.options.admission.middlewares)
    if why is None:
        return []
    place = plan.launcher.location
    return [middleware_refused("the launcher's own node", middleware, why, place, by_launch_file=False)]


def evaluate_launch(
    launch_file: str | os.PathLike[str],
    arguments: Sequence[tuple[str, str]] = (),
    *,
    options: ResolveOptions | None = None,
) -> EvaluatedLaunch:
    """Evaluate a launch file: what would start, without enclaves; raises LaunchFileError."""
    source = launch_source(launch_file, arguments, options=options)._replace(
        user_code_results=RecordedResults()
    )
    with ament_prefixes(source.prefixes):
        evaluation = evaluate(
            source.launch_file,
            source.arguments,
            host=PlanHost(source.host_options, user_code_results=source.user_code_results),
            launch_configurations=source.launch_configurations,
        )
    return EvaluatedLaunch(source, evaluation)


def launch_source(
    launch_file: str | os.PathLike[str],
    arguments: Sequence[tuple[str, str]] = (),
    *,
    options: ResolveOptions | None = None,
) -> LaunchSource:
    """Describe what to launch without reading it: ``run_unsecured`` evaluates it once, as launch does.

    Raises ``UsageError`` for arguments that are not pairs of strings."""
    chosen = options or ResolveOptions()
    seed = int.from_bytes(os.urandom(8), "big")
    given = tuple(arguments)
    for pair in given:
        if not (isinstance(pair, tuple) and len(pair) == 2 and all(isinstance(each, str) for each in pair)):
            raise UsageError(f"launch arguments are pairs of texts, as in [('count', '2')]; this is {pair!r}")
    return LaunchSource(
        os.path.abspath(launch_file),
        given,
        tuple(map(os.path.abspath, chosen.prefixes)),
        {**chosen.launch_configurations},
        chosen.host_options()._replace(anonymous_seed=seed),
    )


def _missing_programs(evaluation: Evaluation) -> list[Diagnostic]:
    placeholders = f"{MISSING_PREFIX}/"
    real = [item for item in evaluation.processes if not "".join(item.cmd[:1]).startswith(placeholders)]
    return [
        program_not_executable(process.cmd[0], error.message, error.location)
        for process, error in missing_programs(real)
    ]


def provision(
    plan: LaunchPlan, keystore: str | os.PathLike[str], *, options: SecurityOptions | None = None
) -> ProvisionedLaunch:
    """Bring every enclave of ``plan`` to exactly its planned permissions; idempotent.

    Where other launches have shares of the same enclaves, they keep them. The launch counts as running on the keystore
    while the result lives. Raises ``ManifestError`` for a plan with problems (nothing is written then) and
    ``ProvisionError``.
    """
    from enclave_launch.secured import provision_plan  # cryptography

    if plan.problems:
        raise ManifestError(refusal(plan.problems))
    chosen = options or SecurityOptions()
    logs = os.path.abspath(chosen.log_folder) if chosen.log_folder else ""
    settings = SecuritySettings(os.path.abspath(keystore), chosen.strategy, logs)
    return provision_plan(plan, settings, chosen.keystore or ProvisionOptions())


def run(launch: ProvisionedLaunch, *, options: RunSettings | None = None) -> int:
    """Start a provisioned launch, secured, and stay until all has ended. Handle SIGINT and SIGTERM.

    Args:
        launch: What ``provision`` returned.
        options: Log limit, recording, deadline and more.

    Returns:
        The exit status: 0 if all ended well, otherwise 1.

    Raises:
        UsageError: ``launch`` was not provisioned.
        RuntimeFailure: Something that the launch needs is not there. Nothing was started.
        LaunchFileError: A program cannot be executed. Nothing was started.
    """
    from enclave_launch.running import check_provisioned, run_launched  # asyncio

    check_provisioned(launch, run.__name__)
    return run_launched(launch, options or RunSettings())


def run_unsecured(launch: UnsecuredLaunch, *, options: RunSettings | None = None) -> int:
    """Start a launch without enclaves, as plain ``ros2 launch`` does, and stay until all has ended.

    Args:
        launch: What ``launch_source``, ``evaluate_launch`` or ``resolve`` returned.
        options: Log limit, recording, deadline and more.

    Returns:
        The exit status: 0 if all ended well, otherwise 1. A program that cannot be executed gives 1 in the end, and
        the others are started, as launch does.

    Raises:
        UsageError: ``launch`` was provisioned.
        RuntimeFailure: Something that the launch needs is not there. Nothing was started.
    """
    from enclave_launch.running import check_unsecured, run_launched  # asyncio

    check_unsecured(launch, run_unsecured.__name__)
    return run_launched(launch, options or RunSettings())


def start(launch: ProvisionedLaunch, *, options: RunSettings | None = None) -> RunningLaunch:
    """Start a provisioned launch, secured, and return at once: a handle to inspect it, wait for it and stop it.

    The caller handles signals. Raises as ``run``.
    """
    from enclave_launch.running import check_provisioned, start_launched  # asyncio

    check_provisioned(launch, start.__name__)
    return start_launched(launch, options or RunSettings())


def start_unsecured(launch: UnsecuredLaunch, *, options: RunSettings | None = None) -> RunningLaunch:
    """Start a launch without enclaves and return at once, as ``start`` does. Raises as ``run_unsecured``."""
    from enclave_launch.running import check_unsecured, start_launched  # asyncio

    check_unsecured(launch, start_unsecured.__name__)
    return start_launched(launch, options or RunSettings())


async def run_async(launch: ProvisionedLaunch, *, options: RunSettings | None = None) -> int:
    """Run a provisioned launch, secured, inside a running event loop.

    The caller handles signals. Cancelling ends every process first. Raises as ``run``.
    """
    from enclave_launch.running import check_provisioned, run_launched_async  # asyncio

    check_provisioned(launch, run_async.__name__)
    return await run_launched_async(launch, options or RunSettings())


async def run_async_unsecured(launch: UnsecuredLaunch, *, options: RunSettings | None = None) -> int:
    """Run a launch without enclaves inside a running event loop, as ``run_async`` does."""
    from enclave_launch.running import check_unsecured, run_launched_async  # asyncio

    check_unsecured(launch, run_async_unsecured.__name__)
    return await run_launched_async(launch, options or RunSettings())
