"""Where the interfaces of a node come from: its manifest, else (unless forbidden) its source, else the library.

Takes a process or component that launch starts; gives ``Found`` or ``Missing`` with what to do next. Reads the
ament index, manifests, sources and documents of the library; next is the plan.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

from enclave_common.dependencies import installed
from enclave_launch.errors import ManifestError, translated
from enclave_launch.interfaces.library_access import LibraryAccess
from enclave_launch.interfaces.started_program import StartedProgram
from enclave_launch.options import ResolveOptions
from enclave_launch.plan import Found, InterfaceOrigin, Missing
from enclave_launch.process import Evaluation, ResolvedComponent, ResolvedProcess
from nodl.errors import NoDLError
from nodl.lookup import Lookup, ManifestLookup
from nodl.name_template import UnknownPart
from nodl.node_interface import ClientLibrary, Endpoint, NodeInterface
from nodl.source_ref import SourceRef

if TYPE_CHECKING:
    from nodl.infer.cpp.reach import SourcesInReach
    from nodl.infer.executable import InferredExecutable

SOURCE_VARIABLE = "SECURE_LAUNCH_SOURCE"
"""Folders with sources of compiled nodes, separated as in ``PATH``; after those that ``--source`` names."""

CONTAINER_PACKAGE = "rclcpp_components"
"""Its executables (``component_container``, ``_mt``, ``_isolated``) are containers and nothing else."""

_PLACES = 2  # named in a message
# rclcpp_components/src/component_manager.hpp, the constructor's default.
_CONTAINER_NODE_NAME = "ComponentManager"


class _Subject(NamedTuple):
    """What is asked for: an executable or a plugin of a package."""

    package: str | None
    executable: str | None = None
    plugin: str | None = None

    def __str__(self) -> str:
        return f"{self.package or '(no package)'}/{self.executable or self.plugin}"


class InterfaceFinder:
    """Answers for one launch, by the rules of ``distro``; what can be said without knowing the start is kept."""

    def __init__(
        self,
        prefixes: Sequence[str],
        options: ResolveOptions | None = None,
        distro: str = "rolling",
        launch: Evaluation | None = None,
    ) -> None:
        """``launch``: all that starts, for nodes that must know others. Raises ``UsageError`` for a folder of documents
        that is not there."""
        self._options = options or ResolveOptions()
        self._prefixes = prefixes
        self._distro = distro
        self._lookup = ManifestLookup(prefixes, self._options.manifests)
        self._library = LibraryAccess(prefixes, self._options, distro, launch)
        self._known: dict[_Subject, Found | Missing] = {}
        self._infers = self._options.infer and installed("nodl.infer")

    def __call__(
        self, started: ResolvedProcess | ResolvedComponent, container: ResolvedProcess | None = None
    ) -> Found | Missing:
        """``container``: that of a component. Raises ``ManifestError`` for manifests that are broken or contradict
        each other, ``LaunchFileError`` for a remap rule at which the process would end."""
        if isinstance(started, ResolvedProcess):
            subject = _Subject(started.package, executable=_executable_name(started))
        else:
            subject = _Subject(started.package, plugin=started.plugin)
        found = self._known.get(subject)
        if found is None:
            found, of_this_start = self._find(subject, StartedProgram(started, container, self._distro))
            if not of_this_start:
                self._known[subject] = found
        if isinstance(found, Missing) or not any(each.depends for each in found.interfaces):
            return found
        with translated(NoDLError, ManifestError):
            return found._replace(interfaces=self._library.complete(found.interfaces, started, container))

    def _find(self, subject: _Subject, started: StartedProgram) -> tuple[Found | Missing, bool]:
        """The answer, and whether it holds for this start alone."""
        with translated(NoDLError, ManifestError):
            manifest = self._lookup.find(
                subject.package or "", executable=subject.executable, plugin=subject.plugin
            )
            if manifest:
                lacks, of_this_start = self._lacks(subject, manifest, started)
                return Found(manifest.found, _origin(manifest), lacks=lacks), of_this_start
            if subject.package == CONTAINER_PACKAGE and subject.executable:
                return Found((_container(subject),)), False
            return self._without_manifest(subject, manifest, started)

    def _lacks(
        self, subject: _Subject, manifest: Lookup, started: StartedProgram
    ) -> tuple[tuple[Endpoint, ...], bool]:
        """What an installed manifest leaves out, where the sources of the compiled program are in reach."""
        if not self._infers or manifest.named or not self._sources.hold(subject.package):
            return (), False
        from nodl.infer.report.comparison import lacking  # an add-on: inference

        analysed = self._inferred(subject, started, compiled_only=True)
        if not analysed:
            return (), False
        return lacking(manifest.found, analysed.interfaces).endpoints, analysed.of_this_start

    def _without_manifest(
        self, subject: _Subject, manifest: Lookup, started: StartedProgram
    ) -> tuple[Found | Missing, bool]:
        """What the user recorded, else the analysis where it leaves nothing open, else the library, else what the
        analysis has."""
        name = subject.executable or subject.plugin or ""
        recorded = self._library.recorded(subject.package, name)
        if recorded:
            interfaces = tuple(hit.document.interface for hit in recorded)
            doubt = next((hit.doubt for hit in recorded if hit.doubt), "")
            return Found(interfaces, InterfaceOrigin.RECORDED, doubt), False
        searched = ["looked at " + _shortly(manifest.searched)]
        searched += [f"--nodl describes {', '.join(manifest.described)}"] if manifest.described else []
        analysed = self._inferred(subject, started)
        searched += [analysed.why] if analysed is not None and analysed.why else []
        if self._options.infer and not self._infers:
            searched.append("inference is not part of this installation")
        inferred = analysed.interfaces if analysed is not None else ()
        of_this_start = analysed is not None and analysed.of_this_start
        if inferred and all(map(_complete, inferred)):
            return Found(inferred, InterfaceOrigin.ANALYSIS), of_this_start
        hit = self._library.find(subject.package, name)
        if hit:
            return Found((hit.document.interface,), InterfaceOrigin.LIBRARY, hit.doubt), of_this_start
        if inferred:
            return Found(inferred, InterfaceOrigin.ANALYSIS), of_this_start
        if self._options.library:
            searched.append("the library has no document of it")
        return Missing(str(subject), "; ".join(searched)), of_this_start

    def _inferred(
        self, subject: _Subject, started: StartedProgram, *, compiled_only: bool = False
    ) -> InferredExecutable | None:
        if not self._infers or subject.package is None:
            return None
        from nodl.infer.executable import infer_executable  # an add-on: inference

        if self._options.progress is not None:
            self._options.progress(str(subject))
        return infer_executable(
            subject.package,
            executable=subject.executable,
            plugin=subject.plugin,
            prefixes=self._prefixes,
            sources=self._sources,
            start_of=started,
            compiled_only=compiled_only,
        )

    @cached_property
    def _sources(self) -> SourcesInReach:
        from nodl.infer.cpp.reach import SourcesInReach  # an add-on: inference

        named = [str(folder) for folder in self._options.source_folders]
        named += [folder for folder in os.environ.get(SOURCE_VARIABLE, "").split(os.pathsep) if folder]
        return SourcesInReach(self._prefixes, named)


def _shortly(places: Sequence[str]) -> str:
    """The first, which are the package's own, and how many more: each prefix of a workspace has some."""
    if len(places) <= _PLACES + 1:
        return ", ".join(places)
    return f"{', '.join(places[:_PLACES])} and {len(places) - _PLACES} more places"


def _origin(manifest: Lookup) -> InterfaceOrigin:
    """A manifest that was learnt says so itself, wherever it lies."""
    if any(each.runs for each in manifest.found):
        return InterfaceOrigin.RECORDED
    return InterfaceOrigin.NAMED if manifest.named else InterfaceOrigin.PACKAGE


def _complete(interface: NodeInterface) -> bool:
    """Whether an analysis answered everything: no gap, and no name that is unknown in part or empty."""
    return not interface.gaps and all(
        endpoint.name.parts
        and not any(part == "" or isinstance(part, UnknownPart) for part in endpoint.name.parts)
        for endpoint in interface.endpoints
    )


def _executable_name(process: ResolvedProcess) -> str:
    """Without a package launch takes ``exec`` as a path: manifests speak of its last part."""
    return process.executable if process.package else process.executable.rpartition("/")[2]


def _container(subject: _Subject) -> NodeInterface:
    return NodeInterface(
        package=subject.package,
        executable=subject.executable,
        plugin=None,
        name=_CONTAINER_NODE_NAME,
        namespace=None,
        endpoints=(),
        source=SourceRef("rclcpp_components, a container"),
        library=ClientLibrary.RCLCPP,
        parameter_services=False,  # component_manager.hpp: nor the publisher of parameter events
    )
