"""Let a process start only with its enclave: complete on disk, and no more than the plan foresaw.

A refusal says what was planned, what came instead, and why that can be.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple, Protocol, TypeVar

from enclave_launch.errors import RuntimeFailure
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
    """A process about to start is not what was planned: it needs permissions that nobody signed."""


def identity(process: ResolvedProcess) -> tuple[object, ...]:
    """Return what decides the permissions of a process: what a dry run and a live one have in common."""
    return (
        process.kind,
        process.package,
        process.executable,
        process.fqn,
        process.enclave,
        parse_ros_arguments(process.cmd).remaps,
        process.parameters.get("use_sim_time"),  # subscribes /clock
        process.prefix,
        *(process.final_environment.get(name) for name in ("RMW_IMPLEMENTATION", "ROS_DOMAIN_ID")),
    )


def component_identity(component: ResolvedComponent) -> tuple[object, ...]:
    """Return what decides the permissions of a component, as ``identity`` does for a process."""
    return (
        component.container,
        component.package,
        component.plugin,
        component.fqn,
        tuple((rule.source, rule.target) for rule in component.remaps),
        component.parameters.get("use_sim_time"),
    )


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
        self._components = {component_identity(component) for component in self._planned_components}
        self._provider = provider
        self._allow_late = allow_late
        self._say_late = say_late

    def granted(self, process: ResolvedProcess) -> StartAdditions | None:
        return self._provider.granted(process)

    def ensure(self, process: ResolvedProcess) -> StartAdditions:
        if identity(process) in self._processes:
            return self._provider.ensure(process)
        if process.kind == "executable" and process.enclave.attribute is process.enclave.argument is None:
            return self._provider.ensure_late(process)  # no ROS process by the launch file: nothing to sign
        named = f"{process.program} ({process.fqn})" if process.fqn else process.program
        what = f"{named} at {process.location}"
        if not self._allow_late:
            remedy = "--allow-late provisions it when it appears"
            raise _late(what, compared(process, self._planned), remedy)
        self._say_late(f"{what} was not foreseen: provisioned now (--allow-late)")
        grant = self._provider.ensure_late(process)
        self._processes.add(identity(process))
        return grant

    def ensure_components(self, components: Sequence[ResolvedComponent]) -> None:
        """Refuse components that are not in the plan: a container reads its permissions once, at its start."""
        for component in components:
            if component_identity(component) not in self._components:
                what = f"component {component.program} for {component.container} at {component.location}"
                difference = compared_component(component, self._planned_components)
                raise _late(what, difference, "its container has read its permissions already")

    def launcher(self) -> StartAdditions | None:
        return self._provider.launcher()


def _late(what: str, difference: str, remedy: str) -> LateProcess:
    return LateProcess(
        f"refused: {what} goes beyond the permissions that were signed: {difference}; {remedy}"
    )


Item = TypeVar("Item", ResolvedProcess, ResolvedComponent)
_Facts = Mapping[str, object]

_COMPUTED = (
    "the launch file gave something else when it was started: a time, a random value, a file or a program's answer "
    "that changed since"
)
_NOT_FORESEEN = (
    "the plan has nothing like it: what a callback gives when an event happens is not known before that event"
)


def compared(process: ResolvedProcess, planned: Sequence[ResolvedProcess]) -> str:
    """Describe how ``process`` differs from what was planned in its place."""
    return _compared(process, planned, _process_facts, (_same_program, _same_node))


def compared_component(component: ResolvedComponent, planned: Sequence[ResolvedComponent]) -> str:
    """Describe how ``component`` differs from what was planned in its place."""
    return _compared(component, planned, _component_facts, (_same_plugin,))


def _compared(
    item: Item,
    planned: Sequence[Item],
    facts: Callable[[Item], _Facts],
    likenesses: Iterable[Callable[[Item, Item], bool]],
) -> str:
    came = facts(item)
    alike = next(
        (found for like in likenesses if (found := [other for other in planned if like(item, other)])), []
    )
    if not alike:
        return _NOT_FORESEEN
    nearest = min(alike, key=lambda other: len(_different(came, facts(other))))
    was = facts(nearest)
    names = _different(came, was)
    differing = "; ".join(f"planned {name} {_shown(was[name])}, came {_shown(came[name])}" for name in names)
    return f"{differing} ({_why(nearest)})" if differing else _NOT_FORESEEN


def _why(planned: ResolvedProcess | ResolvedComponent) -> str:
    if planned.on_event is None:
        return _COMPUTED
    return f"it was planned for {planned.on_event}, and what an event brings is only known when it happens"


def _different(came: _Facts, planned: _Facts) -> list[str]:
    return [name for name, value in came.items() if planned[name] != value]


def _shown(value: object) -> str:
    if isinstance(value, tuple):
        return " ".join(map(str, value)) or "none"
    return "none" if value is None or value == "" else str(value)


def _process_facts(process: ResolvedProcess) -> _Facts:
    return {
        "program": process.program,
        "node": process.fqn,
        "remap rules": parse_ros_arguments(process.cmd).remaps,
        "enclave": process.enclave.attribute,
        "enclave scope": process.enclave.scope,
        "--enclave": process.enclave.argument,
        "use_sim_time": process.parameters.get("use_sim_time"),
    }


def _component_facts(component: ResolvedComponent) -> _Facts:
    return {
        "container": component.container,
        "plugin": component.program,
        "node": component.fqn,
        "remap rules": tuple(f"{rule.source}:={rule.target}" for rule in component.remaps),
        "use_sim_time": component.parameters.get("use_sim_time"),
    }


def _same_program(process: ResolvedProcess, other: ResolvedProcess) -> bool:
    return process.program == other.program and process.location == other.location


def _same_node(process: ResolvedProcess, other: ResolvedProcess) -> bool:
    return process.fqn is not None and process.fqn == other.fqn


def _same_plugin(component: ResolvedComponent, other: ResolvedComponent) -> bool:
    return component.location == other.location or component.fqn == other.fqn
