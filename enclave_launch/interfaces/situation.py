"""The start of a node, as descriptions that depend on it need it: final names, parameters, words, packages.

Takes a process or component of the evaluation, gives ``nodl.dependence.Situation``; next is the interface that a
description has there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from enclave_common.source_location import SourceLocation
from enclave_launch.policy.program_inputs import (
    ProgramInputs,
    environment_inputs,
    own_words,
    program_inputs,
    words_of,
)
from enclave_launch.policy.running_node import (
    RunningNode,
    node_of_component,
    node_of_process,
    parameters_of_node,
)
from enclave_launch.process import ResolvedComponent, ResolvedProcess
from nodl.dependence import COMPONENT, CONTROLLER, HOST, Situation
from nodl.node_interface import NodeInterface
from nodl.remap import NodeNames


def situation_of(
    started: ResolvedProcess | ResolvedComponent,
    container: ResolvedProcess | None,
    interface: NodeInterface,
    distro: str,
    installed: frozenset[str] | None = None,
) -> Situation:
    """Return the situation of one node of what launch starts.

    A component's main node gets what the load request says, a further one what the container's command line says.
    Raises ``LaunchFileError`` for a remap rule at which the process would end.
    """
    words: tuple[str, ...] = ()
    files: Mapping[str, str] = {}
    if isinstance(started, ResolvedProcess):
        node = node_of_process(started, interface, "/", "node")
        words = tuple(own_words(started))
        files = started.parameter_files
    else:
        node = node_of_component(started, container, interface, "/")
    return Situation(
        distro=distro,
        node=node.name,
        namespace=node.namespace,
        parameters={**node.parameters, **dict(interface.own_parameters)},
        words=words,
        installed=installed,
        remap=_remap(node),
        files=files,
    )


def _remap(node: RunningNode) -> Callable[[str], str]:
    """Return a function from topics of the node's code to final names. That raises ``InvalidNameError``."""
    names = NodeNames(node.name, node.namespace, node.rules)
    return lambda name: names.topic(name).name


class StartedProgram:
    """One process, or one component with the container that loads it."""

    def __init__(
        self, started: ResolvedProcess | ResolvedComponent, container: ResolvedProcess | None, distro: str
    ) -> None:
        self._started = started
        self._container = container
        self._distro = distro
        self.process = started if isinstance(started, ResolvedProcess) else container

    def parameters(self, node: str | None) -> Mapping[str, object]:
        """Return what launch sets for the node that the source calls ``node``."""
        return self.situation(node).parameters

    def final_name(self, node: str | None) -> tuple[str | None, str | None]:
        """Return the node's name and namespace under the remap rules of the launch."""
        situation = self.situation(node)
        return situation.node, situation.namespace

    def situation(self, node: str | None) -> Situation:
        """Return the situation of the node that the source calls ``node``."""
        started = self._started
        interface = NodeInterface(
            package=started.package,
            executable=None,
            plugin=None,
            name=node or "unnamed",
            namespace="/",
            endpoints=(),
            source=SourceLocation(str(started.location)),
        )
        return situation_of(started, self._container, interface, self._distro)

    def inputs(self, names: Iterable[str]) -> Mapping[str, str | None]:
        """Return what launch gives the options and variables of the program, ``None`` for a default."""
        if isinstance(self._started, ResolvedProcess):
            given = program_inputs(self._started)
        else:
            given = environment_inputs(self.process) if self.process else ProgramInputs()
        return {name: given.values.get(name) for name in names if given.is_known(name)}

    def words(self) -> tuple[str, ...] | None:
        """Return the words that the program gets; ``None`` for what a container loads."""
        return tuple(words_of(self._started)) if isinstance(self._started, ResolvedProcess) else None


class StartedPlugin:
    """A plugin that a node in ``situation``, one of ``program``, loads under a name."""

    def __init__(self, program: StartedProgram, situation: Situation, name: str) -> None:
        self._program, self._situation, self._name = program, situation, name

    def parameters(self, node: str | None) -> Mapping[str, object]:
        """Return what launch sets for the node: for a controller its manager's command line and the spawners."""
        if node == HOST:
            return self._situation.parameters
        if node != CONTROLLER:
            return self._program.parameters(self._name if node == COMPONENT else node)
        process = self._program.process
        given = parameters_of_node(process, self._situation.namespace, self._name) if process else {}
        spawned = (each for each in self._situation.launched.spawned if each.controller == self._name)
        return {**given, **next((each.parameters for each in spawned), {})}

    def final_name(self, node: str | None) -> tuple[str | None, str | None]:
        """Return the node's name and namespace: those of the host, or of a controller beside its manager."""
        if node == HOST:
            return self._situation.node, self._situation.namespace
        if node == CONTROLLER:
            return self._name, self._situation.namespace
        return self._program.final_name(self._name if node == COMPONENT else node)

    def inputs(self, names: Iterable[str]) -> Mapping[str, str | None]:
        """Return what launch gives the options and variables of the program that loads it."""
        return self._program.inputs(names)

    def words(self) -> tuple[str, ...] | None:
        """Return None: a plugin has no command line of its own."""
        return None
