"""Events of lifecycle nodes: a transition is requested, a state has changed."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any, ClassVar

from enclave_launch.description import node_names, read_only
from enclave_launch.description.events.event import Event
from enclave_launch.description.lifecycle_msgs import State, Transition


def _constants(message: type, prefix: str) -> dict[int, str]:
    named = {value: name for name, value in vars(message).items() if name.startswith(prefix)}
    return dict(sorted(named.items()))


@read_only("transition_id", "lifecycle_node_matcher")
class ChangeState(Event):
    """A request for a lifecycle transition. ``transition_id`` is one of the constants of
    ``lifecycle_msgs/msg/Transition``."""

    name = "launch_ros.events.lifecycle.ChangeState"
    valid_transitions: ClassVar[dict[int, str]] = {
        value: name
        for value, name in _constants(Transition, "TRANSITION_").items()
        if value <= Transition.TRANSITION_DESTROY
    }
    valid_states: ClassVar[dict[int, str]] = {
        **_constants(State, "PRIMARY_STATE_"),
        **_constants(State, "TRANSITION_STATE_"),
    }
    transition_id: int = 0
    lifecycle_node_matcher: Callable[[Any], bool]

    def __init__(self, *, lifecycle_node_matcher: Callable[[Any], bool], transition_id: int):
        super().__init__()
        if transition_id not in self.valid_transitions:
            known = ", ".join(f"{name}: {value}" for value, name in self.valid_transitions.items())
            raise ValueError(f"given transition_id of '{transition_id}', expected one of {{{known}}}")
        self.__lifecycle_node_matcher = lifecycle_node_matcher
        self.__transition_id = transition_id


@read_only("msg", "action")
class StateTransition(Event):
    """A lifecycle node has changed its state. ``msg`` is a ``lifecycle_msgs/msg/TransitionEvent`` that ``action``'s
    node published."""

    name = "launch_ros.events.lifecycle.StateTransition"
    msg: Any = None
    action: Any

    def __init__(self, *, action: Any, msg: Any):
        super().__init__()
        self.__action = action
        self.__msg = msg

    def subject(self) -> str:
        return str(self.__action.node_name)

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


def matches_node_name(node_name: str) -> Callable[[Any], bool]:
    """Forward to ``launch_ros.events``, where it is now, and warn."""
    warnings.warn("'matches_node_name' is in 'launch_ros.events' now, not in 'lifecycle'", stacklevel=2)
    return node_names.matches_node_name(node_name)
