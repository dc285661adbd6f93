"""What a source package installs: its name and its executables. Reads package.xml, setup.py, setup.cfg, CMake.

``setup.py`` is only parsed: entry points are the literal texts ``name = module:function`` in it.
"""

from __future__ import annotations

import ast
import re
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

from enclave_common.files import text_or_nothing
from nodl.package_xml import read_package_xml

_ENTRY = re.compile(r"\s*([\w.\-]+)\s*=\s*([\w.]+)\s*:\s*([\w.]+)\s*\Z")
_PROGRAMS = re.compile(r"install\s*\(\s*PROGRAMS(.*?)DESTINATION", re.S | re.I)


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
    installed_programs: frozenset[str] = frozenset()
    dependencies: frozenset[str] = frozenset()

    def entry_points_of(self, module: str) -> list[EntryPoint]:
        return [entry for entry in self.entry_points if entry.module == module]


def find_package(file: str) -> Package | None:
    """Return the package that ``file`` belongs to: the nearest folder above with a ``package.xml``."""
    for folder in Path(file).parents:
        if (folder / "package.xml").is_file():
            return read_package(str(folder))
        if (folder / ".git").exists():
            return None
    return None


@lru_cache(maxsize=512)
def read_package(folder: str) -> Package:
    """Return what the files in ``folder`` tell; the folder's name stands in where package.xml gives none."""
    base = Path(folder)
    manifest = read_package_xml(base)
    texts = (*_literal_texts(base / "setup.py"), *text_or_nothing(base / "setup.cfg").splitlines())
    entries = tuple(EntryPoint(*match.groups()) for match in map(_ENTRY.match, texts) if match)
    programs = _cmake_programs(base / "CMakeLists.txt")
    return Package(manifest.name or base.name, folder, entries, programs, manifest.depends)


def _literal_texts(path: Path) -> list[str]:
    try:
        tree = ast.parse(text_or_nothing(path))
    except (SyntaxError, ValueError):
        return []
    constants = (node.value for node in ast.walk(tree) if isinstance(node, ast.Constant))
    return [value for value in constants if isinstance(value, str)]


def _cmake_programs(path: Path) -> frozenset[str]:
    names: set[str] = set()
    for block in _PROGRAMS.findall(text_or_nothing(path)):
        names.update(word.rpartition("/")[2] for word in block.split())
    return frozenset(names)
