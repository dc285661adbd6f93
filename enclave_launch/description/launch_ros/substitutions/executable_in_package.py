"""``exec-in-pkg``: an executable in a package's libexec directory. Every ``node`` with ``pkg`` uses it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from enclave_launch.description.launch.frontend import expose_substitution
from enclave_launch.description.launch.launch_context import LaunchContext
from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType
from enclave_launch.description.launch.substitution import Substitution
from enclave_launch.description.launch.substitutions.substitution_failure import SubstitutionFailure
from enclave_launch.description.launch.utilities import (
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.description.launch_ros.substitutions.find_package import FindPackagePrefix
from nodl.ament_index import ExecutableNotFoundError


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
