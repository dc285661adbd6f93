"""Where a launch description comes from: a file of some kind, or one made in a script."""

from __future__ import annotations

from typing import TYPE_CHECKING

from enclave_launch.description.launch.utilities import (
    normalize_to_list_of_substitutions,
    perform_substitutions,
)

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_context import LaunchContext
    from enclave_launch.description.launch.launch_description import LaunchDescription
    from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType


class LaunchDescriptionSource:
    """Loads its description once, when first asked with a context. Subclasses say how."""

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
        """Load it for looking only, if its path can be performed in an empty context; ``None`` if anything fails.

        A file loaded for this is not kept as the one to visit: upstream loads it again then.
        """
        if self.__launch_description is not None:
            return self.__launch_description
        try:
            return self._get_launch_description(self._location_without_context())
        except Exception:  # whatever the file raises: upstream goes on without it, and so must we
            return None

    def _location_without_context(self) -> str:
        from enclave_launch.description.launch.launch_context import LaunchContext

        return perform_substitutions(LaunchContext(), self.__location)

    def get_launch_description(self, context: LaunchContext) -> LaunchDescription:
        """The description, loaded if necessary."""
        if self.__expanded_location is None:
            self.__expanded_location = perform_substitutions(context, self.__location)
        if self.__launch_description is None:
            self.__launch_description = self._get_launch_description(self.__expanded_location)
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
        """The path once it is known, before that its substitutions as text."""
        if self.__expanded_location is None:
            return " + ".join(str(sub) for sub in self.__location)
        return self.__expanded_location

    @property
    def method(self) -> str:
        return self.__method
