"""``group``."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.action import Action
from enclave_launch.description.launch.actions.pop_environment import PopEnvironment
from enclave_launch.description.launch.actions.pop_launch_configurations import PopLaunchConfigurations
from enclave_launch.description.launch.actions.push_environment import PushEnvironment
from enclave_launch.description.launch.actions.push_launch_configurations import PushLaunchConfigurations
from enclave_launch.description.launch.actions.reset_environment import ResetEnvironment
from enclave_launch.description.launch.actions.reset_launch_configurations import (
    ResetLaunchConfigurations,
    parse_keeps,
)
from enclave_launch.description.launch.actions.set_launch_configuration import SetLaunchConfiguration
from enclave_launch.description.launch.frontend.entity import Entity
from enclave_launch.description.launch.frontend.expose import expose_action

if TYPE_CHECKING:
    from enclave_launch.description.launch.frontend.parser import Parser
    from enclave_launch.description.launch.launch_context import LaunchContext
    from enclave_launch.description.launch.launch_description_entity import LaunchDescriptionEntity
    from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType


@expose_action("group")
class GroupAction(Action):
    """Gives its actions, by default inside a scope of launch configurations and environment.

    ``forwarding=False`` starts the scope empty but for ``launch_configurations``. The pushed namespace, remaps
    and global parameters are launch configurations too and so are scoped with them.
    """

    def __init__(
        self,
        actions: Iterable[LaunchDescriptionEntity],
        *,
        scoped: bool = True,
        forwarding: bool = True,
        launch_configurations: Mapping[SomeSubstitutionsType, SomeSubstitutionsType] | None = None,
        **left_over_kwargs: Any,
    ) -> None:
        super().__init__(**left_over_kwargs)
        self.__actions = actions
        self.__scoped = scoped
        self.__forwarding = forwarding
        self.__launch_configurations = launch_configurations or {}
        self.__expanded: list[LaunchDescriptionEntity] | None = None

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        for name in ("scoped", "forwarding"):
            value = entity.get_attr(name, data_type=bool, optional=True)
            if value is not None:
                kwargs[name] = value
        keeps = entity.get_attr("keep", data_type=list[Entity], optional=True)
        if keeps is not None:
            kwargs["launch_configurations"] = parse_keeps(keeps, parser)
        kwargs["actions"] = [
            parser.parse_action(child) for child in entity.children if child.type_name != "keep"
        ]
        return cls, kwargs

    def get_sub_entities(self) -> list[LaunchDescriptionEntity]:
        if self.__expanded is None:
            self.__expanded = self.__expand()
        return self.__expanded

    def __expand(self) -> list[LaunchDescriptionEntity]:
        actions = list(self.__actions)
        keeps = [SetLaunchConfiguration(name, value) for name, value in self.__launch_configurations.items()]
        if not self.__scoped:
            return [*keeps, *actions]
        start: list[LaunchDescriptionEntity] = [PushLaunchConfigurations(), PushEnvironment()]
        if self.__forwarding:
            start += keeps
        else:
            start += [ResetEnvironment(), ResetLaunchConfigurations(self.__launch_configurations)]
        return [*start, *actions, PopEnvironment(), PopLaunchConfigurations()]

    def execute(self, context: LaunchContext) -> list[LaunchDescriptionEntity]:
        return self.get_sub_entities()
