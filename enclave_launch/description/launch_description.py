"""A list of entities: what a launch file describes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from enclave_launch.description import read_only
from enclave_launch.description.argument_scan import DeclaredArguments, collect_arguments
from enclave_launch.description.entity import Action, LaunchDescriptionEntity
from enclave_launch.diagnostics.evaluation import launch_file_deprecated

if TYPE_CHECKING:
    from enclave_launch.description.launch_context import LaunchContext


@read_only("deprecated_reason", "entities")
class LaunchDescription(LaunchDescriptionEntity):
    """Visited, it gives its entities. ``deprecated_reason`` is warned about at each visit."""

    argument_summary: DeclaredArguments | None = None  # of a file whose arguments were collected before
    deprecated_reason: str | None = None
    entities: list[LaunchDescriptionEntity]

    def __init__(
        self,
        initial_entities: Iterable[LaunchDescriptionEntity] | None = None,
        *,
        deprecated_reason: str | None = None,
    ) -> None:
        self.__entities = list(initial_entities) if initial_entities is not None else []
        self.__deprecated_reason = deprecated_reason

    @property
    def deprecated(self) -> bool:
        return self.__deprecated_reason is not None

    def add_entity(self, entity: LaunchDescriptionEntity) -> None:
        self.__entities.append(entity)

    def add_action(self, action: Action) -> None:
        self.add_entity(action)

    def visit(self, context: LaunchContext) -> list[LaunchDescriptionEntity]:
        if self.__deprecated_reason is not None:
            file = context.get_locals_as_dict().get("current_launch_file_path")
            context.host.warn(launch_file_deprecated(file, self.__deprecated_reason))
        return self.__entities

    def describe_sub_entities(self) -> list[LaunchDescriptionEntity]:
        return self.__entities

    def get_launch_arguments(self, conditional_inclusion: bool = False) -> list[Any]:
        """Return the first ``DeclareLaunchArgument`` of each name that can be found without executing anything."""
        found = self.get_launch_arguments_with_include_launch_description_actions(conditional_inclusion)
        return [argument for argument, _ in found]

    def get_launch_arguments_with_include_launch_description_actions(
        self, conditional_inclusion: bool = False
    ) -> list[tuple[Any, list[Any] | None]]:
        """Return the arguments as ``get_launch_arguments``, each with the includes on the way to it (None: none)."""
        return collect_arguments(self, conditional_inclusion)
