"""One document of a library: the node that it describes, the versions it holds for, and how that is known."""

from __future__ import annotations

import os
from typing import Any, NamedTuple

from nodl.document import read_root
from nodl.document.v2 import parse_root
from nodl.document.v2_section import section_of
from nodl.node_interface import NodeInterface
from nodl.yaml_text import plain

SUFFIX = ".nodl.yaml"


def stem_of(file: str) -> str:
    """Return ``PACKAGE/NAME`` of ``PACKAGE/NAME.nodl.yaml`` or ``PACKAGE__NAME.nodl.yaml``, a file of a library."""
    name = file.removesuffix(SUFFIX)
    return name if "/" in name else name.replace("__", "/", 1)


class Evidence(NamedTuple):
    """Source of the description. ``missing``: parts that are known to be left out; ``differs``: why an analysis of
    the same sources says something else."""

    repository: str = ""
    version: str = ""
    commit: str = ""
    how: str = ""
    missing: tuple[str, ...] = ()
    differs: tuple[str, ...] = ()


class LibraryDocument(NamedTuple):
    """A document of the library. ``stem``: ``package/name`` of the file. ``programs``: executables and plugins that
    run this node; ``classes``: names of the class if other nodes load it. ``versions``: a series by distribution.
    ``recorded``: learnt from runs."""

    interface: NodeInterface
    stem: str
    file: str
    programs: tuple[str, ...]
    classes: tuple[str, ...]
    versions: dict[str, str]
    evidence: Evidence
    transport: str = ""
    recorded: bool = False

    @property
    def package(self) -> str:
        return self.stem.partition("/")[0]


def read_library_document(folder: str, file: str) -> LibraryDocument:
    """Read the document ``file`` of the library in ``folder``. Raises ``InvalidNoDLError``."""
    path = os.path.join(folder, file)
    stem = stem_of(file)
    package, _, name = stem.partition("/")
    root = read_root(path)
    section = section_of(root)
    classes, transport = section.texts("classes"), section.text("transport")
    evidence: dict[str, Any] = {
        key: tuple(value) if isinstance(value, list) else value
        for key, value in ((key, plain(each)) for key, each in section.mapping("evidence").items.items())
    }
    node = parse_root(root, path, package=package, name=name).interface
    programs = () if classes or transport else (node.executable, node.plugin)
    return LibraryDocument(
        interface=node,
        stem=stem,
        file=path,
        programs=(*(each for each in programs if each), *section.texts("also")),
        classes=classes,
        versions={
            distro: section.mapping("versions").text(distro) for distro in section.mapping("versions").items
        },
        evidence=Evidence(**evidence),
        transport=transport,
        recorded=bool(section.listed("runs")) or evidence.get("how") == "recorded",
    )
