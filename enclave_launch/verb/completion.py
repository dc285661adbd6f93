"""Complete, for a shell, the words that name a launch: packages, launch files, launch arguments.

The shell asks through argcomplete, as for ``ros2`` (``command_line.complete``). Nothing of a launch file is
executed for it: the arguments of a Python file, which only running it would show, are not offered.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterable, Sequence

from enclave_launch.errors import EnclaveLaunchError
from enclave_launch.evaluation.evaluate import read_description
from enclave_launch.host.host import HostOptions
from enclave_launch.host.plan_host import PlanHost
from enclave_launch.verb.target import find_target
from nodl import ament_index


def launch_words(prefix: str, parsed_args: argparse.Namespace, **_: object) -> Iterable[str]:
    """Return what can follow at ``prefix`` among the words that name a launch, as argcomplete asks for it."""
    words: Sequence[str] = vars(parsed_args).get("words") or ()
    prefixes = ament_index.search_prefixes(vars(parsed_args).get("prefix") or ())
    if not words:
        return [*ament_index.installed_packages(prefixes), *_files(prefix)]
    if len(words) == 1 and not os.path.isfile(words[0]):
        return _launch_files(words[0], prefixes)
    return _arguments(words, prefixes)


def _files(prefix: str) -> Iterable[str]:
    from argcomplete.completers import FilesCompleter

    found: Iterable[str] = FilesCompleter(("xml", "yaml", "yml", "py", "json"))(prefix)
    return found


def _launch_files(package: str, prefixes: Sequence[str]) -> Iterable[str]:
    try:
        return ament_index.launch_files(package, prefixes)
    except (ament_index.PackageNotFoundError, ValueError):
        return ()


def _arguments(words: Sequence[str], prefixes: Sequence[str]) -> Iterable[str]:
    given = {word.partition(":=")[0] for word in words if ":=" in word}
    try:
        target = find_target([word for word in words if ":=" not in word], prefixes)
        with read_description(target.launch_file, PlanHost(HostOptions(no_python=True))) as description:
            names = [argument.name for argument in description.get_launch_arguments()]
    except EnclaveLaunchError:
        return ()
    return [f"{name}:=" for name in names if name not in given]
