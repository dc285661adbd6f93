"""Sources of a launch description: a launch file of some kind, or a script."""

from __future__ import annotations

import os
from collections.abc import Callable
from types import ModuleType
from typing import TYPE_CHECKING

from enclave_launch.description import read_only
from enclave_launch.description.launch_context import LaunchContext
from enclave_launch.description.markup.parser import (
    InvalidFrontendLaunchFileError as InvalidFrontendLaunchFileError,
)
from enclave_launch.description.markup.parser import InvalidLaunchFileError, Parser
from enclave_launch.description.substitution import (
    SomeSubstitutionsType,
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.frontend import error_location, python_file
from enclave_launch.host.current import current_host

if TYPE_CHECKING:
    from enclave_launch.description.launch_description import LaunchDescription


@read_only("method")
class LaunchDescriptionSource:
    """Loads its description once, when first requested with a context. Subclasses say how."""

    method: str = ""
    is_file = False  # its location is the path of a launch file

    def __init__(
        self,
        launch_description: LaunchDescription | None = None,
        location: SomeSubstitutionsType = "<string>",
        method: str = "unspecified mechanism from a script",
    ) -> None:
        self.__launch_description = launch_description
        self.__location = normalize_to_list_of_substitutions(location)
        self.__expanded_location: str | None = None
        self.__method = method

    def try_get_launch_description_without_context(self) -> LaunchDescription | None:
        """Load it for looking only, with an empty context; None if anything fails. Upstream loads it again, too."""
        if self.__launch_description is not None:
            return self.__launch_description
        location = self.location_without_context()
        if location is None:
            return None
        try:
            return self._get_launch_description(location)
        except Exception:  # whatever the file raises: upstream goes on without it, and so must we
            return None

    def location_without_context(self) -> str | None:
        """Return the path, performed in an empty context; None if that fails, or if there is nothing to load."""
        if self.__launch_description is not None:
            return None
        try:
            return perform_substitutions(LaunchContext(), self.__location)
        except Exception:  # any substitution, ours or a third party's
            return None

    def expand(self, context: LaunchContext) -> str:
        """Return the path, performed at the first call."""
        if self.__expanded_location is None:
            self.__expanded_location = perform_substitutions(context, self.__location)
        return self.__expanded_location

    def get_launch_description(self, context: LaunchContext) -> LaunchDescription:
        """Return the description, loaded if necessary."""
        location = self.expand(context)
        if self.__launch_description is None:
            known = context.host.loads.take(self, location)
            self.__launch_description = self._get_launch_description(location) if known is None else known
        return self.__launch_description

    def _get_launch_description(self, location: str) -> LaunchDescription:
        if self.__launch_description is None:
            raise RuntimeError(
                "LaunchDescriptionSource.get_launch_description(): "
                "called without launch description being set"
            )
        return self.__launch_description

    @property
    def location(self) -> str:
        """Return the path once it is known, before that its substitutions as text."""
        if self.__expanded_location is None:
            return " + ".join(str(sub) for sub in self.__location)
        return self.__expanded_location


class InvalidPythonLaunchFileError(Exception):
    """A Python file that is not a launch file."""


def load_python_launch_file_as_module(python_launch_file_path: str) -> ModuleType:
    """Execute the file as a module that ``sys.modules`` does not hold; raises whatever it raises."""
    return python_file.run(python_launch_file_path, allowed=not current_host().no_python)


def get_launch_description_from_python_launch_file(python_launch_file_path: str) -> LaunchDescription:
    """Call the file's ``generate_launch_description()``; raises ``InvalidPythonLaunchFileError`` without one,
    ``PythonRefused`` under ``--no-python``, and whatever the file raises, with its place."""
    results = current_host().user_code_results
    if results is None:
        return _run_python_launch_file(python_launch_file_path)
    key = ("python file", os.path.abspath(python_launch_file_path))
    return results.call(key, lambda: _run_python_launch_file(python_launch_file_path))


def _run_python_launch_file(python_launch_file_path: str) -> LaunchDescription:
    try:
        module = load_python_launch_file_as_module(python_launch_file_path)
        if not hasattr(module, "generate_launch_description"):
            raise InvalidPythonLaunchFileError(
                f"launch file at '{python_launch_file_path}' does not contain the required function "
                "'generate_launch_description()'"
            )
        description: LaunchDescription = module.generate_launch_description()
    except error_location.RAISED_BY_USER_CODE as error:  # it goes on, with its place noted
        error_location.mark_at(error, python_file.user_frame(error, python_launch_file_path))
        raise
    return description


def get_launch_description_from_frontend_launch_file(
    frontend_launch_file_path: str, *, parser: type[Parser] = Parser
) -> LaunchDescription:
    """Load an XML or YAML launch file.

    Raises ``InvalidFrontendLaunchFileError``, ``OSError``, and the errors of elements and substitutions.
    """
    root, implementation = parser.load(frontend_launch_file_path)
    return implementation.parse_description(root)


# Launch file of any kind -> launch description. The content decides; the name only gives the order.


def get_launch_description_from_any_launch_file(
    launch_file_path: str, *, parser: type[Parser] = Parser
) -> LaunchDescription:
    """Load a launch file: ``.py`` as Python first, any other by the front ends; raises InvalidLaunchFileError."""
    name = os.path.basename(launch_file_path)
    extension = os.path.splitext(name)[1][1:]
    loaders: list[Callable[[str], LaunchDescription]] = [
        get_launch_description_from_frontend_launch_file,
        get_launch_description_from_python_launch_file,
    ]
    if extension == "py":
        loaders.reverse()
    elif not Parser.is_filename_valid(name):
        extension = ""
    errors: list[Exception] = []
    for load in loaders:
        try:
            return load(launch_file_path)
        except Exception as error:  # any error of foreign code or of a syntax; all are reported together
            errors.append(error)
    raise InvalidLaunchFileError(extension, likely_errors=errors)


class PythonLaunchDescriptionSource(LaunchDescriptionSource):
    """Runs the file; its own exceptions come out unchanged."""

    is_file = True

    def __init__(self, launch_file_path: SomeSubstitutionsType) -> None:
        super().__init__(None, launch_file_path, "interpreted python launch file")

    def _get_launch_description(self, location: str) -> LaunchDescription:
        return get_launch_description_from_python_launch_file(location)


class FrontendLaunchDescriptionSource(LaunchDescriptionSource):
    """Any front end may read the file. ``parser`` is accepted and, as upstream, not used."""

    is_file = True

    def __init__(
        self,
        launch_file_path: SomeSubstitutionsType,
        *,
        method: str = "interpreted frontend launch file",
        parser: type[Parser] = Parser,
    ) -> None:
        super().__init__(None, launch_file_path, method)
        self._parser = Parser

    def _get_launch_description(self, location: str) -> LaunchDescription:
        return get_launch_description_from_frontend_launch_file(location, parser=self._parser)


class AnyLaunchDescriptionSource(LaunchDescriptionSource):
    """Tries the loaders in the order that the file name suggests. A relative path starts at the current
    working directory."""

    is_file = True

    def __init__(self, launch_file_path: SomeSubstitutionsType) -> None:
        super().__init__(None, launch_file_path, "interpreted launch file")

    def _get_launch_description(self, location: str) -> LaunchDescription:
        return get_launch_description_from_any_launch_file(location)


class XMLLaunchDescriptionSource(FrontendLaunchDescriptionSource):
    """As upstream, the name decides nothing: either syntax is read."""

    def __init__(self, launch_file_path: SomeSubstitutionsType) -> None:
        super().__init__(launch_file_path, method="interpreted XML launch file")


class YAMLLaunchDescriptionSource(FrontendLaunchDescriptionSource):
    """As upstream, the name decides nothing: either syntax is read."""

    def __init__(self, launch_file_path: SomeSubstitutionsType) -> None:
        super().__init__(launch_file_path, method="interpreted YAML launch file")
