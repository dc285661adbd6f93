"""Describe the programs of a launch from their sources (``enclave_launch.interfaces.describers``)."""

from __future__ import annotations

from collections.abc import Sequence

from enclave_addons.inference.executable import InferredExecutable, infer_executable, infer_plugin
from enclave_addons.inference.reach import SourcesInReach
from enclave_addons.inference.source_digest import source_digest
from enclave_addons.inference.start import Start
from nodl.node_interface import NodeInterface


class SourceInference:
    """The sources in reach of one launch. They are read when a first program asks for them."""

    def __init__(self, prefixes: Sequence[str], folders: Sequence[str]) -> None:
        self._prefixes = prefixes
        self._sources = SourcesInReach(prefixes, folders)

    def hold(self, package: str | None) -> bool:
        """Return True if the sources of ``package`` are in reach."""
        return self._sources.hold(package)

    def infer(
        self,
        package: str,
        executable: str | None,
        plugin: str | None,
        started: Start,
        *,
        compiled_only: bool,
    ) -> InferredExecutable:
        """Infer the nodes of an executable or component; ``compiled_only`` leaves Python programs out."""
        return infer_executable(
            package,
            executable=executable,
            plugin=plugin,
            prefixes=self._prefixes,
            sources=self._sources,
            start_of=started,
            compiled_only=compiled_only,
        )

    def digest(self, interfaces: Sequence[NodeInterface]) -> str:
        """Return the digest of the sources that these nodes of one program come from."""
        return source_digest(interfaces)

    def infer_plugin(self, plugin_class: str, instance: str, start: Start) -> tuple[NodeInterface, ...]:
        """Infer a plugin that a node loads, and the nodes that the plugin makes."""
        return infer_plugin(plugin_class, instance, self._sources, start)
