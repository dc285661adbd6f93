"""``node_container``: a node that loads components, with the components to load first."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from enclave_launch.description.launch.frontend import Entity, Parser, expose_action
from enclave_launch.description.launch.launch_context import LaunchContext
from enclave_launch.description.launch.launch_description_entity import LaunchDescriptionEntity
from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType
from enclave_launch.description.launch_ros.actions.node import Node
from enclave_launch.description.launch_ros.descriptions.composable_node import ComposableNode
from enclave_launch.process import ProcessKind


@expose_action("node_container")
class ComposableNodeContainer(Node):
    """Executes as a node, then gives a ``LoadComposableNodes`` for the components whose condition holds."""

    process_kind: ProcessKind = "container"

    def __init__(
        self,
        *,
        name: SomeSubstitutionsType,
        namespace: SomeSubstitutionsType,
        composable_node_descriptions: Sequence[ComposableNode] | None = None,
        **kwargs: Any,
    ):
        super().__init__(name=name, namespace=namespace, **kwargs)
        self.__descriptions = composable_node_descriptions or ()

    @classmethod
    def parse(
        cls, entity: Entity, parser: Parser, ignore: list[str] | None = None
    ) -> tuple[type[ComposableNodeContainer], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser, ignore)
        components = parse_components(entity, parser, optional=True)
        if components is not None:
            kwargs["composable_node_descriptions"] = components
        return cls, kwargs

    def execute(self, context: LaunchContext) -> list[LaunchDescriptionEntity] | None:
        from enclave_launch.description.launch_ros.actions.load_composable_nodes import LoadComposableNodes

        wanted = [item for item in self.__descriptions if _condition_holds(item, context)]
        actions = super().execute(context)
        if not wanted:
            return actions
        load = LoadComposableNodes(composable_node_descriptions=wanted, target_container=self)
        load.source_location = self.source_location
        return [*(actions or ()), load]


def parse_components(entity: Entity, parser: Parser, *, optional: bool) -> list[ComposableNode] | None:
    """The ``composable_node`` children, of newer distributions also ``composable_lifecycle_node``."""
    from enclave_launch.description.launch_ros.descriptions.composable_lifecycle_node import (
        parse_lifecycle_components,
    )

    lifecycle = parse_lifecycle_components(entity, parser)
    children = entity.get_attr(
        "composable_node",
        data_type=list[Entity],
        optional=optional or bool(lifecycle),
    )
    if children is None:
        return lifecycle or None
    return [ComposableNode.from_entity(child, parser) for child in children] + lifecycle


def _condition_holds(description: ComposableNode, context: LaunchContext) -> bool:
    condition = description.condition()
    return condition is None or condition.evaluate(context)
