"""What a manifest was inferred from, as a digest, so that a plan can tell when the source has changed since.

It covers, of each file that an interface stands in, the whole Python package, the script, or the whole C++ package.
Names in it are relative, so that what is installed has the digest of what it was copied from. Reads files.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path

from enclave_addons.inference.answers.folder import digest, digest_of
from enclave_addons.inference.packages import find_package
from enclave_addons.inference.system import CPP_SUFFIXES, source_files
from nodl.node_interface import NodeInterface

_CPP = (*CPP_SUFFIXES, "CMakeLists.txt")


def source_digest(nodes: Iterable[NodeInterface]) -> str:
    """Return the digest of the sources of ``nodes``, which are those of one program."""
    places = {
        place.file for node in nodes for place in (node.source, *(each.source for each in node.endpoints))
    }
    files = {file for place in places if os.path.isfile(place) for file in _belonging(place)}
    return "sha256:" + digest(sorted((name, digest_of(path)) for name, path in files))


def _belonging(place: str) -> Iterator[tuple[str, str]]:
    """Yield the files that belong together with ``place``, each with its name below their folder."""
    package = find_package(place) if place.endswith(_CPP) else None
    top = package.folder if package is not None else _python_package(place)
    if top is None:
        yield os.path.basename(place), place
        return
    suffixes = _CPP if package is not None else ".py"
    for path in source_files(Path(top)):
        if path.endswith(suffixes):
            yield os.path.relpath(path, os.path.dirname(top)), path


def _python_package(file: str) -> str | None:
    """Return the folder of the outermost Python package that ``file`` is in, None for a script."""
    folder, top = os.path.dirname(os.path.abspath(file)), None
    while os.path.isfile(os.path.join(folder, "__init__.py")):
        folder, top = os.path.dirname(folder), folder
    return top
