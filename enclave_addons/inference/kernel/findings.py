"""What a run finds: nodes with their interfaces and parameters, and what stayed unknown, grouped by its cause."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

from enclave_addons.inference.kernel.values import BOTTOM, Value, join
from enclave_common.source_location import SourceLocation
from nodl.node_interface import EndpointKind, Gap, QosPolicies

MAX_CAUSES = 10
SHOWN_PLACES = 3


class FoundEndpoint(NamedTuple):
    """One possible name (a text or an ``Unknown``) of an interface."""

    kind: EndpointKind
    name: object
    type: str
    source: SourceLocation
    qos: QosPolicies = ()
    introspected: bool = False


class Gaps:
    """What stayed unknown: each cause with the places where it was met."""

    def __init__(self) -> None:
        self._places: dict[str, dict[SourceLocation, None]] = {}

    def __bool__(self) -> bool:
        return bool(self._places)

    def add(self, source: SourceLocation, why: str) -> None:
        self._places.setdefault(why, {}).setdefault(source)

    def include(self, others: Iterable[Gap]) -> None:
        for gap in others:
            self.add(gap.source, gap.why)

    def listed(self, whole: bool = True) -> list[Gap]:
        """Return one gap for each cause; of a whole program that has too many, a single one."""
        if whole and len(self._places) > MAX_CAUSES:
            places = [place for found in self._places.values() for place in found]
            why = f"this program is not followed: {len(places)} places, first: {next(iter(self._places))}"
            return [Gap(places[0], f"{why}; give the node a manifest, or record it")]
        return [Gap(next(iter(places)), _counted(why, list(places))) for why, places in self._places.items()]


def _counted(why: str, places: list[SourceLocation]) -> str:
    if len(places) == 1:
        return why
    others = ", ".join(f"{each.file.rpartition('/')[2]}:{each.line}" for each in places[:SHOWN_PLACES])
    return f"{why} ({len(places)} places: {others}{', ...' if len(places) > SHOWN_PLACES else ''})"


@dataclass(eq=False)
class FoundNode:
    """A node, by the object that the program has of it.

    Attributes:
        created: The constructor of the client library's node was seen.
        words: Arguments that the program hands to the node; ``None`` among them if they are not known.
        typed: Parameters of ``defaults`` that can only have the type of their default.
        hears_launch: Whether the node obeys the arguments of its process.
    """

    source: SourceLocation
    created: bool = False
    lifecycle: bool = False
    names: Value = BOTTOM
    namespaces: Value = BOTTOM
    endpoints: dict[FoundEndpoint, None] = field(default_factory=dict)
    defaults: dict[str, Value] = field(default_factory=dict)
    typed: dict[str, bool] = field(default_factory=dict)
    cells: dict[object, Value] = field(default_factory=dict)  # parameters that the program sets itself
    set_in_code: dict[str, None] = field(default_factory=dict)
    undeclared_allowed: bool = False
    declares_given: bool = False  # parameters that launch sets are declared without more
    words: list[tuple[str, ...] | None] = field(default_factory=list)
    hears_launch: Value = (True,)
    gaps: Gaps = field(default_factory=Gaps)

    def declare(self, name: str, default: Value) -> None:
        self.defaults[name] = join(self.defaults.get(name, BOTTOM), default)

    def default(self, name: str) -> Value:
        return self.defaults.get(name, BOTTOM)


class Options:
    """The command line options and environment variables that a program asks for, with their defaults."""

    def __init__(self) -> None:
        self.defaults: dict[str, Value] = {}

    def declare(self, name: str, default: Value) -> None:
        self.defaults[name] = join(self.defaults.get(name, BOTTOM), default)

    def default(self, name: str) -> Value:
        return self.defaults.get(name, BOTTOM)


class Findings:
    """All nodes and gaps of one run."""

    def __init__(self) -> None:
        self.nodes: dict[object, FoundNode] = {}
        self.options = Options()
        self.gaps = Gaps()
        self.global_words: list[tuple[str, ...] | None] = []  # handed to the client library in code

    def node_of(self, identity: object, source: SourceLocation) -> FoundNode:
        """Return the node that ``identity`` stands for, new where there was none."""
        return self.nodes.setdefault(identity, FoundNode(source))
