"""How a launch is run."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from types import MappingProxyType
from typing import NamedTuple, TextIO

from enclave_launch.host.outcomes import Outcomes
from enclave_launch.host.protocol import HostOptions
from enclave_launch.runtime.companion import LaunchCompanion


class RunOptions(NamedTuple):
    """How to run; what to run is decided elsewhere.

    ``prefixes`` come before ``AMENT_PREFIX_PATH``. ``log_limit``: bytes after which a log file is begun anew.
    ``host_options`` go to the evaluation's host (distribution, seed of anonymous names, ...), the same as the plan's.
    ``secrets``: environment variables no child may see. ``notices`` are said once, at the start.
    """

    noninteractive: bool = False
    debug: bool = False
    shutdown_when_idle: bool = True
    launch_configurations: Mapping[str, str] = MappingProxyType({})
    screen: TextIO | None = None
    secrets: frozenset[str] = frozenset()
    notices: tuple[str, ...] = ()
    needs_ros_services: bool | None = False
    log_limit: int | None = None
    deadline: Deadline | None = None
    prefixes: tuple[str, ...] = ()
    companion: LaunchCompanion | None = None
    host_options: HostOptions = HostOptions()
    outcomes: Outcomes | None = None


class Deadline:
    """A moment at which a launch is ended in order, to be started anew by whoever set it.

    ``reached`` once the launch was ended because of it, and for nothing else."""

    def __init__(self, at: datetime, reason: str) -> None:
        self.at = at
        self.reason = reason
        self.reached = False
