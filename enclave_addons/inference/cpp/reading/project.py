"""The sources in reach: packages with their builds, include folders, plugin descriptions. Reads files."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from html import unescape

from enclave_addons.inference.cpp.reading.built import UNBUILT, Definitions, built_targets, joined
from enclave_addons.inference.cpp.reading.cmake import SOURCES, Build, Target, read_build
from enclave_common.files import text_or_nothing
from nodl.package_xml import read_package_xml

_CLASS = re.compile(r"<class\b((?:\s+[\w:]+\s*=\s*(?:\"[^\"]*\"|'[^']*'))+)\s*/?>")
_ATTRIBUTE = re.compile(r"([\w:]+)\s*=\s*(?:\"([^\"]*)\"|'([^']*)')")
_SKIPPED = frozenset({"build", "install", "log", "node_modules", "venv", "site-packages", "__pycache__"})


@dataclass(frozen=True)
class PluginClass:
    """An entry of a plugin description file: looked up by ``name``, made as ``type``, used as ``base``."""

    name: str
    type: str
    base: str


@dataclass
class SourcePackage:
    """A package folder; its build, plugins and include folders are read when first asked for."""

    name: str
    folder: str
    depends: frozenset[str] = frozenset()
    plugin_files: tuple[str, ...] = ()  # that ``package.xml`` names

    @cached_property
    def build(self) -> Build:
        return read_build(self.folder)

    @cached_property
    def plugins(self) -> list[PluginClass]:
        named = [each.replace("${prefix}", self.folder) for each in self.plugin_files]
        files = [*self.build.plugin_files, *named]
        return [each for file in dict.fromkeys(files) for each in plugin_classes(file)]

    @cached_property
    def include_folders(self) -> list[str]:
        usual = [os.path.join(self.folder, "include"), os.path.join(self.folder, "include", self.name)]
        found = [*self.build.includes, *usual, os.path.join(self.folder, "src"), self.folder]
        return [folder for folder in dict.fromkeys(found) if os.path.isdir(folder)]

    def header(self, name: str) -> str | None:
        """Return the source of the header that is installed as ``include/<name>``, if the build says so."""
        parts = name.split("/")
        for count in range(len(parts) - 1, 0, -1):
            folder = self.build.headers.get("/".join(parts[:count]))
            path = os.path.normpath(os.path.join(folder, *parts[count:])) if folder else ""
            if path and os.path.isfile(path):
                return path
        return None


@dataclass
class Workspace:
    """Packages whose sources are in reach, and installed prefixes whose headers are."""

    packages: dict[str, SourcePackage] = field(default_factory=dict)
    prefixes: tuple[str, ...] = ()
    build_folders: tuple[str, ...] = ()
    _found: dict[tuple[str, str], str | None] = field(default_factory=dict)
    _public: dict[str, str | None] = field(default_factory=dict)

    def package_of(self, file: str) -> SourcePackage | None:
        best: SourcePackage | None = None
        for package in self.packages.values():
            inside = file.startswith(package.folder + os.sep)
            if inside and (best is None or len(package.folder) > len(best.folder)):
                best = package
        return best

    def header(self, name: str, from_file: str, quoted: bool) -> str | None:
        """Return the file that ``#include`` means: beside the file, in its package, in others, in the prefixes."""
        if quoted:
            beside = os.path.normpath(os.path.join(os.path.dirname(from_file), name))
            if os.path.isfile(beside):
                return beside
        package = self.package_of(from_file)
        key = (package.name if package else "", name)
        if key not in self._found:
            self._found[key] = self._search(name, package)
        return self._found[key]

    def _search(self, name: str, package: SourcePackage | None) -> str | None:
        own = package.include_folders if package else []
        first = self.packages.get(name.partition("/")[0])
        others = first.include_folders if first else []
        return (
            _first_below((*own, *others), name)
            or (first.header(name) if first is not None else None)
            or self._anywhere(name)
            or self._generated(name, package, first)
        )

    def _anywhere(self, name: str) -> str | None:
        """Return the header of that name in any package, else in a prefix: the same for whoever includes it."""
        if name not in self._public:
            self._public[name] = _first_below((*self._all_folders, *self._installed(name)), name)
        return self._public[name]

    def _generated(self, name: str, *packages: SourcePackage | None) -> str | None:
        """Return the file of parameters that generate_parameter_library makes this header of."""
        target, suffix = os.path.splitext(os.path.basename(name))
        for package in filter(None, (*packages, *self.packages.values())) if suffix == ".hpp" else ():
            if "generate_parameter_library" in package.depends and target in package.build.parameter_files:
                return package.build.parameter_files[target]
        return None

    @cached_property
    def _all_folders(self) -> list[str]:
        return [
            f
            for p in self.packages.values()
            for f in p.include_folders
            if f.startswith(os.path.join(p.folder, "include"))
        ]

    def _installed(self, name: str) -> Iterable[str]:
        package = name.partition("/")[0]
        for prefix in self.prefixes:
            yield os.path.join(prefix, "include", package)
            yield os.path.join(prefix, "include")

    @cached_property
    def plugin_classes(self) -> dict[str, list[tuple[PluginClass, SourcePackage]]]:
        """Return the plugins by lookup name and by class."""
        found: dict[str, list[tuple[PluginClass, SourcePackage]]] = {}
        for package in self.packages.values():
            for each in package.plugins:
                for key in dict.fromkeys((each.name, each.type)):
                    found.setdefault(key, []).append((each, package))
        return found

    @cached_property
    def _built(self) -> dict[tuple[str, str], Definitions]:
        return built_targets(self.build_folders)

    def definitions(self, package: SourcePackage, targets: Sequence[Target]) -> Definitions:
        """Return what sources of one program are compiled with: as they were built, else it is open."""
        own = self._definitions(package, targets)
        return own if self.within(package, own) == own else own._replace(package=package.name)

    def within(self, package: SourcePackage, definitions: Definitions) -> Definitions:
        """Return what files of a package are compiled with: in a program with ``definitions``, or its libraries."""
        libraries = [each for each in package.build.libraries if each.sources]
        return joined([definitions, self._definitions(package, libraries)]) if libraries else definitions

    def _definitions(self, package: SourcePackage, targets: Iterable[Target]) -> Definitions:
        compiled = [each for each in targets if any(file.endswith(SOURCES) for file in each.sources)]
        return joined(self._built.get((package.name, each.name), UNBUILT) for each in compiled)


def find_packages(roots: Iterable[str]) -> dict[str, SourcePackage]:
    """Find every package below ``roots``; links are followed, and folders ignored, as colcon does."""
    found: dict[str, SourcePackage] = {}
    for root in roots:
        seen: set[str] = set()
        for folder, folders, names in os.walk(root, followlinks=True):
            real = os.path.realpath(folder)
            if real in seen or "COLCON_IGNORE" in names or "AMENT_IGNORE" in names:
                folders[:] = []
                continue
            seen.add(real)
            if "package.xml" in names:
                folders[:] = []
                package = read_source_package(folder)
                found.setdefault(package.name, package)
            else:
                folders[:] = sorted(f for f in folders if f not in _SKIPPED and not f.startswith("."))
    return found


def read_source_package(folder: str) -> SourcePackage:
    """Name and dependencies from ``package.xml``; the name of the folder where that gives no name."""
    manifest = read_package_xml(folder)
    return SourcePackage(
        manifest.name or os.path.basename(folder), folder, manifest.depends, manifest.plugins
    )


def plugin_classes(file: str) -> list[PluginClass]:
    """Return the classes of a plugin description file; none if it cannot be read."""
    found = []
    for match in _CLASS.finditer(re.sub(r"<!--(?:.|\n)*?-->", "", text_or_nothing(file))):
        values = {m[1]: unescape(m[2] if m[2] is not None else m[3]) for m in _ATTRIBUTE.finditer(match[1])}
        if "type" in values:
            name = values.get("name") or values["type"]
            found.append(PluginClass(name, values["type"].lstrip(":"), values.get("base_class_type", "")))
    return found


def targets_of(target: Target, build: Build) -> list[Target]:
    """Return the target and the libraries of its package that it links."""
    found, waiting = {target.name: target}, [target]
    while waiting:
        current = waiting.pop()
        names = list(current.links)
        if current.automatic:
            names += [each.name for each in build.libraries]
        for name in names:
            linked = build.targets.get(name.rpartition("::")[2])
            if linked is not None and linked.name not in found:
                found[linked.name] = linked
                waiting.append(linked)
    return list(found.values())


def sources_of(targets: Iterable[Target]) -> list[str]:
    """Return what targets are built from, each file once."""
    return list(dict.fromkeys(file for target in targets for file in target.sources))


def _first_below(folders: Iterable[str], name: str) -> str | None:
    """Return the file of that name below the first folder that has it."""
    paths = (os.path.normpath(os.path.join(folder, name)) for folder in folders)
    return next(filter(os.path.isfile, paths), None)
