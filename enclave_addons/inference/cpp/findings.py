"""What a run found: nodes with their endpoints and parameters, gaps, places that are dead for a reason."""

from __future__ import annotations

from dataclasses import dataclass, field

from enclave_addons.inference.cpp.engine.values import BOTTOM, Text, Value, join
from enclave_common.source_location import SourceLocation
from nodl.dependence import ALWAYS, When
from nodl.node_interface import EndpointKind


@dataclass(frozen=True)
class Follows:
    """A name that a library makes of the final name of another topic, as remapped: ``how`` is ``remapped`` (``ending``
    stands behind it) or ``camera_info``."""

    how: str
    topic: Text
    ending: str = ""


@dataclass(frozen=True)
class PossibleEndpoint:
    """An interface made at ``source``; ``follows`` where its name derives from another topic, ``when``: in which
    releases a library makes it."""

    kind: EndpointKind
    name: Text
    type: str
    source: SourceLocation
    exact: bool = True
    follows: Follows | None = None
    when: When = ALWAYS


@dataclass(eq=False)
class AllocatedNode:
    """A node under construction. ``description``: the class of a library that makes it for itself;
    ``of_process``: it is made without the options that a container gives.
    ``parameter_services``: they, or its parameter events, are not certainly switched off."""

    source: SourceLocation
    lifecycle: bool
    parameters: dict[str, Value] = field(default_factory=dict)
    overrides: dict[str, Value] = field(default_factory=dict)
    set_values: dict[str, Value] = field(default_factory=dict)  # what the program gives parameters later
    names: Value = BOTTOM
    namespaces: Value = BOTTOM
    endpoints: dict[PossibleEndpoint, None] = field(default_factory=dict)
    unconditional: set[PossibleEndpoint] = field(default_factory=set)
    gaps: dict[tuple[SourceLocation, str], None] = field(default_factory=dict)
    arguments: list[tuple[str | None, ...]] = field(default_factory=list)
    use_global_arguments: bool = True
    of_process: bool = False
    statistics: bool = False  # node options ask for topic statistics of its subscriptions
    parameter_services: bool = False
    description: str = ""

    def declare(self, name: str, default: Value) -> None:
        self.parameters[name] = join(self.parameters.get(name, BOTTOM), default)

    def default(self, name: str) -> Value:
        """Return what the program gives for the parameter itself: in its node options, else where it declares it."""
        given: Value = self.overrides.get(name) or self.parameters.get(name, BOTTOM)
        return given

    def gap(self, source: SourceLocation, why: str) -> None:
        self.gaps.setdefault((source, why))
