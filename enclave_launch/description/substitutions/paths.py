"""Substitutions that give a path: ``path-join``, ``dirname``, ``filename``, ``log_dir``."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from enclave_launch.description import ament_index as packages
from enclave_launch.description import read_only
from enclave_launch.description.launch_context import LaunchContext
from enclave_launch.description.logging import launch_config
from enclave_launch.description.markup.expose import expose_substitution
from enclave_launch.description.substitution import (
    SomeSubstitutionsType,
    Substitution,
    SubstitutionFailure,
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.description.templates import TemplateSubstitution, described, template
from enclave_launch.host.current import current_release
from enclave_launch.ros_rules.distro import Feature, Since
from nodl.ament_index import ExecutableNotInstalledError

if TYPE_CHECKING:
    from collections.abc import Iterable


class PathOperator:
    """Mixed into such a substitution: ``directory / "launch"`` is a ``PathJoinSubstitution``."""

    path_operator: ClassVar[Since] = Feature.DIRECTORY_OPERATOR

    def __truediv__(self, other: SomeSubstitutionsType) -> PathJoinSubstitution:
        if not current_release().has(self.path_operator):
            return NotImplemented
        return PathJoinSubstitution([self, other])


@expose_substitution("path-join", feature=Feature.PATH_JOIN_IN_FRONTENDS)
class PathJoinSubstitution(Substitution):
    """Joins its parts as ``os.path.join`` does: an absolute part discards what is before it.

    Since launch 3.8.1 a part may be a sequence, which is concatenated first.
    """

    def __init__(self, substitutions: Iterable[Any]) -> None:
        self.__parts = [_part(item) for item in _items(substitutions)]

    @classmethod
    def parse(cls, data: Sequence[SomeSubstitutionsType]) -> tuple[type[Substitution], dict[str, Any]]:
        if len(data) < 1:
            raise TypeError("path-join substitution expects at least 1 argument")
        return cls, {"substitutions": data}

    @property
    def substitutions(self) -> list[Any]:
        return [part[0] if len(part) == 1 else part for part in self.__parts]

    def describe(self) -> str:
        return f"PathJoin('{' + '.join(map(described, self.__parts))}')"

    def perform(self, context: LaunchContext) -> str:
        return os.path.join(*("".join([sub.perform(context) for sub in part]) for part in self.__parts))

    def __truediv__(self, other: SomeSubstitutionsType) -> PathJoinSubstitution:
        if not current_release().has(Feature.PATH_JOIN_OPERATOR):
            return NotImplemented
        return PathJoinSubstitution([*self.substitutions, other])


def _items(substitutions: Any) -> Iterable[Any]:
    if isinstance(substitutions, (str, Substitution)):
        return [substitutions]
    return substitutions  # type: ignore[no-any-return]


def _part(item: Any) -> list[Substitution]:
    if isinstance(item, (str, Substitution)) or current_release().has(Feature.NESTED_PATH_JOIN):
        return normalize_to_list_of_substitutions(item)
    return normalize_to_list_of_substitutions([item])


@read_only("path")
class PathSubstitution(PathOperator, Substitution):
    """A ``pathlib.Path`` as a substitution, or anything that gives a path, with the operator ``/``."""

    path_operator = Feature.PATH_JOIN_OPERATOR
    path: object

    def __init__(self, path: object) -> None:
        self.__path = path
        text = str(path) if isinstance(path, Path) else path
        self.__parts = normalize_to_list_of_substitutions(text)  # type: ignore[arg-type]

    def describe(self) -> str:
        return f"'{self.__path}'"

    def perform(self, context: LaunchContext) -> str:
        return "".join([sub.perform(context) for sub in self.__parts])


@expose_substitution("filename")
class ThisLaunchFile(TemplateSubstitution):
    """The path of the launch file being visited; an include leaves its own behind."""

    refusal = (TypeError, "filename substitution doesn't expect arguments")

    def describe(self) -> str:
        return "ThisLaunchFile()"

    def perform(self, context: LaunchContext) -> str:
        path: str | None = context.get_locals_as_dict().get("current_launch_file_path")
        if path is None:
            raise SubstitutionFailure("ThisLaunchFile used outside of a launch file (in a script)")
        return path


@expose_substitution("dirname")
class ThisLaunchFileDir(PathOperator, TemplateSubstitution):
    """The directory of the launch file being visited; an include leaves its own behind."""

    refusal = (TypeError, "dirname substitution doesn't expect arguments")

    def describe(self) -> str:
        return "ThisLaunchFileDir()"

    def perform(self, context: LaunchContext) -> str:
        path: str | None = context.get_locals_as_dict().get("current_launch_file_directory")
        if path is None:
            raise SubstitutionFailure("ThisLaunchFileDir used outside of a launch file (in a script)")
        return path


@expose_substitution("launch_log_dir", feature=Feature.LAUNCH_LOG_DIR)
@expose_substitution("log_dir")
class LaunchLogDir(PathOperator, TemplateSubstitution):
    """The directory of this run's log files."""

    refusal = (TypeError, "launch_log_dir/log_dir substitution doesn't expect arguments")

    def describe(self) -> str:
        return "LaunchLogDir()"

    def perform(self, context: LaunchContext) -> str:
        return context.host.log_directory() or launch_config.log_dir


class FindPackage(PathOperator, TemplateSubstitution):
    """A directory that belongs to a package; subclasses say which in ``find``."""

    path_operator = Feature.PACKAGE_OPERATOR
    package = template()
    refusal = (AttributeError, "find package substitutions expect 1 argument")

    def find(self, package_name: str) -> str:
        """Return the directory; raises ``PackageNotFoundError``, ``ValueError`` for an invalid name."""
        raise NotImplementedError

    def describe(self) -> str:
        return f"{type(self).__name__}(pkg={described(self.package)})"

    def perform(self, context: LaunchContext) -> str:
        return self.find(perform_substitutions(context, self.package))


@expose_substitution("find-pkg-prefix")
class FindPackagePrefix(FindPackage):
    """The prefix in which a package is installed."""

    def find(self, package_name: str) -> str:
        return packages.get_package_prefix(package_name)


@expose_substitution("find-pkg-share")
class FindPackageShare(FindPackage):
    """The share directory of a package: ``<prefix>/share/<package>``."""

    def find(self, package_name: str) -> str:
        return packages.get_package_share_directory(package_name)


# ``exec-in-pkg``: an executable in a package's libexec directory. Every ``node`` with ``pkg`` uses it.


@expose_substitution("exec-in-pkg")
class ExecutableInPackage(FindPackagePrefix):
    """The path ``<prefix>/lib/<package>/<executable>``."""

    executable = template()
    path_operator = Feature.PACKAGE_OPERATOR
    package = template()
    refusal = (AttributeError, "exec-in-package substitution expects 2 arguments")

    def describe(self) -> str:
        return f"ExecInPkg(pkg={described(self.package)}, exec={described(self.executable)})"

    def perform(self, context: LaunchContext) -> str:
        """Return the path; raises as ``find``, and ``SubstitutionFailure`` if the package lacks the executable."""
        executable = perform_substitutions(context, self.executable)
        package = perform_substitutions(context, self.package)
        try:
            return context.host.find_executable(package, executable)
        except ExecutableNotInstalledError as error:
            raise SubstitutionFailure(str(error)) from error
