"""What answers depend on beside the sources that they read: our own code, which files there are, the build files.

Reads files.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from nodl.infer.cpp.cache.folder import digest, digest_of
from nodl.infer.cpp.reading.project import Workspace

_BUILD_SUFFIXES = (".cmake", ".xml", ".yaml", ".yml")
_BUILD_NAMES = frozenset({"CMakeLists.txt", "compile_commands.json", "CMakeCache.txt"})


@lru_cache(maxsize=1)
def analyser() -> str:
    """Return a digest of our own code, whatever it is installed as, and of the parser."""
    root = Path(__file__).parents[3]
    own = [(str(path.relative_to(root)), digest_of(str(path))) for path in sorted(root.rglob("*.py"))]
    return digest(own, [_version(name) for name in ("tree-sitter", "tree-sitter-cpp")])


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return ""


def surroundings(workspace: Workspace, folders: Sequence[str] = ()) -> str:
    """Return a digest of the names of files that an ``#include`` may mean, and of what the build files say.

    The files are those in the packages, right in ``folders`` and below the prefixes' ``include``. One that comes or
    goes may change what an ``#include`` means; a build file, what a program consists of.
    """
    folders = sorted({package.folder for package in workspace.packages.values()})
    headers = [os.path.join(prefix, "include") for prefix in workspace.prefixes]
    names = [*_files(folders), *_files(headers)]
    read = [name for name in names if _is_build_file(name)] + list(_left_by_builds(workspace))
    beside = [sorted(os.listdir(folder)) for folder in folders]
    return digest(sorted(workspace.packages), names, beside, [(name, digest_of(name)) for name in read])


def _files(folders: Iterable[str]) -> Iterator[str]:
    for root in folders:
        for folder, folders_in, names in os.walk(root):
            folders_in[:] = sorted(each for each in folders_in if not each.startswith("."))
            yield from (os.path.join(folder, name) for name in sorted(names))


def _is_build_file(path: str) -> bool:
    return path.endswith(_BUILD_SUFFIXES) or os.path.basename(path) in _BUILD_NAMES


def _left_by_builds(workspace: Workspace) -> Iterator[str]:
    for folder in workspace.build_folders:
        for name in ("compile_commands.json", "*/compile_commands.json", "*/CMakeCache.txt"):
            yield from map(str, sorted(Path(folder).glob(name)))
