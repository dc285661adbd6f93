"""What a source package installs: its name and its executables. Reads package.xml, setup.py, setup.cfg, CMake.

``setup.py`` is only parsed: entry points are the texts ``name = module:function`` in it, literal or made of literals.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

from enclave_addons.inference.cpp.reading.cmake import read_build
from enclave_common.files import text_or_nothing
from nodl.package_xml import read_package_xml

_ENTRY = re.compile(r"\s*([\w.\-]+)\s*=\s*([\w.]+)\s*:\s*([\w.]+)\s*\Z")


class EntryPoint(NamedTuple):
    """An entry point in setup.py or setup.cfg: an executable with the module and function it calls."""

    executable: str
    module: str
    function: str


class Package(NamedTuple):
    """A source package: the folder with ``package.xml``."""

    name: str
    folder: str
    entry_points: tuple[EntryPoint, ...] = ()
    dependencies: frozenset[str] = frozenset()

    def entry_points_of(self, module: str) -> list[EntryPoint]:
        return [entry for entry in self.entry_points if entry.module == module]


def find_package(file: str) -> Package | None:
    """Return the package that ``file`` belongs to: the nearest folder above with a ``package.xml``."""
    *_, last = manifest_places(file)
    return read_package(str(last.parent)) if last.is_file() else None


def manifest_places(file: str) -> Iterator[Path]:
    """Return where the ``package.xml`` of ``file`` may be, nearest first, up to the one that is there."""
    for folder in Path(file).parents:
        manifest = folder / "package.xml"
        yield manifest
        if manifest.is_file() or (folder / ".git").exists():
            return


@lru_cache(maxsize=512)
def read_package(folder: str) -> Package:
    """Return what the files in ``folder`` tell; the folder's name stands in where package.xml gives none."""
    base = Path(folder)
    manifest = read_package_xml(base)
    texts = (*_literal_texts(base / "setup.py"), *text_or_nothing(base / "setup.cfg").splitlines())
    entries = tuple(EntryPoint(*match.groups()) for match in map(_ENTRY.match, texts) if match)
    return Package(manifest.name or base.name, folder, entries, manifest.depends)


@lru_cache(maxsize=512)
def scripts_of(folder: str) -> Mapping[str, str]:
    """Return the file behind each executable of a package that CMake installs as it is."""
    return read_build(folder).scripts


def _literal_texts(path: Path) -> Iterator[str]:
    try:
        tree = ast.parse(text_or_nothing(path).removeprefix("\ufeff"))
    except (SyntaxError, ValueError):
        return
    named = {
        target.id: node.value.value
        for node in tree.body
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Constant)
        for target in node.targets
        if isinstance(target, ast.Name) and isinstance(node.value.value, str)
    }
    for node in ast.walk(tree):
        text = _text(node, named)
        if text is not None:
            yield text


def _text(node: ast.AST, named: Mapping[str, str]) -> str | None:
    """Return a text that ``node`` writes, alone or with the constants in ``named``: ``f"{package_name}.main"``."""
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else None
    if isinstance(node, ast.Name):
        return named.get(node.id)
    if isinstance(node, ast.FormattedValue) and node.format_spec is None:
        return _text(node.value, named)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return _joined([node.left, node.right], named)
    return _joined(node.values, named) if isinstance(node, ast.JoinedStr) else None


def _joined(parts: Iterable[ast.AST], named: Mapping[str, str]) -> str | None:
    texts = [_text(part, named) for part in parts]
    return None if None in texts else "".join(filter(None, texts))
