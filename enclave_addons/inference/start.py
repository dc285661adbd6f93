"""What a launch decides about the nodes of one program that it starts, as inference may ask, and the answer. Pure."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import NamedTuple, Protocol

from nodl.name_template import UnknownPart
from nodl.node_interface import Gap, NodeInterface

Progress = Callable[[int, int], None]
"""Called with how many programs of how many are read."""


class LaunchKey(NamedTuple):
    """Under which name launch starts a program."""

    package: str | None = None
    executable: str | None = None
    plugin: str | None = None


class LaunchedNode(NamedTuple):
    """What one launch makes of a node: the parameters that it sets, final name and namespace."""

    parameters: Mapping[str, object]
    name: str | None
    namespace: str | None


class ProgramLaunch(NamedTuple):
    """One launch of a program: its nodes, by the names in the source, its variables and its command line.

    ``inputs``: by name (``--fps``, ``$ROBOT``), ``None`` for one that has its default; any other stays open.
    ``words``: what stands behind the executable; ``None`` if that is not known.
    """

    nodes: Mapping[str, LaunchedNode] = MappingProxyType({})
    inputs: Mapping[str, str | None] = MappingProxyType({})
    words: tuple[str, ...] | None = None


NO_LAUNCH = ProgramLaunch()


class Start(Protocol):
    """Nodes are told by the name that the source gives them; ``None`` for one whose name is not known."""

    def parameters(self, node: str | None) -> Mapping[str, object]:
        """Return what launch sets for that node."""
        ...

    def final_name(self, node: str | None) -> tuple[str | None, str | None]:
        """Name and namespace under the rules of the launch."""
        ...

    def inputs(self, names: Iterable[str]) -> Mapping[str, str | None]:
        """Return what launch gives options and variables (see ``ProgramLaunch``)."""
        ...

    def words(self) -> tuple[str, ...] | None:
        """Return the words behind the executable; ``None`` if they are not known."""
        ...


class InferredProgram(NamedTuple):
    """The nodes of a program, with its gaps; ``why`` there are none.

    ``asks_launch``: with the parameters of a launch more may be known. ``lost``: the net's gaps, also in the nodes.
    ``inputs``: the options and variables that it asks for.
    """

    interfaces: tuple[NodeInterface, ...]
    why: str = ""
    asks_launch: bool = False
    lost: tuple[Gap, ...] = ()
    inputs: tuple[str, ...] = ()

    @property
    def open_places(self) -> int:
        """Count what is not known: gaps, and names that are not known in full."""
        gaps = sum(len(node.gaps) for node in self.interfaces)
        names = (each.name for node in self.interfaces for each in node.endpoints)
        return gaps + sum(any(isinstance(part, UnknownPart) for part in name.parts) for name in names)
