"""The launch file and arguments: the positional words of ``secure-launch``, as ``ros2 launch`` understands them.

Source: ros2launch/ros2launch/command/launch.py and api/api.py. One word is a file; two are a package and a file
below its share directory, unless the first is a file that exists: then arguments follow.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from enclave_common.words import did_you_mean, nearest, some_of
from enclave_launch.errors import UsageError, translated
from enclave_launch.evaluation import evaluate
from nodl import ament_index


class LaunchTarget(NamedTuple):
    """The launch file and arguments of a command line. ``arguments``: name and value of each ``name:=value``, the last
    of a repeated name."""

    launch_file: str
    arguments: tuple[tuple[str, str], ...]


def find_target(words: Sequence[str], prefixes: Sequence[str]) -> LaunchTarget:
    """Find the launch file and its arguments.

    Raises ``UsageError``: nothing given, no such file or package, several files of that name, bad argument, a working
    directory that was removed.
    """
    if not words:
        raise UsageError(
            "give PACKAGE LAUNCH_FILE, or the PATH of a launch file\ntry: secure-launch --dry-run PACKAGE LAUNCH_FILE"
        )
    with translated(OSError, UsageError, "the working directory: "):
        os.getcwd()
    first, *rest = words
    if os.path.isfile(first):
        return LaunchTarget(first, parse_arguments(rest))
    if not rest or ":=" in rest[0]:
        what = "is not a regular file" if os.path.exists(first) else "does not exist"
        raise UsageError(f"launch file {first!r} {what} (give PACKAGE LAUNCH_FILE or a PATH){_beside(first)}")
    return LaunchTarget(_in_package(first, rest[0], prefixes), parse_arguments(rest[1:]))


def launch_folder(words: Sequence[str], prefixes: Sequence[str]) -> Path | None:
    """Return the folder of the launch file that ``words`` name, None if they name none."""
    if not words:
        return None
    if os.path.isfile(words[0]) or len(words) == 1 or ":=" in words[1]:
        return Path(words[0]).parent if os.path.exists(words[0]) else None
    try:
        return Path(ament_index.launch_file_path(words[0], words[1], prefixes)).parent
    except (LookupError, OSError, ValueError):
        return None


def _beside(path: str) -> str:
    """Return a suggestion: the file in the same folder that was probably meant."""
    folder, name = os.path.split(path)
    try:
        beside = os.listdir(folder or ".")
    except OSError:  # no such folder, or no permission to list it
        return ""
    # Compared without what all launch files have in common, such as .launch.xml.
    stems = {each.split(".")[0]: each for each in beside if each.endswith((".py", ".xml", ".yaml", ".yml"))}
    meant = name if name in stems else nearest(name.split(".")[0], stems)
    return f"; did you mean {stems[meant]!r}?" if meant else ""


def _in_package(package: str, file_name: str, prefixes: Sequence[str]) -> str:
    try:
        return ament_index.launch_file_path(package, file_name, prefixes)
    except ament_index.PackageNotFoundError as error:
        searched = some_of(prefixes, 3) or "no prefix at all"
        raise UsageError(
            f"package {error.package!r} not found{_meant(error.package, prefixes)}, searched: {searched}\n"
            "try: . install/setup.bash in the workspace of the package, or --prefix DIR with its install prefix"
        ) from error
    except ament_index.LaunchFileNotFoundError as error:
        known = ament_index.launch_files(package, prefixes)
        raise UsageError(f"{error}{did_you_mean(file_name, known)}") from error
    except (ament_index.MultipleLaunchFilesError, ValueError) as error:
        raise UsageError(str(error)) from error


def _meant(package: str, prefixes: Sequence[str]) -> str:
    """Return a suggestion for a package that is not installed, in brackets within the sentence."""
    meant = did_you_mean(package, ament_index.installed_packages(prefixes)).removeprefix("; ")
    return f" ({meant})" if meant else ""


def parse_arguments(words: Sequence[str]) -> tuple[tuple[str, str], ...]:
    """Parse ``name:=value`` words; raises UsageError with upstream's message."""
    with translated(RuntimeError, UsageError):
        return tuple(evaluate.parse_arguments(words))
