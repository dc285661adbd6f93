"""The plan of a launch: everything decided, nothing done. Performs no I/O."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from enum import Enum
from types import MappingProxyType
from typing import NamedTuple

from enclave_common.source_location import SourceLocation
from enclave_launch.admission import AdmissionOptions
from enclave_launch.admission.middleware import DEFAULT as DEFAULT_MIDDLEWARE
from enclave_launch.admission.middleware import (
    ZENOH,
    EnclaveProcess,
    middleware_of,
    vendor_of,
)
from enclave_launch.diagnostics import Diagnostic
from enclave_launch.enclave import EnclaveAssignment, EnclaveScope
from enclave_launch.host.host import HostOptions
from enclave_launch.host.user_code_results import RecordedResults
from enclave_launch.policy import DerivedPolicy, PolicyOptions, RunningNode
from enclave_launch.process import UNSPECIFIED_NODE_NAME, Evaluation, ResolvedComponent, ResolvedProcess
from keystore.formats.policy import Operation
from nodl.node_interface import NodeInterface


class InterfaceOrigin(str, Enum):
    """A source of knowledge about a node; manifests that were learnt are ``RECORDED`` wherever they lie."""

    __str__ = str.__str__

    NAMED = "--nodl"
    PACKAGE = "manifest of the package"
    RECORDED = "recorded"
    ANALYSIS = "inferred"
    LIBRARY = "library"
    POLICY = "policy"


Named = tuple[Operation, str]
"""One operation on a final name."""


class Found(NamedTuple):
    """The nodes of one executable or component under one start, as a source of knowledge has them. ``doubt``: what they
    were described for is another version; ``outdated``: the source has changed since the manifest was written from it;
    ``descriptions``: all that were compared, if there are several."""

    interfaces: tuple[NodeInterface, ...]
    origin: InterfaceOrigin = InterfaceOrigin.PACKAGE
    doubt: str = ""
    descriptions: tuple[Described, ...] = ()
    outdated: bool = False

    @property
    def source(self) -> str:
        """Return the place that describes the first of the nodes."""
        return str(self.interfaces[0].source)


class Described(NamedTuple):
    """One of several descriptions of a program, applied to one start.

    ``names``: each with the place that says it; ``open``: what it leaves open; ``used``: the plan grants what it says.
    """

    found: Found
    names: Mapping[Named, str]
    open: tuple[str, ...]
    used: bool = False

    @property
    def complete(self) -> bool:
        return not self.open


class Missing(NamedTuple):
    """Nothing is known of an executable or component, and why: what was searched. ``unnamed``: but its name.
    ``not_made``: no build in reach makes it, and it is not installed."""

    subject: str
    why: str
    unnamed: bool = False
    not_made: bool = False


InterfaceLookup = Callable[
    ["ResolvedProcess | ResolvedComponent", "ResolvedProcess | None"], "Found | Missing"
]
"""Called with what launch starts and, for a component, its container where that is known."""


class PlannedProcess(NamedTuple):
    """One process with its enclave (``None``: it runs unsecured by the launch file's own word) and its nodes.

    ``origin``: where their interfaces come from; ``doubt``: why they may not be those of the installed version;
    ``descriptions``: all that were compared, if there are several. ``started``: of a command of ``ros2``, the node that
    it is or starts.
    """

    process: ResolvedProcess
    enclave: EnclaveAssignment | None
    nodes: tuple[RunningNode, ...]
    missing: Missing | None = None
    origin: InterfaceOrigin | None = None
    doubt: str = ""
    descriptions: tuple[Described, ...] = ()
    refusals: tuple[Diagnostic, ...] = ()
    domain: int = 0
    middleware: str = DEFAULT_MIDDLEWARE
    started: ResolvedProcess | None = None

    @property
    def program(self) -> str:
        """Return ``package/executable``, or the executable alone."""
        return (self.started or self.process).program

    @property
    def location(self) -> SourceLocation:
        return self.process.location

    @property
    def name(self) -> str | None:
        """Return the node name: launch's, else the manifest's, else launch's placeholder."""
        name = (self.started or self.process).name
        return self.nodes[0].original_name if name == UNSPECIFIED_NODE_NAME and self.nodes else name

    @property
    def fqn(self) -> str | None:
        """Return the fully qualified name as launch shows it, with the placeholder replaced by a known name."""
        fqn = (self.started or self.process).fqn
        if fqn is None or self.name is None:
            return fqn
        return fqn.replace(UNSPECIFIED_NODE_NAME, self.name)


class PlannedComponent(NamedTuple):
    """One composable node; ``enclave`` is its container's, ``None`` when that is not part of this launch."""

    component: ResolvedComponent
    container: PlannedProcess | None
    nodes: tuple[RunningNode, ...]
    missing: Missing | None = None
    origin: InterfaceOrigin | None = None
    doubt: str = ""
    descriptions: tuple[Described, ...] = ()

    @property
    def program(self) -> str:
        """Return ``package/plugin``."""
        return self.component.program

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
    """The processes of a launch file, their enclaves and permissions.

    ``problems`` are what ``--secure`` refuses to start with; ``warnings`` are for the reader.
    """

    evaluation: Evaluation
    inputs: PlanInputs
    processes: tuple[PlannedProcess, ...]
    components: tuple[PlannedComponent, ...]
    launcher: RunningNode | None
    derived: DerivedPolicy
    problems: tuple[Diagnostic, ...] = ()
    warnings: tuple[Diagnostic, ...] = ()

    @property
    def evaluated(self) -> EvaluatedLaunch:
        return EvaluatedLaunch(self.inputs.source, self.evaluation)

    @property
    def launch_file(self) -> str:
        return self.inputs.source.launch_file

    @property
    def distro(self) -> str:
        return self.evaluation.distro

    @property
    def nodes(self) -> tuple[RunningNode, ...]:
        """Return every node of the launch, the launcher's own last."""
        return nodes_of(self.processes, self.components, self.launcher)


class PlanOptions(NamedTuple):
    """Options of planning. ``enclave_scope``: where processes without an ``enclave`` attribute go; ``policy``: how
    permissions derive; ``admission``: what may start though it is not known to keep its enclave."""

    enclave_scope: EnclaveScope = EnclaveScope.NAMESPACE
    policy: PolicyOptions = PolicyOptions()
    admission: AdmissionOptions = AdmissionOptions()


class LaunchSource(NamedTuple):
    """The requested launch: enough to evaluate it once more, live, with the same results.

    ``launch_file`` and ``prefixes`` are absolute; ``launch_configurations`` are set before the file is included;
    ``host_options`` are those of the evaluation's host; ``user_code_results`` are the
    results of the user's code from the evaluation.
    """

    launch_file: str
    arguments: tuple[tuple[str, str], ...] = ()
    prefixes: tuple[str, ...] = ()
    launch_configurations: Mapping[str, str] = MappingProxyType({})
    host_options: HostOptions = HostOptions()
    user_code_results: RecordedResults | None = None


class PlanInputs(NamedTuple):
    """The inputs of a plan beside its evaluation. They suffice to plan again with a further process."""

    source: LaunchSource
    lookup: InterfaceLookup
    options: PlanOptions


class EvaluatedLaunch(NamedTuple):
    """An evaluated launch file, before anything is decided about enclaves."""

    source: LaunchSource
    evaluation: Evaluation


def enclave_domains(processes: Iterable[PlannedProcess]) -> dict[str, dict[int, list[PlannedProcess]]]:
    """Map enclave path -> domain -> the processes of that enclave in it."""
    found: dict[str, dict[int, list[PlannedProcess]]] = {}
    for item in processes:
        if item.enclave is not None:
            found.setdefault(item.enclave.path, {}).setdefault(item.domain, []).append(item)
    return found


def enclave_processes(processes: Iterable[PlannedProcess]) -> tuple[EnclaveProcess, ...]:
    """Return each process with an enclave as what decides whom it can authenticate."""
    return tuple(
        EnclaveProcess(item.enclave.path, item.domain, vendor_of(item.middleware))
        for item in processes
        if item.enclave
    )


def on_zenoh(plan: LaunchPlan, environment: Mapping[str, str]) -> frozenset[str]:
    """Return enclaves with a process on Zenoh, or with the launcher's own node, in ``environment``, on it."""
    found = {item.enclave.path for item in plan.processes if item.enclave and item.middleware == ZENOH}
    if plan.launcher is not None and middleware_of(environment) == ZENOH:
        found.add(plan.launcher.enclave)
    return frozenset(found)


def nodes_of(
    processes: Iterable[PlannedProcess], components: Iterable[PlannedComponent], launcher: RunningNode | None
) -> tuple[RunningNode, ...]:
    """Return every node that is planned, the launcher's own last."""
    planned: Iterable[PlannedProcess | PlannedComponent] = (*processes, *components)
    own = (launcher,) if launcher else ()
    return (*(node for item in planned for node in item.nodes), *own)
