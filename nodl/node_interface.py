"""The interfaces of one node, before any launch file renames it; every source of knowledge ends in these values."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

from enclave_common.source_location import SourceLocation
from nodl.endpoint_kind import EndpointKind as EndpointKind
from nodl.name_template import NameTemplate

if TYPE_CHECKING:
    from nodl.dependence import Dependence


class Certainty(str, Enum):
    """The degree to which a name can be trusted."""

    __str__ = str.__str__

    EXACT = "exact"  # a manifest says so, or the source has one constant
    FROM_DEFAULT = "from default"  # a parameter's default, used because the launch file sets no value
    PATTERN = "pattern"  # only a part of the name is known
    UNKNOWN = "unknown"


QosPolicies = tuple[tuple[str, "str | int"], ...]
"""Policies of quality of service by NoDL v2's names, sorted; what is not known is left out."""


class Endpoint(NamedTuple):
    """One publisher, subscription, server or client, under the name the node's code uses.

    ``name`` is absolute (``/x``), relative (``x``) or private (``~/x``); nothing is expanded yet.
    ``type`` is a ROS interface type such as ``std_msgs/msg/String``; empty when not known.
    """

    kind: EndpointKind
    name: NameTemplate
    type: str
    source: SourceLocation
    certainty: Certainty = Certainty.EXACT
    written: str = ""  # the text in the source where a reader took it for another name, else empty
    introspected: bool = False  # a service whose calls are published below its name (service introspection)
    note: str = ""  # what else a reader should know: the parameter or plugin that the name comes from
    qos: QosPolicies = ()  # what the description fixes
    readings: tuple[NameTemplate, ...] = ()  # what a recorded name may be as well, until another run decides


class Gap(NamedTuple):
    """Something about the node that could not be found out, and why. Never silently dropped."""

    source: SourceLocation
    why: str


class ClientLibrary(str, Enum):
    """The ROS client library of a node; decides its built-in interfaces."""

    __str__ = str.__str__

    RCLCPP = "rclcpp"
    RCLPY = "rclpy"
    UNKNOWN = "unknown"


RANDOM_ENDING = "_*"
"""Of a node's own name whose end the program makes up at each start; launch can give it another."""


class NodeInterface(NamedTuple):
    """One node of an executable or component.

    ``name`` and ``namespace`` are the program's own defaults (what applies when launch gives none);
    ``None`` when unknown. ``executable`` or ``plugin`` is the key under which launch starts the node.
    ``own_rules``: remap rules in the options with which a program makes a further node beside its main one; such a
    node obeys them before the process's, and the process's even in a container; ``own_parameters`` stand in the
    same options. ``global_arguments``: the node listens to the arguments of its process, so that a launch can rename
    and remap it and give it parameters; ``None``: not known. ``parameter_services``: the program does not switch them
    off. ``depends``: what varies with its start. ``runs``: of a recorded node, how many it was seen in; ``incomplete``:
    why they may not have shown all of it. ``parameters_complete``: its description says that ``parameters`` lists all.
    ``unused_configuration``: what the program does not take of the files that it is given, and why. ``source_digest``:
    of a manifest that inference wrote, the digest of its source. ``parameter_types``: parameters that are declared with
    exactly this type, as NoDL 2 names it. ``of_process``: the program makes the node without the options that a
    container gives to a component, so that it obeys the arguments of the process even there (ros2/rclcpp#3003).
    """

    package: str | None
    executable: str | None
    plugin: str | None
    name: str | None
    namespace: str | None
    endpoints: tuple[Endpoint, ...]
    source: SourceLocation
    library: ClientLibrary = ClientLibrary.UNKNOWN
    lifecycle: bool = False
    parameters: tuple[str, ...] = ()
    gaps: tuple[Gap, ...] = ()
    own_rules: tuple[str, ...] = ()
    own_parameters: tuple[tuple[str, object], ...] = ()
    global_arguments: bool | None = True
    parameter_services: bool = True
    depends: Dependence | None = None
    runs: int = 0
    incomplete: tuple[str, ...] = ()
    parameters_complete: bool = False
    unused_configuration: tuple[str, ...] = ()
    source_digest: str = ""
    parameter_types: tuple[tuple[str, str], ...] = ()
    of_process: bool = False


class ManifestNode(NamedTuple):
    """One node as one document describes it, in ``version`` 1 or 2 of NoDL. ``parameter_types``: declared parameters
    with the type as written.

    ``explicit_executable``: the document itself says which executable or plugin runs the node (always in
    v1; in v2 only through our extension), rather than the name under which it was registered.
    ``included``: files that were merged in, to know what the description depends on.
    """

    interface: NodeInterface
    version: int
    parameter_types: Mapping[str, str] = MappingProxyType({})
    explicit_executable: bool = True
    included: tuple[str, ...] = ()
