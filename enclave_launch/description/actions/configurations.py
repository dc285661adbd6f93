"""Launch configurations: ``let`` sets one, ``reset`` forgets them; groups push and pop their scope."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from enclave_launch.description.entity import Action, ScanRole
from enclave_launch.description.markup.entity import Entity
from enclave_launch.description.markup.expose import expose_action
from enclave_launch.description.substitution import normalize_to_list_of_substitutions, perform_substitutions
from enclave_launch.description.templates import TemplateAction, template

if TYPE_CHECKING:
    from enclave_launch.description.launch_context import LaunchContext
    from enclave_launch.description.markup.entity import Parser
    from enclave_launch.description.substitution import SomeSubstitutionsType


@expose_action("let")
class SetLaunchConfiguration(TemplateAction):
    """Set a launch configuration, for the rest of the scope it is in."""

    name = template()
    value = template()

    def execute(self, context: LaunchContext) -> None:
        value = perform_substitutions(context, self.value)
        context.launch_configurations[perform_substitutions(context, self.name)] = value


class UnsetLaunchConfiguration(TemplateAction):
    """Remove a launch configuration; absent ones are fine."""

    name = template()

    def execute(self, context: LaunchContext) -> None:
        context.launch_configurations.pop(perform_substitutions(context, self.name), None)


class PushLaunchConfigurations(Action):
    """Open a scope of launch configurations."""

    def execute(self, context: LaunchContext) -> None:
        context._push_launch_configurations()


class PopLaunchConfigurations(Action):
    """Close a scope of launch configurations."""

    def execute(self, context: LaunchContext) -> None:
        context._pop_launch_configurations()


@expose_action("reset")
class ResetLaunchConfigurations(Action):
    """Remove every launch configuration but those given, whose values still see the old ones."""

    scan_role = ScanRole.RESET

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
    """Return ``<keep name= value=>`` elements as a constructor argument."""
    parse = parser.parse_substitution
    parsed: dict[SomeSubstitutionsType, SomeSubstitutionsType] = {
        tuple(parse(keep.get_attr("name"))): parse(keep.get_attr("value")) for keep in keeps
    }
    for keep in keeps:
        keep.assert_entity_completely_parsed()
    return parsed
