"""``composable_lifecycle_node``: a component that is a lifecycle node. Only in newer distributions."""

from __future__ import annotations

from typing import Any

from enclave_launch.description.launch.frontend import Entity, Parser
from enclave_launch.description.launch_ros.descriptions.composable_node import ComposableNode
from enclave_launch.host.current import current_release
from enclave_launch.ros_rules.distro import Feature


class ComposableLifecycleNode(ComposableNode):
    """With ``autostart`` launch configures and activates it once it is loaded."""

    def __init__(self, *, autostart: bool = False, **kwargs: Any):
        super().__init__(**kwargs)
        self.__autostart = autostart

    @classmethod
    def parse(cls, parser: Parser, entity: Entity) -> tuple[type[ComposableLifecycleNode], dict[str, Any]]:
        autostart = entity.get_attr("autostart", data_type=bool, optional=True)
        _, kwargs = super().parse(parser, entity)
        if autostart is not None:
            kwargs["autostart"] = autostart
        return cls, kwargs

    @property
    def node_autostart(self) -> bool:
        return self.__autostart


def parse_lifecycle_components(entity: Entity, parser: Parser) -> list[ComposableNode]:
    """The ``composable_lifecycle_node`` children; where the distribution has none, they stay unread."""
    if not current_release().has(Feature.LIFECYCLE_TAGS):
        return []
    children = entity.get_attr("composable_lifecycle_node", data_type=list[Entity], optional=True)
    return [ComposableLifecycleNode.from_entity(child, parser) for child in children or ()]
