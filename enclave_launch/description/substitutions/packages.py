"""Substitutions about packages: ``find-pkg-prefix``, ``find-pkg-share``, ``exec-in-pkg``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from enclave_launch.description import ament_index as packages
from enclave_launch.description.launch_context import LaunchContext
from enclave_launch.description.markup.expose import expose_substitution
from enclave_launch.description.substitution import (
    SomeSubstitutionsType,
    Substitution,
    SubstitutionFailure,
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.description.substitutions.paths import PathOperator
from nodl.ament_index import ExecutableNotFoundError


class FindPackage(PathOperator, Substitution):
    """A directory that belongs to a package; subclasses say which in ``find``."""

    def __init__(self, package: SomeSubstitutionsType):
        super().__init__()
        self.__package = normalize_to_list_of_substitutions(package)

    @classmethod
    def parse(cls, data: Sequence[SomeSubstitutionsType]) -> tuple[type[FindPackage], dict[str, Any]]:
        if not data or len(data) != 1:
            raise AttributeError("find package substitutions expect 1 argument")
        return cls, {"package": data[0]}

    @property
    def package(self) -> list[Substitution]:
        return self.__package

    def find(self, package_name: str) -> str:
        """Raises ``PackageNotFoundError``, ``ValueError`` for what cannot be a package name."""
        raise NotImplementedError

    def describe(self) -> str:
        package = " + ".join(part.describe() for part in self.package)
        return f"{type(self).__name__}(pkg={package})"

    def perform(self, context: LaunchContext) -> str:
        return self.find(perform_substitutions(context, self.__package))


@expose_substitution("find-pkg-prefix")
class FindPackagePrefix(FindPackage):
    def find(self, package_name: str) -> str:
        return packages.get_package_prefix(package_name)


@expose_substitution("find-pkg-share")
class FindPackageShare(FindPackage):
    def find(self, package_name: str) -> str:
        return packages.get_package_share_directory(package_name)


# ``exec-in-pkg``: an executable in a package's libexec directory. Every ``node`` with ``pkg`` uses it.


@expose_substitution("exec-in-pkg")
class ExecutableInPackage(FindPackagePrefix):
    """The path ``<prefix>/lib/<package>/<executable>``."""

    def __init__(self, executable: SomeSubstitutionsType, package: SomeSubstitutionsType):
        super().__init__(package)
        self.__executable = normalize_to_list_of_substitutions(executable)

    @classmethod
    def parse(cls, data: Sequence[SomeSubstitutionsType]) -> tuple[type[ExecutableInPackage], dict[str, Any]]:
        if not data or len(data) != 2:
            raise AttributeError("exec-in-package substitution expects 2 arguments")
        return cls, {"executable": data[0], "package": data[1]}

    @property
    def executable(self) -> list[Substitution]:
        return self.__executable

    def describe(self) -> str:
        executable = " + ".join(part.describe() for part in self.executable)
        package = " + ".join(part.describe() for part in self.package)
        return f"ExecInPkg(pkg={package}, exec={executable})"

    def perform(self, context: LaunchContext) -> str:
        """Raises as ``find``, and ``SubstitutionFailure`` when the package lacks the executable."""
        executable = perform_substitutions(context, self.__executable)
        package = perform_substitutions(context, self.package)
        try:
            return context.host.find_executable(package, executable)
        except ExecutableNotFoundError as error:
            raise SubstitutionFailure(str(error)) from error
