"""Answers kept and found again: the same question over the same sources was answered before. Reads and writes files."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, NamedTuple

from enclave_addons.inference.answers.codec import keep_variant, variants
from enclave_addons.inference.answers.folder import CacheFolder, digest, digest_of
from enclave_addons.inference.cpp.reading.built import build_files
from enclave_addons.inference.cpp.reading.project import Workspace
from enclave_addons.inference.start import Start

VARIANTS = 32
"""Answers to one question, under different launches (each robot of a fleet has one) or after different edits, of which
the newest are kept."""

Asked = tuple[str, str, str]  # what, of which node, and what the launch said


class WatchedStart:
    """A start that remembers what was asked of it, and what it said."""

    def __init__(self, start: Start) -> None:
        self._start = start
        self.asked: dict[Asked, None] = {}

    def parameters(self, node: str | None) -> Mapping[str, object]:
        self.asked.setdefault(_said(self._start, "parameters", node))
        return self._start.parameters(node)

    def final_name(self, node: str | None) -> tuple[str | None, str | None]:
        self.asked.setdefault(_said(self._start, "name", node))
        return self._start.final_name(node)

    def inputs(self, names: Iterable[str]) -> Mapping[str, str | None]:
        for name in names:
            self.asked.setdefault(_said(self._start, "input", name))
        return self._start.inputs(names)

    def words(self) -> tuple[str, ...] | None:
        """Return nothing: the command line of a C++ program is not followed."""
        return None


def _said(start: Start, what: str, node: str | None) -> Asked:
    """Return what a launch says of a node: of its ``parameters``, its final ``name``; or of an ``input``."""
    answer: object
    if what == "input":
        answer = dict(start.inputs([node or ""]))
    else:
        answer = sorted(start.parameters(node).items()) if what == "parameters" else start.final_name(node)
    return what, json.dumps(node), repr(answer)


def _says_the_same(start: Start | None, asked: Iterable[Asked]) -> bool:
    return all(
        start is not None and _said(start, what, json.loads(node))[2] == said for what, node, said in asked
    )


class Made(NamedTuple):
    """An answer, with the digest of each file that it was made from.

    ``lasting``: another run would answer the same; one that failed for want of memory may not.
    """

    answer: Any
    files: Mapping[str, str]
    lasting: bool = True


class Answers:
    """Of one workspace, for one run: a file that was looked at once is not looked at again.

    A question says by its ``repr`` what is asked. ``folders``: of sources that lie in no package.
    """

    def __init__(self, workspace: Workspace, folders: Sequence[str] = ()) -> None:
        self._workspace = workspace
        self._folders = folders
        self._folder = CacheFolder()
        self._base = ""
        self._content = lru_cache(maxsize=None)(digest_of)

    def find(self, question: object, start: Start | None = None) -> Made | None:
        """Return the answer of a run in which all files that it was made from, and the launch, were as they are now."""
        for asked, files, answer in variants(self._folder, self._key(question, start)):
            if _says_the_same(start, asked) and all(self._content(name) == was for name, was in files):
                return Made(answer, dict(files))
        return None

    def keep(self, question: object, made: Made, start: WatchedStart | None = None) -> None:
        """Keep a lasting answer for the next run, with what was asked of the launch."""
        if not made.lasting:
            return
        key = self._key(question, start)
        asked = tuple(start.asked) if start is not None else ()
        variant = (asked, tuple(sorted(made.files.items())), made.answer)
        keep_variant(self._folder, key, variant, VARIANTS)

    def _key(self, question: object, start: object) -> str:
        if not self._base:
            self._base = digest(analyser(), surroundings(self._workspace, self._folders))
        return digest(self._base, question, start is None)


# --- what answers depend on beside the sources ------------------------------------------------------------------


_BUILD_SUFFIXES = (".cmake", ".xml", ".yaml", ".yml")
_BUILD_NAMES = frozenset({"CMakeLists.txt", "CMakeCache.txt"})


@lru_cache(maxsize=1)
def analyser() -> str:
    """Return a digest of our own code, whatever it is installed as, and of the parser."""
    root = Path(__file__).parents[2]
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
        yield from map(str, sorted((*build_files(folder), *Path(folder).glob("*/CMakeCache.txt"))))
