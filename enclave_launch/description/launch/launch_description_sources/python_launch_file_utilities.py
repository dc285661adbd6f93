"""Python launch file -> launch description."""

from __future__ import annotations

from types import ModuleType
from typing import TYPE_CHECKING

from enclave_launch.frontend import error_location, python_file
from enclave_launch.host.current import current_host

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_description import LaunchDescription


class InvalidPythonLaunchFileError(Exception):
    """A Python file that is no launch file."""


def load_python_launch_file_as_module(python_launch_file_path: str) -> ModuleType:
    """Execute the file as a module that ``sys.modules`` does not hold; raises whatever it raises."""
    return python_file.run(python_launch_file_path, allowed=not current_host().no_python)


def get_launch_description_from_python_launch_file(python_launch_file_path: str) -> LaunchDescription:
    """Call the file's ``generate_launch_description()`` and return whatever it returns.

    Raises ``InvalidPythonLaunchFileError`` without that function, ``PythonRefused`` under ``--no-python``,
    and whatever the file raises, with the place in the file noted on it (``error_location``).
    """
    try:
        module = load_python_launch_file_as_module(python_launch_file_path)
        if not hasattr(module, "generate_launch_description"):
            raise InvalidPythonLaunchFileError(
                f"launch file at '{python_launch_file_path}' does not contain the required function "
                "'generate_launch_description()'"
            )
        description: LaunchDescription = module.generate_launch_description()
    except Exception as error:  # foreign code may raise anything; it goes on, with its place noted
        error_location.mark_at(error, python_file.user_frame(error, python_launch_file_path))
        raise
    return description
