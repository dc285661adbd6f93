"""What inference may ask about the program that launch starts: parameters and final names of its nodes.

Takes a process or component of the evaluation; used by ``nodl.infer`` as its ``Start``. Reads parameter files.
"""

from __future__ import annotations

from collections.abc import Mapping

from enclave_launch.interfaces.situation import situation_of
from enclave_launch.process import ResolvedComponent, ResolvedProcess
from nodl.dependence import Situation
from nodl.node_interface import NodeInterface
from nodl.source_ref import SourceRef


class StartedProgram:
    """One process, or one component with the container that loads it."""

    def __init__(
        self, started: ResolvedProcess | ResolvedComponent, container: ResolvedProcess | None, distro: str
    ) -> None:
        self._started = started
        self._container = container
        self._distro = distro

    def parameters(self, node: str | None) -> Mapping[str, object]:
        """Return what launch sets for the node that the source calls ``node``."""
        return self._situation(node).parameters

    def final_name(self, node: str | None) -> tuple[str | None, str | None]:
        """Return the node's name and namespace under the remap rules of the launch."""
        situation = self._situation(node)
        return situation.node, situation.namespace

    def _situation(self, node: str | None) -> Situation:
        started = self._started
        interface = NodeInterface(
            package=started.package,
            executable=None,
            plugin=None,
            name=node or "unnamed",
            namespace="/",
            endpoints=(),
            source=SourceRef(str(started.location)),
        )
        return situation_of(started, self._container, interface, self._distro)
