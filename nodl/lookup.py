"""Find the NoDL that describes the nodes of an executable or component.

Takes package and executable (or plugin), gives their ``NodeInterface`` values, or reports where it searched.
Sources, the first that knows the executable decides:

1. manifests named by the user (``--nodl FILE``, or a folder of them), to settle conflicts or stand in for missing ones;
2. the package: v1 files ``share/<package>/*.nodl.xml`` and v2 resources ``nodl/<package>__<name>`` of
   the ament index. Documents that disagree are an error, never a choice.

In v1 a component is described by a node whose ``executable`` is the plugin (``demo::Talker``); in v2 by
a document registered under the plugin's name, or under its class name, or with ``plugin:`` in our section.
Reads the disk, each document once per ``ManifestLookup``.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from enclave_common.words import some_of
from nodl.ament_index import (
    INDEX_FOLDER,
    PackageNotFoundError,
    executables,
    list_resources,
    package_share_directory,
)
from nodl.document import RESOURCE_TYPE, V1_SUFFIX, V2_SUFFIXES, read_document, resource_key
from nodl.errors import ConflictingNoDLError, IncludeError, NoManifestError
from nodl.node_interface import ManifestNode, NodeInterface


class Lookup(NamedTuple):
    """The answer of a lookup. ``found`` is empty when no document describes the executable; ``searched`` says where we
    looked. ``named``: the user named the document; ``described``: the programs of the documents that were named in
    vain; ``registered``: names under which the package registers documents, of which none is a program of it."""

    found: tuple[NodeInterface, ...]
    searched: tuple[str, ...]
    named: bool = False
    described: tuple[str, ...] = ()
    registered: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.found)


class ManifestLookup:
    """Answers for one launch: the same prefixes and ``--nodl`` files for every question."""

    def __init__(self, prefixes: Sequence[str], manifests: Iterable[str | Path] = ()):
        self._prefixes = tuple(prefixes)
        self._manifests = tuple(file for manifest in manifests for file in _files(str(manifest)))
        self._chosen: tuple[ManifestNode, ...] | None = None
        self._packages: dict[str, _Package] = {}

    def find(self, package: str, *, executable: str | None = None, plugin: str | None = None) -> Lookup:
        """Return the nodes that ``executable`` runs, or the one that ``plugin`` is; raises ``InvalidNoDLError``."""
        fits = partial(_describes, executable=executable, plugin=plugin)
        subject = f"{package}/{executable or plugin}"
        chosen = [
            node for node in self._chosen_nodes() if fits(node) and node.interface.package in (None, package)
        ]
        if chosen:
            return Lookup(_agreed(subject, chosen), self._manifests, named=True)
        installed = self.installed(package, executable=executable, plugin=plugin)
        others = tuple(dict.fromkeys(map(_program, self._chosen_nodes())))
        return installed._replace(searched=(*self._manifests, *installed.searched), described=others)

    def installed(self, package: str, *, executable: str | None = None, plugin: str | None = None) -> Lookup:
        """Return what the documents of the package itself say, whatever the user names. Raises as ``find``."""
        fits = partial(_describes, executable=executable, plugin=plugin)
        installed = self._package(package)
        found = [node for node in installed.nodes if fits(node)]
        unresolved = installed.unresolved.get(executable or (plugin or "").rpartition("::")[2])
        if unresolved is not None and not found:
            raise unresolved
        agreed = _agreed(f"{package}/{executable or plugin}", found)
        return Lookup(agreed, installed.searched, registered=() if found else installed.no_programs())

    def all_of(self, package: str) -> Lookup:
        """Return every node that the documents of ``package`` describe, conflicts included."""
        installed = self._package(package)
        for error in installed.unresolved.values():
            raise error
        return Lookup(tuple(node.interface for node in installed.nodes), installed.searched)

    def _chosen_nodes(self) -> tuple[ManifestNode, ...]:
        if self._chosen is None:
            self._chosen = tuple(
                node
                for file in self._manifests
                for node in read_document(file, package=self._owner(file), prefixes=self._prefixes)
            )
        return self._chosen

    def _owner(self, file: str) -> str | None:
        absolute = os.path.abspath(file)
        for prefix in self._prefixes:
            relative = os.path.relpath(absolute, prefix).split(os.sep)
            if relative[:4] == [*INDEX_FOLDER.split(os.sep), RESOURCE_TYPE]:
                return relative[-1].partition("__")[0]
            if len(relative) > 2 and relative[0] == "share" and relative[1] != "ament_index":
                return relative[1]
        return None

    def _package(self, package: str) -> _Package:
        if package not in self._packages:
            self._packages[package] = _read_package(package, self._prefixes)
        return self._packages[package]


_NAMED = 3  # prefixes in a message: an isolated workspace has one for each package


class _Package(NamedTuple):
    """The documents of a package. ``unresolved``: those that include something absent, by the name they have in the
    index. They are an error of that program alone."""

    nodes: tuple[ManifestNode, ...]
    searched: tuple[str, ...]
    unresolved: Mapping[str, IncludeError]
    programs: frozenset[str]

    def no_programs(self) -> tuple[str, ...]:
        """Return the programs that documents name and the package does not have."""
        named = (node.interface.executable for node in self.nodes)
        return tuple(sorted({name for name in named if name and name not in self.programs}))


def _read_package(package: str, prefixes: Sequence[str]) -> _Package:
    nodes: list[ManifestNode] = []
    searched: list[str] = []
    unresolved: dict[str, IncludeError] = {}
    try:
        share = package_share_directory(package, prefixes)
    except (PackageNotFoundError, ValueError):
        searched.append(f"package '{package}' in {some_of(prefixes, _NAMED) or 'no prefix at all'}")
    else:
        searched.append(os.path.join(share, "*" + V1_SUFFIX))
        for file in sorted(_v1_files(share)):
            nodes.extend(read_document(file, package=package))
    start = resource_key(package, "")
    for prefix in prefixes:
        searched.append(os.path.join(prefix, INDEX_FOLDER, RESOURCE_TYPE, start + "*"))
    for key, prefix in sorted(list_resources(RESOURCE_TYPE, prefixes).items()):
        if key.startswith(start):
            path = os.path.join(prefix, INDEX_FOLDER, RESOURCE_TYPE, key)
            name = key[len(start) :]
            try:
                nodes.extend(read_document(path, package=package, name=name, prefixes=prefixes))
            except IncludeError as error:
                unresolved[name] = error
    programs = (each for prefix in prefixes for each in executables(os.path.join(prefix, "lib", package)))
    return _Package(tuple(nodes), tuple(searched), unresolved, frozenset(programs))


def _v1_files(share: str) -> list[str]:
    try:
        with os.scandir(share) as entries:
            return [entry.path for entry in entries if entry.name.endswith(V1_SUFFIX) and entry.is_file()]
    except (FileNotFoundError, NotADirectoryError):
        return []


def _files(path: str) -> list[str]:
    if not os.path.isdir(path):
        return [path]
    suffixes = (V1_SUFFIX, *(suffix for suffix in V2_SUFFIXES if suffix.startswith(".nodl.")))
    found = sorted(str(file) for file in Path(path).rglob("*.nodl.*") if file.name.endswith(suffixes))
    if not found:
        raise NoManifestError(f"--nodl {path}: no manifest in this folder (*{', *'.join(suffixes)})")
    return found


def _program(node: ManifestNode) -> str:
    interface = node.interface
    program = interface.executable or interface.plugin or "a node of no program"
    return f"{interface.package}/{program}" if interface.package else program


def _describes(node: ManifestNode, *, executable: str | None, plugin: str | None) -> bool:
    interface = node.interface
    if executable is not None:
        return interface.executable == executable
    if plugin is None:
        return False
    if interface.plugin is not None or node.explicit_executable:
        return interface.plugin == plugin
    return interface.executable == plugin.rpartition("::")[2]


def _agreed(subject: str, nodes: Sequence[ManifestNode]) -> tuple[NodeInterface, ...]:
    """Return the nodes without repetitions. Raises ``ConflictingNoDLError`` if documents disagree.

    One file may describe several nodes of an executable under different names. Two files that describe it must say the
    same, except v2 documents that name the executable themselves: v2 needs one document for each node.
    """
    distinct: dict[object, ManifestNode] = {}
    for node in nodes:
        distinct.setdefault(_meaning(node.interface), node)
    kept = list(distinct.values())
    files = {node.interface.source.file for node in kept}
    names = {(node.interface.name, node.interface.namespace) for node in kept}
    one_document_each = all(node.version == 2 and node.explicit_executable for node in kept)
    if len(names) < len(kept) or (len(files) > 1 and not one_document_each):
        raise ConflictingNoDLError(subject, (node.interface.source for node in kept))
    return tuple(node.interface for node in kept)


def _meaning(interface: NodeInterface) -> object:
    endpoints = frozenset((e.kind, e.name, e.type) for e in interface.endpoints)
    return interface.name, interface.namespace or "/", endpoints, interface.lifecycle
