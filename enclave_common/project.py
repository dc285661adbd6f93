"""Find the project's ``enclaves.yaml`` and let it give the values of options that were not written.

The order of precedence: an option, the environment (``ROS_SECURITY_KEYSTORE``), ``enclaves.yaml``, the default. An
option that the file may set says so in its table: ``{**PATH, "configured": FromProject("keystore")}``.
"""

from __future__ import annotations

import argparse
import os
import stat
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from enclave_common.command_line import CommandLine, FromProject
from enclave_common.terminal import printable, quoted

if TYPE_CHECKING:
    from enclave_common.project_file import ProjectFile

FILE_NAME = "enclaves.yaml"
VARIABLES = {"keystore": "ROS_SECURITY_KEYSTORE"}
"""Environment variables that give the value of a key."""
_PATHS = frozenset({"keystore", "nodl", "source", "library", "hosts"})


class ProjectError(Exception):
    """An ``enclaves.yaml`` that cannot be used. The text names file and line."""

    exit_status = 2


@dataclass(frozen=True)
class Project:
    """An ``enclaves.yaml`` that was found and read."""

    file: Path
    content: ProjectFile

    def values(self, key: str) -> list[str]:
        """Return what the file says under ``key``; paths are relative to its folder."""
        given = getattr(self.content, key.replace("-", "_"))
        texts = [] if given is None else [given] if isinstance(given, str) else list(given)
        if key not in _PATHS:
            return texts
        return [os.path.normpath(self.file.parent / os.path.expanduser(text)) for text in texts]


def find_project(*folders: Path | None) -> Project | None:
    """Find the file upwards from each of ``folders``.

    Args:
        folders: Where to begin, the first with a file wins. None is passed over.

    Returns:
        The first file that is found, None without one.

    Raises:
        ProjectError: The file is not what it should be, or anyone may have put it there.
    """
    for folder in folders:
        if folder is None:
            continue
        try:
            start = Path(os.path.abspath(folder))
        except OSError:  # the current folder was removed
            continue
        for each in (start, *start.parents):
            if (each / FILE_NAME).is_file():
                return _read(each / FILE_NAME)
    return None


def _read(file: Path) -> Project:
    from enclave_common.project_file import read_project_file  # pydantic
    from enclave_common.strict_yaml import YamlFileError

    status = file.stat()
    if status.st_uid not in (0, os.geteuid()) and file.parent.stat().st_mode & stat.S_IWOTH:
        raise ProjectError(
            f"{file} belongs to another user, in a folder where everyone may write: it is not read\n"
            f"try: move your workspace out of {file.parent}"
        )
    try:
        return Project(file, read_project_file(file))
    except YamlFileError as error:
        raise ProjectError(str(error)) from None


def with_project(
    line: CommandLine, project: Project | None, environment: Mapping[str, str] = os.environ
) -> argparse.Namespace:
    """Return the options of a command line with what the environment and the project say where an option is absent.

    The namespace also gets ``project``, ``given`` (the names of the options that were written), and ``typed`` (the
    words of the command line).

    Raises:
        ProjectError: A value that the option does not take.
    """
    found = dict(vars(line.options))
    for action in line.actions:
        configured: FromProject | None = getattr(action, "configured", None)
        if configured is None or action.dest in line.given or not configured.applies(line.given):
            continue
        values = _values(configured, action, project, environment)
        if values:
            found[action.dest] = values if isinstance(found.get(action.dest), list) else values[0]
    return argparse.Namespace(**{**found, "project": project, "given": line.given, "typed": line.words})


def _values(
    configured: FromProject, action: argparse.Action, project: Project | None, environment: Mapping[str, str]
) -> list[Any]:
    variable = VARIABLES.get(configured.key, "")
    texts = project.values(configured.key) if project else []
    where = f"{project.file}: {configured.key}" if project else ""
    if environment.get(variable):
        chosen = os.path.abspath(os.path.expanduser(environment[variable]))
        if texts and os.path.realpath(texts[0]) != os.path.realpath(chosen):
            text = f"{variable}={environment[variable]} is used, not {texts[0]} of {where}"
            print(f"warning: {printable(text)}; unset {variable} to use the other", file=sys.stderr)
        texts, where = [chosen], variable
    if configured.if_exists:
        texts = [text for text in texts if os.path.exists(text)]
    return [_converted(text, action, where) for text in texts]


def _converted(text: str, action: argparse.Action, where: str) -> Any:
    convert: Any = action.type or str
    try:
        value = convert(text)
    except argparse.ArgumentTypeError as error:
        raise ProjectError(f"{where}: {error}") from None
    if action.choices is not None and value not in action.choices:
        raise ProjectError(f"{where}: {quoted(text)} is not one of {', '.join(map(str, action.choices))}")
    return value


def described(options: argparse.Namespace) -> Iterator[str]:
    """Yield one line about the file that is in use, for ``--verbose``."""
    project: Project | None = options.project
    if project is None:
        yield f"no {FILE_NAME} above the launch file or the current folder (secure-plan init writes one)"
        return
    keys = ("keystore", "enclave-scope", "nodl", "source", "library", "distro", "hosts")
    said = [f"{key} {' '.join(project.values(key))}" for key in keys if project.values(key)]
    yield f"configuration {project.file}: {'; '.join(said) or 'nothing but rules'}"
