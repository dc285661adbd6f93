"""Source of an XML or YAML launch file."""

from __future__ import annotations

from typing import TYPE_CHECKING

from enclave_launch.description.launch.frontend.parser import Parser
from enclave_launch.description.launch.launch_description_source import LaunchDescriptionSource
from enclave_launch.description.launch.launch_description_sources.frontend_launch_file_utilities import (
    get_launch_description_from_frontend_launch_file,
)

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_description import LaunchDescription
    from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType


class FrontendLaunchDescriptionSource(LaunchDescriptionSource):
    """Any front end may read the file. ``parser`` is accepted and, as upstream, not used."""

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
