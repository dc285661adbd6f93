"""The Python program behind ``lib/<package>/<executable>``: found, and analysed where no earlier answer holds.

Knows plain scripts, the wrappers that setuptools and pip generate for console scripts (which name an entry point
directly or through ``entry_points.txt``), and the links that ``colcon build --symlink-install`` leaves; for a package
that is not installed the script or the entry point's function in its source.
Reads files; runs nothing.
"""

from __future__ import annotations

import configparser
import glob
import os
import re
from collections.abc import Iterable, Iterator, Sequence

from enclave_addons.inference.answers.python import CachedAnswer
from enclave_addons.inference.python.program import Program, ProgramTarget
from enclave_addons.inference.start import (
    NO_LAUNCH,
    InferredProgram,
    LaunchedNode,
    LaunchKey,
    ProgramLaunch,
    Start,
)
from enclave_common.files import read_text
from nodl.node_interface import Gap, NodeInterface

_SITE_PATTERNS = (
    "lib/python3*/site-packages",
    "local/lib/python3*/dist-packages",
    "lib/python3/dist-packages",
)
_LOADS_ENTRY_POINT = re.compile(
    r"load_entry_point\(\s*['\"]([^'\"]+)['\"]\s*,\s*['\"]console_scripts['\"]\s*,\s*['\"]([^'\"]+)['\"]"
)
_DEVELOPED = re.compile(r"^__file__ = ['\"](.+)['\"]$", re.MULTILINE)


def infer_python(
    path: str, package: str, executable: str, prefixes: Sequence[str], start: Start | None
) -> tuple[tuple[NodeInterface, ...], str, bool]:
    """Return the nodes that the program at ``path`` creates, with its gaps; without any, why none was found.

    Parameters stay open, for each start of the program to fill in. Where their values decide more than that can say,
    the program is read once more with those of ``start``; the last item is then True. The answer of an earlier run is
    taken where nothing that it was made from has changed.
    """
    finder = _Finder(prefixes)
    target = finder.target(path, package, executable)
    return _inferred(finder.program, target, path, LaunchKey(package, executable), start)


def infer_script(
    target: ProgramTarget,
    key: LaunchKey,
    prefixes: Sequence[str],
    folders: Iterable[str],
    start: Start | None,
) -> tuple[tuple[NodeInterface, ...], str, bool]:
    """Return the nodes of a program that is not installed, as ``infer_python``; ``folders`` hold further modules."""
    installed = _Finder(prefixes).program
    program = Program([installed.top_folder(target.file), *installed.roots, *folders])
    return _inferred(program, target, target.file, key, start)


def _inferred(
    program: Program, target: ProgramTarget, path: str, key: LaunchKey, start: Start | None
) -> tuple[tuple[NodeInterface, ...], str, bool]:
    def answered(launch: ProgramLaunch, lost: tuple[Gap, ...] | None) -> InferredProgram:
        nodes = [(name, sorted(each.parameters.items()), each[1:]) for name, each in launch.nodes.items()]
        said = (nodes, sorted(launch.inputs.items()), launch.words)
        cached = CachedAnswer(program, (path, key.package, key.executable, target, said))
        answer: InferredProgram | None = cached.find()
        if answer is None:
            from enclave_addons.inference.python.analysis import infer_program  # the whole analysis of Python

            answer = infer_program(program, target, path, key, launch, lost)
            cached.store(answer)
        return answer

    found = answered(NO_LAUNCH, None)
    if start is None or not found.asks_launch:
        return found.interfaces, found.why, False
    names = dict.fromkeys(node.name for node in found.interfaces if node.name is not None)
    nodes = {name: LaunchedNode(start.parameters(name), *start.final_name(name)) for name in names}
    settled = answered(ProgramLaunch(nodes, start.inputs(found.inputs), start.words()), found.lost)
    if not settled.interfaces or settled.open_places > found.open_places:
        return found.interfaces, found.why, False
    return settled.interfaces, "", True


class _Finder:
    """Resolves wrappers below the given prefixes."""

    def __init__(self, prefixes: Sequence[str]):
        self._sites = [site for prefix in prefixes for site in _sites_of(prefix)]
        folders = (folder for site in self._sites for folder in (site, *_linked_folders(site)))
        self.program = Program(folders)

    def target(self, path: str, package: str, executable: str) -> ProgramTarget:
        text = read_text(path, errors="replace")
        developed = _DEVELOPED.search(text)
        if developed and "exec(" in text and os.path.isfile(developed[1]):
            return self.target(developed[1], package, executable)
        loaded = _LOADS_ENTRY_POINT.search(text)
        if loaded:
            distribution = re.split(r"[=<>!~ ]", loaded[1])[0]
            target = self._entry_point(distribution, loaded[2]) or self._entry_point(package, executable)
            if target:
                return self._function(target, path)
        return ProgramTarget(os.path.realpath(path))

    def _function(self, target: str, path: str) -> ProgramTarget:
        """Find the function of an entry point. ``target``: ``package.module:function``."""
        module, _, function = target.partition(":")
        file = self.program.find(module.strip(), os.path.dirname(path))
        if file is None:
            missing = f"the module {module} of entry point {target} was not found"
            return ProgramTarget(os.path.realpath(path), missing=missing)
        return ProgramTarget(
            os.path.realpath(file), module.strip(), tuple((function.strip() or "main").split("."))
        )

    def _entry_point(self, distribution: str, name: str) -> str | None:
        wanted = _normalised(distribution)
        for site in self.program.roots:
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
    """Return folders that ``*.egg-link`` and ``*.pth`` files in ``site`` add to the import path."""
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
