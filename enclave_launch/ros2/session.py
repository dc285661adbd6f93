"""The enclaves of one secured launch under upstream's engine.

``enter`` is called for every process just before it starts and returns when its enclave is complete on disk.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NoReturn, Protocol

from launch.event_handlers import OnShutdown

from enclave_launch.errors import ProvisionError
from enclave_launch.policy.launcher import LAUNCHER_NODE
from enclave_launch.process import ResolvedProcess
from enclave_launch.ros2.context import KEY
from enclave_launch.runtime.gate import PlannedGate, StartAdditions
from enclave_launch.secured import PlanProvider, ProvisionedLaunch


class Doorkeeper(Protocol):
    """Decides about one process; a container may load components at once."""

    def admit(self, process: ResolvedProcess, *, loads_components: bool) -> StartAdditions: ...

    def launcher(self) -> StartAdditions | None: ...


@dataclass(frozen=True)
class PlannedDoor:
    """A plan of the whole launch file was signed beforehand; it knows all components, too."""

    gate: PlannedGate

    def admit(self, process: ResolvedProcess, *, loads_components: bool) -> StartAdditions:
        return self.gate.ensure(process)

    def launcher(self) -> StartAdditions | None:
        return self.gate.launcher()


class OpenDoor:
    """No launch file to plan from, only actions as they come: each one is planned and provisioned as it
    appears.
    """

    def __init__(self, launch: ProvisionedLaunch) -> None:
        self._provider = PlanProvider(launch)

    def admit(self, process: ResolvedProcess, *, loads_components: bool) -> StartAdditions:
        """:raises ProvisionError: no manifest, or something to load that only a plan could have permitted."""
        if loads_components:
            raise ProvisionError(f"{process.location}: {process.fqn} loads components; {_NEEDS_PLAN}")
        return self._provider.ensure_late(process)

    def launcher(self) -> StartAdditions | None:
        return None


class EnclaveSession:
    """One secured launch, from ``install`` on: asks ``door`` for the enclave of each process."""

    def __init__(self, door: Doorkeeper) -> None:
        self._door = door

    def install(self, context: Any) -> None:
        """Make it known to our extensions, and give launch's own ROS node its enclave before it is
        created.
        """
        context.extend_globals({KEY: self, "ros_adapter": _adapter(self._door.launcher())})
        context.register_event_handler(
            OnShutdown(on_shutdown=lambda *_: context.locals.ros_adapter.shutdown_if_running())
        )

    def enter(self, process: ResolvedProcess, *, loads_components: bool = False) -> StartAdditions:
        """:raises EnclaveLaunchError: not foreseen in the plan, or its enclave cannot be completed."""
        return self._door.admit(process, loads_components=loads_components)


_NEEDS_PLAN = (
    "the permissions that launch itself needs for that come from a plan of the launch file: "
    "use ros2 launch --secure, or enclave_launch.resolve on the file"
)


class _NoAdapter:
    """In place of launch's ROS node where it has no enclave: asking for it is an error, not an unsecured
    node.
    """

    @property
    def ros_node(self) -> NoReturn:
        raise ProvisionError(f"launch must call ROS services; {_NEEDS_PLAN}")

    def shutdown_if_running(self) -> None:
        """Nothing ever runs."""


def _adapter(grant: StartAdditions | None) -> Any:
    """What launch_ros keeps as ``ros_adapter`` (launch_ros/ros_adapters.py); started when it is first
    asked for.
    """
    if grant is None:
        return _NoAdapter()
    from launch_ros.ros_adapters import ROSAdapter

    class LazyAdapter(ROSAdapter):  # type: ignore[misc]  # untyped without ROS
        started = False

        @property
        def ros_node(self) -> Any:
            if not self.started:
                self.started = True
                self.start()
            return super().ros_node

        def shutdown_if_running(self) -> None:
            if self.started:
                self.shutdown()

    arguments = ["--ros-args", "-r", f"__node:={LAUNCHER_NODE}", *grant.arguments]
    return LazyAdapter(argv=arguments, autostart=False)
