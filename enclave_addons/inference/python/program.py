"""The analysed program as text: which module is which file, parsed once. Reads files, runs nothing.

An import finds a module as Python would: relative to the package, beside the started script, or below one
of the roots (folders that hold top-level packages). What is not found there is a foreign library. What is searched in a
file's text (``yield``, private names, whatever makes interfaces) must find every name that the parser finds: encoding,
newlines, NFKC and private names are as Python has them. An encoding in which plain ASCII can spell another text
(``utf-7``, ``unicode_escape``) is refused.
"""

from __future__ import annotations

import ast
import errno
import io
import os
import re
import sys
import tokenize
import unicodedata
import warnings
from collections.abc import Iterable
from typing import NamedTuple

from enclave_addons.inference.answers.folder import digest, digest_of
from enclave_common.files import read_bytes

_PRIVATE = re.compile(r"__(?!\w*__\b)\w")  # or the middle of a name, which does no harm
_ASCII = b"\\x41\\u0041+AEE-"


class HidingEncodingError(ValueError):
    """The declared encoding writes letters as other letters."""


def source_text(data: bytes) -> str:
    """Return the text of a file that could be parsed. Raises ``HidingEncodingError``."""
    encoding = "utf-8"
    if any(b"coding" in line for line in data.split(b"\n", 2)[:2]):  # PEP 263: in one of the first two
        encoding, _ = tokenize.detect_encoding(io.BytesIO(data).readline)
        if _ASCII.decode(encoding, "replace") != _ASCII.decode("ascii"):
            raise HidingEncodingError(f"the encoding {encoding} hides what the file says")
    text = data.decode(encoding, "replace")
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    return text if text.isascii() else unicodedata.normalize("NFKC", text)  # language reference, 2.3


def mangle(tree: ast.Module, text: str) -> ast.Module:
    """Write private names in ``tree`` as the compiler does, in place: ``__x`` in ``class C`` is ``_C__x``.

    Source: language reference, 6.2.1. Cheap for files that have none.
    """
    if _PRIVATE.search(text):
        _Mangler().visit(tree)
    return tree


class _Mangler(ast.NodeVisitor):
    def __init__(self) -> None:
        self._class = ""

    def visit(self, node: ast.AST) -> None:
        if self._class:
            for field in ("id", "attr", "name", "arg", "asname"):
                name = getattr(node, field, None)
                if isinstance(name, str) and not isinstance(node, ast.keyword):
                    setattr(node, field, self._mangled(name))
            if isinstance(node, (ast.Global, ast.Nonlocal)):
                node.names = [self._mangled(name) for name in node.names]
        if isinstance(node, ast.ClassDef):
            outer, self._class = self._class, node.name.lstrip("_")
            self.generic_visit(node)
            self._class = outer
        else:
            self.generic_visit(node)

    def _mangled(self, name: str) -> str:
        private = name.startswith("__") and not name.endswith("__") and "." not in name
        return f"_{self._class}{name}" if private else name


MAX_SOURCE_BYTES = 1_000_000

# Libraries whose behaviour the models describe; their sources are never analysed.
MODELLED = frozenset(
    {
        "rclpy", "tf2_ros", "tf2_py", "tf2_geometry_msgs", "tf2_sensor_msgs", "message_filters", "cv_bridge",
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
