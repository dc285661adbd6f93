"""The ``include`` of NoDL v2: which files a document draws in, each once, none from where it should not.

Files are compared by their resolved path, so that neither ``x/../x`` nor a link hides a cycle. Reads files."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from enclave_common.files import read_bytes
from enclave_common.source_location import SourceLocation
from enclave_common.terminal import quoted
from nodl.ament_index import INDEX_FOLDER, find_resource
from nodl.document.v2_schema import check_document
from nodl.errors import IncludeError
from nodl.yaml_text import MAX_BYTES, YamlMap, parse_yaml

RESOURCE_TYPE = "nodl"  # of v2 documents in the ament index
MAX_DEPTH = 32
COMMON = Path(__file__).parent / "common"
"""Documents that packages of ROS bring, for machines without them: the installed ones come first."""
_PACKAGE_OR_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.:-]*\Z")


class Included(NamedTuple):
    """One document: the file as found and its checked content."""

    file: str
    root: YamlMap


def follow_includes(root: YamlMap, file: str, prefixes: Sequence[str]) -> tuple[Included, ...]:
    """Return all documents that ``root`` includes, depth first. Raises ``IncludeError`` with file:line."""
    origin = Path(file).resolve()
    walk = _Walk(prefixes, {origin: (str(file),)})
    return tuple(walk.of(root, origin, (str(file),)))


class _Walk:
    def __init__(self, prefixes: Sequence[str], visited: dict[Path, tuple[str, ...]]):
        self._prefixes = prefixes
        self._visited = visited  # resolved file -> the chain of references that led there

    def of(self, root: YamlMap, origin: Path, chain: tuple[str, ...]) -> Iterator[Included]:
        for entry in root.mappings("include"):
            yield from self._one(entry.text("ref"), entry.items["ref"].source, origin, chain)

    def _one(
        self, ref: str, source: SourceLocation, origin: Path, chain: tuple[str, ...]
    ) -> Iterator[Included]:
        path = self._resolve(ref, source, origin)
        here = (*chain, ref)
        if path in self._visited:
            raise IncludeError.at(
                source,
                f"{quoted(ref)} includes a document a second time: "
                f"{' > '.join(here)} and {' > '.join(self._visited[path])}",
            )
        if len(here) > MAX_DEPTH:
            raise IncludeError.at(source, f"includes are nested more than {MAX_DEPTH} deep")
        self._visited[path] = here
        root = check_document(parse_yaml(_read(path, source), str(path)))
        yield Included(str(path), root)
        yield from self.of(root, path, here)

    def _resolve(self, ref: str, source: SourceLocation, origin: Path) -> Path:
        scheme, _, rest = ref.partition("://")
        if scheme == "nodl":
            return self._from_index(rest, source)
        if scheme == "local":
            return _local(rest, source, origin)
        raise IncludeError.at(
            source, f"{quoted(ref)}: only nodl://<package>/<name> and local://<path> are known"
        )

    def _from_index(self, body: str, source: SourceLocation) -> Path:
        package, _, name = body.partition("/")
        if not _PACKAGE_OR_NAME.match(package) or not _PACKAGE_OR_NAME.match(name):
            raise IncludeError.at(source, f"{quoted('nodl://' + body)} is not nodl://<package>/<name>")
        key = resource_key(package, name)
        prefix = find_resource(RESOURCE_TYPE, key, self._prefixes)
        shipped = COMMON / package / f"{name}.nodl.yaml"
        if prefix is None and shipped.is_file():
            return shipped.resolve()
        if prefix is None:
            raise IncludeError.at(
                source,
                f"no document 'nodl://{package}/{name}' (resource {RESOURCE_TYPE}/{key}) "
                f"in {', '.join(self._prefixes) or 'any prefix: AMENT_PREFIX_PATH is empty'}",
            )
        return Path(prefix, INDEX_FOLDER, RESOURCE_TYPE, key).resolve()


def _local(body: str, source: SourceLocation, origin: Path) -> Path:
    if body.startswith("/") or "\\" in body or not body.isprintable():
        raise IncludeError.at(source, f"{quoted('local://' + body)} must be a relative path")
    path = (origin.parent / body).resolve()
    root = package_root(origin)
    if not path.is_relative_to(root):
        raise IncludeError.at(
            source, f"{quoted('local://' + body)} is outside of {root}, where its package is"
        )
    return path


def package_root(document: Path) -> Path:
    """Return the folder that local includes may not leave: that of ``package.xml``, else the document's own."""
    for folder in document.parents:
        if (folder / "package.xml").is_file():
            return folder
    return document.parent


def _read(path: Path, source: SourceLocation) -> bytes:
    try:
        return read_bytes(path, MAX_BYTES)
    except OSError as error:
        raise IncludeError.at(source, f"cannot read {path}: {error.strerror}") from None


def resource_key(package: str, name: str) -> str:
    """Return the name in the ament index of the v2 document ``nodl://package/name``."""
    return f"{package}__{name}"
