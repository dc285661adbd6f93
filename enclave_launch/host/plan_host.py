"""The dry run's world."""

from __future__ import annotations

from collections.abc import Sequence

from enclave_launch.boundary.light import TYPE_CHECKING, Any
from enclave_launch.host.base_host import BaseHost
from enclave_launch.host.protocol import HostOptions
from enclave_launch.host.virtual_loop import VirtualLoop

if TYPE_CHECKING:
    from enclave_launch.description.actions.lifecycle import LifecycleNode
    from enclave_launch.description.actions.processes import ExecuteLocal
    from enclave_launch.description.launch_context import LaunchContext
    from enclave_launch.host.outcomes import Outcomes
    from enclave_launch.host.protocol import Completion
    from enclave_launch.process import (
        LauncherCall,
        Reaction,
        ResolvedComponent,
        ResolvedProcess,
        Unforeseeable,
    )


class PlanHost(BaseHost):
    """The dry run's world: everything is recorded, nothing is started or written."""

    def __init__(
        self, options: HostOptions | None = None, *, outcomes: Outcomes | None = None, **given: Any
    ) -> None:
        """``given``: fields of ``HostOptions``, for callers that have only some."""
        super().__init__(options or HostOptions(**given), outcomes)
        self.processes: list[ResolvedProcess] = []
        self.started: list[ExecuteLocal] = []  # action of each process, same order
        self.components: list[ResolvedComponent] = []
        self.calls: list[LauncherCall] = []
        self.unforeseen: list[Unforeseeable] = []
        self.reactions: list[Reaction] = []
        self.parameter_files: dict[str, str] = {}
        self._loop = VirtualLoop()

    @property
    def loop(self) -> VirtualLoop:
        return self._loop

    def started_so_far(self) -> int:
        return len(self.processes) + len(self.components) + len(self.calls) + self._loop.used

    def write_parameter_file(self, text: str) -> str:
        path = f"<params:{len(self.parameter_files) + 1}>"
        self.parameter_files[path] = text
        return path

    def parameter_file(self, path: str) -> str | None:
        return self.parameter_files.get(path)

    def start_process(
        self, action: ExecuteLocal, process: ResolvedProcess, context: LaunchContext
    ) -> Completion | None:
        self.processes.append(process)
        self.started.append(action)
        return self._loop.create_future()

    def load_components(self, components: Sequence[ResolvedComponent], context: LaunchContext) -> None:
        self.components.extend(components)

    def launcher_call(self, call: LauncherCall) -> None:
        self.calls.append(call)

    def change_state(self, node: LifecycleNode, transition_id: int, context: LaunchContext) -> None:
        """Nothing is started in a dry run, so nothing changes its state."""

    def unforeseeable(self, item: Unforeseeable) -> None:
        self.unforeseen.append(item)
