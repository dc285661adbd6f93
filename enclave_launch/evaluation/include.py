"""Loading what an include names, with the two ways it can go wrong that are ours to see: a file of a package
that is not installed, and an include that never ends."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

from enclave_launch.diagnostics import include_left_out
from enclave_launch.host.loading import CyclicIncludeError

if TYPE_CHECKING:
    from enclave_launch.description.launch.actions.include_launch_description import (
        IncludeLaunchDescription,
    )
    from enclave_launch.description.launch.launch_context import LaunchContext
    from enclave_launch.description.launch.launch_description import LaunchDescription

MAX_DEPTH = 200
"""Nested includes; upstream runs out of stack at about this depth."""

OpenFile = tuple[str, dict[str, Any]]
"""A file that is being visited, and the launch configurations with which it was entered."""


def left_out(include: IncludeLaunchDescription, context: LaunchContext) -> bool:
    """Whether ``include`` names a file of a package that is not installed; that gives a warning."""
    location = include.launch_description_source.expand(context)
    if not context.host.is_missing(location) or os.path.exists(location):
        return False
    context.host.warn(include_left_out(location))
    return True


def prepare_include(include: IncludeLaunchDescription, context: LaunchContext) -> LaunchDescription:
    """The description to visit: whatever a Python file returned. Raises ``CyclicIncludeError``."""
    source = include.launch_description_source
    _check_cycle(source.expand(context), context)
    return source.get_launch_description(context)


def _check_cycle(location: str, context: LaunchContext) -> None:
    """The same file entered again with the same configurations will be entered for ever."""
    path = os.path.abspath(location)
    repeated = any(
        known == path and configurations == context.launch_configurations
        for known, configurations in context.open_files
    )
    if repeated or len(context.open_files) >= MAX_DEPTH:
        cycle = [known for known, _ in context.open_files]
        if path in cycle:
            cycle = cycle[len(cycle) - 1 - cycle[::-1].index(path) :]
        raise CyclicIncludeError(
            "launch files include each other without end: " + " -> ".join([*cycle, path])
        )


def opened(include: IncludeLaunchDescription, context: LaunchContext) -> tuple[OpenFile, ...]:
    """The files open below ``include``."""
    path = os.path.abspath(include.launch_description_source.location)
    return (*context.open_files, (path, include.entered_with))
