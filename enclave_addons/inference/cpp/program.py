"""Programs: one main or component with the sources that it is built from, run to its findings. Reads files."""

from __future__ import annotations

import os
import re
from codecs import BOM_UTF8
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from enclave_addons.inference.answers.folder import digest_of, digest_of_content
from enclave_addons.inference.cpp.engine import calls, expressions, statements  # noqa: F401 (how each runs)
from enclave_addons.inference.cpp.engine.callbacks import run_callbacks
from enclave_addons.inference.cpp.engine.check import SiteAnswer, account
from enclave_addons.inference.cpp.engine.frames import Frame
from enclave_addons.inference.cpp.engine.invocation import invoke
from enclave_addons.inference.cpp.engine.machine import Machine, StepLimitExceeded
from enclave_addons.inference.cpp.engine.objects import construct, initial_value
from enclave_addons.inference.cpp.engine.places import static_place
from enclave_addons.inference.cpp.engine.sites import CREATES
from enclave_addons.inference.cpp.engine.values import Seq, Value, literal, unknown
from enclave_addons.inference.cpp.entry import CppSupportMissing, Entry, failure
from enclave_addons.inference.cpp.findings import AllocatedNode
from enclave_addons.inference.cpp.models.loaded import host_of, load
from enclave_addons.inference.cpp.models.nodes import ARGUMENT, OF_CONTAINER
from enclave_addons.inference.cpp.reading.built import Definitions, named_in
from enclave_addons.inference.cpp.reading.cmake import Target
from enclave_addons.inference.cpp.reading.collect import index_file
from enclave_addons.inference.cpp.reading.declarations import (
    Class,
    FileIndex,
    Function,
    FunctionParameter,
)
from enclave_addons.inference.cpp.reading.known_headers import KNOWN_HEADERS
from enclave_addons.inference.cpp.reading.names import Names
from enclave_addons.inference.cpp.reading.parameter_library import listener_of
from enclave_addons.inference.cpp.reading.preprocess import Include, Preprocessed, preprocess
from enclave_addons.inference.cpp.reading.project import SourcePackage, Workspace, sources_of, targets_of
from enclave_addons.inference.cpp.reading.type_names import Type
from enclave_addons.inference.start import Start
from enclave_common.files import read_bytes
from enclave_common.source_location import SourceLocation

MAX_FILE_SIZE = 2_000_000
_REGISTERED = re.compile(
    r"RCLCPP_COMPONENTS_REGISTER_NODE\s*\(\s*([\w:<>, ]+?)\s*\)"
    r"|CLASS_LOADER_REGISTER_CLASS\s*\(\s*([\w:<>, ]+?)\s*,\s*(?:rclcpp|rclcpp_lifecycle)::\w*Node\s*\)"
)


@dataclass(frozen=True)
class ProgramFindings:
    """What one program makes. ``classes``: the node classes that it makes objects of."""

    nodes: list[AllocatedNode]
    gaps: tuple[tuple[SourceLocation, str], ...]
    answers: list[SiteAnswer]
    classes: set[str]
    files: tuple[str, ...]
    consulted: bool
    from_default: tuple[str, ...]


_Included: TypeAlias = dict[tuple[str, bool], Preprocessed | None]


class Sources:
    """Files of one workspace, each preprocessed and indexed once for each set of definitions."""

    def __init__(self, workspace: Workspace):
        self.workspace = workspace
        self._preprocessed: dict[tuple[str, Definitions], Preprocessed | None] = {}
        self._elsewhere: dict[tuple[str, Definitions], Definitions] = {}  # in another package, by its name
        self._alike: dict[tuple[str, Definitions], list[tuple[Preprocessed, _Included]]] = {}
        self._indexed: dict[int, FileIndex] = {}  # by the ``id`` of what was preprocessed
        self.unreadable: dict[str, str] = {}
        self.digests: dict[str, str] = {}  # SHA-256 of what was read

    def preprocessed(self, file: str, definitions: Definitions) -> Preprocessed | None:
        key = (file, definitions)
        if key not in self._preprocessed:
            self._preprocessed[key] = None  # a file that includes itself
            source = self._read(file)
            if source is not None and file.endswith((".yaml", ".yml")):
                source = listener_of(source)
            if source is not None:

                def include(name: str, quoted: bool) -> Preprocessed | None:
                    found = self.workspace.header(name, file, quoted)
                    if found is None or self._is_modelled(name, found, file):
                        return None
                    return self.preprocessed(found, definitions)

                own = named_in(source, self._of(file, definitions))
                self._preprocessed[key] = self._preprocess(file, source, own, include)
        return self._preprocessed[key]

    def _preprocess(self, file: str, source: str, own: Definitions, include: Include) -> Preprocessed:
        """Preprocess a file, or return what was made of it with other definitions, if it sees no difference."""
        before = self._alike.setdefault((file, own), [])
        for found, included in before:
            if all(include(*asked) is given for asked, given in included.items()):
                return found
        seen: _Included = {}

        def noted(name: str, quoted: bool) -> Preprocessed | None:
            seen[name, quoted] = include(name, quoted)
            return seen[name, quoted]

        before.append((preprocess(file, source, own, noted), seen))
        return before[-1][0]

    def _is_modelled(self, name: str, found: str, file: str) -> bool:
        """Return whether a header is of rclcpp or a library of the table, known by its model alone, seen from
        outside.
        """
        folder = name.partition("/")[0]
        if name.endswith("/version.h"):
            return False  # which release this is
        if folder in _CORE:
            return True
        package = self.workspace.package_of(found)
        if folder in _MODELLED_IF_INSTALLED:
            return package is None
        said = _COPIED.get(os.path.basename(name))
        if said is not None and said in (self._read(found) or "")[:1000]:
            return True
        return folder in KNOWN_HEADERS and package is not self.workspace.package_of(file)

    def _read(self, file: str) -> str | None:
        try:
            if os.path.getsize(file) > MAX_FILE_SIZE:
                self.digests[file] = digest_of(file)
                self.unreadable[file] = "this file is over 2 MB and was not read"
                return None
            content = read_bytes(file)
            self.digests[file] = digest_of_content(content)
            text = content.removeprefix(BOM_UTF8).decode("utf-8", "replace")
            return text.replace("\r\n", "\n").replace("\r", "\n")
        except OSError as error:
            self.digests[file] = digest_of(file)
            self.unreadable[file] = f"this file cannot be read: {error.strerror}"
            return None

    def _of(self, file: str, definitions: Definitions) -> Definitions:
        """Return what a file is compiled with: as part of a program with ``definitions``, or of its own package."""
        package = self.workspace.package_of(file)
        if package is None or package.name == definitions.package:
            return definitions
        key = (package.name, definitions)
        if key not in self._elsewhere:
            self._elsewhere[key] = self.workspace.within(package, definitions)
        return self._elsewhere[key]

    def index(self, file: str, definitions: Definitions) -> FileIndex | None:
        try:
            source = self.preprocessed(file, definitions)
            if source is None:
                return None
            if id(source) not in self._indexed:
                self._indexed[id(source)] = index_file(source)
            return self._indexed[id(source)]
        except CppSupportMissing:
            raise
        except (
            Exception
        ) as error:  # a mistake of ours is a gap of the programs with this file, and ends no plan
            self.unreadable[file] = failure("reading this file", error)
            return None

    def closure(self, files: Iterable[str], definitions: Definitions) -> list[FileIndex]:
        """Return ``files``, what they include, and the library sources of other packages that define what they
        include.
        """
        found: dict[str, FileIndex] = {}
        waiting = list(dict.fromkeys(files))
        packages: set[str] = set()
        own = self.workspace.package_of(waiting[0]) if waiting else None
        while waiting:
            file = waiting.pop(0)
            if file in found:
                continue
            index = self.index(file, definitions)
            if index is None:
                continue
            found[file] = index
            waiting += index.source.includes
            package = self.workspace.package_of(file)
            if package is not None and package is not own and package.name not in packages:
                packages.add(package.name)
                waiting += library_sources(package)
        return list(found.values())


_CORE = frozenset({
    "rclcpp", "rclcpp_lifecycle", "rclcpp_action", "rclcpp_components", "rcl", "rcutils", "rmw", "rcpputils",
    "pluginlib", "class_loader", "rosidl_runtime_cpp", "rosidl_typesupport_cpp", "tracetools",
})  # fmt: skip

_COPIED = {"json.hpp": "JSON for Modern C++", "robin_hood.h": "based on robin hood hashing"}
"""Headers that packages have copies of, with what these begin with: they know nothing of ROS."""

_MODELLED_IF_INSTALLED = frozenset({"nav2_core", "nav2_costmap_2d", "nav2_ros_common", "nav2_util"})
"""Of whose classes the table has what plugins and nodes of others use; beside its sources nav2 itself is followed."""


def library_sources(package: SourcePackage) -> list[str]:
    """Return what the libraries of a package are built from."""
    return sources_of(package.build.libraries)


# --- running ----------------------------------------------------------------------------------------------------


def run_program(sources: Sources, entry: Entry, start: Start | None) -> ProgramFindings:
    """Run everything that the program may make; raises ``CppSupportMissing``."""
    files = sources.closure(entry.files, entry.definitions)
    missing = [name for name in _possible_plugins(sources, files) if name not in {i.file for i in files}]
    if missing:
        files = sources.closure([*entry.files, *missing], entry.definitions)
    ros_1 = _header_of_ros_1(files)
    if ros_1 is not None:
        gap = (ros_1, "this is a program of ROS 1, which is not analysed")
        return ProgramFindings([], (gap,), [], set(), tuple(index.file for index in files), False, ())
    names = Names(files)
    names.plugins = {key: found[0][0].type for key, found in sources.workspace.plugin_classes.items()}
    names.depends = frozenset().union(
        *(p.depends for i in files if (p := sources.workspace.package_of(i.file)) is not None)
    )
    run = Machine(names, start, _Calls())
    try:
        _start(run, entry)
        run_callbacks(run)
    except StepLimitExceeded:
        why = f"this program was given up after {run.steps} steps; any interface beside those listed is possible"
        run.gap_at(_place(entry), why)
    except Exception as error:
        run.gap_at(_place(entry), failure("the analysis of this program", error))
    return _findings(run, sources)


def _header_of_ros_1(files: Sequence[FileIndex]) -> SourceLocation | None:
    """Return where a program that has no header of rclcpp includes that of roscpp."""
    if any(name.startswith("rcl") for index in files for name in index.source.foreign):
        return None
    lines = ((index.file, index.source.foreign.get("ros/ros.h")) for index in files)
    return next((SourceLocation(file, line) for file, line in lines if line is not None), None)


def _place(entry: Entry) -> SourceLocation:
    return SourceLocation(entry.files[0] if entry.files else entry.place)


def _possible_plugins(sources: Sources, files: Iterable[FileIndex]) -> list[str]:
    """Return sources of plugins whose base class a loader of the program loads."""
    loaders = (match for index in files for match in _LOADER.finditer(index.source.text))
    wanted = {match[1].rpartition("::")[2] for match in loaders}
    entries = (each for listed in sources.workspace.plugin_classes.values() for each in listed)
    packages = {package.name: package for each, package in entries if each.base.rpartition("::")[2] in wanted}
    return list(dict.fromkeys(file for package in packages.values() for file in library_sources(package)))


_LOADER = re.compile(r"ClassLoader\s*<\s*([\w:]+)\s*>")


def _start(run: Machine, entry: Entry) -> None:
    _globals(run, entry)
    if entry.cls:
        _construct_entry(run, entry)
    if entry.main:
        for file in entry.files:
            for function in run.names.functions.get("main", ()):
                if function.file.file == file:
                    _run_main(run, function)


def _globals(run: Machine, entry: Entry) -> None:
    """Make objects outside of functions, as happens before main."""
    seen = (name for file in entry.files for name in (*sorted(run.names.visible(file) - {file}), file))
    for index in (run.names.files[name] for name in dict.fromkeys(seen) if name in run.names.files):
        listed = (each for found in index.globals.values() for each in found)
        for each in sorted(listed, key=lambda found: found.node.start_byte):
            kind = run.names.resolve(each.type, each.scope, each.file)
            known = run.names.class_of(kind, each.scope, each.file) is not None
            if known or (each.value is not None and run.leading.code(each.value)):
                static_place(run, "::".join((*each.scope, each.name)), (), each.file)


class _Calls:
    """How functions are called and variables begin, for modules that these stand on."""

    invoke = staticmethod(invoke)
    initial_value = staticmethod(initial_value)


def _run_main(run: Machine, function: Function) -> None:
    words: Value = (Seq((unknown(ARGUMENT),), open=True),)
    arguments = [unknown("the number of arguments"), words][: len(function.parameters)]
    invoke(run, function, None, arguments, function.node, Frame(function.file, function.scope))


def _construct_entry(run: Machine, entry: Entry) -> None:
    index = next((run.names.files[f] for f in entry.files if f in run.names.files), None)
    if index is None:
        why = f"the source of component {entry.cls} was not found in its package"
        run.gap_at(SourceLocation(entry.place), why)
        return
    kind = run.names.resolve(entry.cls, (), index)
    cls = run.names.class_of(kind, (), index)
    if cls is None:
        why = f"the class {entry.cls} was not found in the sources of its library"
        run.gap_at(SourceLocation(index.file), why)
        return
    frame = Frame(cls.file, ())
    host = host_of(run, cls, frame) if entry.instance else None
    made = construct(run, Type(cls.qualified), _entry_arguments(run, cls), cls.node, frame, heap=True)
    if host is not None:
        load(run, made, host, entry.instance)


def _entry_arguments(run: Machine, cls: Class) -> list[Value]:
    """Return what a container gives: node options, to the constructor that takes only these; else it is not known."""
    constructors = run.names.find_methods(cls, cls.name)
    given = run.object(("options", cls), Type("rclcpp::NodeOptions"))
    run.store.set((given, OF_CONTAINER), literal(OF_CONTAINER))
    options: Value = (given,)
    required = {c: [p for p in c.parameters if p.default is None] for c in constructors}
    one = [c for c in constructors if len(required[c]) <= 1 and any(map(_is_options, c.parameters))]
    if one:
        return [options] if _is_options(one[0].parameters[0]) else []
    if constructors and all(required.values()):
        best = min(constructors, key=lambda c: len(c.parameters))
        return [options if _is_options(p) else unknown(f"the argument {p.name}") for p in best.parameters]
    return [options] if cls.inherits_constructors else []


def _is_options(parameter: FunctionParameter) -> bool:
    return "NodeOptions" in parameter.type


def _findings(run: Machine, sources: Sources) -> ProgramFindings:
    nodes = list(run.nodes.values())
    for record in nodes if run.global_arguments else ():
        if record.use_global_arguments:
            record.arguments += run.global_arguments
            record.use_global_arguments = False
    for (file, start), (source, what, name) in run.unset.items():
        leads = name in run.leading.words or CREATES.fullmatch(name)
        if leads and start not in run.handled.get(file, ()):
            run.gap_at(source, f"{what} was never seen to be set: what {name}() makes is not known")
    for cls in run.names.doubts.values():
        why = f"which specialisation of {cls.qualified} is meant is not known"
        run.gap_at(SourceLocation(cls.file.file, cls.line), why)
    for index in run.names.files.values():
        _text_gaps(run, index)
    for file, why in sources.unreadable.items():
        run.gap_at(SourceLocation(file), why)
    return ProgramFindings(
        nodes=nodes,
        gaps=tuple(run.gaps),
        answers=account(run, run.names.files.values()),
        classes={cls.qualified for cls in run.made_classes()},
        files=tuple(run.names.files),
        consulted=bool(run.consulted),
        from_default=tuple(run.from_default),
    )


def _text_gaps(run: Machine, index: FileIndex) -> None:
    """Report what the parser did not understand, and macros that nobody in reach defines."""
    if not any(function.file is index for function in run.called):
        return
    for _, line, written in index.errors:
        called = [
            each for word in _CALLED.findall(written) for each in run.names.functions_by_name.get(word, ())
        ]
        if CREATES.search(written) or any(map(run.leading.function, called)):
            run.gap_at(SourceLocation(index.file, line), "this C++ could not be parsed")
    lines = index.source.text.split("\n")
    for line, name in index.source.unknown_macros:
        if not _NODE.search(lines[line - 1]):
            continue
        why = f"the macro {name} is not in reach: what it stands for is not known"
        run.gap_at(SourceLocation(index.file, line), why)
    for line, name, body in index.source.open_macros:
        if run.leading.of_words(frozenset(_WORD.findall(body))):
            why = f"what the macro {name} stands for here is not known; it may make interfaces"
            run.gap_at(SourceLocation(index.file, line), why)


_NODE = re.compile(r"\b(?:this|\w*[Nn]ode\w*)\b")
"""What a macro is given that may make interfaces."""
_WORD = re.compile(r"[A-Za-z_]\w*")
_CALLED = re.compile(r"([A-Za-z_]\w*)\s*\(")


def registered_components(index: FileIndex) -> list[str]:
    """Return the classes that a file registers as components."""
    found = ((match[1] or match[2]) for match in _REGISTERED.finditer(index.source.text))
    return [name.replace(" ", "").lstrip(":") for name in found]


def target_entry(target: Target, package: SourcePackage, workspace: Workspace) -> Entry:
    """Return the program of an executable target."""
    files = sources_of(targets_of(target, package.build))
    return Entry(tuple(files), definitions=definitions_of(target, package, workspace))


def definitions_of(target: Target, package: SourcePackage, workspace: Workspace) -> Definitions:
    """Return what a program is compiled with: the target, and the libraries of its package that it links."""
    return workspace.definitions(package, targets_of(target, package.build))
