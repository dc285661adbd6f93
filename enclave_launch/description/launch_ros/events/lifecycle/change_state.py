"""``ChangeState``: asks lifecycle nodes for a transition."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

from enclave_launch.description.launch.event import Event
from enclave_launch.description.lifecycle_msgs.msg import State, Transition


def _constants(message: type, prefix: str) -> dict[int, str]:
    named = {value: name for name, value in vars(message).items() if name.startswith(prefix)}
    return dict(sorted(named.items()))


class ChangeState(Event):
    """``transition_id`` is one of the constants of ``lifecycle_msgs/msg/Transition``."""

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

    def __init__(self, *, lifecycle_node_matcher: Callable[[Any], bool], transition_id: int):
        super().__init__()
        if transition_id not in self.valid_transitions:
            known = ", ".join(f"{name}: {value}" for value, name in self.valid_transitions.items())
            raise ValueError(f"given transition_id of '{transition_id}', expected one of {{{known}}}")
        self.__lifecycle_node_matcher = lifecycle_node_matcher
        self.__transition_id = transition_id

    @property
    def lifecycle_node_matcher(self) -> Callable[[Any], bool]:
        return self.__lifecycle_node_matcher

    @property
    def transition_id(self) -> int:
        return self.__transition_id
