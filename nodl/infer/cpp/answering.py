"""What the sources of a workspace say of the programs that its packages build, kept by content between runs."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

from nodl.infer.cpp.cache.answers import Answers, Made, WatchedStart
from nodl.infer.cpp.entry import Answer, Entry, Solved
from nodl.infer.cpp.program import Sources
from nodl.infer.cpp.reading.project import SourcePackage, Workspace
from nodl.infer.cpp.solved import solve
from nodl.infer.cpp.syntax import check_support
from nodl.infer.cpp.system import package_programs
from nodl.infer.start import LaunchKey, Start


class Answering:
    """Answers for one workspace; each package is looked at once."""

    def __init__(self, workspace: Workspace):
        self._workspace = workspace
        self._programs: dict[str, Sequence[tuple[LaunchKey, Entry]]] = {}

    def of_program(
        self, package: SourcePackage, executable: str | None, plugin: str | None, start: Start | None
    ) -> Answer:
        """The nodes of an executable or component of ``package``. Raises ``CppSupportMissing``."""
        for key, entry in self._programs_of(package):
            if (executable is not None and key.executable == executable) or (plugin and key.plugin == plugin):
                return _answer(self._solved(key, entry, start))
        what = f"executable '{executable}'" if executable else f"component {plugin}"
        return Answer((), f"the CMakeLists.txt of {package.folder} builds no {what}")

    @cached_property
    def _sources(self) -> Sources:
        return Sources(self._workspace)

    def _solved(self, key: LaunchKey, entry: Entry, start: Start | None) -> Solved:
        question = ("program", key, entry)
        found = self._answers.find(question, start)
        if found is None:
            watched = WatchedStart(start) if start is not None else None
            found = solve(self._sources, key, entry, watched)
            self._answers.keep(question, found, watched)
        solved: Solved = found.answer
        return solved

    def _programs_of(self, package: SourcePackage) -> Sequence[tuple[LaunchKey, Entry]]:
        question = ("programs", package.name, package.folder)
        if package.name not in self._programs:
            found = self._answers.find(question)
            if found is None:
                sources = Sources(self._workspace)
                found = Made(tuple(package_programs(package, sources.workspace, sources)), sources.digests)
                self._answers.keep(question, found)
            self._programs[package.name] = found.answer
        return self._programs[package.name]

    @cached_property
    def _answers(self) -> Answers:
        check_support()
        return Answers(self._workspace)


def _answer(solved: Solved) -> Answer:
    if solved.nodes:
        return Answer(solved.nodes, consulted=solved.consulted)
    reasons = "; ".join(f"{gap.source}: {gap.why}" for gap in solved.gaps)
    return Answer(
        (), f"no node was found in its sources{f' ({reasons})' if reasons else ''}", solved.consulted
    )
