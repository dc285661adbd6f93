"""Launch file of any kind -> launch description. The content decides; the name only gives the order."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import TYPE_CHECKING

from enclave_launch.description.launch.frontend.parser import Parser
from enclave_launch.description.launch.invalid_launch_file_error import InvalidLaunchFileError
from enclave_launch.description.launch.launch_description_sources.frontend_launch_file_utilities import (
    get_launch_description_from_frontend_launch_file,
)
from enclave_launch.description.launch.launch_description_sources.python_launch_file_utilities import (
    get_launch_description_from_python_launch_file,
)

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_description import LaunchDescription


def get_launch_description_from_any_launch_file(
    launch_file_path: str, *, parser: type[Parser] = Parser
) -> LaunchDescription:
    """``.py``: Python, then the front ends; anything else: the front ends, then Python.

    Raises ``InvalidLaunchFileError``, with one line for each attempt, when all fail.
    """
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
