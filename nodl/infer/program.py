"""The analysed program as text: which module is which file, parsed once. Reads files, runs nothing.

An import finds a module as Python would: relative to the package, beside the started script, or below one
of the roots (folders that hold top-level packages). What is not found there is a foreign library.
"""

from __future__ import annotations

import ast
import errno
import functools
import os
import re
import sys
import warnings
from collections.abc import Iterable
from typing import NamedTuple

from enclave_common.files import read_bytes
from nodl.infer.cpp.cache.folder import digest, digest_of
from nodl.infer.source_text import mangle, source_text

MAX_SOURCE_BYTES = 1_000_000

# Libraries whose behaviour the models describe; their sources are never analysed.
MODELLED = frozenset(
    {
        "rclpy", "tf2_ros", "tf2_py", "tf2_geometry_msgs", "message_filters", "cv_bridge",
        "diagnostic_updater", "rosidl_runtime_py", "rosidl_parser", "ament_index_python", "launch",
        "launch_ros", "numpy", "cv2", "yaml", "setuptools", "pkg_resources",
    }
)  # fmt: skip
_INTERFACES = ("msg", "srv", "action")  # generated from interface files, so types and not programs


class SourceModule:
    """One parsed file. ``error`` says why it could not be parsed (``tree`` is then empty)."""

    def __init__(
        self,
        name: str,
        path: str,
        tree: ast.Module,
        text: str = "",
        is_package: bool = False,
        error: str | None = None,
        error_line: int = 0,
    ) -> None:
        self.name = name
        self.path = path
        self.tree = tree
        self.text = text
        self.is_package = is_package
        self.error = error
        self.error_line = error_line

    @functools.cached_property
    def has_yield(self) -> bool:
        return "yield" in self.text

    def lines_with(self, pattern: re.Pattern[str]) -> list[int]:
        """Return the numbers of the lines where ``pattern`` is found, in order; it does not span lines."""
        lines: list[int] = []
        line, counted = 1, 0
        for found in pattern.finditer(self.text):
            line += self.text.count("\n", counted, found.start())
            counted = found.start()
            if not lines or lines[-1] != line:
                lines.append(line)
        return lines

    def package(self) -> str:
        return self.name if self.is_package else self.name.rpartition(".")[0]


class ProgramTarget(NamedTuple):
    """Where a program starts: a script, or ``function`` of ``module``. ``missing``: why it is not its entry point."""

    file: str
    module: str | None = None
    function: tuple[str, ...] = ()
    missing: str = ""


class Program:
    """Finds and parses modules below ``roots``; one object serves many runs."""

    def __init__(self, roots: Iterable[str] = ()):
        self.roots = list(dict.fromkeys(os.path.abspath(root) for root in roots))
        # What was asked of the disk, with a digest of what it said.
        self.asked: dict[tuple[str, str], str] = {}
        self._by_path: dict[str, SourceModule] = {}
        self._found: dict[tuple[str, str], str | None] = {}
        self._listings: dict[str, frozenset[str]] = {}

    def add_root(self, folder: str) -> None:
        folder = os.path.abspath(folder)
        if folder not in self.roots:
            self.roots.append(folder)
            self._found.clear()

    def load(self, path: str, name: str | None = None) -> SourceModule:
        """Return the module in file ``path``; its name is derived from the ``__init__.py`` files above it."""
        path = os.path.abspath(path)
        module = self._by_path.get(path)
        if module is None:
            self.ask("file", path)
            module = self._by_path[path] = _parse(path, name or self.module_name(path))
        return module

    def ask(self, kind: str, what: str) -> str:
        """Return a digest of a ``file``'s content or a ``folder``'s names; remembered.

        To be asked before a file is read: what changes in between is then found to have changed.
        """
        said = self.asked.get((kind, what))
        if said is None:
            said = digest_of(what) if kind == "file" else digest(sorted(self._listing(what)))
            self.asked[kind, what] = said
        return said

    def module_name(self, path: str) -> str:
        """Return ``p.sub.node`` for ``/ws/src/p/p/sub/node.py`` if ``p`` and ``sub`` are Python packages."""
        folder, base = os.path.split(path)
        names = [] if base == "__init__.py" else [base.removesuffix(".py")]
        while "__init__.py" in self._listing(folder):
            folder, package = os.path.split(folder)
            names.insert(0, package)
        return ".".join(names) or base.removesuffix(".py")

    def top_folder(self, path: str) -> str:
        """Return the folder that would have to be on ``sys.path`` for the module in ``path``."""
        folder = os.path.dirname(os.path.abspath(path))
        while "__init__.py" in self._listing(folder):
            folder = os.path.dirname(folder)
        return folder

    def find(self, name: str, beside: str) -> str | None:
        """Return the file of module ``name`` for a program started in folder ``beside``; ``None``: foreign."""
        key = (name, beside)
        if key not in self._found:
            self._found[key] = self._search(name, beside)
        return self._found[key]

    def _search(self, name: str, beside: str) -> str | None:
        steps = name.split(".")
        if steps[0] in MODELLED or (len(steps) > 1 and steps[1] in _INTERFACES):
            return None
        for root in (beside, *self.roots):
            found = self._below(root, steps)
            if found:
                return found
        return None

    def _below(self, root: str, steps: list[str]) -> str | None:
        folder = root
        for step in steps[:-1]:
            if step not in self._listing(folder):
                return None
            folder = os.path.join(folder, step)
        last = steps[-1]
        listing = self._listing(folder)
        if last in listing:
            inside = os.path.join(folder, last)
            if "__init__.py" in self._listing(inside):
                return os.path.join(inside, "__init__.py")
        if last + ".py" in listing:
            return os.path.join(folder, last + ".py")
        return None

    def _listing(self, folder: str) -> frozenset[str]:
        listing = self._listings.get(folder)
        if listing is None:
            try:
                listing = frozenset(os.listdir(folder))
            except OSError:
                listing = frozenset()
            self._listings[folder] = listing
            self.ask("folder", folder)
        return listing


_UNREADABLE = {errno.EFBIG: "is too large to be a program", errno.EINVAL: "is not a regular file"}


def _parse(path: str, name: str) -> SourceModule:
    is_package = os.path.basename(path) == "__init__.py"
    empty = ast.Module(body=[], type_ignores=[])
    try:
        data = read_bytes(path, MAX_SOURCE_BYTES)
    except OSError as error:
        why = _UNREADABLE.get(error.errno or 0, f"cannot be read: {error.strerror}")
        return SourceModule(name, path, empty, "", is_package, why)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # invalid escapes in foreign sources
            tree = ast.parse(data, path)
        text = source_text(data)
    except SyntaxError as error:
        version = ".".join(map(str, sys.version_info[:2]))
        why = f"is not valid Python {version}: {error.msg}"
        return SourceModule(name, path, empty, "", is_package, why, error.lineno or 0)
    except (ValueError, RecursionError, MemoryError) as error:
        return SourceModule(name, path, empty, "", is_package, f"cannot be parsed: {error}")
    return SourceModule(name, path, mangle(tree, text), text, is_package)
