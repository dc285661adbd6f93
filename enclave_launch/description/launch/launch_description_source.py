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
        location = self.location_without_context()
        if location is None:
            return None
        try:
            return self._get_launch_description(location)
        except Exception:  # whatever the file raises: upstream goes on without it, and so must we
            return None

    def location_without_context(self) -> str | None:
        """The path, performed in an empty context; ``None`` when it cannot, or when there is nothing to load."""
        from enclave_launch.description.launch.launch_context import LaunchContext

        if self.__launch_description is not None:
            return None
        try:
            return perform_substitutions(LaunchContext(), self.__location)
        except Exception:  # any substitution, ours or a third party's
            return None

    def expand(self, context: LaunchContext) -> str:
        """The path, performed at the first call."""
        if self.__expanded_location is None:
            self.__expanded_location = perform_substitutions(context, self.__location)
        return self.__expanded_location

    def get_launch_description(self, context: LaunchContext) -> LaunchDescription:
        """The description, loaded if necessary."""
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
        """The path once it is known, before that its substitutions as text."""
        if self.__expanded_location is None:
            return " + ".join(str(sub) for sub in self.__location)
        return self.__expanded_location

    @property
    def method(self) -> str:
        return self.__method
