"""Files and folders in, all their nodes out: what every Python program among them would create."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import NamedTuple, TypeVar

from enclave_addons.inference.answers.python import CachedAnswer
from enclave_addons.inference.kernel.findings import Gaps
from enclave_addons.inference.kernel.results import interfaces_of
from enclave_addons.inference.packages import EntryPoint, Package, find_package, scripts_of
from enclave_addons.inference.python.analysis import analyse_rest, failure, start, without_collector
from enclave_addons.inference.python.check import may_make_interfaces, unsettled_places
from enclave_addons.inference.python.program import Program
from enclave_addons.inference.python.run import Run
from enclave_addons.inference.start import LaunchKey, Progress
from enclave_common.source_location import SourceLocation
from nodl.node_interface import ClientLibrary, Gap, NodeInterface

Found = TypeVar("Found")
CPP_SUFFIXES = (".cpp", ".cc", ".cxx", ".cu", ".hpp", ".hh", ".hxx", ".h", ".cuh")
_SKIPPED_FOLDERS = frozenset(
    {"build", "install", "log", "node_modules", "venv", "site-packages", "__pycache__"}
)
_NOT_PROGRAMS = re.compile(r"(?:setup|conf|conftest)\.py\Z|.*launch\.py\Z")


class InferredSystem(NamedTuple):
    """``gaps`` belong to no single node; each node carries its own."""

    nodes: tuple[NodeInterface, ...]
    gaps: tuple[Gap, ...]
    files: tuple[str, ...]


def infer_paths(paths: Iterable[str | Path], progress: Progress | None = None) -> InferredSystem:
    """Return all nodes that Python and C++ files may create.

    Args:
        paths: Files, or folders with everything below.
        progress: Called after each program, of either language.

    Raises:
        FileNotFoundError: A path does not exist. A file that cannot be parsed is a gap.
    """
    found = list(dict.fromkeys(file for path in paths for file in source_files(Path(path))))
    files = [file for file in found if file.endswith(".py") or not file.endswith(CPP_SUFFIXES)]
    nodes, gaps = _python(files, progress)
    cpp_nodes, cpp_gaps = _cpp([file for file in found if file not in files], progress)
    # One may be found through several files of a program.
    return InferredSystem(
        tuple(dict.fromkeys([*nodes, *cpp_nodes])), (*dict.fromkeys(gaps), *cpp_gaps), tuple(found)
    )


def _python(files: list[str], progress: Progress | None) -> tuple[Iterable[NodeInterface], Iterable[Gap]]:
    """Infer Python sources together: a file may use what another one makes. An earlier answer is taken if it holds."""
    if not files:
        return (), ()
    program = Program()
    for file in files:
        program.add_root(program.top_folder(file))
    starts = [_start_of(program, file) for file in files]
    cached = CachedAnswer(program, starts)
    answer: tuple[Iterable[NodeInterface], Iterable[Gap]] | None = cached.find()
    if answer is None:
        failed: list[Gap] = []
        with without_collector():
            nodes, gaps = _analysed(program, starts, failed, progress)
        answer = nodes, [*failed, *gaps]
        if not failed:
            cached.store(answer)
    return answer


def _analysed(
    program: Program, starts: list[_Start], failed: list[Gap], progress: Progress | None
) -> tuple[list[NodeInterface], list[Gap]]:
    runs: list[tuple[Run, LaunchKey]] = []
    for number, each in enumerate(starts, 1):
        runs.extend(_attempted(partial(_runs, program, each), each.file, failed))
        if progress is not None:
            progress(number, len(starts))
    entered = {node for run, _ in runs for node in run.entered}
    for run, _ in runs:
        analyse_rest(run, entered)
    entered.update(node for run, _ in runs for node in run.entered)
    nodes: list[NodeInterface] = []
    gaps = Gaps()
    for run, origin in runs:
        found = _attempted(
            partial(interfaces_of, run.findings, origin, ClientLibrary.RCLPY), run.main.path, failed
        )
        nodes.extend(found)
        run.findings.gaps.include(_attempted(partial(unsettled_places, run, entered), run.main.path, failed))
        gaps.include(run.findings.gaps.listed())
    return nodes, gaps.listed(whole=False)


def _attempted(analyse: Callable[[], Iterable[Found]], file: str, failed: list[Gap]) -> list[Found]:
    """Return what ``analyse`` finds in a program; nothing, and a gap in ``failed``, where we fail at it."""
    try:
        return list(analyse())
    except Exception as error:
        failed.append(Gap(SourceLocation(file), failure(error)))
        return []


def _cpp(files: list[str], progress: Progress | None) -> tuple[list[NodeInterface], list[Gap]]:
    """Infer C++ sources. Without the extra ``cpp`` they are one gap."""
    if not files:
        return [], []
    from enclave_addons.inference.cpp.entry import CppSupportMissing
    from enclave_addons.inference.cpp.system import infer_sources

    try:
        inferred = infer_sources(files, progress=progress)
    except CppSupportMissing as error:
        return [], [Gap(SourceLocation(files[0]), str(error))]
    return inferred.nodes, inferred.gaps


class _Start(NamedTuple):
    """How one file is started: as a script, or by the ``functions`` that are its entry points."""

    file: str
    origin: LaunchKey
    functions: tuple[str, ...]


def _start_of(program: Program, file: str) -> _Start:
    package = find_package(file)
    entries = package.entry_points_of(program.module_name(file)) if package else []
    origin = LaunchKey(package.name if package else None, _executable(entries, file, package))
    return _Start(file, origin, tuple(entry.function for entry in entries))


def _runs(program: Program, started: _Start) -> Iterator[tuple[Run, LaunchKey]]:
    module = program.load(started.file)
    if may_make_interfaces(program, module):
        yield start(program, module, started.functions), started.origin


def _executable(entries: list[EntryPoint], file: str, package: Package | None) -> str | None:
    if entries:
        return entries[0].executable
    scripts = scripts_of(package.folder) if package is not None else {}
    return next((name for name, script in scripts.items() if script == file), None)


def source_files(path: Path) -> Iterator[str]:
    """Yield the Python and C++ sources in ``path``, a file or a folder; raises ``FileNotFoundError``."""
    if path.is_file():
        yield os.path.abspath(path)
        return
    if not path.is_dir():
        raise FileNotFoundError(f"no such file or folder: {path}")
    for folder, folders, names in os.walk(path):
        folders[:] = sorted(f for f in folders if f not in _SKIPPED_FOLDERS and not f.startswith("."))
        for name in sorted(names):
            if name.endswith(CPP_SUFFIXES) or (name.endswith(".py") and not _NOT_PROGRAMS.match(name)):
                yield os.path.abspath(os.path.join(folder, name))
