"""What a source package installs: its name and its executables. Reads package.xml, setup.py, setup.cfg, CMake.

``setup.py`` is only parsed: entry points are the literal texts ``name = module:function`` in it.
"""

from __future__ import annotations

import ast
import re
from functools import lru_cache
from pathlib import Path

from enclave_launch.boundary.files import text_or_nothing
from enclave_launch.boundary.light import NamedTuple

_ENTRY = re.compile(r"\s*([\w.\-]+)\s*=\s*([\w.]+)\s*:\s*([\w.]+)\s*\Z")
_NAME = re.compile(r"<name>\s*([^<\s]+)\s*</name>")
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

    def entry_points_of(self, module: str) -> list[EntryPoint]:
        return [entry for entry in self.entry_points if entry.module == module]


def find_package(file: str) -> Package | None:
    """The package that ``file`` belongs to: the nearest folder above with a ``package.xml``."""
    for folder in Path(file).parents:
        if (folder / "package.xml").is_file():
            return read_package(str(folder))
        if (folder / ".git").exists():
            return None
    return None


@lru_cache(maxsize=512)
def read_package(folder: str) -> Package:
    """What the files in ``folder`` tell; the folder's name stands in where package.xml gives none."""
    base = Path(folder)
    match = _NAME.search(text_or_nothing(base / "package.xml"))
    name = match[1] if match else base.name
    entries = (*_python_entries(base / "setup.py"), *_text_entries(base / "setup.cfg"))
    return Package(name, folder, entries, _cmake_programs(base / "CMakeLists.txt"))


def _python_entries(path: Path) -> list[EntryPoint]:
    try:
        tree = ast.parse(text_or_nothing(path))
    except (SyntaxError, ValueError):
        return []
    entries = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            match = _ENTRY.match(node.value)
            if match:
                entries.append(EntryPoint(match[1], match[2], match[3]))
    return entries


def _text_entries(path: Path) -> list[EntryPoint]:
    matches = (_ENTRY.match(line) for line in text_or_nothing(path).splitlines())
    return [EntryPoint(match[1], match[2], match[3]) for match in matches if match]


def _cmake_programs(path: Path) -> frozenset[str]:
    names: set[str] = set()
    for block in _PROGRAMS.findall(text_or_nothing(path)):
        names.update(word.rpartition("/")[2] for word in block.split())
    return frozenset(names)
