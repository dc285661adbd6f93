"""``secure-launch --watch``: a launch, compared with its plan while it runs."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

from enclave_addons.observation.drift.compare import Security
from enclave_addons.observation.drift.expected import out_of_sight
from enclave_addons.observation.drift_watch import DriftWatch, WatchOptions
from enclave_addons.observation.graph.observing import chosen_source
from enclave_common.terminal import warn
from enclave_launch.dry_run import DryRun
from enclave_launch.errors import ProvisionError, UsageError, translated
from enclave_launch.flow import run_unsecured
from enclave_launch.options import RunSettings
from enclave_launch.plan import LaunchPlan
from enclave_launch.report.plan_json import plan_document
from enclave_launch.secured import ProvisionedLaunch
from enclave_launch.verb.planning import resolve_target
from enclave_launch.verb.start import Company, run_settings, start
from enclave_launch.verb.target import LaunchTarget
from enclave_launch.verb.usage import unsecured_notice
from keystore.errors import KeystoreError
from keystore.steps.tool_enclaves import enclaves_by_guid, provide_watcher
from nodl.errors import NoDLError


def launch(target: LaunchTarget, options: argparse.Namespace, keystore: str | None) -> int:
    """Run and watch the launch. Return its status, or that of the findings."""
    if keystore is not None:
        watch = partial(watch_of_secured_launch, options=options)
        return start(target, options, keystore, Company(check=check_watch, watch=watch))
    plan = resolve_target(target, options)
    warn(*plan.problems, *plan.warnings)
    print(f"secure-launch: {unsecured_notice(os.environ)}", file=sys.stderr)
    return watch_plain_launch(plan, options, run_settings(options))


def watch_plain_launch(plan: LaunchPlan, options: argparse.Namespace, settings: RunSettings) -> int:
    """Run and watch an unsecured launch; return its status, 1 if there were alarms. Raises UsageError."""
    watch = DriftWatch(_dry_run(plan), _options(options))
    return watch.status(run_unsecured(plan, options=replace(settings, watch=watch)))


def check_watch(plan: LaunchPlan) -> None:
    """Raise UsageError unless the launch can be watched, before its keystore is touched."""
    _dry_run(plan)
    with translated(NoDLError, UsageError, "--watch: "):
        chosen_source("auto")


def watch_of_secured_launch(launch: ProvisionedLaunch, options: argparse.Namespace) -> DriftWatch:
    """Return a watch with an enclave of its own, for the observer in use; raises ProvisionError, UsageError."""
    dry_run = _dry_run(launch.plan)
    root = launch.settings.keystore
    with (
        translated(KeystoreError, ProvisionError, "--watch: "),
        translated(NoDLError, UsageError, "--watch: "),
    ):
        as_ros_node = chosen_source("auto") == "rclpy"
        enclave = provide_watcher(root, launch.options, as_ros_node=as_ros_node)
        security = Security(enclaves_by_guid(root))
    directory = Path(root) / "enclaves" / enclave.lstrip("/")
    watched = _options(options, security, directory)
    return DriftWatch(dry_run, watched._replace(enclaves_now=partial(_enclaves_now, root, security)))


def _enclaves_now(root: str, security: Security) -> Mapping[int, str]:
    """Read the keystore's table again; a keystore that cannot be read leaves the one of the start."""
    try:
        return enclaves_by_guid(root)
    except KeystoreError:
        return security.enclaves


def _dry_run(plan: LaunchPlan) -> DryRun:
    """Return the plan as drift reads it; raises UsageError if no observer sees a process of it."""
    dry_run = DryRun(**plan_document(plan))
    zenoh = out_of_sight([dry_run])
    if zenoh:
        raise UsageError(
            f"--watch looks at DDS only, and {', '.join(zenoh)} on Zenoh: start this without --watch"
        )
    return dry_run


def _options(
    options: argparse.Namespace, security: Security | None = None, directory: Path | None = None
) -> WatchOptions:
    return WatchOptions(security, directory, tuple(options.watch_accept), options.watch_report)
