"""Launch files met by the argument scan: each is loaded and summed up once per evaluation.

What the scan loaded for looking only is handed to the first include that visits the same file, so that an
XML or YAML file is built once. Python files run again then, as upstream.
"""

from __future__ import annotations

import os
from collections.abc import Callable

from enclave_launch.boundary.light import TYPE_CHECKING
from enclave_launch.host.environment import environment_snapshot

if TYPE_CHECKING:
    from enclave_launch.description.argument_scan import DeclaredArguments
    from enclave_launch.description.launch_description import LaunchDescription
    from enclave_launch.description.sources import LaunchDescriptionSource

Key = tuple[type, str]


class CyclicIncludeError(RuntimeError):
    """A launch file that includes itself, directly or through others, without end."""


class LoadCache:
    """Valid while the environment stays the same: paths and Python files may depend on it."""

    def __init__(self) -> None:
        self._seen: dict[str, str] | None = None
        self._summaries: dict[Key, DeclaredArguments | None] = {}
        self._unvisited: dict[Key, LaunchDescription] = {}
        self._in_progress: list[Key] = []

    def summary(
        self, source: LaunchDescriptionSource, summarize: Callable[[LaunchDescription], DeclaredArguments]
    ) -> DeclaredArguments | None:
        """What ``source`` declares; ``None`` when it cannot be loaded without a context.

        Raises ``CyclicIncludeError`` where upstream runs out of stack.
        """
        self._drop_outdated()
        location = source.location_without_context()
        if location is None:
            description = source.try_get_launch_description_without_context()
            return None if description is None else summarize(description)
        key = (type(source), location)
        if key not in self._summaries:
            self._summaries[key] = self._summarize(key, source, summarize)
        return self._summaries[key]

    def _summarize(
        self,
        key: Key,
        source: LaunchDescriptionSource,
        summarize: Callable[[LaunchDescription], DeclaredArguments],
    ) -> DeclaredArguments | None:
        if key in self._in_progress:
            cycle = [location for _, location in [*self._in_progress[self._in_progress.index(key) :], key]]
            raise CyclicIncludeError("launch files include each other without end: " + " -> ".join(cycle))
        self._in_progress.append(key)
        try:
            description = source.try_get_launch_description_without_context()
            if description is None:
                return None
            summary = summarize(description)
        finally:
            self._in_progress.pop()
        if not _runs_python(key[1]):
            description.argument_summary = summary
            self._unvisited[key] = description
        return summary

    def take(self, source: LaunchDescriptionSource, location: str) -> LaunchDescription | None:
        """A description of the file at ``location`` that was built and not visited yet, to be visited now."""
        self._drop_outdated()
        return self._unvisited.pop((type(source), location), None)

    def _drop_outdated(self) -> None:
        now = environment_snapshot()
        if now is not self._seen:
            self._seen = now
            self._summaries.clear()
            self._unvisited.clear()


def _runs_python(location: str) -> bool:
    return os.path.splitext(location)[1] == ".py"
