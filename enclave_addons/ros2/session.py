"""The enclaves of one description under upstream's engine: each is planned and provisioned just before its process."""

from __future__ import annotations

from typing import Any, NoReturn

from enclave_launch.errors import ProvisionError
from enclave_launch.process import ResolvedProcess
from enclave_launch.runtime.gate import StartAdditions
from enclave_launch.secured import PlanProvider, ProvisionedLaunch

KEY = "enclave_launch_session"
"""The place of a secured launch in launch's own context, so that several launches in one program stay apart."""


class EnclaveSession:
    """One secured launch, from ``install`` on."""

    def __init__(self, launch: ProvisionedLaunch) -> None:
        self._provider = PlanProvider(launch)

    def install(self, context: Any) -> None:
        """Make it known to our extensions, before launch's own ROS node is created."""
        context.extend_globals({KEY: self, "ros_adapter": _NoAdapter()})

    def enter(self, process: ResolvedProcess, *, loads_components: bool = False) -> StartAdditions:
        """Provision the enclave of a process; raises EnclaveLaunchError if it cannot be completed."""
        if loads_components:
            raise ProvisionError(f"{process.location}: {process.fqn} loads components; {_NEEDS_PLAN}")
        return self._provider.ensure_late(process)


def session_of(context: Any) -> EnclaveSession | None:
    """Return the session of a launch that we secure, None for any other."""
    session: EnclaveSession | None = context.get_locals_as_dict().get(KEY)
    return session


_NEEDS_PLAN = (
    "the permissions that launch itself needs for that come from a plan of the launch file: "
    "use ros2 launch --secure, or enclave_launch.resolve on the file"
)


class _NoAdapter:
    """The ``ros_adapter`` of launch_ros (launch_ros/ros_adapters.py), where launch's ROS node has no enclave:
    asking for it is an error, not an unsecured node."""

    @property
    def ros_node(self) -> NoReturn:
        raise ProvisionError(f"launch must call ROS services; {_NEEDS_PLAN}")
