"""Plan what a command line names, with its options."""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from dataclasses import replace

from enclave_common.terminal import progress
from enclave_launch.errors import EnclaveLaunchError
from enclave_launch.flow import resolve
from enclave_launch.plan import LaunchPlan
from enclave_launch.verb.options import resolve_options
from enclave_launch.verb.target import LaunchTarget, find_target
from keystore.errors import InvalidInputError
from keystore.formats.permissions_patterns import has_wildcard
from keystore.formats.policy import Operation, Qualifier
from nodl.ament_index import search_prefixes


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


def planned_topics(words: Sequence[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the topics that a launch publishes, and what the plan leaves open, for ``secure-keystore tool-enclave``.

    Raises:
        InvalidInputError: The launch cannot be planned, or publishes nothing.
    """
    try:
        target = find_target(words, search_prefixes(()))
        plan = resolve(target.launch_file, target.arguments)
    except EnclaveLaunchError as error:
        raise InvalidInputError(f"--plan {' '.join(words)}: {error}") from error
    published = {
        rule.expression
        for enclave in plan.derived.policy.enclaves
        for profile in enclave.profiles
        for rule in profile.rules
        if rule.operation is Operation.PUBLISH and rule.qualifier is Qualifier.ALLOW
    }
    patterns = sorted(name for name in published if has_wildcard(name))
    if not published:
        raise InvalidInputError(f"--plan {' '.join(words)}: this launch publishes nothing that is known")
    left_out = tuple(f"left out, since a tool is given names only: {name}" for name in patterns)
    return tuple(sorted(published.difference(patterns))), (*map(str, plan.problems), *left_out)
