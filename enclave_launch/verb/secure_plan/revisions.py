"""A plan as it was in another revision of a git repository.

The revision is written out beside the work tree, into a folder that goes away again; the repository, its index and the
work tree stay as they are. Whatever the command line or ``AMENT_PREFIX_PATH`` names below the repository is taken from
there. Packages that are installed elsewhere are taken as they are now: git does not know how they were.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from enclave_common.environment import environment_with
from enclave_launch.errors import UsageError
from enclave_launch.verb.secure_plan.plans import plan_of, read_saved
from enclave_launch.verb.target import find_target
from nodl.ament_index import PREFIX_VARIABLE, search_prefixes

_REVISION_AND_PATH = re.compile(r"(?P<revision>[^:=]+):(?P<path>(?:[^=].*)?)")
_OPTIONS_WITH_PATHS = ("prefix", "nodl", "library", "source", "policy")


class Checkout(NamedTuple):
    """``top`` of the repository as it is, and ``folder`` with all its files as they were."""

    top: Path
    folder: Path

    def then(self, path: str | os.PathLike[str]) -> Path:
        """Return ``path`` in the old revision, or itself if it lies outside of the repository."""
        real = Path(os.path.realpath(path))
        return self.folder / real.relative_to(self.top) if real.is_relative_to(self.top) else Path(path)


def names_revision(word: str) -> bool:
    """Is ``word`` ``REVISION:PATH`` or ``REVISION:``, as ``git show`` has it, and no file of that name?"""
    return bool(_REVISION_AND_PATH.fullmatch(word)) and not os.path.exists(word)


def plan_before(word: str, words: Sequence[str], options: argparse.Namespace) -> Mapping[str, Any]:
    """Return the plan that ``word`` names: of a file of that revision, or for ``REVISION:`` of ``words`` there.

    :raises UsageError: git refuses, the revision lacks the file, or as ``resolve``."""
    found = _REVISION_AND_PATH.fullmatch(word)
    assert found, "asked by names_revision"
    if not found["path"]:
        return _plan_of_words(found["revision"], words, options)
    with checkout(found["revision"], Path.cwd()) as old:
        here = Path.cwd() if found["path"].startswith(("./", "../")) else old.top
        file = _in(old, here / found["path"], found["revision"])
        return read_saved(file) if file.suffix == ".json" else _plan([str(file)], options, old)


def _plan_of_words(revision: str, words: Sequence[str], options: argparse.Namespace) -> Mapping[str, Any]:
    if len(words) == 1 and words[0].endswith(".json"):
        file = Path(os.path.realpath(words[0]))
        with checkout(revision, file.parent) as old:
            return read_saved(_in(old, file, revision))
    now = find_target(words, search_prefixes(options.prefix))
    file = Path(os.path.realpath(now.launch_file))
    with checkout(revision, file.parent) as old:
        arguments = [f"{name}:={value}" for name, value in now.arguments]
        return _plan([str(_in(old, file, revision)), *arguments], options, old)


def _in(old: Checkout, file: Path, revision: str) -> Path:
    before = old.then(file)
    if not before.is_relative_to(old.folder) or not before.is_file():
        raise UsageError(f"{file} is not in revision {revision}")
    return before


def _plan(words: Sequence[str], options: argparse.Namespace, old: Checkout) -> Mapping[str, Any]:
    moved = {name: _moved(getattr(options, name), old) for name in _OPTIONS_WITH_PATHS}
    present = os.environ.get(PREFIX_VARIABLE, "").split(os.pathsep)
    prefixes = os.pathsep.join(str(old.then(each)) if each else each for each in present)
    with environment_with({PREFIX_VARIABLE: prefixes} if prefixes else {}):
        return plan_of(words, argparse.Namespace(**{**vars(options), **moved}))


def _moved(value: Any, old: Checkout) -> Any:
    if isinstance(value, (list, tuple)):
        return [_moved(each, old) for each in value]
    return old.then(value) if isinstance(value, Path) else value


@contextmanager
def checkout(revision: str, inside: Path) -> Iterator[Checkout]:
    """Check out all files of ``revision`` of the repository that contains ``inside``, in a temporary folder.

    :raises UsageError: git refuses; the words are its own."""
    top = Path(_git(inside, "rev-parse", "--show-toplevel"))
    commit = _git(top, "rev-parse", "--verify", "--quiet", "--end-of-options", f"{revision}^{{commit}}")
    with tempfile.TemporaryDirectory(prefix="secure-plan-") as scratch:
        folder = Path(os.path.realpath(scratch)) / "tree"
        own_index = {"GIT_INDEX_FILE": f"{scratch}/index"}
        _git(top, "read-tree", commit, environment=own_index)
        _git(top, "checkout-index", "--all", f"--prefix={folder}/", environment=own_index)
        yield Checkout(Path(os.path.realpath(top)), folder)


def _git(folder: Path, *words: str, environment: Mapping[str, str] | None = None) -> str:
    try:
        done = subprocess.run(
            ["git", "-C", str(folder), *words],
            capture_output=True,
            text=True,
            check=False,
            env={**os.environ, **(environment or {})},
        )
    except OSError as error:
        raise UsageError(f"git cannot be run: {error.strerror}") from error
    if done.returncode:
        said = done.stderr.strip() or f"no such revision: {words[-1].removesuffix('^{commit}')}"
        raise UsageError(f"git {words[0]}: {said}")
    return done.stdout.strip()
