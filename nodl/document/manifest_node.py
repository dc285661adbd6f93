"""One node as one document describes it: what the flow needs, and what only conversion needs."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from enclave_launch.boundary.light import NamedTuple
from nodl.node_interface import NodeInterface


class ManifestNode(NamedTuple):
    """``version`` of NoDL (1 or 2). ``parameter_types``: declared parameters with the type as written.

    ``explicit_executable``: the document itself says which executable or plugin runs the node (always in
    v1; in v2 only through our extension), rather than the name under which it was registered.
    ``included``: files that were merged in, to know what the description depends on.
    """

    interface: NodeInterface
    version: int
    parameter_types: Mapping[str, str] = MappingProxyType({})
    explicit_executable: bool = True
    included: tuple[str, ...] = ()
