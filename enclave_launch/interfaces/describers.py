"""Describe nodes by more than manifests: what the look-up asks of the add-ons library and inference.

Each add-on brings a class as an entry point of ``enclave_launch.describer``. Performs no I/O itself.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from enclave_common.add_ons import add_on
from enclave_launch.interfaces.situation import StartedPlugin, StartedProgram
from enclave_launch.options import ResolveOptions
from enclave_launch.plan import Found
from enclave_launch.process import Evaluation, ResolvedComponent, ResolvedProcess
from nodl.node_interface import Gap, NodeInterface

GROUP = "enclave_launch.describer"

DescribePlugin = Callable[[str, str, StartedPlugin], tuple[NodeInterface, ...]]
"""Describe a plugin from its sources, by its class and the instance's name, with the nodes that it makes."""


class LibraryDescriber(Protocol):
    """The documents of known packages, for one launch."""

    def find(self, package: str | None, name: str) -> Found | None:
        """Return the document of a program. Raises ``InvalidNoDLError`` for a broken one."""

    def recorded(self, package: str | None, name: str) -> Found | None:
        """Return the documents that the user recorded of a program. Raises as ``find``."""

    def complete(
        self,
        interfaces: Sequence[NodeInterface],
        started: ResolvedProcess | ResolvedComponent,
        container: ResolvedProcess | None,
    ) -> tuple[NodeInterface, ...]:
        """Return the nodes of one start, with those that they bring along.

        Raises ``InvalidNoDLError`` and, for a remap rule at which the process would end, ``LaunchFileError``.
        """


class InferredNodes(Protocol):
    """The nodes of a program by its sources."""

    @property
    def interfaces(self) -> tuple[NodeInterface, ...]:
        """Return the nodes, none if nothing could be inferred."""

    @property
    def why(self) -> str:
        """Return the reason why there are none."""

    @property
    def of_this_start(self) -> bool:
        """Return True if another start may have other interfaces."""

    @property
    def not_made(self) -> bool:
        """Return True if no build in reach makes this program."""


class SourceDescriber(Protocol):
    """The sources in reach of one launch."""

    def hold(self, package: str | None) -> bool:
        """Return True if the sources of ``package`` are in reach."""

    def infer(
        self,
        package: str,
        executable: str | None,
        plugin: str | None,
        started: StartedProgram,
        *,
        compiled_only: bool,
    ) -> InferredNodes:
        """Infer the nodes of an executable or component; ``compiled_only`` leaves Python programs out."""

    def digest(self, interfaces: Sequence[NodeInterface]) -> str:
        """Return the digest of the sources that these nodes of one program come from."""

    def infer_plugin(
        self, plugin_class: str, instance: str, start: StartedPlugin
    ) -> tuple[NodeInterface, ...]:
        """Infer a plugin that a node loads, and the nodes that the plugin makes."""


class NoLibrary:
    """Answers without the library: no documents, and a gap where a manifest depends on its start."""

    def find(self, package: str | None, name: str) -> Found | None:
        """Return None."""
        return None

    def recorded(self, package: str | None, name: str) -> Found | None:
        """Return None."""
        return None

    def complete(
        self,
        interfaces: Sequence[NodeInterface],
        started: ResolvedProcess | ResolvedComponent,
        container: ResolvedProcess | None,
    ) -> tuple[NodeInterface, ...]:
        """Return ``interfaces``, each with a gap if it depends on its start."""
        return tuple(map(_with_gap, interfaces))


def _with_gap(interface: NodeInterface) -> NodeInterface:
    if interface.depends is None:
        return interface
    why = "the manifest depends on the start of the node, which the add-on library reads; it is not installed"
    return interface._replace(depends=None, gaps=(*interface.gaps, Gap(interface.source, why)))


def library_describer(
    prefixes: Sequence[str],
    options: ResolveOptions,
    distro: str,
    launch: Evaluation | None,
    describe_plugin: DescribePlugin,
) -> LibraryDescriber:
    """Return the library for one launch.

    Raises:
        UsageError: A folder of documents that the user names is not there.
    """
    found = add_on(GROUP, "library")
    if found is None:
        return NoLibrary()
    library: LibraryDescriber = found(prefixes, options, distro, launch, describe_plugin)
    return library


def source_describer(prefixes: Sequence[str], folders: Sequence[str]) -> SourceDescriber | None:
    """Return what infers from sources, None if inference is not installed."""
    found = add_on(GROUP, "inference")
    if found is None:
        return None
    sources: SourceDescriber = found(prefixes, folders)
    return sources
