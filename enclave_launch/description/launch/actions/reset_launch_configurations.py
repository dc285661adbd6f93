"""``reset``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.action import Action
from enclave_launch.description.launch.frontend.entity import Entity
from enclave_launch.description.launch.frontend.expose import expose_action
from enclave_launch.description.launch.utilities import (
    normalize_to_list_of_substitutions,
    perform_substitutions,
)

if TYPE_CHECKING:
    from enclave_launch.description.launch.frontend.parser import Parser
    from enclave_launch.description.launch.launch_context import LaunchContext
    from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType


@expose_action("reset")
class ResetLaunchConfigurations(Action):
    """Remove every launch configuration but those given, whose values still see the old ones."""

    def __init__(
        self,
        launch_configurations: Mapping[SomeSubstitutionsType, SomeSubstitutionsType] | None = None,
        **kwargs: Any,
    ) -> None:
        super().__init__(**kwargs)
        self.__launch_configurations = launch_configurations or {}

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        keeps = entity.get_attr("keep", data_type=list[Entity], optional=True)
        if keeps is not None:
            kwargs["launch_configurations"] = parse_keeps(keeps, parser)
        return cls, kwargs

    def execute(self, context: LaunchContext) -> None:
        kept = {
            perform_substitutions(context, normalize_to_list_of_substitutions(name)): perform_substitutions(
                context, normalize_to_list_of_substitutions(value)
            )
            for name, value in self.__launch_configurations.items()
        }
        context.launch_configurations.clear()
        context.launch_configurations.update(kept)


def parse_keeps(keeps: list[Entity], parser: Parser) -> dict[SomeSubstitutionsType, SomeSubstitutionsType]:
    """``<keep name= value=>`` elements as constructor argument."""
    parse = parser.parse_substitution
    parsed: dict[SomeSubstitutionsType, SomeSubstitutionsType] = {
        tuple(parse(keep.get_attr("name"))): parse(keep.get_attr("value")) for keep in keeps
    }
    for keep in keeps:
        keep.assert_entity_completely_parsed()
    return parsed
