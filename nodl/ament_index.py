"""The ament resource index: which installed package lies where, and what it registered.

Every function takes the prefixes to search, first hit wins; nothing is cached. Rules as in ament_index_python
(``packages.py``, ``resources.py``) and, for launch files of a package, ``ros2launch/api/api.py``.
"""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from enclave_common.files import read_text
from nodl.package_xml import read_package_xml

PREFIX_VARIABLE = "AMENT_PREFIX_PATH"
MISSING_PREFIX = "/missing"
"""``--allow-missing-packages``: package ``p`` is taken to be installed in ``/missing/p``, a program in
``/missing/bin``."""
INDEX_FOLDER = os.path.join("share", "ament_index", "resource_index")
_LAUNCH_FILE = re.compile(r"launch\.(py|xml|ya?ml)$")  # ros2launch/api/api.py, is_launch_file
_PACKAGE_NAME = re.compile("[a-zA-Z0-9][a-zA-Z0-9_-]+", re.ASCII)  # REP 127 with its exemptions


class PackageNotFoundError(KeyError):
    """No searched prefix holds the package. ``package`` and ``prefixes`` say which and where.

    With one argument, as third-party code raises upstream's class of this name, it is the message.
    """

    def __init__(self, package: str, prefixes: Sequence[str] | None = None):
        self.package = package
        self.prefixes = tuple(prefixes or ())
        known = prefixes is not None
        super().__init__(
            f"package '{package}' not found, searching: {list(self.prefixes)}" if known else package
        )

    def __str__(self) -> str:
        return str(self.args[0])  # a KeyError would show the repr


class ExecutableNotInstalledError(LookupError):
    """The package is installed, but not this executable of it; ``folder`` is where its executables would be."""

    def __init__(self, message: str, executable: str = "", folder: str = ""):
        self.executable = executable
        self.folder = folder
        super().__init__(message)


class LaunchFileNotFoundError(FileNotFoundError):
    """No file of that name below the package's share directory."""


class MultipleLaunchFilesError(LookupError):
    """Several files of that name below the package's share directory; ``paths`` lists them."""

    def __init__(self, message: str, paths: Sequence[str]):
        self.paths = tuple(paths)
        super().__init__(message)


class InvalidResourceTypeNameError(ValueError):
    """A resource type is a folder: it may not contain a path separator."""


class InvalidResourceNameError(ValueError):
    """A resource is a file: its name may not contain a path separator."""


class Resource(NamedTuple):
    """The text of one marker file and the prefix that holds it."""

    text: str
    prefix: str


def search_prefixes(
    extra: Iterable[str] = (), environment: Mapping[str, str] | None = None
) -> tuple[str, ...]:
    """Return ``extra`` (made absolute), then the entries of ``AMENT_PREFIX_PATH``; those that exist, each once."""
    variables = os.environ if environment is None else environment
    listed = variables.get(PREFIX_VARIABLE, "").split(os.pathsep)
    candidates = [*(os.path.abspath(os.path.expanduser(prefix)) for prefix in extra), *listed]
    return tuple(dict.fromkeys(prefix for prefix in candidates if prefix and os.path.exists(prefix)))


def installed_packages(prefixes: Sequence[str]) -> list[str]:
    """Return the names of all packages in the index, sorted."""
    found: set[str] = set()
    for prefix in prefixes:
        folder = os.path.join(prefix, INDEX_FOLDER, "packages")
        found.update(os.listdir(folder) if os.path.isdir(folder) else ())
    return sorted(found)


def executables(folder: str) -> list[str]:
    """Return the names of the programs in ``folder``, sorted; none if it does not exist."""
    if not os.path.isdir(folder):
        return []
    return sorted(entry.name for entry in os.scandir(folder) if entry.is_file() and os.access(entry, os.X_OK))


def launch_files(package: str, prefixes: Sequence[str]) -> list[str]:
    """Return the base names of the launch files below the package's share directory; raises as ``package_prefix``."""
    share = package_share_directory(package, prefixes)
    files = {file for _, _, files in os.walk(share) for file in files}
    return sorted(file for file in files if _LAUNCH_FILE.search(file))


def package_prefix(package: str, prefixes: Sequence[str]) -> str:
    """Return the first prefix with ``package``; raises ``PackageNotFoundError``, ``ValueError`` for no such name."""
    if _PACKAGE_NAME.fullmatch(package) is None:
        raise ValueError(f"'{package}' is not a valid package name")
    prefix = find_resource("packages", package, prefixes)
    if prefix is None:
        raise PackageNotFoundError(package, prefixes)
    return prefix


def package_share_directory(package: str, prefixes: Sequence[str]) -> str:
    """Return ``<prefix>/share/<package>``, which need not exist; raises as ``package_prefix``."""
    return os.path.join(package_prefix(package, prefixes), "share", package)


def package_version(package: str, prefixes: Sequence[str]) -> str | None:
    """Return what the installed ``package.xml`` says; ``None`` if the package or its version is not known."""
    try:
        share = package_share_directory(package, prefixes)
    except (PackageNotFoundError, ValueError):
        return None
    return read_package_xml(share).version or None


def executable_path(package: str, executable: str, prefixes: Sequence[str]) -> str:
    """Return the file ``<prefix>/lib/<package>/<executable>``; with a slash ``executable`` is a path, as upstream.

    Raises as ``package_prefix``, and ``ExecutableNotInstalledError``."""
    prefix = package_prefix(package, prefixes)
    folder = os.path.join(prefix, "lib", package)
    if not os.path.exists(folder):
        raise ExecutableNotInstalledError(
            f"package '{package}' found at '{prefix}', but libexec directory '{folder}' does not exist",
            executable,
            folder,
        )
    found = executable if os.path.dirname(executable) else os.path.join(folder, executable)
    if shutil.which(found) is None:
        raise ExecutableNotInstalledError(
            f"executable '{executable}' not found on the libexec directory '{folder}' ", executable, folder
        )
    return found


def launch_file_path(package: str, file_name: str, prefixes: Sequence[str]) -> str:
    """Return the one file with this base name below the package's share directory; raises if there is not one."""
    share = package_share_directory(package, prefixes)
    hits = sorted(
        os.path.join(folder, file_name) for folder, _, files in os.walk(share) if file_name in files
    )
    if not hits:
        raise LaunchFileNotFoundError(
            f"file '{file_name}' was not found in the share directory of package '{package}' "
            f"which is at '{share}'"
        )
    if len(hits) > 1:
        listing = ", ".join(f"'{hit}'" for hit in hits)
        raise MultipleLaunchFilesError(
            f"file '{file_name}' was found more than once in the share directory of package '{package}': "
            f"[{listing}]",
            hits,
        )
    return hits[0]


def find_resource(resource_type: str, name: str, prefixes: Sequence[str]) -> str | None:
    """Return the first prefix that holds the resource, or ``None``; raises for names with a path separator."""
    _check_type(resource_type)
    if not name or _has_separator(name):
        raise InvalidResourceNameError(f"Resource name '{name}' is invalid")
    for prefix in prefixes:
        if os.path.isfile(os.path.join(prefix, INDEX_FOLDER, resource_type, name)):
            return prefix
    return None


def read_resource(resource_type: str, name: str, prefixes: Sequence[str]) -> Resource:
    """Return text and prefix of a resource; raises ``LookupError`` if no prefix has it."""
    prefix = find_resource(resource_type, name, prefixes)
    if prefix is None:
        raise LookupError(
            f"Could not find the resource '{name}' of type '{resource_type}', searching: {list(prefixes)}"
        )
    path = os.path.join(prefix, INDEX_FOLDER, resource_type, name)
    try:
        return Resource(read_text(path), prefix)
    except OSError as error:
        raise OSError(f"Could not open the resource '{name}' of type '{resource_type}':\n{error}") from error


def list_resources(resource_type: str, prefixes: Sequence[str]) -> dict[str, str]:
    """Map every resource of one type to the first prefix that holds it. Dot files do not count."""
    _check_type(resource_type)
    found: dict[str, str] = {}
    for prefix in prefixes:
        for entry in _entries(os.path.join(prefix, INDEX_FOLDER, resource_type)):
            if not entry.is_dir() and not entry.name.startswith("."):
                found.setdefault(entry.name, prefix)
    return found


def list_resource_types(prefixes: Sequence[str]) -> set[str]:
    """List every resource type that some prefix knows."""
    return {
        entry.name
        for prefix in prefixes
        for entry in _entries(os.path.join(prefix, INDEX_FOLDER))
        if entry.is_dir() and not entry.name.startswith(".")
    }


def _entries(folder: str) -> list[os.DirEntry[str]]:
    try:
        with os.scandir(folder) as entries:
            return sorted(entries, key=lambda entry: entry.name)
    except (FileNotFoundError, NotADirectoryError):
        return []


def _check_type(resource_type: str) -> None:
    if not resource_type or _has_separator(resource_type):
        raise InvalidResourceTypeNameError(f"Resource type '{resource_type}' is invalid")


def _has_separator(name: str) -> bool:
    return "/" in name or "\\" in name
