"""What the analysis finds while it runs: nodes, their endpoints and parameters, and what stayed unknown.

Everything here only grows, in whatever order branches and loops are analysed; ``results`` turns it into
``NodeInterface`` values at the end.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from enclave_addons.inference.values import BOTTOM, ContentCells, Instance, Unknown, Value, join
from nodl.node_interface import EndpointKind, QosPolicies
from nodl.source_ref import SourceRef


class FoundEndpoint(NamedTuple):
    """One possible name (a ``str``, a ``Text`` or an ``Unknown``) of an endpoint, with where it is made."""

    kind: EndpointKind
    name: object
    type: str
    source: SourceRef
    qos: QosPolicies = ()


class DeclaredParameter(NamedTuple):
    """The cell of a node for a parameter that is declared; without a name, for some whose names are not known.

    It holds the type of which every value is certainly taken; an empty text if there is none.
    """

    name: str


class NodeRecord:
    """A node under its allocation site."""

    def __init__(self, source: SourceRef) -> None:
        self.source = source
        self.lifecycle = False
        self.names: Value = BOTTOM
        self.namespaces: Value = BOTTOM
        self.created = False  # Node.__init__ was seen
        self.communication_interface = True
        self.endpoints: dict[FoundEndpoint, None] = {}
        self.parameters: dict[str, Value] = {}
        self.assigned: dict[str, Value] = {}  # set by the program itself
        self.arguments: Value = BOTTOM  # cli_args of the node
        self.use_global_arguments: Value = (True,)
        self.allow_undeclared: Value = (False,)
        self.declares_given: Value = (False,)  # automatically_declare_parameters_from_overrides
        self.gaps: dict[tuple[SourceRef, str], None] = {}
        # Parameters that the program sets itself, and which there are (``DeclaredParameter``).
        self.cells = ContentCells()

    def __repr__(self) -> str:
        return f"NodeRecord({self.source})"

    def add_endpoint(
        self, kind: EndpointKind, name: object, type_name: str, source: SourceRef, qos: QosPolicies = ()
    ) -> None:
        self.endpoints.setdefault(FoundEndpoint(kind, name, type_name, source, qos))

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

    def default(self, name: str) -> Value:
        return self._defaults.get(name, BOTTOM)

    @property
    def names(self) -> Iterable[str]:
        return self._defaults.keys()


class Findings:
    """All nodes and gaps of one run."""

    def __init__(self) -> None:
        self.nodes: dict[NodeRecord, None] = {}
        self.node_of: dict[Instance, NodeRecord] = {}
        self.gaps: dict[tuple[SourceRef, str], None] = {}
        self.homeless: NodeRecord | None = None
        self.made = 0  # how many nodes and interfaces were found so far
        self.global_arguments: Value = BOTTOM  # a list handed to rclpy.init(args=...)

    @property
    def is_open(self) -> bool:
        """Return True if there is a gap already, or a name of which nothing is known."""
        unknown = any(type(each.name) is Unknown for record in self.nodes for each in record.endpoints)
        return unknown or bool(self.gaps) or any(record.gaps for record in self.nodes)

    def add_node(self, record: NodeRecord) -> NodeRecord:
        self.nodes.setdefault(record)
        self.made += 1
        return record

    def gap(self, source: SourceRef, why: str) -> None:
        self.gaps.setdefault((source, why))

    def unknown_node(self, source: SourceRef) -> NodeRecord:
        """Return the node of endpoints that are created on something the analysis could not identify."""
        if self.homeless is None:
            self.homeless = self.add_node(NodeRecord(source))
        return self.homeless
