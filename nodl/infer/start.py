"""What a launch decides about the nodes of one program that it starts, as inference may ask. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple, Protocol


class LaunchKey(NamedTuple):
    """Under which name launch starts a program."""

    package: str | None = None
    executable: str | None = None
    plugin: str | None = None


class Start(Protocol):
    """Nodes are told by the name that the source gives them; ``None`` for one whose name is not known."""

    def parameters(self, node: str | None) -> Mapping[str, object]:
        """Return what launch sets for that node."""
        ...

    def final_name(self, node: str | None) -> tuple[str | None, str | None]:
        """Name and namespace under the rules of the launch."""
        ...
