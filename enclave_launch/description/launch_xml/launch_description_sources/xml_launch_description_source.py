"""Source of a markup launch file that calls itself XML."""

from __future__ import annotations

from enclave_launch.description.launch.launch_description_sources import FrontendLaunchDescriptionSource
from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType


class XMLLaunchDescriptionSource(FrontendLaunchDescriptionSource):
    """As upstream, the name decides nothing: either syntax is read."""

    def __init__(self, launch_file_path: SomeSubstitutionsType) -> None:
        super().__init__(launch_file_path, method="interpreted XML launch file")
