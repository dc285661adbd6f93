"""In words: what was planned, what came instead, and why that can be. Performs no I/O."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TypeVar

from enclave_launch.process import ResolvedComponent, ResolvedProcess
from nodl.ros_arguments import parse_ros_arguments

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
