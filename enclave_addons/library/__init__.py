"""The library of manifests: what nodes of widely used packages say, for those who have no manifest of them.

Folders of NoDL v2 documents, one for each program, plugin or further node: those of users (``--library DIR``) before
the one that ships with us. ``find`` opens the index and one document. docs/library.md describes the form.

The shipped index is ``index.json`` beside the documents, written by ``tools/library``; folders of users are scanned.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import NamedTuple

from enclave_addons.library.document import SUFFIX, LibraryDocument, read_library_document, stem_of
from nodl.errors import NoDLError
from nodl.node_interface import NodeInterface

SHIPPED = os.path.join(os.path.dirname(os.path.abspath(__file__)), "documents")


class Hit(NamedTuple):
    """A document that was found. ``doubt``: it was written for another version, in words for a person."""

    document: LibraryDocument
    doubt: str = ""


class Library:
    """Folders of documents, the first that knows a name decides. ``folders``: those of the user."""

    def __init__(self, folders: Iterable[str | os.PathLike[str]] = (), shipped: str | None = SHIPPED):
        self._folders = [os.path.abspath(folder) for folder in folders]
        for folder in self._folders:
            if not os.path.isdir(folder):
                raise NoDLError(f"--library {folder}: no such directory")
        self._shipped = shipped
        self._indexes: dict[str, tuple[IndexEntry, ...]] = {}
        self._documents: dict[tuple[str, str], LibraryDocument] = {}

    def find(self, package: str, name: str, *, distro: str = "", version: str | None = None) -> Hit | None:
        """Return the document of executable or plugin ``name``, not counting what was recorded.

        ``version`` is that of the installed package, if known. Raises ``InvalidNoDLError`` for a broken document.
        """
        for folder in self._all():
            if folder == SHIPPED and not os.path.isdir(os.path.join(folder, package)):
                continue  # the documents of a package lie in its folder
            entries = [e for e in self._entries(folder) if e.package == package and name in e.programs]
            hit = self._chosen(folder, entries, distro, version) if entries else None
            if hit and not hit.document.recorded:
                return hit
        return None

    def recorded(self, package: str, name: str, *, distro: str, version: str | None) -> tuple[Hit, ...]:
        """Return what the user recorded of a program, one document for each of its nodes. Raises as ``find``."""
        for folder in self._folders:
            entries = [e for e in self._entries(folder) if e.package == package and name in e.programs]
            hits = (self._chosen(folder, [entry], distro, version) for entry in entries)
            found = tuple(hit for hit in hits if hit.document.recorded)
            if found:
                return found
        return ()

    def of_class(self, plugin_class: str, *, distro: str = "") -> Hit | None:
        """Return the document of a plugin, by the name of its class as launch files give it."""
        return self._first(lambda entry: plugin_class in entry.classes, distro)

    def named(self, name: str, *, distro: str = "") -> Hit | None:
        """Return the document ``package/stem``, as documents refer to each other."""
        return self._first(lambda entry: entry.stem == name, distro)

    def _first(self, fitting: Callable[[IndexEntry], bool], distro: str) -> Hit | None:
        for folder in self._all():
            entries = list(filter(fitting, self._entries(folder)))
            if entries:
                return self._chosen(folder, entries, distro, None)
        return None

    def transports(self) -> tuple[tuple[str, str, NodeInterface], ...]:
        """Return short name, package and description of each transport of image_transport."""
        found: dict[str, tuple[str, str, NodeInterface]] = {}
        for folder in self._all():
            for entry in self._entries(folder):
                if entry.transport and entry.transport not in found:
                    interface = self._document(folder, entry.file).interface
                    found[entry.transport] = (entry.transport, entry.package, interface)
        return tuple(found.values())

    def documents(self) -> Iterator[LibraryDocument]:
        """Yield each package and name once, sorted."""
        seen: dict[str, tuple[str, str]] = {}
        for folder in self._all():
            for entry in self._entries(folder):
                seen.setdefault(entry.stem, (folder, entry.file))
        for stem in sorted(seen):
            yield self._document(*seen[stem])

    def _all(self) -> Sequence[str]:
        return [*self._folders, *([self._shipped] if self._shipped else [])]

    def _entries(self, folder: str) -> tuple[IndexEntry, ...]:
        if folder not in self._indexes:
            self._indexes[folder] = read_index(folder) if folder == SHIPPED else scanned(folder)
        return self._indexes[folder]

    def _chosen(self, folder: str, entries: Sequence[IndexEntry], distro: str, version: str | None) -> Hit:
        """Return the entry for this version, else the last, with a doubt that names both."""
        fitting = [entry for entry in entries if fits(entry.versions, distro, version)]
        file = (fitting or entries)[-1].file
        document = self._document(folder, file)
        return Hit(document, "" if fitting else _doubt(document, distro, version))

    def _document(self, folder: str, file: str) -> LibraryDocument:
        if (folder, file) not in self._documents:
            self._documents[folder, file] = read_library_document(folder, file)
        return self._documents[folder, file]


class LibraryDocuments(NamedTuple):
    """References of documents in a library, as ``enclave_addons.library.apply`` requests them. ``of_source``: what
    sources say of a plugin, by its class and instance, that no document describes."""

    library: Library
    distro: str = ""
    of_source: Callable[[str, str], NodeInterface | None] | None = None

    def of_class(self, plugin_class: str, instance: str = "") -> NodeInterface | None:
        """Return the description of a plugin by its class, of a document the same for each ``instance``."""
        hit = self.library.of_class(plugin_class, distro=self.distro)
        if hit is None and self.of_source is not None:
            return self.of_source(plugin_class, instance)
        return hit.document.interface if hit else None

    def named(self, name: str) -> NodeInterface | None:
        """Return the description ``package/stem``."""
        hit = self.library.named(name, distro=self.distro)
        return hit.document.interface if hit else None

    def transports(self) -> tuple[tuple[str, str, NodeInterface], ...]:
        """Return what ``Library.transports`` returns."""
        return self.library.transports()


def fits(versions: dict[str, str], distro: str, version: str | None) -> bool:
    """Return True if a document that was read from ``versions`` (a series by distribution) holds here.

    A series covers what begins with it: 1.3 covers 1.3.7. Without an installed version the distribution decides; a
    document that names none holds for all.
    """
    if not versions:
        return True
    if version is None:
        return not distro or distro in versions
    return any(f"{version}.".startswith(f"{series}.") for series in versions.values())


def _doubt(document: LibraryDocument, distro: str, version: str | None) -> str:
    read = ", ".join(f"{series} ({name})" for name, series in document.versions.items())
    here = f"version {version}" if version else f"distribution {distro}"
    return f"{document.stem} was written for {read}, here is {here}"


INDEX = "index.json"


class IndexEntry(NamedTuple):
    """One document: ``file`` relative to the folder, and by what it is found."""

    file: str
    programs: tuple[str, ...] = ()
    classes: tuple[str, ...] = ()
    versions: dict[str, str] = {}  # noqa: RUF012  # never changed
    transport: str = ""

    @property
    def package(self) -> str:
        return self.stem.partition("/")[0]

    @property
    def stem(self) -> str:
        return stem_of(self.file)


def read_index(folder: str) -> tuple[IndexEntry, ...]:
    """Return what the index file of a library folder lists.

    Raises ``OSError``, ``ValueError`` for JSON that does not parse.
    """
    with open(os.path.join(folder, INDEX), encoding="utf-8") as stream:
        listed = json.load(stream)
    return tuple(
        IndexEntry(
            file,
            tuple(entry.get("programs", ())),
            tuple(entry.get("classes", ())),
            entry.get("versions", {}),
            entry.get("transport", ""),
        )
        for file, entry in listed.items()
    )


def scanned(folder: str) -> tuple[IndexEntry, ...]:
    """Return the entries of all documents below ``folder``.

    Raises ``InvalidNoDLError`` for a broken one, ``NoDLError`` for one that would never be found.
    """
    found = {file: read_library_document(folder, file) for file in _files(folder)}
    for file, document in found.items():
        if "/" not in document.stem and not document.recorded:  # a program without a package can be recorded
            raise _misplaced(folder, file)
    return tuple(_entry(folder, document) for document in found.values())


def _entry(folder: str, document: LibraryDocument) -> IndexEntry:
    return IndexEntry(
        os.path.relpath(document.file, folder).replace(os.sep, "/"),
        document.programs,
        document.classes,
        document.versions,
        document.transport,
    )


def _files(folder: str) -> Iterator[str]:
    """Yield ``PACKAGE/NAME.nodl.yaml``, and ``PACKAGE__NAME.nodl.yaml`` as ``--learn`` writes them.

    Raises ``NoDLError`` for other documents: they are not passed over silently.
    """
    for name in sorted(os.listdir(folder)):
        if os.path.isdir(os.path.join(folder, name)):
            inside = sorted(os.listdir(os.path.join(folder, name)))
            yield from (f"{name}/{each}" for each in inside if _is_document(folder, f"{name}/{each}"))
        elif _is_document(folder, name):
            yield name


def _is_document(folder: str, file: str) -> bool:
    if ".nodl." in file and not file.endswith(SUFFIX):
        raise _misplaced(folder, file)
    return file.endswith(SUFFIX)


def _misplaced(folder: str, file: str) -> NoDLError:
    return NoDLError(
        f"{os.path.join(folder, file)}: a library has documents of NoDL v2 as PACKAGE/NAME{SUFFIX}, "
        f"or PACKAGE__NAME{SUFFIX} as --learn writes them; name any other file with --nodl"
    )
