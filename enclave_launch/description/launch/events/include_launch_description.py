"""A request to include a description."""

from __future__ import annotations

from typing import TYPE_CHECKING

from enclave_launch.description.launch.event import Event

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_description import LaunchDescription


class IncludeLaunchDescription(Event):
    """``launch_description`` is to be visited."""

    name = "launch.events.IncludeLaunchDescription"

    def __init__(self, launch_description: LaunchDescription) -> None:
        self.__launch_description = launch_description

    @property
    def launch_description(self) -> LaunchDescription:
        return self.__launch_description
