"""All that is known of a node: its manifest, records, its source and the library.

Takes a process or component that launch starts; ``descriptions`` makes one answer of what is found. Reads the ament
index, manifests, sources and documents of the library; next is the plan.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

from enclave_common.source_location import SourceLocation
from enclave_common.words import counted
from enclave_launch.errors import ManifestError, UsageError, translated
from enclave_launch.interfaces.describers import (
    InferredNodes,
    SourceDescriber,
    library_describer,
    source_describer,
)
from enclave_launch.interfaces.descriptions import ProgramStart, meeting
from enclave_launch.interfaces.situation import StartedPlugin, StartedProgram
from enclave_launch.options import ResolveOptions
from enclave_launch.plan import Found, InterfaceOrigin, Missing
from enclave_launch.policy.node_permissions import UNSEEN
from enclave_launch.policy.running_node import UnknownNodeName
from enclave_launch.process import Evaluation, ResolvedComponent, ResolvedProcess
from nodl.errors import ConflictingNoDLError, NoDLError, NoManifestError
from nodl.lookup import Lookup, ManifestLookup
from nodl.node_interface import ClientLibrary, NodeInterface

SOURCE_VARIABLE = "SECURE_LAUNCH_SOURCE"
"""Folders with sources of compiled nodes, separated as in ``PATH``; after those that ``--source`` names."""

CONTAINER_PACKAGE = "rclcpp_components"
"""Its executables (``component_container``, ``_mt``, ``_isolated``) are containers and nothing else."""

# rclcpp_components/src/component_manager.hpp, the constructor's default.
_CONTAINER_NODE_NAME = "ComponentManager"


class _Subject(NamedTuple):
    """The subject of a look-up: an executable or a plugin of a package."""

    package: str | None
    executable: str | None = None
    plugin: str | None = None

    def __str__(self) -> str:
        return f"{self.package or '(no package)'}/{self.executable or self.plugin}"


class _Known(NamedTuple):
    """The descriptions of a program; ``of_this_start``: another start of it needs another lookup. ``not_made``: there
    is none, since no build in reach makes it."""

    descriptions: tuple[Found, ...]
    searched: tuple[str, ...] = ()
    of_this_start: bool = False
    not_made: bool = False


class InterfaceFinder:
    """Answers for one launch, by the rules of ``distro``; what can be said without knowing the start is cached."""

    def __init__(
        self,
        prefixes: Sequence[str],
        options: ResolveOptions | None = None,
        distro: str = "rolling",
        launch: Evaluation | None = None,
    ) -> None:
        """Prepare to answer for one launch; ``launch`` is all that starts, for nodes that must know others.

        Raises ``UsageError`` for a folder of documents that is not there, or has no manifest.
        """
        self._options = options or ResolveOptions()
        self._prefixes = prefixes
        self._distro = distro
        with translated(NoManifestError, UsageError):
            self._lookup = ManifestLookup(prefixes, self._options.manifests)
        self._library = library_describer(prefixes, self._options, distro, launch, self._plugin)
        self._known: dict[_Subject, _Known] = {}

    def __call__(
        self, started: ResolvedProcess | ResolvedComponent, container: ResolvedProcess | None = None
    ) -> Found | Missing:
        """Return what is known of ``started``; ``container`` is that of a component.

        Raises ``ManifestError`` for manifests that are broken or contradict each other, ``LaunchFileError`` for a remap
        rule at which the process would end.
        """
        if isinstance(started, ResolvedProcess):
            subject = _Subject(started.package, executable=_executable_name(started))
        else:
            subject = _Subject(started.package, plugin=started.plugin)
        known = self._known.get(subject)
        with translated(NoDLError, ManifestError):
            if known is None:
                known = self._look_up(subject, StartedProgram(started, container, self._distro))
                if not known.of_this_start:
                    self._known[subject] = known
            if not known.descriptions:
                return Missing(str(subject), "; ".join(known.searched), not_made=known.not_made)
            applied = [self._applied(each, started, container) for each in known.descriptions]
            start = ProgramStart(started, container, self._distro)
            return meeting(applied, start, also_unseen=UNSEEN in self._options.also)

    def _applied(
        self,
        description: Found,
        started: ResolvedProcess | ResolvedComponent,
        container: ResolvedProcess | None,
    ) -> Found:
        """Return the description under this start; one with a node of unknown name as it is, which the plan reports."""
        try:
            interfaces = self._library.complete(description.interfaces, started, container)
        except UnknownNodeName:
            return description
        return description._replace(interfaces=interfaces)

    def _look_up(self, subject: _Subject, started: StartedProgram) -> _Known:
        """Collect every description of ``subject``, in the order of ``InterfaceOrigin``.

        A manifest that the user names is not compared. Python sources are read for programs without a manifest only,
        as that takes time at each start.
        """
        name = subject.executable or subject.plugin or ""
        named = self._lookup.find(subject.package or "", executable=subject.executable, plugin=subject.plugin)
        found = [_of_manifest(named)] if named else []
        if named and any(each.source_digest for each in named.found):
            return self._with_its_source(found[0], subject, started)
        if found and found[0].origin is InterfaceOrigin.NAMED:
            return _Known((*found,))
        if named.named:
            with contextlib.suppress(ConflictingNoDLError):  # which is why the user names another
                installed = self._lookup.installed(
                    subject.package or "", executable=subject.executable, plugin=subject.plugin
                )
                found += [_of_manifest(installed)] if installed else []
        if not found and subject.package == CONTAINER_PACKAGE and subject.executable:
            return _Known((Found((_container(subject),)),))
        recorded = self._library.recorded(subject.package, name)
        if recorded:
            found.append(recorded)
        analysed = None
        by_hand = any(each.origin is InterfaceOrigin.PACKAGE for each in found)
        if self._options.infer and (not by_hand or (self._sources and self._sources.hold(subject.package))):
            analysed = self._inferred(subject, started, compiled_only=by_hand)
        if analysed is not None and analysed.interfaces:
            found.append(Found(analysed.interfaces, InterfaceOrigin.ANALYSIS))
        hit = self._library.find(subject.package, name)
        if hit:
            found.append(hit)
        if analysed is not None and analysed.not_made and not found:
            return _Known((), (analysed.why,), not_made=True)
        searched = [analysed.why] if analysed is not None and analysed.why else []
        if self._options.infer and self._sources is None:
            searched.append("inference is not part of this installation")
        if self._options.library:
            searched.append("the library has no document of it")
        searched += [f"--nodl describes {', '.join(named.described)}"] if named.described else []
        if named.registered:
            names = ", ".join(named.registered)
            searched.append(f"the manifests of the package are of {names}, which is no program of it")
        searched.append("looked for a manifest at " + _shortly(named.searched))
        return _Known((*found,), (*searched,), analysed is not None and analysed.of_this_start)

    def _with_its_source(self, manifest: Found, subject: _Subject, started: StartedProgram) -> _Known:
        """Hold a manifest that inference wrote against the source in reach, which may have changed since.

        Also where the analysis may not describe what has no manifest (``--missing-nodl error``).
        """
        sources, analysed = self._sources, self._inferred(subject, started)
        if sources is None or analysed is None or not analysed.interfaces:
            return _Known((manifest,))
        written = {each.source_digest for each in manifest.interfaces if each.source_digest}
        is_changed = written != {sources.digest(analysed.interfaces)}
        source = Found(analysed.interfaces, InterfaceOrigin.ANALYSIS)
        return _Known((manifest._replace(outdated=is_changed), source), of_this_start=analysed.of_this_start)

    def _inferred(
        self, subject: _Subject, started: StartedProgram, *, compiled_only: bool = False
    ) -> InferredNodes | None:
        if self._sources is None or subject.package is None:
            return None
        if self._options.progress is not None:
            self._options.progress(str(subject))
        return self._sources.infer(
            subject.package, subject.executable, subject.plugin, started, compiled_only=compiled_only
        )

    def _plugin(self, plugin_class: str, instance: str, start: StartedPlugin) -> tuple[NodeInterface, ...]:
        if not self._options.infer or self._sources is None:
            return ()
        return self._sources.infer_plugin(plugin_class, instance, start)

    @cached_property
    def _sources(self) -> SourceDescriber | None:
        named = [str(folder) for folder in self._options.source_folders]
        named += [folder for folder in os.environ.get(SOURCE_VARIABLE, "").split(os.pathsep) if folder]
        return source_describer(self._prefixes, named)


def _shortly(places: Sequence[str]) -> str:
    """Return the first place, which is the package's own, and how many more there are: each prefix of a workspace
    has some.
    """
    more = f" and {counted(len(places) - 1, 'more place')}" if len(places) > 1 else ""
    return f"{places[0]}{more}"


def _of_manifest(manifest: Lookup) -> Found:
    """Return the description; a manifest that was learnt says so itself, wherever it lies."""
    origin = InterfaceOrigin.NAMED if manifest.named else InterfaceOrigin.PACKAGE
    if any(each.runs for each in manifest.found):
        origin = InterfaceOrigin.RECORDED
    return Found(manifest.found, origin)


def _executable_name(process: ResolvedProcess) -> str:
    """Return the name by which manifests know the program: without a package launch takes ``exec`` as a path."""
    return process.executable if process.package else process.executable.rpartition("/")[2]


def _container(subject: _Subject) -> NodeInterface:
    return NodeInterface(
        package=subject.package,
        executable=subject.executable,
        plugin=None,
        name=_CONTAINER_NODE_NAME,
        namespace=None,
        endpoints=(),
        source=SourceLocation("rclcpp_components, a container"),
        library=ClientLibrary.RCLCPP,
        parameter_services=False,  # component_manager.hpp: nor the publisher of parameter events
    )
