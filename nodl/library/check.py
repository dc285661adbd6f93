"""The library against sources: for each document whose package lies below a folder, what inference says of it.

The two must agree in every name that is literal in both, or the document's evidence says why they do not (``differs``).
What the document derives from parameters is compared by the listed, default name. Reads the sources.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from typing import NamedTuple

from nodl.infer.packages import read_package
from nodl.library import Library
from nodl.library.document import LibraryDocument
from nodl.node_interface import EndpointKind, NodeInterface

_Name = tuple[EndpointKind, str]


class Verdict(NamedTuple):
    """``only_document`` and ``only_source``: names that the other side does not have. ``why``: the document's words
    for it; ``not_compared``: why there was nothing to compare with."""

    document: LibraryDocument
    only_document: tuple[str, ...] = ()
    only_source: tuple[str, ...] = ()
    not_compared: str = ""

    @property
    def agrees(self) -> bool:
        return not (self.only_document or self.only_source or self.not_compared)

    @property
    def is_wrong(self) -> bool:
        """They differ, and the document does not say why."""
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


def check(library: Library, folder: str) -> list[Verdict]:
    """One verdict for each document whose package is below ``folder``. Raises ``FileNotFoundError``."""
    from nodl.infer.system import infer_paths

    if not os.path.isdir(folder):
        raise FileNotFoundError(2, "no such directory", folder)
    packages = dict(_packages(folder))
    verdicts: list[Verdict] = []
    inferred: dict[str, tuple[NodeInterface, ...]] = {}
    for document in library.documents():
        source = packages.get(document.package)
        if source is None:
            continue
        if document.package not in inferred:
            inferred[document.package] = infer_paths([source]).nodes
        verdicts.append(compare(document, inferred[document.package]))
    return verdicts


def compare(document: LibraryDocument, nodes: Iterable[NodeInterface]) -> Verdict:
    """``document`` with what inference found in its package."""
    if document.classes or document.transport:
        return Verdict(document, not_compared="a plugin, whose node is made by those who load it")
    same = [node for node in nodes if _is_same(document, node)]
    if not same:
        return Verdict(document, not_compared="inference found no such node in the sources")
    theirs = {(e.kind, _key(e.name.text)) for node in same for e in node.endpoints if "*" not in e.name.text}
    unknown = any("*" in e.name.text for node in same for e in node.endpoints)
    ours = {(e.kind, _key(e.name.text)) for e in document.interface.endpoints}
    depends = document.interface.depends
    varied = {(kind, _key(name)) for kind, name in depends.variations} if depends else set()
    only_document = () if unknown else _shown(ours - theirs - varied)
    return Verdict(document, only_document, _shown(theirs - ours))


def _is_same(document: LibraryDocument, node: NodeInterface) -> bool:
    programs = {node.executable, node.plugin} - {None}
    return bool(programs & set(document.programs))


def _key(name: str) -> str:
    return name.removeprefix("/") if name.startswith(("/tf", "/clock")) else name


def _shown(names: Iterable[_Name]) -> tuple[str, ...]:
    return tuple(sorted(f"{kind.value} {name}" for kind, name in names))


def _packages(folder: str) -> Iterator[tuple[str, str]]:
    """Name and folder of each package; what is inside of one is not searched for others."""
    for place, folders, files in os.walk(folder):
        if "package.xml" in files:
            folders.clear()
            yield read_package(place).name, place
        else:
            folders[:] = sorted(name for name in folders if not name.startswith("."))
