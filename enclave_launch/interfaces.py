"""Where the interfaces of a node come from: its manifest, else (unless forbidden) its source.

Takes a process or component that launch starts; gives ``Found`` or ``Missing`` with what to do next. Reads the
ament index, manifests and Python sources; next is the plan.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from enclave_launch.errors import ManifestError
from enclave_launch.plan import Found, Missing
from enclave_launch.process import ResolvedComponent, ResolvedProcess
from nodl.errors import NoDLError
from nodl.lookup import Lookup, ManifestLookup
from nodl.node_interface import ClientLibrary, NodeInterface
from nodl.source_ref import SourceRef

CONTAINER_PACKAGE = "rclcpp_components"
"""Its executables (``component_container``, ``_mt``, ``_isolated``) are containers and nothing else."""

_CONTAINER_NODE_NAME = (
    "ComponentManager"  # rclcpp_components/src/component_manager.hpp, the constructor's default
)


class _Subject(NamedTuple):
    """What is asked for: an executable or a plugin of a package."""

    package: str | None
    executable: str | None = None
    plugin: str | None = None

    def __str__(self) -> str:
        return f"{self.package or '(no package)'}/{self.executable or self.plugin}"


class InterfaceFinder:
    """Answers for one launch, each question once. ``infer``: look at the source of nodes without a manifest."""

    def __init__(self, prefixes: Sequence[str], manifests: Sequence[Path] = (), infer: bool = True) -> None:
        self._prefixes = prefixes
        self._may_infer = infer
        self._lookup = ManifestLookup(prefixes, manifests)
        self._known: dict[_Subject, Found | Missing] = {}

    def __call__(self, started: ResolvedProcess | ResolvedComponent) -> Found | Missing:
        """Raises ``ManifestError`` for manifests that are broken or contradict each other."""
        if isinstance(started, ResolvedProcess):
            subject = _Subject(started.package, executable=_executable_name(started))
        else:
            subject = _Subject(started.package, plugin=started.plugin)
        if subject not in self._known:
            self._known[subject] = self._find(subject)
        return self._known[subject]

    def _find(self, subject: _Subject) -> Found | Missing:
        try:
            manifest = self._lookup.find(
                subject.package or "", executable=subject.executable, plugin=subject.plugin
            )
        except NoDLError as error:
            raise ManifestError(str(error)) from error
        if manifest:
            return Found(manifest.found)
        if subject.package == CONTAINER_PACKAGE and subject.executable:
            return Found((_container(subject),))
        return self._infer(subject, manifest)

    def _infer(self, subject: _Subject, manifest: Lookup) -> Found | Missing:
        searched = "looked at " + ", ".join(manifest.searched)
        if not self._may_infer or subject.package is None:
            return Missing(str(subject), searched)
        from nodl.infer.executable import infer_executable

        inferred = infer_executable(
            subject.package, executable=subject.executable, plugin=subject.plugin, prefixes=self._prefixes
        )
        if not inferred.interfaces:
            return Missing(str(subject), f"{searched}; {inferred.why}")
        return Found(inferred.interfaces, inferred=True)


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
    )
