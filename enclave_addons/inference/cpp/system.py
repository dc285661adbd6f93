"""C++ files in, their nodes out: executables and components of their packages, nodes nobody makes; single programs of a
workspace. Answers are kept by content between runs. Reads files."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from enclave_addons.inference.answers.cpp import Answers, Made, WatchedStart
from enclave_addons.inference.cpp.entry import Answer, CppSupportMissing, Entry, Solved, failure
from enclave_addons.inference.cpp.libraries import NODE_BASES
from enclave_addons.inference.cpp.models.controllers import CONTROLLERS
from enclave_addons.inference.cpp.program import Sources, definitions_of, registered_components, target_entry
from enclave_addons.inference.cpp.reading.built import UNBUILT
from enclave_addons.inference.cpp.reading.cmake import SOURCES
from enclave_addons.inference.cpp.reading.names import Names
from enclave_addons.inference.cpp.reading.project import SourcePackage, Workspace, find_packages
from enclave_addons.inference.cpp.solved import solve, solve_all
from enclave_addons.inference.cpp.syntax import check_support
from enclave_addons.inference.packages import read_package
from enclave_addons.inference.start import LaunchKey, Progress, Start
from enclave_common.files import text_or_nothing
from enclave_common.source_location import SourceLocation
from enclave_common.words import did_you_mean, some_of
from nodl.dependence import COMPONENT, HOST
from nodl.node_interface import Gap, NodeInterface

_NAMED = 5  # programs of a package in a message
_TESTS = frozenset({"test", "tests", "testing", "benchmark", "examples", "example", "mock"})


@dataclass
class Inferred:
    """The nodes, the gaps of programs that gave none, and the places that make nothing, with the reason."""

    nodes: list[NodeInterface] = field(default_factory=list)
    gaps: list[Gap] = field(default_factory=list)
    dead: list[Gap] = field(default_factory=list)


def infer_sources(
    files: Sequence[str], prefixes: Sequence[str] = (), progress: Progress | None = None
) -> Inferred:
    """Infer the nodes of ``files``; raises ``CppSupportMissing``."""
    check_support()
    workspace = workspace_of(files, prefixes)
    loose = (os.path.dirname(file) for file in files if workspace.package_of(file) is None)
    answers = Answers(workspace, tuple(sorted(set(loose))))
    question = ("files", tuple(files), workspace.build_folders)
    found = answers.find(question)
    if found is None:
        found = _infer(files, Sources(workspace), answers, progress)
        answers.keep(question, found)
    solved: tuple[Solved, ...] = found.answer
    return Inferred(
        [node for each in solved for node in each.nodes],
        [gap for each in solved if not each.nodes for gap in each.gaps],
        [gap for each in solved for gap in each.dead],
    )


def _infer(
    files: Sequence[str], sources: Sources, answers: Answers, progress: Progress | None = None
) -> Made:
    """Infer the programs of all files: those that are built, loose ones, then the nodes that nobody makes."""
    workspace, read = sources.workspace, dict[str, str]()
    found: list[Solved] = []
    made: set[str] = set()
    lasting = True

    def solved(search: Callable[[], Iterable[tuple[LaunchKey, Entry]]]) -> list[tuple[Entry, Solved]]:
        nonlocal lasting
        try:
            listed = tuple(search())
        except CppSupportMissing:
            raise
        except Exception as error:
            lasting, why = False, failure("the search for C++ programs", error)
            found.append(Solved(gaps=(Gap(SourceLocation(files[0]), why),)))
            return []
        answered = solve_all(sources, answers, listed, progress)
        for each in answered:
            read.update(each.files)
            lasting = lasting and each.lasting
        return [(entry, each.answer) for (_, entry), each in zip(listed, answered, strict=True)]

    for search in (
        lambda: programs(workspace, sources, set(files)),
        lambda: _left_over(workspace, sources, files),
    ):
        for _, each in solved(search):
            found.append(each)
            made.update(each.classes)
    for entry, each in solved(lambda: _unmade(workspace, sources, files, set(made))):
        if entry.cls not in made and not made.issuperset(each.classes):
            made.update(each.classes)
            found.append(each)
    return Made(tuple(found), {**sources.digests, **read}, lasting)


def workspace_of(files: Iterable[str], prefixes: Sequence[str] = ()) -> Workspace:
    """Return the packages that ``files`` lie in, and those beside them in the same source space."""
    own: dict[str, None] = {}
    roots: dict[str, None] = {}
    builds: dict[str, None] = {}
    for file in files:
        package = _package_folder(Path(file))
        if package is None:
            continue
        own.setdefault(str(package))
        space = _source_space(package)
        roots.setdefault(str(space if space is not None else package))
        if space is not None:
            builds.setdefault(str(space.parent / "build"))
    return Workspace(find_packages((*own, *roots)), tuple(prefixes), tuple(builds))


def _package_folder(file: Path) -> Path | None:
    return next((folder for folder in file.parents if (folder / "package.xml").is_file()), None)


def _source_space(package: Path) -> Path | None:
    """Return ``src`` of a colcon workspace, or the repository that holds the package beside others.

    A package that is a repository itself, in no workspace, has none: what lies beside it is not its own.
    """
    for folder in package.parents:
        if folder.name == "src":
            return folder
        if (folder / ".git").exists():
            return folder
    if (package / ".git").exists():
        return None
    siblings = [p for p in package.parent.glob("*/package.xml") if p.parent != package]
    return package.parent if siblings else None


def programs(workspace: Workspace, sources: Sources, given: set[str]) -> list[tuple[LaunchKey, Entry]]:
    """Return every executable and component that one of the given files belongs to."""
    found: list[tuple[LaunchKey, Entry]] = []
    touched = [p for p in workspace.packages.values() if any(f.startswith(p.folder + os.sep) for f in given)]
    for package in touched:
        found += package_programs(package, workspace, sources, given)
    return found


def package_programs(
    package: SourcePackage, workspace: Workspace, sources: Sources, given: set[str] | None = None
) -> list[tuple[LaunchKey, Entry]]:
    """Return the executables and components of one package; with ``given`` those built from one of these files."""
    found: list[tuple[LaunchKey, Entry]] = []
    build = package.build
    for target in build.targets.values():
        entry = target_entry(target, package, workspace)
        wanted = given is None or any(file in given for file in entry.files)
        if target.executable and wanted:
            found.append((LaunchKey(package.name, build.renamed.get(target.name, target.name)), entry))
    for name, key in components(package, sources).items():
        entry = _component_entry(name, package, workspace, sources)
        if given is None or any(file in given for file in entry.files):
            found.append((key, entry))
    return found


def components(package: SourcePackage, sources: Sources) -> dict[str, LaunchKey]:
    """Return components by CMake and by the macro in the source."""
    found = {
        name: LaunchKey(package.name, executable, name) for name, executable in package.build.plugins.items()
    }
    for target in package.build.targets.values():
        for file in target.sources:
            index = sources.index(file, definitions_of(target, package, sources.workspace))
            for name in registered_components(index) if index is not None else ():
                if name not in found:
                    found[name] = LaunchKey(package.name, None, name)
    return found


def _component_entry(name: str, package: SourcePackage, workspace: Workspace, sources: Sources) -> Entry:
    build = package.build
    target = build.targets.get(build.plugin_targets.get(name, ""))
    if target is None:
        target = next(
            (
                t
                for t in build.targets.values()
                for f in t.sources
                if (i := sources.index(f, definitions_of(t, package, workspace)))
                and name in registered_components(i)
            ),
            None,
        )
    if target is None or not target.sources:
        files = [
            f
            for f in _all_sources(package)
            if (i := sources.index(f, UNBUILT)) and name in registered_components(i)
        ]
        return Entry(tuple(files), cls=name, main=False, place=package.folder)
    return target_entry(target, package, workspace)._replace(cls=name, main=False)


def _all_sources(package: SourcePackage) -> list[str]:
    return [str(path) for path in sorted(Path(package.folder).rglob("*")) if path.suffix in SOURCES]


def _left_over(
    workspace: Workspace, sources: Sources, files: Sequence[str]
) -> Iterable[tuple[LaunchKey, Entry]]:
    """Return files of no target: their mains and components."""
    built = {f for p in workspace.packages.values() for t in p.build.targets.values() for f in t.sources}
    loose = [file for file in files if file not in built and not _is_test(file, workspace)]
    by_folder: dict[str, list[str]] = {}
    for file in loose:
        package = workspace.package_of(file)
        by_folder.setdefault(package.name if package else "", []).append(file)
    for name, listed in by_folder.items():
        package_name = name or None
        indexed = {file: sources.index(file, UNBUILT) for file in listed}
        for file, index in indexed.items():
            if index is not None and "main" in index.functions:
                others = [f for f in listed if "main" not in getattr(indexed[f], "functions", {})]
                yield LaunchKey(package_name), Entry((file, *others))
        for file, index in indexed.items():
            for cls in registered_components(index) if index is not None else ():
                yield (
                    LaunchKey(package_name, None, cls),
                    Entry((file, *(f for f in listed if f != file)), cls=cls, main=False),
                )


def _unmade(
    workspace: Workspace, sources: Sources, files: Sequence[str], made: set[str]
) -> Iterable[tuple[LaunchKey, Entry]]:
    indexes = [
        i for f in files if not _is_test(f, workspace) and (i := sources.index(f, UNBUILT)) is not None
    ]
    headers = dict.fromkeys(name for index in indexes for name in index.source.includes)
    packages = {p.name for index in indexes if (p := workspace.package_of(index.file)) is not None}
    indexes += [
        i
        for name in headers
        if name not in files
        and getattr(workspace.package_of(name), "name", None) in packages
        and (i := sources.index(name, UNBUILT)) is not None
    ]
    names = Names(indexes)
    parents = {
        base.qualified
        for listed in names.classes.values()
        for cls in listed
        for _, base in names.bases(cls)
        if base
    }
    for index in indexes:
        for cls in [c for listed in index.classes.values() for c in listed]:
            bases = {
                names.resolve(w, each.scope, each.file).name
                for each in names.ancestry(cls)
                for w in each.bases
            }
            if not bases & NODE_BASES or cls.qualified in parents | made or cls.templates:
                continue
            package = workspace.package_of(index.file)
            own = [f for f in files if workspace.package_of(f) is package]
            yield (
                LaunchKey(package.name if package else None),
                Entry(_with_first(index.file, own), cls=cls.qualified, main=False),
            )


def _with_first(file: str, files: Sequence[str]) -> tuple[str, ...]:
    return (file, *(each for each in files if each != file and each.endswith(SOURCES)))


def _is_test(file: str, workspace: Workspace) -> bool:
    package = workspace.package_of(file)
    if package is not None and package.name.endswith(("_test", "_tests")):
        return True
    relative = os.path.relpath(file, package.folder) if package else os.path.basename(file)
    return any(part in _TESTS for part in Path(relative).parts[:-1])


class Answering:
    """Answers for one workspace; each package is looked at once."""

    def __init__(self, workspace: Workspace):
        self._workspace = workspace
        self._programs: dict[str, Sequence[tuple[LaunchKey, Entry]]] = {}

    def of_program(
        self, package: SourcePackage, executable: str | None, plugin: str | None, start: Start | None
    ) -> Answer:
        """Infer the nodes of an executable or component of ``package``; raises ``CppSupportMissing``."""
        try:
            programs = self._programs_of(package)
        except CppSupportMissing:
            raise
        except Exception as error:
            return Answer((), failure(f"reading the build of {package.folder}", error))
        for key, entry in programs:
            if (executable is not None and key.executable == executable) or (plugin and key.plugin == plugin):
                return _answer(self._solved(key, entry, start))
        what = f"executable '{executable}'" if executable else f"component {plugin}"
        made = {(key.executable if executable else key.plugin) or "" for key, _ in programs} - {""}
        if executable:
            made |= {
                *package.build.scripts,
                *(each.executable for each in read_package(package.folder).entry_points),
            }
        others = f"; it makes {some_of(sorted(made), _NAMED)}" if made else ""
        by_cmake = os.path.isfile(os.path.join(package.folder, "CMakeLists.txt"))
        build = f"{'CMakeLists.txt' if by_cmake else 'setup.py'} in {package.folder}"
        meant = did_you_mean(executable or plugin or "", made) or others
        return Answer((), f"{build} makes no {what}{meant}", not_made=True)

    def of_plugin(self, name: str, instance: str, start: Start | None) -> Answer:
        """Infer what the plugin that descriptions call ``name`` makes when a host loads it as ``instance``.

        Returns:
            First the controller of ros2_control, or what another plugin makes on its ``HOST`` or as ``COMPONENT``;
            then the nodes that it makes.

        Raises:
            CppSupportMissing: tree-sitter is not installed.
        """
        try:
            listed = self._workspace.plugin_classes.get(name, ())
        except Exception as error:
            return Answer((), failure("reading the plugin descriptions in reach", error))
        if not listed:
            return Answer((), f"no plugin description in reach has a class '{name}'")
        plugin, package = listed[0]
        entry = _plugin_entry(plugin.type, package, self._workspace)
        if plugin.base not in CONTROLLERS and not plugin.base.startswith("hardware_interface::"):
            entry = entry._replace(instance=instance or plugin.type)  # rviz gives its plugins no name
        solved = self._solved(LaunchKey(package.name, None, plugin.type), entry, start)
        return _answer(solved) if plugin.base in CONTROLLERS else _on_host(solved, package, plugin.type)

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


def _plugin_entry(name: str, package: SourcePackage, workspace: Workspace) -> Entry:
    """Return the class of a plugin with the sources of the library that exports it.

    With all sources of the package if CMake's files do not say what the library is made of.
    """
    last = name.rpartition("::")[2]
    libraries = package.build.libraries
    target = next((each for each in libraries if any(_exports(file, last) for file in each.sources)), None)
    if target is None:
        sources = _all_sources(package)
        exporting = next((each for each in sources if _exports(each, last)), None)
        files = _with_first(exporting, sources) if exporting is not None else ()
        return Entry(files, cls=name, main=False, place=package.folder)
    return target_entry(target, package, workspace)._replace(cls=name, main=False)


def _exports(file: str, name: str) -> bool:
    text = text_or_nothing(file)
    return "PLUGINLIB_EXPORT_CLASS" in text and re.search(rf"\b{re.escape(name)}\b", text) is not None


def _on_host(solved: Solved, package: SourcePackage, name: str) -> Answer:
    """Return what a plugin makes on the node that loads it, if anything, before the nodes that it makes."""
    host = next((node for node in solved.nodes if node.name in (HOST, COMPONENT)), None)
    others = tuple(node for node in solved.nodes if node is not host)
    if host is None:
        host = NodeInterface(
            package=package.name,
            executable=None,
            plugin=name,
            name=HOST,
            namespace=None,
            endpoints=(),
            source=SourceLocation(package.folder),
            gaps=() if others else solved.gaps,  # the first of them has those of the program
        )
    return Answer((host, *others), consulted=solved.consulted)


def _answer(solved: Solved) -> Answer:
    if solved.nodes:
        return Answer(solved.nodes, consulted=solved.consulted)
    reasons = "; ".join(f"{gap.source}: {gap.why}" for gap in solved.gaps)
    return Answer(
        (), f"no node was found in its sources{f' ({reasons})' if reasons else ''}", solved.consulted
    )
