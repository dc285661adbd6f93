"""``StateTransition``: a lifecycle node has changed its state."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.event import Event

if TYPE_CHECKING:
    from enclave_launch.description.launch_ros.actions.lifecycle_node import LifecycleNode


class StateTransition(Event):
    """``msg`` is a ``lifecycle_msgs/msg/TransitionEvent`` that ``action``'s node published."""

    name = "launch_ros.events.lifecycle.StateTransition"

    def __init__(self, *, action: LifecycleNode, msg: Any):
        super().__init__()
        self.__action = action
        self.__msg = msg

    def subject(self) -> str:
        return self.__action.node_name

    @property
    def action(self) -> LifecycleNode:
        return self.__action

    @property
    def msg(self) -> Any:
        return self.__msg

    @property
    def timestamp(self) -> int:
        return int(self.__msg.timestamp)

    @property
    def transition(self) -> str:
        return str(self.__msg.transition.label)

    @property
    def start_state(self) -> str:
        return str(self.__msg.start_state.label)

    @property
    def goal_state(self) -> str:
        return str(self.__msg.goal_state.label)
