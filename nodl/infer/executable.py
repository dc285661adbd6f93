"""The Python source behind ``lib/<package>/<executable>``, analysed from its entry point.

Takes what launch starts and the install prefixes, gives interfaces or the reason why there are none. Knows
plain scripts, the wrappers that setuptools and pip generate for console scripts (which name an entry point
directly or through ``entry_points.txt``), and the links that ``colcon build --symlink-install`` leaves.
Reads files; runs nothing.
"""

from __future__ import annotations

import configparser
import glob
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from enclave_launch.boundary.files import check_regular, read_text
from nodl.ament_index import ExecutableNotInstalledError, PackageNotFoundError, executable_path
from nodl.infer.analysis import start, start_function
from nodl.infer.coverage import unsettled_places
from nodl.infer.interpreter.run import Run
from nodl.infer.program import Program
from nodl.infer.results import Origin, interfaces_of
from nodl.infer.start import Start
from nodl.infer.system import without_collector
from nodl.node_interface import Gap, NodeInterface
from nodl.source_ref import SourceRef

if TYPE_CHECKING:
    from nodl.infer.cpp.reach import SourcesInReach

_SITE_PATTERNS = (
    "lib/python3*/site-packages",
    "local/lib/python3*/dist-packages",
    "lib/python3/dist-packages",
)
_LOADS_ENTRY_POINT = re.compile(
    r"load_entry_point\(\s*['\"]([^'\"]+)['\"]\s*,\s*['\"]console_scripts['\"]\s*,\s*['\"]([^'\"]+)['\"]"
)
_DEVELOPED = re.compile(r"^__file__ = ['\"](.+)['\"]$", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class InferredExecutable:
    """``interfaces`` is empty when nothing could be inferred; ``why`` then says what was found instead."""

    interfaces: tuple[NodeInterface, ...]
    why: str = ""
    of_this_start: bool = False  # another start may have other interfaces: parameters decide what is made

    def __bool__(self) -> bool:
        return bool(self.interfaces)


def infer_executable(
    package: str,
    executable: str | None = None,
    plugin: str | None = None,
    *,
    prefixes: Sequence[str],
    sources: SourcesInReach | None = None,
    start_of: Start | None = None,
) -> InferredExecutable:
    """The nodes that ``executable`` of an installed package creates; gaps are attached to them.

    Compiled programs and components are read from ``sources``, in the light of what launch gives them (``start_of``).
    """
    if executable is None:
        return _compiled(package, None, plugin, sources, start_of, f"component {plugin} is compiled code")
    try:
        path = executable_path(package, executable, prefixes)
    except (PackageNotFoundError, ExecutableNotInstalledError, ValueError) as error:
        return _compiled(package, executable, None, sources, start_of, str(error))
    if not _is_python(path):
        return _compiled(package, executable, None, sources, start_of, f"{path} is a compiled program")
    finder = _Finder(prefixes)
    with without_collector():
        run = finder.run(path, package, executable)
        interfaces = interfaces_of(run.findings, Origin(package, executable))
        for gap in unsettled_places(run):
            run.findings.gap(gap.source, gap.why)
    if not interfaces:
        reasons = "; ".join(f"{source}: {why}" for source, why in run.findings.gaps)
        return InferredExecutable((), f"no node was found in {path}" + (f" ({reasons})" if reasons else ""))
    return InferredExecutable(_with_gaps(interfaces, run))


def _compiled(
    package: str,
    executable: str | None,
    plugin: str | None,
    sources: SourcesInReach | None,
    start_of: Start | None,
    what: str,
) -> InferredExecutable:
    if sources is None:
        return InferredExecutable((), f"{what}, whose sources were not looked for")
    from nodl.infer.cpp.syntax import CppSupportMissing

    try:
        answer = sources.infer(package, executable, plugin, start_of)
    except CppSupportMissing as error:
        return InferredExecutable((), f"{what}: {error}")
    why = f"{what}: {answer.why}" if answer.why else ""
    return InferredExecutable(answer.interfaces, why, answer.consulted)


def _with_gaps(interfaces: list[NodeInterface], run: Run) -> tuple[NodeInterface, ...]:
    """Gaps that belong to the whole program go to its first node, so that nobody overlooks them."""
    gaps = tuple(Gap(source, why) for source, why in run.findings.gaps)
    first = interfaces[0]
    return (first._replace(gaps=(*first.gaps, *gaps)), *interfaces[1:])


def _is_python(path: str) -> bool:
    """By the first line, or the suffix of a script without one."""
    try:
        check_regular(path)
        with open(path, "rb") as stream:
            start_of_file = stream.read(256)
    except OSError:
        return False
    if start_of_file.startswith(b"#!"):
        return b"python" in start_of_file.partition(b"\n")[0] or b"exec" in start_of_file
    return path.endswith(".py") and b"\0" not in start_of_file


class _Finder:
    """Resolves wrappers below the given prefixes."""

    def __init__(self, prefixes: Sequence[str]):
        self._sites = [site for prefix in prefixes for site in _sites_of(prefix)]
        folders = (folder for site in self._sites for folder in (site, *_linked_folders(site)))
        self._program = Program(folders, prefixes)

    def run(self, path: str, package: str, executable: str) -> Run:
        text = read_text(path, errors="replace")
        developed = _DEVELOPED.search(text)
        if developed and "exec(" in text and os.path.isfile(developed[1]):
            return self.run(developed[1], package, executable)
        loaded = _LOADS_ENTRY_POINT.search(text)
        if loaded:
            distribution = re.split(r"[=<>!~ ]", loaded[1])[0]
            target = self._entry_point(distribution, loaded[2]) or self._entry_point(package, executable)
            if target:
                return self._run_target(target, path)
        return start(self._program, self._program.load(os.path.realpath(path)))

    def _run_target(self, target: str, path: str) -> Run:
        """``target``: ``package.module:function`` of an entry point."""
        module, _, function = target.partition(":")
        file = self._program.find(module.strip(), os.path.dirname(path))
        if file is None:
            run = start(self._program, self._program.load(os.path.realpath(path)))
            run.findings.gap(SourceRef(path), f"the module {module} of entry point {target} was not found")
            return run
        source = self._program.load(os.path.realpath(file), module.strip())
        return start_function(self._program, source, (function.strip() or "main").split("."))

    def _entry_point(self, distribution: str, name: str) -> str | None:
        wanted = _normalised(distribution)
        for site in self._program.roots:
            for folder in glob.glob(os.path.join(glob.escape(site), "*-info")):
                stem = os.path.basename(folder).rpartition(".")[0]
                if _normalised(stem.partition("-")[0]) != wanted:
                    continue
                target = _console_script(os.path.join(folder, "entry_points.txt"), name)
                if target:
                    return target
        return None


def _sites_of(prefix: str) -> Iterator[str]:
    for pattern in _SITE_PATTERNS:
        yield from sorted(glob.glob(os.path.join(glob.escape(prefix), pattern)))


def _linked_folders(site: str) -> Iterator[str]:
    """Folders that ``*.egg-link`` and ``*.pth`` files in ``site`` add to the import path."""
    for link in sorted(glob.glob(os.path.join(glob.escape(site), "*.egg-link"))):
        yield from _lines(link)[:1]
    for paths in sorted(glob.glob(os.path.join(glob.escape(site), "*.pth"))):
        yield from (line for line in _lines(paths) if os.path.isabs(line))


def _lines(path: str) -> list[str]:
    try:
        return [line.strip() for line in read_text(path).splitlines() if line.strip()]
    except (OSError, UnicodeDecodeError):
        return []


def _normalised(distribution: str) -> str:
    return re.sub(r"[-_.]+", "-", distribution).lower()


class _EntryPoints(configparser.ConfigParser):
    """Names of entry points keep their case."""

    def optionxform(self, optionstr: str) -> str:
        return optionstr


def _console_script(path: str, name: str) -> str | None:
    parser = _EntryPoints(delimiters=("=",), interpolation=None, strict=False)
    try:
        parser.read_string(read_text(path), path)
    except (OSError, configparser.Error, UnicodeDecodeError):
        return None
    return parser.get("console_scripts", name, fallback=None)
