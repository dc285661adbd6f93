"""``composable_node``: what to load into a container. Not an action: ``node_container`` and the like hold these."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from enclave_launch.description import read_only
from enclave_launch.description.actions.nodes import Node, parse_remaps
from enclave_launch.description.entity import Action
from enclave_launch.description.markup.entity import Entity, Parser
from enclave_launch.description.node_names import RemapRules, SomeRemapRules, normalize_remap_rules
from enclave_launch.description.parameters.normalize import normalize_parameters
from enclave_launch.description.substitution import (
    SomeSubstitutionsType,
    Substitution,
    normalize_to_list_of_substitutions,
)
from enclave_launch.host.current import current_release
from enclave_launch.ros_rules.distro import Feature

if TYPE_CHECKING:
    from enclave_common.source_location import SourceLocation
    from enclave_launch.description.conditions import Condition
    from enclave_launch.description.parameters.types import Parameters, SomeParameters


@read_only(
    "node_name", "node_namespace", "parameters", "remappings", "extra_arguments", "package", "node_plugin"
)
class ComposableNode:
    """Package and plugin with its name, namespace, parameters, remap rules and extra arguments.

    As upstream the remap rules are read once: the same object loaded a second time has none.
    """

    source_location: SourceLocation | None = None
    node_name: list[Substitution] | None = None
    node_namespace: list[Substitution] | None = None
    parameters: Parameters | None = None
    remappings: RemapRules | None = None
    extra_arguments: Parameters | None = None
    package: list[Substitution]
    node_plugin: list[Substitution]

    def __init__(
        self,
        *,
        package: SomeSubstitutionsType,
        plugin: SomeSubstitutionsType,
        name: SomeSubstitutionsType | None = None,
        namespace: SomeSubstitutionsType | None = None,
        parameters: SomeParameters | None = None,
        remappings: SomeRemapRules | None = None,
        extra_arguments: SomeParameters | None = None,
        condition: Condition | None = None,
    ):
        self.__package = normalize_to_list_of_substitutions(package)
        self.__node_plugin = normalize_to_list_of_substitutions(plugin)
        self.__node_name = None if name is None else normalize_to_list_of_substitutions(name)
        self.__node_namespace = None if namespace is None else normalize_to_list_of_substitutions(namespace)
        self.__parameters = None if parameters is None else normalize_parameters(parameters)
        self.__remappings = normalize_remap_rules(remappings) if remappings else None
        self.__extra_arguments = normalize_parameters(extra_arguments) if extra_arguments else None
        self.__condition = condition

    @classmethod
    def parse(cls, parser: Parser, entity: Entity) -> tuple[type[ComposableNode], dict[str, Any]]:
        """Parse keywords from a ``composable_node`` element; raises if something in it was not understood."""
        kwargs: dict[str, Any] = {
            "package": parser.parse_substitution(entity.get_attr("pkg")),
            "plugin": parser.parse_substitution(entity.get_attr("plugin")),
            "name": parser.parse_substitution(entity.get_attr("name")),
        }
        kwargs |= Action.parse(entity, parser)[1]
        namespace = entity.get_attr("namespace", optional=True)
        if namespace is not None:
            kwargs["namespace"] = parser.parse_substitution(namespace)
        parameters = entity.get_attr("param", data_type=list[Entity], optional=True)
        if parameters is not None:
            kwargs["parameters"] = Node.parse_nested_parameters(parameters, parser)
        remappings = entity.get_attr("remap", data_type=list[Entity], optional=True)
        if remappings is not None:
            kwargs["remappings"] = parse_remaps(remappings, parser)
        extra_arguments = entity.get_attr("extra_arg", data_type=list[Entity], optional=True)
        if extra_arguments is not None:
            kwargs["extra_arguments"] = [_parse_extra_argument(item, parser) for item in extra_arguments]
        entity.assert_entity_completely_parsed()
        return cls, kwargs

    @classmethod
    def from_entity(cls, entity: Entity, parser: Parser) -> ComposableNode:
        """Build the description and remember where it was written."""
        kind, kwargs = cls.parse(parser, entity)
        description = kind(**kwargs)
        description.source_location = entity.source_location
        return description

    def condition(self) -> Condition | None:
        return self.__condition


def _parse_extra_argument(entity: Entity, parser: Parser) -> dict[tuple[Substitution, ...], Any]:
    name = tuple(parser.parse_substitution(entity.get_attr("name")))
    value = parser.parse_substitution(entity.get_attr("value"))
    entity.assert_entity_completely_parsed()
    return {name: value}


# ``composable_lifecycle_node``: a component that is a lifecycle node. Only in newer distributions.


@read_only("node_autostart")
class ComposableLifecycleNode(ComposableNode):
    """With ``autostart`` launch configures and activates it once it is loaded."""

    node_autostart: bool = False

    def __init__(self, *, autostart: bool = False, **kwargs: Any):
        super().__init__(**kwargs)
        self.__node_autostart = autostart

    @classmethod
    def parse(cls, parser: Parser, entity: Entity) -> tuple[type[ComposableLifecycleNode], dict[str, Any]]:
        autostart = entity.get_attr("autostart", data_type=bool, optional=True)
        _, kwargs = super().parse(parser, entity)
        if autostart is not None:
            kwargs["autostart"] = autostart
        return cls, kwargs


def parse_lifecycle_components(entity: Entity, parser: Parser) -> list[ComposableNode]:
    """Parse the ``composable_lifecycle_node`` children; a distribution without them leaves them unread."""
    if not current_release().has(Feature.COMPOSABLE_LIFECYCLE_TAG):
        return []
    children = entity.get_attr("composable_lifecycle_node", data_type=list[Entity], optional=True)
    return [ComposableLifecycleNode.from_entity(child, parser) for child in children or ()]
