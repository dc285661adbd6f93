"""A launch in a revision of a git repository and in its work tree, as two plans.

The revision is written out beside the work tree, into a folder that goes away again; the repository, its index and the
work tree stay as they are. The packages of the repository are taken from their sources in both, so an installed copy
that is older than the work tree hides nothing; with ``--build`` the revision is built, and compared with what is
installed. Git knows nothing of other packages: both plans take them as they are installed now; ``Revised`` names them.
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import subprocess
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

from enclave_addons.review.verb.plans import is_saved_plan, plan_of, read_plan, read_saved
from enclave_addons.review.verb.source_prefix import install_sources, source_packages
from enclave_common.environment import environment_with
from enclave_launch.dry_run import DryRun
from enclave_launch.errors import EnclaveLaunchError, UsageError
from enclave_launch.verb.target import find_target
from nodl.ament_index import PREFIX_VARIABLE, PackageNotFoundError, package_prefix, search_prefixes

_REVISION_AND_PATH = re.compile(r"(?P<revision>[^:=]+):(?P<path>(?:[^=].*)?)")
_OPTIONS_WITH_PATHS = ("prefix", "nodl", "library", "source", "policy")


class Revised(NamedTuple):
    """A plan at two revisions. ``as_installed``: packages that both read as they are installed now."""

    before: DryRun
    after: DryRun
    as_installed: tuple[str, ...] = ()


class Checkout(NamedTuple):
    """A revision of a repository: ``top`` of the repository as it is, ``folder`` with all its files as they were."""

    top: Path
    folder: Path

    def then(self, path: str | os.PathLike[str]) -> Path:
        """Return ``path`` in the old revision, or itself if it is outside of the repository or not in git."""
        real = Path(os.path.realpath(path))
        if not real.is_relative_to(self.top):
            return Path(path)
        before = self.folder / real.relative_to(self.top)
        return before if before.exists() or _git(self.top, "ls-files", "--", str(real)) else Path(path)


class _Launch(NamedTuple):
    inside: Path
    file: Path | None
    in_package: tuple[str, ...]
    arguments: tuple[str, ...]

    def words(self, old: Checkout) -> list[str]:
        return [*([str(old.then(self.file))] if self.file else self.in_package), *self.arguments]


def names_revision(word: str) -> bool:
    """Return whether ``word`` is ``REVISION:PATH`` or ``REVISION:``, as ``git show`` has it, and no file."""
    return bool(_REVISION_AND_PATH.fullmatch(word)) and not os.path.exists(word)


def plans_of(word: str, words: Sequence[str], options: argparse.Namespace) -> Revised:
    """Plan what ``word`` (``REVISION:[PATH]``) names, and ``words`` as they are now; raises UsageError."""
    found = _REVISION_AND_PATH.fullmatch(word)
    assert found, "checked by names_revision"
    revision, path = found["revision"], found["path"]
    if path.endswith(".json") or (not path and is_saved_plan(words)):
        inside = Path.cwd() if path else Path(os.path.realpath(words[0])).parent
        with checkout(revision, inside) as old:
            file = _named(path, old) if path else Path(os.path.realpath(words[0]))
            return Revised(read_saved(_in(old, file, revision)), read_plan(words, options))
    now = None if is_saved_plan(words) else _located(words, options)
    inside = Path.cwd() if path or now is None else now.inside
    with checkout(revision, inside) as old, tempfile.TemporaryDirectory(prefix="secure-plan-") as scratch:
        arguments = now.arguments if now is not None else ()
        then = _Launch(inside, _named(path, old), (), arguments) if path or now is None else now
        if then.file is not None:
            _in(old, then.file, revision)
        prefixes = _then_prefixes(old, Path(scratch, "before"), options)
        before = _planned_before(then, options, old, prefixes, revision)
        after = _planned_now(words, now, options, old, Path(scratch, "after"))
        return Revised(before, after, tuple(sorted(_outside((before, after), old, prefixes, options))))


def _planned_before(
    launch: _Launch, options: argparse.Namespace, old: Checkout, prefixes: Sequence[Path], revision: str
) -> DryRun:
    try:
        return _plan(launch.words(old), options, old, prefixes)
    except EnclaveLaunchError as error:
        hint = (
            ""
            if options.build
            else "\nif a build places more than CMakeLists.txt and setup.py say: --build 'colcon build'"
        )
        raise UsageError(f"in revision {revision}: {error}{hint}") from error


def _planned_now(
    words: Sequence[str], launch: _Launch | None, options: argparse.Namespace, old: Checkout, scratch: Path
) -> DryRun:
    if launch is None or options.build:
        return read_plan(words, options)
    now = Checkout(old.top, old.top)
    return _plan(launch.words(now), options, now, tuple(install_sources(now.folder, scratch).values()))


def _plan(
    words: Sequence[str], options: argparse.Namespace, old: Checkout, prefixes: Sequence[Path]
) -> DryRun:
    moved = {name: _moved(getattr(options, name), old) for name in _OPTIONS_WITH_PATHS}
    if prefixes:
        moved["prefix"] = [*prefixes, *moved["prefix"]]
        moved["source"] = [old.folder, *moved["source"]]
    present = filter(None, os.environ.get(PREFIX_VARIABLE, "").split(os.pathsep))
    listed = os.pathsep.join(str(old.then(each)) for each in present)
    with environment_with({PREFIX_VARIABLE: listed} if listed else {}):
        return plan_of(words, argparse.Namespace(**{**vars(options), **moved}))


def _moved(value: Any, old: Checkout) -> Any:
    if isinstance(value, (list, tuple)):
        return [_moved(each, old) for each in value]
    return old.then(value) if isinstance(value, Path) else value


def _then_prefixes(old: Checkout, scratch: Path, options: argparse.Namespace) -> tuple[Path, ...]:
    if not options.build:
        return tuple(install_sources(old.folder, scratch).values())
    try:
        done = subprocess.run(
            shlex.split(options.build), cwd=old.folder, capture_output=True, text=True, check=False
        )
    except (OSError, ValueError) as error:
        raise UsageError(f"--build {options.build!r} cannot be run: {error}") from error
    if done.returncode:
        raise UsageError(f"--build {options.build!r} failed:\n{(done.stderr or done.stdout).strip()[-2000:]}")
    install = old.folder / "install"
    found = [install, *sorted(install.glob("*"))]
    prefixes = tuple(each for each in found if (each / "share" / "ament_index").is_dir())
    if not prefixes:
        raise UsageError(f"--build {options.build!r} left no package in install/ of the revision")
    return prefixes


def _outside(
    plans: Sequence[DryRun], old: Checkout, prefixes: Sequence[Path], options: argparse.Namespace
) -> Iterator[str]:
    started = (one for plan in plans for one in plan.launched)
    searched = search_prefixes([*map(str, prefixes), *(str(old.then(each)) for each in options.prefix)])
    for package in {one.package for one in started if one.package is not None}:
        try:
            prefix = Path(package_prefix(package, searched))
        except PackageNotFoundError:
            continue
        if prefix not in prefixes and not old.then(prefix).is_relative_to(old.folder):
            yield package


def _located(words: Sequence[str], options: argparse.Namespace) -> _Launch:
    searched = search_prefixes(options.prefix)
    first, *rest = words
    if os.path.isfile(first):
        package = _package_of_installed(os.path.abspath(first), searched)
        source = package and _source_of(package, searched)
        if source:
            return _Launch(source, None, (package, os.path.basename(first)), tuple(rest))
        file = Path(os.path.realpath(first))
        return _Launch(file.parent, file, (), tuple(rest))
    source = _source_of(first, searched)
    if source:
        return _Launch(source, None, tuple(words[:2]), tuple(words[2:]))
    file = Path(os.path.realpath(find_target(words, searched).launch_file))
    try:
        _git(file.parent, "rev-parse", "--show-toplevel")
    except UsageError as error:
        raise UsageError(
            f"no sources of package {first!r} in the git repository of {Path.cwd()} or beside its install prefix; "
            "call this in the repository, or compare saved plans (secure-plan show --format json)"
        ) from error
    return _Launch(file.parent, file, (), tuple(words[2:]))


def _package_of_installed(file: str, prefixes: Sequence[str]) -> str:
    for prefix in prefixes:
        share = os.path.join(prefix, "share", "")
        if file.startswith(share):
            return file[len(share) :].partition(os.sep)[0]
    return ""


def _source_of(package: str, prefixes: Sequence[str]) -> Path | None:
    """Return the source folder of ``package`` in the repository of the current directory, or in a workspace's src."""
    places: list[Path] = []
    with suppress(UsageError):
        places.append(Path(_git(Path.cwd(), "rev-parse", "--show-toplevel")))
    for prefix in map(Path, prefixes):
        places += [above / "src" for above in prefix.parents[:2] if (above / "src").is_dir()]
    for place in dict.fromkeys(places):
        folder = source_packages(place).get(package)
        if folder is not None:
            return folder
    return None


def _named(path: str, old: Checkout) -> Path:
    return (Path.cwd() if path.startswith(("./", "../")) else old.top) / path


def _in(old: Checkout, file: Path, revision: str) -> Path:
    real = Path(os.path.realpath(file))
    if not real.is_relative_to(old.top) or not (old.folder / real.relative_to(old.top)).is_file():
        raise UsageError(f"{file} is not in revision {revision}")
    return old.folder / real.relative_to(old.top)


@contextmanager
def checkout(revision: str, inside: Path) -> Iterator[Checkout]:
    """Check out all files of ``revision`` in a temporary folder; raises UsageError with git's words."""
    top = Path(_git(inside, "rev-parse", "--show-toplevel"))
    commit = _git(top, "rev-parse", "--verify", "--quiet", "--end-of-options", f"{revision}^{{commit}}")
    with tempfile.TemporaryDirectory(prefix="secure-plan-") as scratch:
        folder = Path(os.path.realpath(scratch)) / "tree"
        folder.mkdir()
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
