"""Plan what a command line names, with its options."""

from __future__ import annotations

import argparse
import os
from dataclasses import replace

from enclave_common.terminal import progress
from enclave_launch.flow import resolve
from enclave_launch.plan import LaunchPlan
from enclave_launch.verb.options import resolve_options
from enclave_launch.verb.target import LaunchTarget


def planned(target: LaunchTarget, options: argparse.Namespace, keystore: str | None) -> LaunchPlan:
    """Plan ``target``; with a keystore, warn about enclaves shared with other launches there."""
    plan = resolve_target(target, options)
    if keystore is None or not os.path.isdir(keystore):
        return plan
    from enclave_launch.secured import with_shares_reported  # cryptography

    return with_shares_reported(plan, keystore)


def resolve_target(target: LaunchTarget, options: argparse.Namespace) -> LaunchPlan:
    """Plan ``target``; on a terminal, report what takes long."""
    chosen = replace(resolve_options(options), progress=progress("analysing", quiet=options.quiet))
    return resolve(target.launch_file, target.arguments, options=chosen)
