"""Source of a Python launch file."""

from __future__ import annotations

from typing import TYPE_CHECKING

from enclave_launch.description.launch.launch_description_source import LaunchDescriptionSource
from enclave_launch.description.launch.launch_description_sources.python_launch_file_utilities import (
    get_launch_description_from_python_launch_file,
)

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_description import LaunchDescription
    from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType


class PythonLaunchDescriptionSource(LaunchDescriptionSource):
    """Runs the file; its own exceptions come out unchanged."""

    def __init__(self, launch_file_path: SomeSubstitutionsType) -> None:
        super().__init__(None, launch_file_path, "interpreted python launch file")

    def _get_launch_description(self, location: str) -> LaunchDescription:
        return get_launch_description_from_python_launch_file(location)
