"""``LifecycleNode``: a node whose state launch can watch and change."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.actions.opaque_function import OpaqueFunction
from enclave_launch.description.launch.event import Event
from enclave_launch.description.launch.event_handler import EventHandler
from enclave_launch.description.launch.frontend import Entity, Parser, expose_action
from enclave_launch.description.launch_ros.actions.node import Node
from enclave_launch.description.launch_ros.events.lifecycle.change_state import ChangeState
from enclave_launch.evaluation.location import location_of
from enclave_launch.host.current import current_release
from enclave_launch.process import UNSPECIFIED_NODE_NAME, LauncherCall, ProcessKind
from enclave_launch.ros_rules.distro import Feature

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_context import LaunchContext
    from enclave_launch.description.launch.launch_description_entity import LaunchDescriptionEntity
    from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType

_CHANGE_STATE = "lifecycle_msgs/srv/ChangeState"


@expose_action("lifecycle_node", feature=Feature.LIFECYCLE_TAGS)
class LifecycleNode(Node):
    """Answers ``ChangeState`` events; ``autostart`` (newer distributions) configures and activates."""

    process_kind: ProcessKind = "lifecycle_node"

    def __init__(
        self,
        *,
        name: SomeSubstitutionsType,
        namespace: SomeSubstitutionsType,
        autostart: bool | None = None,
        **kwargs: Any,
    ):
        if autostart is not None and not current_release().has(Feature.LIFECYCLE_AUTOSTART):
            kwargs["autostart"] = autostart  # the base class refuses it, as upstream does
        super().__init__(name=name, namespace=namespace, **kwargs)
        self.__autostart = bool(autostart)

    @classmethod
    def parse(
        cls, entity: Entity, parser: Parser, ignore: list[str] | None = None
    ) -> tuple[type[LifecycleNode], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser, ignore)
        autostart = entity.get_attr("autostart", data_type=bool, optional=True)
        if autostart is not None:
            kwargs["autostart"] = autostart
        return cls, kwargs

    @property
    def node_autostart(self) -> bool:
        return self.__autostart

    def execute(self, context: LaunchContext) -> list[LaunchDescriptionEntity] | None:
        """Raises ``RuntimeError`` without a node name, and as ``Node.execute``."""
        self._perform_substitutions(context)
        if UNSPECIFIED_NODE_NAME in self.node_name:
            raise RuntimeError("node_name unexpectedly incomplete for lifecycle node")
        context.host.launcher_call(
            LauncherCall(f"{self.node_name}/change_state", _CHANGE_STATE, location_of(self, context))
        )
        context.register_event_handler(_ChangeStateHandler(self))
        actions = super().execute(context)
        if not self.__autostart:
            return actions
        from enclave_launch.description.launch_ros.actions.lifecycle_transition import autostart_transition

        return [*(actions or ()), autostart_transition(self.node_name)]


class _ChangeStateHandler(EventHandler):
    """Passes requests for this node on to the host, which calls the service."""

    event_class: type[Event] | None = ChangeState
    internal = True

    def __init__(self, node: LifecycleNode):
        def change_state(context: LaunchContext) -> None:
            request = context.locals.event
            if request.lifecycle_node_matcher(node):
                context.host.change_state(node, request.transition_id, context)

        super().__init__(
            matcher=lambda event: isinstance(event, ChangeState),
            entities=[OpaqueFunction(function=change_state)],
        )
