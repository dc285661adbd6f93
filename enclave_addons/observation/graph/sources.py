"""Observed runs → what a manifest of each program says. Performs no I/O.

A final name becomes what the source writes (``inverse``). Where several spellings lead to it, those stay that explain
the most runs; what is still undecided then is written under the likeliest and reported. Merging and parameters are as
in records (``recording.record.learning``): an observation proves that something is there, never that it is not.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from enclave_addons.observation.graph.model import GraphNode, SeenInterface
from enclave_addons.observation.graph.observation import Observed
from enclave_addons.observation.graph.starts import start_for, start_of_command
from enclave_addons.recording.record.learning import OBSERVED, Learnt, learn_from
from enclave_addons.recording.record.lines import RecordedRun
from enclave_addons.recording.record.requested import RequestedEndpoint, RequestedNode, StartedNode
from enclave_addons.recording.record.written import final_names, written_names
from nodl.builtin_interfaces import DISTROS, BuiltinCondition, built_in_interfaces
from nodl.names import split_fqn
from nodl.node_interface import ClientLibrary, EndpointKind
from nodl.ros_arguments import arguments_as_inputs

_WITHOUT_PROGRAM = "the program is not known: give the launch file, or observe on the machine that runs it"
_ROS_TYPE_PARTS = 3


class LearntFromGraph(NamedTuple):
    """The manifests that observations teach. ``left_out``: nodes and interfaces that are in no manifest, each with the
    reason."""

    learnt: Learnt
    left_out: tuple[str, ...]


class _Placed(NamedTuple):
    run: RecordedRun
    node: GraphNode
    start: StartedNode
    ends: frozenset[tuple[EndpointKind, str]]


def learn_observed(runs: Sequence[Observed]) -> LearntFromGraph:
    """Learn from all ``runs`` together; their order does not matter."""
    left_out: list[str] = []
    placed = [each for observed in runs for each in _placed(observed, left_out)]
    by_run: dict[str, tuple[RecordedRun, list[RequestedNode]]] = {}
    for each in placed:
        others = [other for other in placed if _same_program(each, other)]
        _, nodes = by_run.setdefault(each.run.id, (each.run, []))
        nodes.append(_requested_node(each, others, left_out))
    return LearntFromGraph(learn_from(by_run.values()), tuple(dict.fromkeys(left_out)))


def _placed(observed: Observed, left_out: list[str]) -> Iterator[_Placed]:
    for process in observed.graph.processes:
        command = observed.commands.get(process.participant.guid, ())
        for each in process.unowned:
            left_out.append(f"{each.kind.value} {each.name}: no node of its process is known to have it")
        for node in process.nodes:
            if node.fqn.rpartition("/")[2].startswith("_"):
                left_out.append(f"{node.fqn}: a hidden node, of a tool or the daemon")
                continue
            starts = start_for(node.fqn, command, observed.starts)
            own = start_of_command(command) if not observed.starts else None
            found = starts or ((own,) if own else ())
            if len({(each.program, each.rule_texts) for each in found}) == 1:
                ends = frozenset((each.kind, each.name) for each in node.interfaces)
                yield _Placed(observed.run, node, found[0], ends)
            elif found:
                names = ", ".join(sorted({each.program for each in found}))
                left_out.append(f"{node.fqn}: it may be any of {names}; which is not known")
            else:
                left_out.append(f"{node.fqn}: {_WITHOUT_PROGRAM}")


def _same_program(one: _Placed, other: _Placed) -> bool:
    """Return True if both are one program; a renamed node may be any of its program."""
    names = {_own_name(one), _own_name(other)} - {""}
    return one.start.program == other.start.program and len(names) <= 1


def _own_name(placed: _Placed) -> str:
    name = split_fqn(placed.node.fqn)[1]
    renamed = any(
        rule.replacement == name and rule.kind.value == "__node" and rule.node is None
        for rule in (*placed.start.rules.local, *placed.start.rules.process)
    )
    return "" if renamed else name


def _known_name(placed: _Placed, others: Iterable[_Placed]) -> str:
    """Return the name of a renamed node that another run shows, if all of them show the same."""
    own = _own_name(placed)
    shown = {name for other in others if (name := _own_name(other))}
    return own or (shown.pop() if len(shown) == 1 else "")


def _requested_node(placed: _Placed, others: Sequence[_Placed], left_out: list[str]) -> RequestedNode:
    namespace, _ = split_fqn(placed.node.fqn)
    start, rules = placed.start, placed.start.rules
    moved = any(rule.kind.value == "__ns" for rule in (*rules.local, *rules.process))
    every = _BuiltIn(placed.node)
    endpoints = []
    for interface in placed.node.interfaces:
        shown = f"{placed.node.fqn}: {interface.kind.value} {interface.name}"
        if not interface.complete:
            left_out.append(f"{shown} is half open, without {', '.join(interface.missing)}")
        elif len(interface.type.split("/")) != _ROS_TYPE_PARTS:
            left_out.append(f"{shown} has no ROS type")
        elif not every.has(interface):
            endpoints.append(_endpoint(interface, placed, others))
    return RequestedNode(
        start=start,
        name=_known_name(placed, others),
        namespace="" if moved or namespace == "/" else namespace,
        fqn=placed.node.fqn,
        library=ClientLibrary.UNKNOWN,
        lifecycle=BuiltinCondition.LIFECYCLE in every.there,
        states=(),
        endpoints=tuple(endpoints),
        known_start=True,
        logger_services=BuiltinCondition.LOGGER_SERVICES in every.there,
        container=BuiltinCondition.CONTAINER in every.there,
        process=placed.run.id,
        started_as=OBSERVED,
    )


def _endpoint(interface: SeenInterface, placed: _Placed, others: Sequence[_Placed]) -> RequestedEndpoint:
    fqn = placed.node.fqn
    found = written_names(interface.kind, interface.name, fqn, placed.start.rules)
    given = _values(placed.start)
    by_parameter = [each for each in found if each in given]
    left = by_parameter[:1] or list(_left(interface.kind, found, others))
    name = left[0] if left else interface.name
    quality = interface.endpoints[0].quality.rmw_numbers if interface.endpoints else ()
    return RequestedEndpoint(
        interface.kind, name, name, interface.name, interface.type, 0, quality, spellings=tuple(left[1:])
    )


def _left(kind: EndpointKind, candidates: Sequence[str], runs: Sequence[_Placed]) -> Iterator[str]:
    explained = {
        each: sum(
            any((kind, final) in run.ends for final in final_names(kind, each, run.node.fqn, run.start.rules))
            for run in runs
        )
        for each in candidates
    }
    most = max(explained.values(), default=0)
    return (each for each in candidates if explained[each] == most)


def _values(start: StartedNode) -> set[object]:
    found: set[object] = set()
    for value in (*start.parameters.values(), *arguments_as_inputs(start.arguments).values()):
        found.update([value] if isinstance(value, str) else value if isinstance(value, list | tuple) else [])
    return found


class _BuiltIn:
    """Interfaces that every node of its sort has, under the final names of this node."""

    _SORTS = frozenset(BuiltinCondition) - {BuiltinCondition.SIM_TIME, BuiltinCondition.TF_LISTENER}

    def __init__(self, node: GraphNode) -> None:
        rows = built_in_interfaces(DISTROS[-1], ClientLibrary.UNKNOWN, self._SORTS)
        self._rows = {(row.kind, row.name.replace("~", node.fqn, 1), row.type): row.condition for row in rows}
        self.there = {self._rows[key] for each in node.interfaces if (key := _key(each)) in self._rows}

    def has(self, interface: SeenInterface) -> bool:
        return _key(interface) in self._rows


def _key(interface: SeenInterface) -> tuple[EndpointKind, str, str]:
    return interface.kind, interface.name, interface.type
