"""The library against sources: for each document whose package lies below a folder, what inference says of it.

The two must agree in every name that is literal in both, or the document's evidence says why they do not (``differs``).
What the document derives from parameters is compared by the listed, default name. Reads the sources.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from typing import NamedTuple

from enclave_addons.inference.packages import read_package
from enclave_addons.inference.system import infer_paths
from enclave_addons.library import Library, LibraryDocuments, fits
from enclave_addons.library.apply import applied
from enclave_addons.library.document import LibraryDocument
from nodl.dependence import Situation
from nodl.node_interface import Endpoint, EndpointKind, NodeInterface
from nodl.package_xml import read_package_xml

_Name = tuple[EndpointKind, str]
_BUILT_IN = frozenset(("clock", "parameter_events", "rosout"))
_MOST = 10_000


class LibraryVerdict(NamedTuple):
    """The comparison of one document with its source. ``only_document`` and ``only_source``: names that the other side
    does not have; ``not_compared``: why there was nothing to compare with. ``version``: of the package whose source
    was read."""

    document: LibraryDocument
    only_document: tuple[str, ...] = ()
    only_source: tuple[str, ...] = ()
    not_compared: str = ""
    version: str | None = None
    of_other_version: bool = False

    @property
    def agrees(self) -> bool:
        return not (self.only_document or self.only_source or self.not_compared)

    @property
    def is_wrong(self) -> bool:
        """Return True if they differ and the document does not say why."""
        return bool(self.only_document or self.only_source) and not self.document.evidence.differs

    def __str__(self) -> str:
        if self.not_compared:
            return f"{self.document.stem}: not compared: {self.not_compared}"
        if self.agrees:
            return f"{self.document.stem}: agrees"
        lines = [
            f"{self.document.stem}: {'differs' if self.is_wrong else 'differs, as the document explains'}"
        ]
        lines += [f"  only in the document: {name}" for name in self.only_document]
        lines += [f"  only in the source: {name}" for name in self.only_source]
        lines += [f"  because {why}" for why in self.document.evidence.differs]
        return "\n".join(lines)


def check(library: Library, folder: str) -> list[LibraryVerdict]:
    """Return one verdict for each document whose package is below ``folder``. Raises ``FileNotFoundError``."""
    if not os.path.isdir(folder):
        raise FileNotFoundError(2, "no such directory", folder)
    packages = dict(_packages(folder))
    verdicts: list[LibraryVerdict] = []
    inferred: dict[str, tuple[NodeInterface, ...]] = {}
    for document in library.documents():
        source = packages.get(document.package)
        if source is None:
            continue
        version = read_package_xml(source).version or None
        if not fits(document.versions, "", version):
            reason = f"these sources are of version {version}"
            verdicts.append(
                LibraryVerdict(document, not_compared=reason, version=version, of_other_version=True)
            )
            continue
        if document.package not in inferred:
            inferred[document.package] = infer_paths([source]).nodes
        verdicts.append(compare(document, inferred[document.package], library)._replace(version=version))
    return verdicts


def compare(document: LibraryDocument, nodes: Iterable[NodeInterface], library: Library) -> LibraryVerdict:
    """Compare ``document`` with what inference found in its package.

    What its default plugins and further nodes have, which ``library`` describes, may be found too.
    """
    if document.classes or document.transport:
        return LibraryVerdict(document, not_compared="a plugin, whose node is made by those who load it")
    same = [node for node in nodes if _is_same(document, node)]
    if not same:
        return LibraryVerdict(document, not_compared="inference found no such node in the sources")
    theirs = {(e.kind, _key(e.name.text)) for node in same for e in node.endpoints if _is_known(e)}
    unknown = any("*" in e.name.text for node in same for e in node.endpoints)
    ours = {(e.kind, _key(e.name.text)) for e in document.interface.endpoints}
    depends = document.interface.depends
    varied = {(kind, _key(name)) for kind, name in depends.variations} if depends else set()
    only_document = () if unknown else _shown(ours - theirs - varied)
    brought = _brought(document.interface, library)
    return LibraryVerdict(document, only_document, _shown(theirs - ours - brought))


def _is_same(document: LibraryDocument, node: NodeInterface) -> bool:
    programs = {node.executable, node.plugin} - {None}
    return bool(programs & set(document.programs))


def _key(name: str) -> str:
    """Return the name to compare: ``{node}/x`` is ``~/x``, and tf's names are written with and without slash."""
    private = f"~/{name.removeprefix('{node}/')}" if name.startswith("{node}/") else name
    return private.removeprefix("/") if private.startswith("/tf") else private


def _is_known(endpoint: Endpoint) -> bool:
    """Return True for a known name of the node's own, not one that every node has anyway."""
    name = endpoint.name.text
    return bool(name) and "*" not in name and name.lstrip("/") not in _BUILT_IN


def _brought(interface: NodeInterface, library: Library) -> set[_Name]:
    """Return the names of the plugins, transports and further nodes of a start without parameters."""
    transports = frozenset(package for _, package, _ in library.transports())
    situation = Situation("rolling", interface.name or "node", "/", installed=transports)
    names: set[_Name] = set()
    waiting = [interface]
    while waiting and len(names) < _MOST:
        current = waiting.pop()
        done = applied(current, situation._replace(node=current.name or "node"), LibraryDocuments(library))
        names |= {(e.kind, _key(e.name.text)) for e in done.interface.endpoints}
        waiting.extend(done.further)
    return names


def _shown(names: Iterable[_Name]) -> tuple[str, ...]:
    return tuple(sorted(f"{kind.value} {name}" for kind, name in names))


def _packages(folder: str) -> Iterator[tuple[str, str]]:
    """Yield name and folder of each package; does not search inside a package for others."""
    for place, folders, files in os.walk(folder):
        if "package.xml" in files:
            folders.clear()
            yield read_package(place).name, place
        else:
            folders[:] = sorted(name for name in folders if not name.startswith("."))
