"""The sources of compiled nodes that are in reach of a launch: beside the install prefixes, and where the user points.

A colcon workspace keeps ``src/`` and ``build/`` beside ``install/``; ``build/<package>/CMakeCache.txt`` names the
package's folder wherever it lies. Reads files; each workspace is read once.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path

from enclave_launch.boundary.files import read_text
from nodl.infer.cpp.cache.answers import Answers, Made, WatchedStart
from nodl.infer.cpp.entry import Entry, Key, Solved
from nodl.infer.cpp.program import Sources
from nodl.infer.cpp.reading.project import SourcePackage, Workspace, find_packages, read_source_package
from nodl.infer.cpp.solved import solve
from nodl.infer.cpp.syntax import check_support
from nodl.infer.cpp.system import package_programs
from nodl.infer.start import Start
from nodl.node_interface import NodeInterface

_HOME = re.compile(r"^CMAKE_HOME_DIRECTORY:\w+=(.+)$", re.MULTILINE)


class Answer:
    """What the sources say of one program. ``consulted``: parameters of the launch decided what it makes."""

    def __init__(self, interfaces: tuple[NodeInterface, ...], why: str = "", consulted: bool = False):
        self.interfaces = interfaces
        self.why = why
        self.consulted = consulted


class SourcesInReach:
    """Answers for one launch. ``folders`` come before the workspaces of ``prefixes``."""

    def __init__(self, prefixes: Sequence[str], folders: Sequence[str] = ()):
        self._prefixes = tuple(os.path.abspath(prefix) for prefix in prefixes)
        self._folders = tuple(os.path.abspath(folder) for folder in folders)
        self._programs: dict[str, Sequence[tuple[Key, Entry]]] = {}

    def infer(
        self, package: str, executable: str | None, plugin: str | None, start: Start | None = None
    ) -> Answer:
        """The nodes of an executable or component. Raises ``CppSupportMissing``."""
        found = self._sources.workspace.packages.get(package)
        if found is None:
            return Answer((), f"the sources of package '{package}' are not in reach ({self._searched()})")
        for key, entry in self._programs_of(found):
            if (executable is not None and key.executable == executable) or (plugin and key.plugin == plugin):
                return _answer(self._solved(key, entry, start))
        what = f"executable '{executable}'" if executable else f"component {plugin}"
        return Answer((), f"the CMakeLists.txt of {found.folder} builds no {what}")

    def _solved(self, key: Key, entry: Entry, start: Start | None) -> Solved:
        question = ("program", key, entry)
        found = self._answers.find(question, start)
        if found is None:
            watched = WatchedStart(start) if start is not None else None
            found = solve(self._sources, key, entry, watched)
            self._answers.keep(question, found, watched)
        solved: Solved = found.answer
        return solved

    def _programs_of(self, package: SourcePackage) -> Sequence[tuple[Key, Entry]]:
        question = ("programs", package.name, package.folder)
        if package.name not in self._programs:
            found = self._answers.find(question)
            if found is None:
                sources = Sources(self._sources.workspace)
                found = Made(tuple(package_programs(package, sources.workspace, sources)), sources.digests)
                self._answers.keep(question, found)
            self._programs[package.name] = found.answer
        return self._programs[package.name]

    @cached_property
    def _answers(self) -> Answers:
        check_support()
        return Answers(self._sources.workspace)

    @cached_property
    def _sources(self) -> Sources:
        packages = find_packages(self._folders)
        for space in self._workspaces:
            for name, package in find_packages([str(space / "src")]).items():
                packages.setdefault(name, package)
            for package in _built(space / "build"):
                packages.setdefault(package.name, package)
        builds = tuple(str(space / "build") for space in self._workspaces)
        return Sources(Workspace(packages, self._prefixes, builds))

    @cached_property
    def _workspaces(self) -> list[Path]:
        """Folders with ``src`` or ``build`` beside ``install``: above a merged prefix, or two above an isolated one."""
        found: dict[Path, None] = {}
        for prefix in self._prefixes:
            for folder in list(Path(prefix).parents)[:2]:
                if (folder / "src").is_dir() or (folder / "build").is_dir():
                    found.setdefault(folder)
                    break
        return [folder for folder in found if str(folder) not in ("/", "/usr", "/opt")]

    def _searched(self) -> str:
        places = [*self._folders, *(str(space / "src") for space in self._workspaces)]
        return (
            f"looked below {', '.join(places)}"
            if places
            else "no workspace beside the prefixes; name one with --source"
        )


def _built(folder: Path) -> Iterator[SourcePackage]:
    """The source folders that a build remembers."""
    for cache in sorted(folder.glob("*/CMakeCache.txt")):
        try:
            match = _HOME.search(read_text(cache, errors="replace"))
        except OSError:
            continue
        if match and os.path.isfile(os.path.join(match[1], "package.xml")):
            yield read_source_package(match[1])


def _answer(solved: Solved) -> Answer:
    if solved.nodes:
        return Answer(solved.nodes, consulted=solved.consulted)
    reasons = "; ".join(f"{gap.source}: {gap.why}" for gap in solved.gaps)
    return Answer(
        (), f"no node was found in its sources{f' ({reasons})' if reasons else ''}", solved.consulted
    )
