"""``find-pkg-prefix`` and ``find-pkg-share``: where a package is installed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from enclave_launch.description.ament_index_python import packages
from enclave_launch.description.launch.frontend import expose_substitution
from enclave_launch.description.launch.launch_context import LaunchContext
from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType
from enclave_launch.description.launch.substitution import Substitution
from enclave_launch.description.launch.substitutions.path_operator import PathOperator
from enclave_launch.description.launch.utilities import (
    normalize_to_list_of_substitutions,
    perform_substitutions,
)


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
