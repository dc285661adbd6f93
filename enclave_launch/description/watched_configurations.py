"""Launch configurations that note which names somebody looked at: an argument that nobody looks at is a slip."""

from __future__ import annotations

from enclave_launch.boundary.light import Any


class WatchedConfigurations(dict[str, Any]):
    """``looked_at`` gets each name that is read or asked for, found or not; who goes through all has seen all."""

    def __init__(self, looked_at: set[str]) -> None:
        super().__init__()
        self._looked_at = looked_at

    def __contains__(self, name: object) -> bool:
        if isinstance(name, str):
            self._looked_at.add(name)
        return super().__contains__(name)

    def __getitem__(self, name: str) -> Any:
        self._looked_at.add(name)
        return super().__getitem__(name)

    def get(self, name: str, default: Any = None) -> Any:
        self._looked_at.add(name)
        return super().get(name, default)

    def keys(self) -> Any:
        self._looked_at.update(dict(self))
        return super().keys()

    def values(self) -> Any:
        self._looked_at.update(dict(self))
        return super().values()

    def items(self) -> Any:
        self._looked_at.update(dict(self))
        return super().items()

    def copy(self) -> WatchedConfigurations:
        same = WatchedConfigurations(self._looked_at)
        same.update(self)
        return same
