"""The index of a folder of documents: an index file, or a scan of the folder.

The index of the library that ships with us is ``index.json`` beside the documents; a test holds it to them, and
``tools/library`` writes it. Folders of users are scanned: they are small, and change.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from typing import NamedTuple

from nodl.errors import NoDLError
from nodl.library.document import SUFFIX, LibraryDocument, read_library_document, stem_of

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

    Raises ``NoDLError`` for other documents: to pass over them would look as if they said nothing.
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
