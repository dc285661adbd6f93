"""The dry run → what the plan expects to run in one DDS domain. Performs no I/O."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

from enclave_addons.review.document import GrantedName, fqn_of, grant_of, program_of
from enclave_launch.admission.middleware import ZENOH
from enclave_launch.diagnostics import Code
from enclave_launch.dry_run import Component, DryRun, Interface, Node, Process
from enclave_launch.process import UNSPECIFIED_NODE_NAME
from keystore.formats.permissions_patterns import has_wildcard

_STATED = ("--nodl", "manifest of the package")
"""Origins that say what a node has; the others may name what it has only now and then."""
_LIFECYCLE = "/change_state"


class ExpectedInterface(NamedTuple):
    """An interface that a node may have. ``certain``: a node that runs has it. ``qos``: what is known of it, by NoDL
    v2's names."""

    grant: GrantedName
    type: str
    certain: bool
    qos: Mapping[str, Any] = MappingProxyType({})


class ExpectedNode(NamedTuple):
    """A node that the plan has. ``described``: its interfaces are known; ``open``: not all of them; ``always``: it
    starts with the launch, not on an event; ``times``: how many of this name."""

    fqn: str
    enclave: str
    program: str
    interfaces: tuple[ExpectedInterface, ...] = ()
    described: bool = True
    always: bool = True
    times: int = 1
    open: bool = False


class Expected(NamedTuple):
    """Everything that plans expect in one domain. ``opaque``: enclaves, and places without one, in which programs run
    of which no node is known; ``unnamed``: namespaces in which nodes run whose names are not."""

    nodes: Mapping[str, ExpectedNode]
    opaque: frozenset[str]
    unnamed: frozenset[str]
    enclaves: frozenset[str]


def out_of_sight(plans: Iterable[DryRun]) -> tuple[str, ...]:
    """Return the processes on Zenoh: an observer takes part in DDS, and would miss them."""
    processes = (process for plan in plans for process in plan.processes)
    return tuple(process.process for process in processes if process.middleware == ZENOH)


def expected_in(plans: Sequence[DryRun], domain: int) -> Expected:
    """Return what all launches in the domain expect, from their dry runs."""
    processes = [each for plan in plans for each in plan.processes]
    here = [each for each in processes if each.domain_id == domain]
    elsewhere = {_enclave(each) for each in processes if each.domain_id != domain}
    enclaves = {_enclave(each) for each in here}
    started: list[Process | Component] = [*here]
    for plan in plans:
        started += [each for each in plan.components if _enclave(each) not in elsewhere - enclaves]
    described = (each for plan in plans for each in plan.nodes)
    nodes = {
        node.fqn: node
        for node in _described(described, started, _open(plans))
        if node.enclave in enclaves or node.enclave not in elsewhere
    }
    known = {(node.program, node.enclave) for node in nodes.values()}
    for fqn, count in Counter(fqn_of(each) for each in started if each.fqn).items():
        starter = next(each for each in started if each.fqn and fqn_of(each) == fqn)
        program = program_of(starter)
        # Nodes of a known program have the names that rcl gives them, by the user's own ROS arguments, too.
        is_described = (program, _enclave(starter)) in known
        if fqn not in nodes and not is_described and UNSPECIFIED_NODE_NAME not in fqn:
            nodes[fqn] = ExpectedNode(
                fqn, _enclave(starter), program, described=False, always=starter.on_event is None
            )
        if fqn in nodes:
            nodes[fqn] = nodes[fqn]._replace(times=count)
    unnamed = frozenset(
        fqn_of(each).rpartition("/")[0] or "/"
        for each in started
        if each.fqn and UNSPECIFIED_NODE_NAME in each.fqn
    )
    opaque = frozenset(_enclave(each) for each in here if not each.fqn)
    return Expected(nodes, opaque, unnamed, frozenset(path for path in enclaves if path))


def _enclave(started: Process | Component) -> str:
    return started.enclave or ""


def _open(plans: Iterable[DryRun]) -> frozenset[str]:
    diagnostics = (each for plan in plans for each in plan.diagnostics)
    return frozenset(each.subject for each in diagnostics if each.code == Code.INTERFACE_UNKNOWN.value)


def _described(
    nodes: Iterable[Node], started: Iterable[Process | Component], unknown: frozenset[str]
) -> Iterable[ExpectedNode]:
    origins: dict[str, str] = {}
    on_event: dict[str, bool] = {}
    for each in started:
        program = program_of(each)
        origins[program] = each.interfaces or ""
        on_event[program] = on_event.get(program, True) and each.on_event is not None
    for node in nodes:
        lifecycle = any(each.built_in and each.name.endswith(_LIFECYCLE) for each in node.interfaces)
        stated = origins.get(node.program, "") in _STATED and not lifecycle
        yield ExpectedNode(
            node.fqn,
            node.enclave,
            node.program,
            tuple(_interface(each, stated) for each in node.interfaces),
            always=not on_event.get(node.program, False),
            open=node.fqn in unknown,
        )


def _interface(planned: Interface, stated: bool) -> ExpectedInterface:
    wildcard = has_wildcard(planned.name)
    certain = stated and not planned.built_in and not planned.note and not wildcard
    return ExpectedInterface(grant_of(planned), planned.type, certain, planned.qos)
