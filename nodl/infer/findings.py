"""What the analysis finds while it runs: nodes, their endpoints and parameters, and what stayed unknown.

Everything here only grows, in whatever order branches and loops are analysed; ``results`` turns it into
``NodeInterface`` values at the end.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from nodl.infer.values import BOTTOM, FieldCells, Unknown, Value, join
from nodl.node_interface import EndpointKind, QosPolicies
from nodl.source_ref import SourceRef


@dataclass(frozen=True, slots=True)
class FoundEndpoint:
    """One possible name (a ``str``, a ``Text`` or an ``Unknown``) of an endpoint, with where it is made."""

    kind: EndpointKind
    name: object
    type: str
    source: SourceRef
    qos: QosPolicies = ()


@dataclass(eq=False)
class NodeRecord:
    """A node under its allocation site."""

    source: SourceRef
    names: Value = BOTTOM
    namespaces: Value = BOTTOM
    lifecycle: bool = False
    created: bool = False  # Node.__init__ was seen
    communication_interface: bool = True
    endpoints: dict[FoundEndpoint, None] = field(default_factory=dict)
    parameters: dict[str, Value] = field(default_factory=dict)
    assigned: dict[str, Value] = field(default_factory=dict)  # set by the program itself
    arguments: Value = BOTTOM  # cli_args of the node
    use_global_arguments: Value = (True,)
    gaps: dict[tuple[SourceRef, str], None] = field(default_factory=dict)
    class_key: object = None
    cells: FieldCells = field(default_factory=FieldCells)  # parameters that the program sets itself

    def add_endpoint(self, endpoint: FoundEndpoint) -> None:
        self.endpoints.setdefault(endpoint)

    def declare(self, name: str, default: Value) -> None:
        self.parameters[name] = join(self.parameters.get(name, BOTTOM), default)

    def default(self, name: str) -> Value:
        return self.parameters.get(name, BOTTOM)


class OptionDefaults:
    """Who knows the default of a command line option or an environment variable: the call that names it."""

    def __init__(self) -> None:
        self._defaults: dict[str, Value] = {}

    def declare(self, name: str, default: Value) -> None:
        self._defaults[name] = join(self._defaults.get(name, BOTTOM), default)

    def replace(self, name: str, default: Value) -> None:
        self._defaults[name] = default

    def default(self, name: str) -> Value:
        return self._defaults.get(name, BOTTOM)


class Findings:
    """All nodes and gaps of one run."""

    def __init__(self) -> None:
        self.nodes: dict[NodeRecord, None] = {}
        self.gaps: dict[tuple[SourceRef, str], None] = {}
        self.files: dict[str, None] = {}  # data that was read, on which all of this depends
        self.by_path = False  # of several runs, one for each outcome of undecided tests
        self.homeless: NodeRecord | None = None
        self.global_arguments: Value = BOTTOM  # a list handed to rclpy.init(args=...)

    def count(self) -> int:
        """How much was found; it never shrinks."""
        return len(self.nodes) + len(self.gaps) + sum(len(r.endpoints) + len(r.gaps) for r in self.nodes)

    @property
    def is_open(self) -> bool:
        """Whether there is a gap already, or a name of which nothing is known."""
        unknown = any(type(each.name) is Unknown for record in self.nodes for each in record.endpoints)
        return unknown or bool(self.gaps) or any(record.gaps for record in self.nodes)

    def add_node(self, record: NodeRecord) -> NodeRecord:
        self.nodes.setdefault(record)
        return record

    def gap(self, source: SourceRef, why: str) -> None:
        self.gaps.setdefault((source, why))

    def unknown_node(self, source: SourceRef) -> NodeRecord:
        """The node of endpoints that are created on something the analysis could not identify."""
        if self.homeless is None:
            self.homeless = self.add_node(NodeRecord(source))
        return self.homeless
