"""The plan of a launch: everything decided, nothing done.

Takes an ``Evaluation`` and a way to look up node interfaces; gives a ``LaunchPlan``, which the dry run prints,
``provision`` turns into a keystore and ``run`` carries out. Pure: the look-up is handed in.

What could not be found out is a value with a reason: a ``problem`` stops ``--secure`` and is a warning in a dry run.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from enum import Enum
from types import MappingProxyType
from typing import NamedTuple

from enclave_launch.admission import AdmissionOptions, prefix_refusals, refusals, remarks
from enclave_launch.admission.domains import domain_of
from enclave_launch.admission.handshakes import Member, Pair, failing, mixed_pairs
from enclave_launch.admission.middleware import DEFAULT as DEFAULT_MIDDLEWARE
from enclave_launch.admission.middleware import ZENOH, middleware_of, vendor_of
from enclave_launch.diagnostics import (
    Code,
    Diagnostic,
    container_elsewhere,
    domains_shared,
    enclave_attribute_unused,
    enclave_shared_with_launcher,
    enclave_too_deep,
    enclave_ungranted,
    executable_without_enclave,
    handshake_fails,
    library_version,
    machine_elsewhere,
    no_manifest,
    node_name_unknown,
    not_foreseeable,
    parameters_unknown,
    recording_incomplete,
)
from enclave_launch.enclave import EnclaveAssignment, EnclaveScope, assign_enclave
from enclave_launch.host.outcomes import Outcomes
from enclave_launch.host.protocol import HostOptions
from enclave_launch.policy import DerivedPolicy, PolicyOptions, RunningNode, derive_policy
from enclave_launch.policy.launcher import launcher_node
from enclave_launch.policy.running_node import Role, UnknownNodeName, node_of_component, node_of_process
from enclave_launch.process import (
    UNSPECIFIED_NODE_NAME,
    Evaluation,
    ResolvedComponent,
    ResolvedProcess,
)
from enclave_launch.ros_rules.parameter_value import ParameterValue
from enclave_launch.source_location import SourceLocation
from keystore.formats.subject import common_name
from nodl.node_interface import RANDOM_ENDING, NodeInterface


class InterfaceOrigin(str, Enum):
    """Where the interfaces of a node come from; the first that knows it decides, in this order. Manifests that were
    learnt from runs are ``RECORDED`` wherever they lie."""

    NAMED = "--nodl"
    PACKAGE = "manifest of the package"
    RECORDED = "recorded"
    ANALYSIS = "inferred"
    LIBRARY = "library"

    def __str__(self) -> str:
        return self.value


class Found(NamedTuple):
    """The nodes of one executable or component. ``doubt``: what they were described for is another version."""

    interfaces: tuple[NodeInterface, ...]
    origin: InterfaceOrigin = InterfaceOrigin.PACKAGE
    doubt: str = ""


class Missing(NamedTuple):
    """Nothing is known of an executable or component, and why: what was searched. ``unnamed``: but its name."""

    subject: str
    why: str
    unnamed: bool = False


InterfaceLookup = Callable[
    ["ResolvedProcess | ResolvedComponent", "ResolvedProcess | None"], "Found | Missing"
]
"""Asked with what launch starts and, for a component, its container where that is known."""


class PlannedProcess(NamedTuple):
    """One process with its enclave (``None``: it runs unsecured by the launch file's own word) and its nodes.

    ``origin``: where their interfaces come from; ``doubt``: why they may not be those of the installed version.
    """

    process: ResolvedProcess
    enclave: EnclaveAssignment | None
    nodes: tuple[RunningNode, ...]
    missing: Missing | None = None
    origin: InterfaceOrigin | None = None
    doubt: str = ""
    refusals: tuple[Diagnostic, ...] = ()
    domain: int = 0
    middleware: str = DEFAULT_MIDDLEWARE

    @property
    def package(self) -> str | None:
        return self.process.package

    @property
    def executable(self) -> str:
        return self.process.executable

    @property
    def cmd(self) -> tuple[str, ...]:
        """Without what ``--secure`` appends."""
        return self.process.cmd

    @property
    def parameters(self) -> Mapping[str, ParameterValue]:
        return self.process.parameters

    @property
    def location(self) -> SourceLocation:
        return self.process.location

    @property
    def name(self) -> str | None:
        """The node name: launch's, else the manifest's, else launch's placeholder."""
        if self.process.name == UNSPECIFIED_NODE_NAME and self.nodes:
            return self.nodes[0].original_name
        return self.process.name

    @property
    def fqn(self) -> str | None:
        """The fully qualified name as launch shows it, a placeholder for the name filled where known."""
        if self.process.fqn is None or self.name is None:
            return self.process.fqn
        return self.process.fqn.replace(UNSPECIFIED_NODE_NAME, self.name)


class PlannedComponent(NamedTuple):
    """One composable node; ``enclave`` is its container's, ``None`` when that is not part of this launch."""

    component: ResolvedComponent
    container: PlannedProcess | None
    nodes: tuple[RunningNode, ...]
    missing: Missing | None = None
    origin: InterfaceOrigin | None = None
    doubt: str = ""

    @property
    def package(self) -> str:
        return self.component.package

    @property
    def plugin(self) -> str:
        return self.component.plugin

    @property
    def location(self) -> SourceLocation:
        return self.component.location

    @property
    def enclave(self) -> str | None:
        return self.container.enclave.path if self.container and self.container.enclave else None

    @property
    def fqn(self) -> str:
        if not self.component.name and self.nodes:
            return self.component.fqn.replace(UNSPECIFIED_NODE_NAME, self.nodes[0].original_name)
        return self.component.fqn


class LaunchPlan(NamedTuple):
    """What a launch file starts, in which enclaves, with which permissions.

    ``problems`` are what ``--secure`` refuses to start with; ``warnings`` are for the reader.
    """

    evaluation: Evaluation
    planner: Planner
    processes: tuple[PlannedProcess, ...]
    components: tuple[PlannedComponent, ...]
    launcher: RunningNode | None
    derived: DerivedPolicy
    problems: tuple[Diagnostic, ...] = ()
    warnings: tuple[Diagnostic, ...] = ()

    @property
    def evaluated(self) -> EvaluatedLaunch:
        return EvaluatedLaunch(self.planner.source, self.evaluation)

    @property
    def launch_file(self) -> str:
        return self.planner.source.launch_file

    @property
    def distro(self) -> str:
        return self.evaluation.distro

    @property
    def nodes(self) -> tuple[RunningNode, ...]:
        """Every node of the launch, the launcher's own last."""
        return _nodes(self.processes, self.components, self.launcher)


class PlanOptions(NamedTuple):
    """``enclave_scope``: where processes without an ``enclave`` attribute go; ``policy``: how permissions derive;
    ``admission``: what may start though it is not known to keep its enclave."""

    enclave_scope: EnclaveScope = EnclaveScope.NAMESPACE
    policy: PolicyOptions = PolicyOptions()
    admission: AdmissionOptions = AdmissionOptions()


class LaunchSource(NamedTuple):
    """What was asked for: enough to evaluate it once more, live, with the same results.

    ``launch_file`` and ``prefixes`` are absolute; ``launch_configurations`` are set before the file is included;
    ``host_options`` are those of the evaluation's host; ``outcomes`` what the user's code gave when it was evaluated.
    """

    launch_file: str
    arguments: tuple[tuple[str, str], ...] = ()
    prefixes: tuple[str, ...] = ()
    launch_configurations: Mapping[str, str] = MappingProxyType({})
    host_options: HostOptions = HostOptions()
    outcomes: Outcomes | None = None


class EvaluatedLaunch(NamedTuple):
    """What a launch file would start, before anything is decided about enclaves."""

    source: LaunchSource
    evaluation: Evaluation


class Planner(NamedTuple):
    """Makes the plan of one launch: assign enclaves, join interfaces with final names, derive the policy."""

    source: LaunchSource
    lookup: InterfaceLookup
    options: PlanOptions

    def plan(self, evaluation: Evaluation) -> LaunchPlan:
        """Raises ``LaunchFileError`` for an enclave name or remap rule that the started process would refuse."""
        scope = self.options.enclave_scope
        processes = tuple(
            self._admitted(_plan_process(process, self.lookup, scope), evaluation.distro)
            for process in evaluation.processes
        )
        containers = _containers(processes)
        components = tuple(_plan_component(item, containers, self.lookup) for item in evaluation.components)
        launcher = launcher_node(evaluation.launcher_calls) if evaluation.launcher_calls else None
        derived = derive_policy(
            _nodes(processes, components, launcher),
            distro=evaluation.distro,
            options=self.options.policy,
            also=_bare_enclaves(processes),
        )
        return LaunchPlan(
            evaluation=evaluation,
            planner=self,
            processes=processes,
            components=components,
            launcher=launcher,
            derived=derived,
            problems=(*_problems(processes, components), *derived.problems),
            warnings=(
                *evaluation.warnings,
                *(not_foreseeable(action.what, action.location) for action in evaluation.unforeseeable),
                *_notes(processes, components, launcher),
                *(note for item in processes for note in remarks(item.process, evaluation.distro)),
                *_domains_shared(processes),
                *_ungranted(processes, derived),
                *_handshakes(processes),
                *derived.warnings,
            ),
        )

    def _admitted(self, planned: PlannedProcess, distro: str) -> PlannedProcess:
        """With what decides whether its enclave is used. An executable without one starts where none is found."""
        process = planned.process
        middleware = middleware_of(process.final_environment, distro)
        if planned.enclave is None and process.kind == "executable":
            unkept = tuple(prefix_refusals(process, self.options.admission))
            return planned._replace(refusals=unkept, middleware=middleware)
        refused = tuple(refusals(process, distro, self.options.admission))
        bad = any(refusal.code is Code.DOMAIN_INVALID for refusal in refused)
        domain = 0 if bad else domain_of(process.final_environment)
        return planned._replace(refusals=refused, domain=domain, middleware=middleware)


def enclave_domains(processes: Iterable[PlannedProcess]) -> dict[str, dict[int, list[PlannedProcess]]]:
    """Enclave path -> domain -> the processes of that enclave in it."""
    found: dict[str, dict[int, list[PlannedProcess]]] = {}
    for item in processes:
        if item.enclave is not None:
            found.setdefault(item.enclave.path, {}).setdefault(item.domain, []).append(item)
    return found


def _domains_shared(processes: Iterable[PlannedProcess]) -> Iterator[Diagnostic]:
    for enclave, by_domain in enclave_domains(processes).items():
        if len(by_domain) > 1:
            who = (
                f"{item.process.process_name} in {domain}"
                for domain, items in sorted(by_domain.items())
                for item in items
            )
            yield domains_shared(enclave, ", ".join(map(str, sorted(by_domain))), tuple(who))


def mixed_enclaves(processes: Iterable[PlannedProcess]) -> tuple[Pair, ...]:
    """Enclaves on Fast DDS with those on Cyclone DDS that could meet them."""
    return mixed_pairs(
        Member(item.enclave.path, item.domain, vendor_of(item.middleware))
        for item in processes
        if item.enclave
    )


def on_zenoh(plan: LaunchPlan, environment: Mapping[str, str]) -> frozenset[str]:
    """Enclaves with a process on Zenoh, or with the launcher's own node, in ``environment``, on it."""
    found = {item.enclave.path for item in plan.processes if item.enclave and item.middleware == ZENOH}
    if plan.launcher is not None and middleware_of(environment, plan.distro) == ZENOH:
        found.add(plan.launcher.enclave)
    return frozenset(found)


def _handshakes(processes: Iterable[PlannedProcess]) -> Iterator[Diagnostic]:
    """With the subjects that enclaves have by themselves."""
    pairs = mixed_enclaves(processes)
    subjects = {path: common_name(path) for pair in pairs for path in pair}
    for pair in failing(pairs, subjects):
        yield handshake_fails(*pair, planned=True)


def _ungranted(processes: Iterable[PlannedProcess], derived: DerivedPolicy) -> Iterator[Diagnostic]:
    """Enclaves of executables for which no policy file speaks: signed, they permit nothing at all."""
    empty = {enclave.path for enclave in derived.policy.enclaves if not enclave.profiles}
    members: dict[str, list[PlannedProcess]] = {}
    for item in processes:
        if item.enclave and item.enclave.path in empty and item.process.kind == "executable":
            members.setdefault(item.enclave.path, []).append(item)
    for path, items in members.items():
        names = tuple(item.process.process_name for item in items)
        yield enclave_ungranted(path, names, items[0].location)


def _nodes(
    processes: Iterable[PlannedProcess], components: Iterable[PlannedComponent], launcher: RunningNode | None
) -> tuple[RunningNode, ...]:
    planned: Iterable[PlannedProcess | PlannedComponent] = (*processes, *components)
    own = (launcher,) if launcher else ()
    return (*(node for item in planned for node in item.nodes), *own)


def _plan_process(process: ResolvedProcess, lookup: InterfaceLookup, scope: EnclaveScope) -> PlannedProcess:
    if process.kind == "executable":
        return PlannedProcess(process, assign_enclave(process, scope), ())
    found = lookup(process, None)
    if isinstance(found, Missing):
        unnamed = scope is EnclaveScope.NODE and process.name == UNSPECIFIED_NODE_NAME
        enclave = None if unnamed else assign_enclave(process, scope)
        return PlannedProcess(process, enclave, (), found)
    name = found.interfaces[0].name if found.interfaces else None
    enclave = assign_enclave(process, scope, name and name.removesuffix(RANDOM_ENDING))
    path = enclave.path if enclave else "/"
    role = _role(process)
    try:
        nodes = tuple(
            node_of_process(process, interface, path, "node" if interface.own_rules else role)
            for interface in found.interfaces
        )
    except UnknownNodeName as error:
        missing = Missing(process.process_name, error.message, unnamed=True)
        return PlannedProcess(process, enclave, (), missing)
    return PlannedProcess(process, enclave, nodes, origin=found.origin, doubt=found.doubt)


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
    if container is None or container.enclave is None:
        return PlannedComponent(component, container, (), origin=found.origin, doubt=found.doubt)
    try:
        nodes = tuple(
            node_of_component(component, container.process, interface, container.enclave.path)
            for interface in found.interfaces
        )
    except UnknownNodeName as error:
        return PlannedComponent(
            component, container, (), Missing(component.plugin, error.message, unnamed=True)
        )
    return PlannedComponent(component, container, nodes, origin=found.origin, doubt=found.doubt)


def _containers(processes: Iterable[PlannedProcess]) -> dict[str, PlannedProcess]:
    """Processes into which components may be loaded, by final name; of equal names the first one started."""
    containers: dict[str, PlannedProcess] = {}
    for planned in processes:
        for node in planned.nodes:
            containers.setdefault(node.fqn, planned)
        if planned.fqn and not planned.nodes:
            containers.setdefault("/" + planned.fqn.rpartition(">/")[2].lstrip("/"), planned)
    return containers


def _bare_enclaves(processes: Iterable[PlannedProcess]) -> tuple[str, ...]:
    """Enclaves of which no node is known: of executables to which the launch file gives one, and of processes
    without a manifest, which must not be missing from what a person looks at."""
    return tuple(p.enclave.path for p in processes if p.enclave and not p.nodes)


def _problems(
    processes: Sequence[PlannedProcess], components: Sequence[PlannedComponent]
) -> Iterator[Diagnostic]:
    for process in processes:
        if process.missing:
            yield _missing(process.missing, process.process.location)
        yield from process.refusals
        if process.enclave and process.enclave.too_deep:
            yield enclave_too_deep(
                process.process.process_name, process.enclave.too_deep, process.process.location
            )
        for path, why in process.process.unread_parameter_files:
            yield parameters_unknown(process.process.process_name, path, why, process.process.location)
    for component in components:
        if component.missing:
            yield _missing(component.missing, component.component.location)


def _missing(missing: Missing, place: SourceLocation) -> Diagnostic:
    told = node_name_unknown if missing.unnamed else no_manifest
    return told(missing.subject, missing.why, place)


def _notes(
    processes: Sequence[PlannedProcess], components: Sequence[PlannedComponent], launcher: RunningNode | None
) -> Iterator[Diagnostic]:
    for item in processes:
        if item.enclave is None and item.process.kind == "executable":
            yield executable_without_enclave(item.process.process_name, item.process.location)
        if item.process.machine:
            yield machine_elsewhere(item.process.process_name, item.process.machine, item.process.location)
    for component in components:
        if component.container is None:
            target, place = component.component.container, component.component.location
            yield container_elsewhere(component.fqn, target, _alike(target, processes), place)
    yield from _library_versions(processes, components)
    yield from _incomplete(_nodes(processes, components, None))
    for item in processes:
        process, attribute = item.process, item.process.enclave.attribute
        if item.enclave and process.enclave.argument is not None and attribute is not None:
            yield enclave_attribute_unused(
                process.process_name, item.enclave.path, attribute, process.location
            )
    if launcher and any(item.enclave and item.enclave.path == launcher.enclave for item in processes):
        yield enclave_shared_with_launcher(launcher.enclave)


def _library_versions(
    processes: Sequence[PlannedProcess], components: Sequence[PlannedComponent]
) -> Iterator[Diagnostic]:
    for item in processes:
        if item.doubt:
            program = f"{item.process.package}/{item.process.executable}"
            yield library_version(program, item.doubt, item.process.location)
    for component in components:
        if component.doubt:
            program = f"{component.component.package}/{component.component.plugin}"
            yield library_version(program, component.doubt, component.component.location)


def _incomplete(nodes: Iterable[RunningNode]) -> Iterator[Diagnostic]:
    """What was learnt from runs that cannot have shown all of a node."""
    for node in nodes:
        for why in node.interface.incomplete:
            yield recording_incomplete(node.fqn, why, str(node.interface.source), node.location)


def _alike(container: str, processes: Iterable[PlannedProcess]) -> tuple[str, ...]:
    """Nodes of this launch whose last name is that of ``container``."""
    last = "/" + container.rpartition("/")[2]
    return tuple(
        dict.fromkeys(node.fqn for planned in processes for node in planned.nodes if node.fqn.endswith(last))
    )
