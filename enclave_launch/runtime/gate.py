"""Let a process start only with its enclave: complete on disk, and no more than the plan foresaw.

A refusal says what was planned, what came instead, and why that can be.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple, Protocol, TypeVar

from enclave_launch.errors import RuntimeFailure
from enclave_launch.policy.command_nodes import commands_of
from enclave_launch.process import ResolvedComponent, ResolvedProcess
from nodl.ros_arguments import parse_ros_arguments


class StartAdditions(NamedTuple):
    """Additions to a process for its enclave: ``arguments`` end its command line, ``environment`` is laid over."""

    arguments: tuple[str, ...] = ()
    environment: Mapping[str, str] = MappingProxyType({})


class EnclaveGate(Protocol):
    """Called before every start, one call at a time: ``granted`` first, else ``ensure`` in a worker thread."""

    def granted(self, process: ResolvedProcess) -> StartAdditions | None:
        """Return what ``ensure`` would if that needs no work: the enclave is unchanged since the last check."""

    def ensure(self, process: ResolvedProcess) -> StartAdditions:
        """Return once the enclave of ``process`` is complete on disk; raises EnclaveLaunchError."""

    def ensure_components(self, components: Sequence[ResolvedComponent]) -> None:
        """Check components about to be loaded into a running container."""

    def launcher(self) -> StartAdditions | None:
        """Return the additions for the launcher's own ROS node, if the plan has service calls for it."""


class Provider(Protocol):
    """Completes enclaves before a start; implemented over a plan and a keystore."""

    def granted(self, process: ResolvedProcess) -> StartAdditions | None:
        """Return the additions if they need no work, None for every process that is not in the plan."""

    def ensure(self, process: ResolvedProcess) -> StartAdditions: ...

    def ensure_late(self, process: ResolvedProcess) -> StartAdditions:
        """Extend the plan by a process it did not have, and provision that."""

    def launcher(self) -> StartAdditions | None: ...


class LateProcess(RuntimeFailure):
    """A process about to start differs from the plan: it needs permissions that were not signed."""


def permission_facts(item: ResolvedProcess | ResolvedComponent) -> Mapping[str, object]:
    """Return what decides the permissions, which a dry run and a live one have in common, by its name in a refusal."""
    if isinstance(item, ResolvedComponent):
        return {
            "container": item.container,
            "package": item.package,
            "plugin": item.plugin,
            "node": item.fqn,
            "remap rules": tuple(f"{rule.source}:={rule.target}" for rule in item.remaps),
            "use_sim_time": item.parameters.get("use_sim_time"),
        }
    return {
        "kind": item.kind,
        "package": item.package,
        "executable": item.executable,
        "node": item.fqn,
        "remap rules": parse_ros_arguments(item.cmd).remaps,
        "enclave": item.enclave.attribute,
        "enclave scope": item.enclave.scope,
        "--enclave": item.enclave.argument,
        "use_sim_time": item.parameters.get("use_sim_time"),  # subscribes /clock
        "launch prefix": item.prefix,
        "ros2 commands": tuple(map(shlex.join, commands_of(item))),
        "middleware": item.final_environment.get("RMW_IMPLEMENTATION"),
        "domain": item.final_environment.get("ROS_DOMAIN_ID"),
    }


def identity(item: ResolvedProcess | ResolvedComponent) -> tuple[object, ...]:
    """Return the values of ``permission_facts``, to look an item up."""
    return tuple(permission_facts(item).values())


class PlannedGate:
    """Lets processes start that the plan has. ``say_late`` is called with each process that ``allow_late`` lets
    through."""

    def __init__(
        self,
        processes: Iterable[ResolvedProcess],
        components: Iterable[ResolvedComponent],
        provider: Provider,
        *,
        allow_late: bool,
        say_late: Callable[[str], None],
    ) -> None:
        self._planned = tuple(processes)
        self._planned_components = tuple(components)
        self._processes = {identity(process) for process in self._planned}
        self._components = {identity(component) for component in self._planned_components}
        self._provider = provider
        self._allow_late = allow_late
        self._say_late = say_late

    def granted(self, process: ResolvedProcess) -> StartAdditions | None:
        return self._provider.granted(process)

    def ensure(self, process: ResolvedProcess) -> StartAdditions:
        if identity(process) in self._processes:
            return self._provider.ensure(process)
        asks_for_none = process.enclave.attribute is process.enclave.argument is None
        if process.kind == "executable" and asks_for_none and not commands_of(process):
            return self._provider.ensure_late(process)  # no ROS process by the launch file: nothing to sign
        named = f"{process.program} ({process.fqn})" if process.fqn else process.program
        what = f"{named} at {process.location}"
        if not self._allow_late:
            remedy = "--allow-late provisions it when it appears"
            raise _late(what, _compared(process, self._planned, (_same_program, _same_node)), remedy)
        self._say_late(f"{what} was not foreseen: provisioned now (--allow-late)")
        grant = self._provider.ensure_late(process)
        self._processes.add(identity(process))
        return grant

    def ensure_components(self, components: Sequence[ResolvedComponent]) -> None:
        """Refuse components that are not in the plan: a container reads its permissions once, at its start."""
        for component in components:
            if identity(component) not in self._components:
                what = f"component {component.program} for {component.container} at {component.location}"
                difference = _compared(component, self._planned_components, (_same_plugin,))
                raise _late(what, difference, "its container has read its permissions already")

    def launcher(self) -> StartAdditions | None:
        return self._provider.launcher()


def _late(what: str, difference: str, remedy: str) -> LateProcess:
    return LateProcess(
        f"refused: {what} goes beyond the permissions that were signed: {difference}; {remedy}"
    )


Item = TypeVar("Item", ResolvedProcess, ResolvedComponent)

_COMPUTED = (
    "the launch file gave something else when it was started: a time, a random value, a file or a program's answer "
    "that changed since"
)
_NOT_FORESEEN = (
    "the plan has nothing like it: what a callback gives when an event happens is not known before that event"
)


def _compared(item: Item, planned: Sequence[Item], likenesses: Iterable[Callable[[Item, Item], bool]]) -> str:
    """Describe how ``item`` differs from what was planned in its place."""
    alike = next(
        (found for like in likenesses if (found := [other for other in planned if like(item, other)])), []
    )
    if not alike:
        return _NOT_FORESEEN
    nearest = min(alike, key=lambda other: len(_differences(item, other)))
    differing = "; ".join(
        f"planned {name} {_shown(was)}, came {_shown(came)}"
        for name, was, came in _differences(item, nearest)
    )
    return f"{differing} ({_why(nearest)})" if differing else _NOT_FORESEEN


def _why(planned: ResolvedProcess | ResolvedComponent) -> str:
    if planned.on_event is None:
        return _COMPUTED
    return f"it was planned for {planned.on_event}, and what an event brings is only known when it happens"


def _differences(came: Item, planned: Item) -> list[tuple[str, object, object]]:
    facts = permission_facts(came)
    return [(name, was, facts[name]) for name, was in permission_facts(planned).items() if was != facts[name]]


def _shown(value: object) -> str:
    if isinstance(value, tuple):
        return " ".join(map(str, value)) or "none"
    return "none" if value is None or value == "" else str(value)


def _same_program(process: ResolvedProcess, other: ResolvedProcess) -> bool:
    return process.program == other.program and process.location == other.location


def _same_node(process: ResolvedProcess, other: ResolvedProcess) -> bool:
    return process.fqn is not None and process.fqn == other.fqn


def _same_plugin(component: ResolvedComponent, other: ResolvedComponent) -> bool:
    return component.location == other.location or component.fqn == other.fqn
