"""Processes and composable nodes as launch would start them: the result of evaluation. Performs no I/O."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal, NamedTuple

from enclave_common.source_location import SourceLocation
from enclave_launch.diagnostics import Diagnostic
from enclave_launch.ros_rules.distro import DEFAULT, Release, Since, release_of
from enclave_launch.ros_rules.parameter_value import ParameterValue

UNSPECIFIED_NODE_NAME = "<node_name_unspecified>"
UNSPECIFIED_NODE_NAMESPACE = "<node_namespace_unspecified>"

ProcessKind = Literal["node", "lifecycle_node", "container", "executable"]


class EnclaveRequest(NamedTuple):
    """The enclave of one process as the launch file requests it.

    ``attribute``: the performed text of ``enclave=``; ``None`` when absent.
    ``scope``: the enclave scope in force (absolute), ``None`` when nothing was pushed.
    ``argument``: the last ``--enclave`` already present in the user's own ROS arguments.
    """

    attribute: str | None = None
    scope: str | None = None
    argument: str | None = None


class RemapRule(NamedTuple):
    """A remap rule, ``source:=target`` as passed to rcl, with the place it was written.

    ``word``: the index of ``source:=target`` in the command of a process; a load request has no words.
    """

    source: str
    target: str
    location: SourceLocation | None = None
    word: int | None = None


class Respawn(NamedTuple):
    """A process is started again whenever it ends. ``retries``: how often at most, -1 without a limit."""

    delay: float = 0.0  # seconds
    retries: int = -1


@dataclass(frozen=True)
class UnknownParameters:
    """Parameters that a Python module which is not installed would have given. ``value`` is the launch file's text."""

    value: str
    module: str


class ResolvedProcess(NamedTuple):
    """One process. ``cmd`` is what would be executed, prefix included, without ``--enclave``."""

    number: int  # N of the process name NAME-N
    kind: ProcessKind
    package: str | None
    executable: str
    process_name: str  # NAME-N
    name: str | None  # node name; a placeholder when launch does not know; None for executables
    namespace: str | None
    fqn: str | None
    cmd: tuple[str, ...]
    remaps: tuple[RemapRule, ...]
    parameters: Mapping[str, ParameterValue]  # resolved, as the node will see them
    environment: Mapping[str, str]  # added or changed by the launch file
    enclave: EnclaveRequest
    location: SourceLocation
    on_event: str | None = None
    cwd: str | None = None
    shell: bool = False
    parameter_files: Mapping[str, str] = MappingProxyType({})  # "<params:N>" -> YAML text
    unread_parameter_files: tuple[tuple[str, str], ...] = ()  # path, and why it could not be read
    unknown_parameters: tuple[UnknownParameters, ...] = ()
    prefix: tuple[str, ...] = ()  # words of cmd before the program: launch-prefix
    final_environment: Mapping[str, str] = MappingProxyType({})  # all of it, inherited variables included
    machine: str | None = None  # of the launch file: the host it is meant for
    respawn: Respawn | None = None

    @property
    def program(self) -> str:
        """Return ``package/executable``, or the executable alone."""
        return f"{self.package}/{self.executable}" if self.package else self.executable


class ResolvedComponent(NamedTuple):
    """One composable node, loaded into ``container`` (text as launch uses it)."""

    container: str
    package: str
    plugin: str
    name: str  # empty: the plugin's own default
    namespace: str  # empty: not given
    remaps: tuple[RemapRule, ...]
    parameters: Mapping[str, ParameterValue]
    extra_arguments: Mapping[str, ParameterValue]
    location: SourceLocation
    on_event: str | None = None
    unknown_parameters: tuple[UnknownParameters, ...] = ()

    @property
    def program(self) -> str:
        """Return ``package/plugin``."""
        return f"{self.package}/{self.plugin}"

    @property
    def fqn(self) -> str:
        name = self.name or UNSPECIFIED_NODE_NAME
        return f"{self.namespace.rstrip('/')}/{name}"


class LauncherCall(NamedTuple):
    """A ROS service that the launcher itself must call: loading a component, changing a state."""

    service: str  # final name as launch uses it
    type: str
    location: SourceLocation


class Unforeseeable(NamedTuple):
    """An action that only exists once a callback has run; a dry run cannot know it."""

    what: str
    location: SourceLocation


class Reaction(NamedTuple):
    """A reaction of the launch itself, whatever it starts: an event handler or a timer.

    ``ends_with``: the process at whose end it ends the launch, where that is all it does (``on_exit="shutdown"``).
    """

    what: str
    location: SourceLocation
    ends_with: str | None = None


class Evaluation(NamedTuple):
    """Everything a launch file starts, in launch order: first what the visit starts, then what events start."""

    processes: tuple[ResolvedProcess, ...]
    components: tuple[ResolvedComponent, ...]
    launcher_calls: tuple[LauncherCall, ...] = ()
    unforeseeable: tuple[Unforeseeable, ...] = ()
    warnings: tuple[Diagnostic, ...] = ()
    release: Release = release_of(DEFAULT)  # whose rules were followed
    reactions: tuple[Reaction, ...] = ()
    uncertain: tuple[Since, ...] = ()  # what was asked of the release and hangs on versions that are assumed

    @property
    def distro(self) -> str:
        """Return the name of the distribution whose rules were followed."""
        return self.release.distro.value
