"""From an evaluation to the plan: assign enclaves, join interfaces with final names, derive the policy. No I/O."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from fnmatch import fnmatchcase

import enclave_launch.plan_diagnostics as plan_diagnostics
from enclave_common.source_location import SourceLocation
from enclave_common.words import some_of
from enclave_launch.admission import AdmissionOptions, notes, prefix_refusals, refusals
from enclave_launch.admission.middleware import middleware_of
from enclave_launch.admission.variables import domain_of
from enclave_launch.diagnostics import Code
from enclave_launch.diagnostics.evaluation import not_foreseeable
from enclave_launch.enclave import EnclaveScope, assign_enclave
from enclave_launch.plan import (
    InterfaceLookup,
    InterfaceOrigin,
    LaunchPlan,
    Missing,
    PlanInputs,
    PlannedComponent,
    PlannedProcess,
    nodes_of,
)
from enclave_launch.policy import derive_policy
from enclave_launch.policy.command_nodes import interfaces_of_command, only_command, program_of_command
from enclave_launch.policy.launcher import launcher_node
from enclave_launch.policy.running_node import (
    Role,
    RunningNode,
    UnknownNodeName,
    node_of_component,
    node_of_process,
)
from enclave_launch.process import UNSPECIFIED_NODE_NAME, Evaluation, ResolvedComponent, ResolvedProcess
from keystore.formats.permissions_patterns import has_wildcard
from keystore.formats.policy_xml import PolicyDocument
from nodl.node_interface import RANDOM_ENDING, NodeInterface


def make_plan(evaluation: Evaluation, inputs: PlanInputs) -> LaunchPlan:
    """Make the plan of an evaluated launch.

    Raises ``LaunchFileError`` for an enclave name or remap rule that the started process would refuse.
    """
    options = inputs.options
    processes = tuple(
        _admitted(_plan_process(process, inputs.lookup, options.enclave_scope), options.admission)
        for process in evaluation.processes
    )
    containers = _containers(processes)
    components = tuple(_plan_component(item, containers, inputs.lookup) for item in evaluation.components)
    if options.policy.policy_file is not None:
        profiles = _Profiles(options.policy.policy_file)
        profiles.take(nodes_of(processes, components, None))
        processes = tuple(map(profiles.described_process, profiles.named_first(processes)))
        components = tuple(map(profiles.described_component, components))
    launcher = launcher_node(evaluation.launcher_calls) if evaluation.launcher_calls else None
    derived = derive_policy(
        nodes_of(processes, components, launcher),
        distro=evaluation.distro,
        rcl=evaluation.release.rcl,
        options=options.policy,
        # Enclaves of which no node is known: of executables to which the launch file gives one, and of processes
        # without a manifest, which must not be missing from what is shown.
        also=tuple(item.enclave.path for item in processes if item.enclave and not item.nodes),
    )
    return LaunchPlan(
        evaluation=evaluation,
        inputs=inputs,
        processes=processes,
        components=components,
        launcher=launcher,
        derived=derived,
        problems=(*plan_diagnostics.problems(processes, components), *derived.problems),
        warnings=(
            *evaluation.warnings,
            *(not_foreseeable(action.what, action.location) for action in evaluation.unforeseeable),
            *plan_diagnostics.notes(processes, components, launcher),
            *(note for item in processes for note in notes(item.process)),
            *plan_diagnostics.shared_domains(processes),
            *plan_diagnostics.ungranted_enclaves(processes, derived),
            *plan_diagnostics.failing_handshakes(processes),
            *derived.warnings,
        ),
    )


def _admitted(planned: PlannedProcess, options: AdmissionOptions) -> PlannedProcess:
    process = planned.process
    middleware = middleware_of(process.final_environment)
    if planned.enclave is None and process.kind == "executable":
        unkept = tuple(prefix_refusals(process, options))
        return planned._replace(refusals=unkept, middleware=middleware)
    refused = tuple(refusals(process, options))
    bad = any(refusal.code is Code.DOMAIN_INVALID for refusal in refused)
    domain = 0 if bad else domain_of(process.final_environment)
    return planned._replace(refusals=refused, domain=domain, middleware=middleware)


def _plan_process(process: ResolvedProcess, lookup: InterfaceLookup, scope: EnclaveScope) -> PlannedProcess:
    if process.kind == "executable":
        return _plan_executable(process, lookup, scope)
    found = lookup(process, None)
    if isinstance(found, Missing):
        unnamed = scope is EnclaveScope.NODE and process.name == UNSPECIFIED_NODE_NAME
        enclave = None if unnamed else assign_enclave(process, scope)
        return PlannedProcess(process, enclave, (), found)
    name = found.interfaces[0].name if found.interfaces else None
    enclave = assign_enclave(process, scope, name and name.removesuffix(RANDOM_ENDING))
    path, role = enclave.path if enclave else "/", _role(process)
    try:
        nodes = tuple(
            node_of_process(process, interface, path, "node" if interface.own_rules else role)
            for interface in found.interfaces
        )
    except UnknownNodeName as error:
        missing = Missing(process.process_name, error.message, unnamed=True)
        return PlannedProcess(process, enclave, (), missing)
    return PlannedProcess(
        process, enclave, nodes, origin=found.origin, doubt=found.doubt, descriptions=found.descriptions
    )


class _Profiles:
    """Profiles of a policy file, as descriptions of the nodes of which nothing else is known.

    A profile is of the node of its name, as launch names it. Where launch gives no name, the profiles that are no
    other node's are those of the one program in their enclave that has no description.
    """

    def __init__(self, document: PolicyDocument) -> None:
        self._document = document
        self._left = {
            enclave.path: {(profile.ns, profile.node): profile for profile in enclave.profiles}
            for enclave in document.policy.enclaves
        }
        self._unnamed: Counter[str] = Counter()

    def take(self, nodes: Iterable[RunningNode]) -> None:
        """Take the profiles of nodes that are described already: they are of no other program."""
        for node in nodes:
            self._left.get(node.enclave, {}).pop((node.namespace, node.fixed_name), None)

    def named_first(self, processes: tuple[PlannedProcess, ...]) -> tuple[PlannedProcess, ...]:
        """Describe the processes that launch names; the rest is described by what is left."""
        named = tuple(
            item if item.process.name == UNSPECIFIED_NODE_NAME else self.described_process(item)
            for item in processes
        )
        self._unnamed.update(item.enclave.path for item in named if item.missing and item.enclave)
        return named

    def described_process(self, item: PlannedProcess) -> PlannedProcess:
        """Return the process with the nodes that the policy describes."""
        process = item.started or item.process
        if item.missing is None or item.enclave is None or process.kind == "executable":
            return item
        path, role = item.enclave.path, _role(process)
        unnamed = process.name == UNSPECIFIED_NODE_NAME
        nodes = tuple(
            node
            for interface in self._interfaces(path, process.package, process.executable, None)
            if _is_its_own(node := node_of_process(process, interface, path, role), interface)
        )
        if not nodes or (unnamed and self._unnamed[path] > 1):
            return item._replace(missing=self._still_missing(item.missing, path))
        self.take(nodes)
        return item._replace(nodes=nodes, missing=None, origin=InterfaceOrigin.POLICY)

    def described_component(self, item: PlannedComponent) -> PlannedComponent:
        """Return the component with the node that the policy describes."""
        container = item.container
        if item.missing is None or container is None or container.enclave is None:
            return item
        path, component = container.enclave.path, item.component
        nodes = tuple(
            node
            for interface in self._interfaces(path, component.package, None, component.plugin)
            if _is_its_own(
                node := node_of_component(component, container.process, interface, path), interface
            )
        )
        if len(nodes) != 1:
            return item._replace(missing=self._still_missing(item.missing, path))
        self.take(nodes)
        return item._replace(nodes=nodes, missing=None, origin=InterfaceOrigin.POLICY)

    def _interfaces(
        self, path: str, package: str | None, executable: str | None, plugin: str | None
    ) -> Iterator[NodeInterface]:
        for (ns, node), profile in self._left.get(path, {}).items():
            place = SourceLocation(self._document.file)
            if profile.rules:
                file, _, line = self._document.places[path, ns, node, profile.rules[0]].rpartition(":")
                place = SourceLocation(file, int(line) if line.isdecimal() else 0)
            yield NodeInterface(package, executable, plugin, node, ns, (), place)

    def _still_missing(self, missing: Missing, path: str) -> Missing:
        """Return ``missing`` with what the policy has instead."""
        left = [f"{ns.rstrip('/')}/{node}" for ns, node in self._left.get(path, {})]
        elsewhere = sorted(each for each, profiles in self._left.items() if profiles and each != path)
        if left:
            why = f"the policy has profiles of {some_of(left, 3)} in enclave {path}, of which none is surely this node"
        elif elsewhere:
            why = f"the policy has no profile for it in enclave {path}, but some in {some_of(elsewhere, 3)} (enclave=)"
        else:
            why = f"the policy has no profile for it in enclave {path}"
        return missing._replace(why=f"{why}; {missing.why}")


def _is_its_own(node: RunningNode, interface: NodeInterface) -> bool:
    """Return whether a profile is of this node: launch gives it no other name or namespace."""
    written = (interface.namespace, interface.name)
    return written == (node.namespace, node.name) or (
        written[0] == node.namespace
        and has_wildcard(written[1] or "")
        and fnmatchcase(node.name, written[1] or "")
    )


def _plan_executable(
    process: ResolvedProcess, lookup: InterfaceLookup, scope: EnclaveScope
) -> PlannedProcess:
    """Plan a command of ``ros2`` as the node that it is, or starts; any other program as its attributes say."""
    command = only_command(process)
    if command is not None and (program := program_of_command(process, command)) is not None:
        return _plan_process(program, lookup, scope)._replace(process=process, started=program)
    if command is None or (known := interfaces_of_command(process, command)) is None:
        return PlannedProcess(process, assign_enclave(process, scope), ())
    started, interfaces = known
    enclave = assign_enclave(
        started, scope, interfaces[0].name and interfaces[0].name.removesuffix(RANDOM_ENDING)
    )
    path = enclave.path if enclave else "/"
    nodes = tuple(node_of_process(started, interface, path, "node") for interface in interfaces)
    return PlannedProcess(process, enclave, nodes, started=started)


def _role(process: ResolvedProcess) -> Role:
    if process.kind == "container" or process.package == "rclcpp_components":
        return "container"
    return "lifecycle_node" if process.kind == "lifecycle_node" else "node"


def _plan_component(
    component: ResolvedComponent, containers: Mapping[str, PlannedProcess], lookup: InterfaceLookup
) -> PlannedComponent:
    container = containers.get("/" + component.container.lstrip("/"))
    found = lookup(component, container.process if container else None)
    if isinstance(found, Missing):
        return PlannedComponent(component, container, (), found)
    planned = PlannedComponent(
        component, container, (), origin=found.origin, doubt=found.doubt, descriptions=found.descriptions
    )
    if container is None or container.enclave is None:
        return planned
    path = container.enclave.path
    try:
        nodes = (node_of_component(component, container.process, each, path) for each in found.interfaces)
        return planned._replace(nodes=tuple(nodes))
    except UnknownNodeName as error:
        missing = Missing(component.plugin, error.message, unnamed=True)
        return PlannedComponent(component, container, (), missing)


def _containers(processes: Iterable[PlannedProcess]) -> dict[str, PlannedProcess]:
    """Map final names to processes that components may be loaded into; of equal names the first one started."""
    containers: dict[str, PlannedProcess] = {}
    for planned in processes:
        for node in planned.nodes:
            containers.setdefault(node.fqn, planned)
        if planned.fqn and not planned.nodes:
            containers.setdefault("/" + planned.fqn.rpartition(">/")[2].lstrip("/"), planned)
    return containers
