"""Runs a case through our evaluation, in this process."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from enclave_launch.diagnostics import Code
from enclave_launch.evaluation.evaluate import EvaluationError, evaluate, parse_arguments
from enclave_launch.frontend.error_location import likeliest
from enclave_launch.host.plan_host import PlanHost
from enclave_launch.process import Evaluation, RemapRule, ResolvedComponent, ResolvedProcess

from . import case_files
from .case_files import Case
from .outcome import Component, Outcome, Process, render

# What real launch, whose processes never start here, could not show: suppositions of the dry run.
_SUPPOSED = ("OnProcessStart", "OnProcessExit", "OnProcessIO", "OnStateTransition", "on_exit")


def run(case: Case, distro: str, folder: Path, prefix: Path, *, with_suppositions: bool = False) -> str:
    """What we would launch, rendered; without suppositions also without the events that start things."""
    main = case_files.write(case, folder)
    variables = {"AMENT_PREFIX_PATH": str(prefix), "D": str(folder), **case.environment}
    logs: list[tuple[str, str]] = []
    error: tuple[str, str] | None = None
    with _surroundings(folder, variables), _recorded(logs):
        host = PlanHost(distro=f"{distro}@{case_files.RECORDED_IN}")
        try:
            evaluation = evaluate(main, parse_arguments(case.arguments), host=host)
        except EvaluationError as failure:
            evaluation = failure.partial
            shown = likeliest(failure.cause) if failure.cause is not None else failure
            error = (type(shown).__name__, str(shown))
    # Launch has no counterpart of these hints of a plan.
    hints = (Code.FUNCTION_CALLED_AGAIN, Code.SCOPE_ENDED)
    logs += [("WARNING", warning.text) for warning in evaluation.warnings if warning.code not in hints]
    folders = {str(folder): "DIR", str(prefix): "PREFIX"}
    return render(_outcome(evaluation, host, logs, error, folders, with_suppositions))


def _outcome(
    evaluation: Evaluation,
    host: PlanHost,
    logs: list[tuple[str, str]],
    error: tuple[str, str] | None,
    folders: dict[str, str],
    with_suppositions: bool,
) -> Outcome:
    def wanted(item: ResolvedProcess | ResolvedComponent) -> bool:
        return with_suppositions or not any(word in (item.on_event or "") for word in _SUPPOSED)

    def event(item: ResolvedProcess | ResolvedComponent) -> str | None:
        return item.on_event if with_suppositions else None

    return Outcome(
        processes=[
            Process(list(item.cmd), item.fqn, item.environment, item.cwd, item.shell, event(item))
            for item in evaluation.processes
            if wanted(item)
        ],
        components=[
            Component(
                item.container, item.package, item.plugin, item.name, item.namespace,
                [_rule(rule) for rule in item.remaps], item.parameters, item.extra_arguments, event(item),
            )
            for item in evaluation.components
            if wanted(item)
        ],
        logs=logs,
        error=error,
        parameter_files=host.parameter_files,
        folders=folders,
    )  # fmt: skip


def _rule(rule: RemapRule) -> str:
    return f"{rule.source}:={rule.target}"


@contextmanager
def _surroundings(folder: Path, variables: dict[str, str]) -> Iterator[None]:
    """Environment and working directory of the case."""
    before, environment = os.getcwd(), dict(os.environ)
    os.environ.pop("ROS_LOG_DIR", None)
    os.environ.update(variables)
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)
        os.environ.clear()
        os.environ.update(environment)


@contextmanager
def _recorded(logs: list[tuple[str, str]]) -> Iterator[None]:
    """What ``log`` says."""

    class Recorder(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            logs.append((record.levelname, record.getMessage()))

    logger, recorder = logging.getLogger("launch.user"), Recorder()
    logger.addHandler(recorder)
    level, disabled = logger.level, logger.disabled
    logger.setLevel(logging.DEBUG)  # not by attribute: a logger remembers what it is enabled for
    logger.disabled = False
    try:
        yield
    finally:
        logger.setLevel(level)
        logger.disabled = disabled
        logger.removeHandler(recorder)
