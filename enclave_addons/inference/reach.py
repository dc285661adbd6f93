"""The sources that are in reach of a launch: beside the install prefixes, and where the user points.

A colcon workspace keeps ``src/`` and ``build/`` beside ``install/``; ``build/<package>/CMakeCache.txt`` names the
package's folder wherever it lies. Reads files; each workspace is read once.
"""

from __future__ import annotations

import glob
import os
import re
from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from enclave_addons.inference.cpp.entry import Answer
from enclave_addons.inference.packages import read_package
from enclave_addons.inference.python.program import Program, ProgramTarget
from enclave_common.files import read_text

if TYPE_CHECKING:
    from enclave_addons.inference.cpp.reading.project import SourcePackage, Workspace
    from enclave_addons.inference.cpp.system import Answering
    from enclave_addons.inference.start import Start

_HOME = re.compile(r"^CMAKE_HOME_DIRECTORY:\w+=(.+)$", re.MULTILINE)


class SourcesInReach:
    """Answers for one launch. ``folders`` come before the workspaces of ``prefixes``."""

    def __init__(self, prefixes: Sequence[str], folders: Sequence[str] = ()):
        self._prefixes = tuple(os.path.abspath(prefix) for prefix in prefixes)
        self._folders = tuple(os.path.abspath(folder) for folder in folders)

    def hold(self, package: str | None) -> bool:
        """Return whether the sources of ``package`` are among them."""
        return bool(self._folders or self._workspaces) and package in self._workspace.packages

    def infer(
        self, package: str, executable: str | None, plugin: str | None, start: Start | None = None
    ) -> Answer:
        """Infer the nodes of a compiled executable or component; raises ``CppSupportMissing``."""
        found = self._workspace.packages[package] if self.hold(package) else None
        if found is None:
            return Answer((), f"the sources of package '{package}' are not in reach ({self._searched()})")
        return self._answering.of_program(found, executable, plugin, start)

    def script(self, package: str, executable: str) -> ProgramTarget | None:
        """Return what would be installed as ``executable``: an entry point's module, or a script; None if neither."""
        if not self.hold(package):
            return None
        source = self._workspace.packages[package]
        if executable in source.build.scripts:
            return ProgramTarget(source.build.scripts[executable])
        entries = read_package(source.folder).entry_points
        entry = next((each for each in entries if each.executable == executable), None)
        if entry is None:
            return None
        file = Program(_module_folders(source.folder)).find(entry.module, source.folder)
        if file is None:
            missing = f"the module {entry.module} of entry point {executable} was not found"
            return ProgramTarget(os.path.join(source.folder, "setup.py"), missing=missing)
        return ProgramTarget(file, entry.module, tuple(entry.function.split(".")))

    @cached_property
    def module_folders(self) -> list[str]:
        """Return the folders in which the packages have their Python modules."""
        packages = self._workspace.packages.values()
        return [folder for package in packages for folder in _module_folders(package.folder)]

    def infer_plugin(self, name: str, instance: str, start: Start | None = None) -> Answer:
        """Infer a plugin that a host loads as ``instance``, by the name of its class; raises ``CppSupportMissing``."""
        if not (self._folders or self._workspaces):
            return Answer((), self._searched())
        return self._answering.of_plugin(name, instance, start)

    @cached_property
    def _answering(self) -> Answering:
        from enclave_addons.inference.cpp.system import Answering  # the whole analysis of C++ comes with it

        return Answering(self._workspace)

    @cached_property
    def _workspace(self) -> Workspace:
        from enclave_addons.inference.cpp.reading.project import (  # nodes in Python do without
            Workspace,
            find_packages,
        )

        packages = find_packages(self._folders)
        for space in self._workspaces:
            for name, package in find_packages([os.path.join(space, "src")]).items():
                packages.setdefault(name, package)
            for package in _built(os.path.join(space, "build")):
                packages.setdefault(package.name, package)
        builds = tuple(os.path.join(space, "build") for space in self._workspaces)
        return Workspace(packages, self._prefixes, builds)

    @cached_property
    def _workspaces(self) -> list[str]:
        """Folders with ``src`` or ``build`` beside ``install``: above a merged prefix, or two above an isolated one."""
        found: dict[str, None] = {}
        for prefix in self._prefixes:
            above = os.path.dirname(prefix.rstrip(os.sep))
            for folder in (above, os.path.dirname(above)):
                if any(os.path.isdir(os.path.join(folder, name)) for name in ("src", "build")):
                    found.setdefault(folder)
                    break
        return [folder for folder in found if folder not in ("/", "/usr", "/opt")]

    def _searched(self) -> str:
        beside = (os.path.join(space, "src") for space in self._workspaces)
        places = tuple(dict.fromkeys((*self._folders, *beside)))
        return (
            f"looked below {', '.join(places)}"
            if places
            else "no workspace beside the prefixes; name one with --source"
        )


def _module_folders(package: str) -> list[str]:
    """Return the folders that hold a package's top-level modules: its own, and ``src`` if setup.py may say so."""
    if not os.path.isfile(os.path.join(package, "setup.py")):
        return [package] if glob.glob(os.path.join(glob.escape(package), "*", "__init__.py")) else []
    return [package, os.path.join(package, "src")]


def _built(folder: str) -> Iterator[SourcePackage]:
    """Return the source folders that a build remembers."""
    from enclave_addons.inference.cpp.reading.project import read_source_package

    for cache in sorted(Path(folder).glob("*/CMakeCache.txt")):
        try:
            match = _HOME.search(read_text(cache, errors="replace"))
        except OSError:
            continue
        if match and os.path.isfile(os.path.join(match[1], "package.xml")):
            yield read_source_package(match[1])
