"""Substitutions about packages: ``find-pkg-prefix``, ``find-pkg-share``, ``exec-in-pkg``."""

from __future__ import annotations

from enclave_launch.description import ament_index as packages
from enclave_launch.description.launch_context import LaunchContext
from enclave_launch.description.markup.expose import expose_substitution
from enclave_launch.description.substitution import (
    SubstitutionFailure,
    perform_substitutions,
)
from enclave_launch.description.substitutions.paths import PathOperator
from enclave_launch.description.templates import TemplateSubstitution, template
from nodl.ament_index import ExecutableNotInstalledError


class FindPackage(PathOperator, TemplateSubstitution):
    """A directory that belongs to a package; subclasses say which in ``find``."""

    package = template()
    refusal = (AttributeError, "find package substitutions expect 1 argument")

    def find(self, package_name: str) -> str:
        """Raises ``PackageNotFoundError``, ``ValueError`` for what cannot be a package name."""
        raise NotImplementedError

    def describe(self) -> str:
        package = " + ".join(part.describe() for part in self.package)
        return f"{type(self).__name__}(pkg={package})"

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
    package = template()
    refusal = (AttributeError, "exec-in-package substitution expects 2 arguments")

    def describe(self) -> str:
        executable = " + ".join(part.describe() for part in self.executable)
        package = " + ".join(part.describe() for part in self.package)
        return f"ExecInPkg(pkg={package}, exec={executable})"

    def perform(self, context: LaunchContext) -> str:
        """Raises as ``find``, and ``SubstitutionFailure`` when the package lacks the executable."""
        executable = perform_substitutions(context, self.executable)
        package = perform_substitutions(context, self.package)
        try:
            return context.host.find_executable(package, executable)
        except ExecutableNotInstalledError as error:
            raise SubstitutionFailure(str(error)) from error
