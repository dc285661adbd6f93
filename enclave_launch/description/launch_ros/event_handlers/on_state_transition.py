"""``OnStateTransition``: what to do when a lifecycle node has changed its state."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from enclave_launch.description.launch.event import Event
from enclave_launch.description.launch.event_handler import EventHandler
from enclave_launch.description.launch.some_entities_type import SomeEntitiesType
from enclave_launch.description.launch_ros.actions.lifecycle_node import LifecycleNode
from enclave_launch.description.launch_ros.events.lifecycle.state_transition import StateTransition
from enclave_launch.description.lifecycle_msgs.msg import State, Transition, TransitionEvent

# (label, from, to) of every transition event, from ros2/rcl rcl_lifecycle/src/default_state_machine.c
_TRANSITIONS = (
    ("configure", "unconfigured", "configuring"),
    ("transition_success", "configuring", "inactive"),
    ("activate", "inactive", "activating"),
    ("transition_success", "activating", "active"),
    ("deactivate", "active", "deactivating"),
    ("transition_success", "deactivating", "inactive"),
    ("cleanup", "inactive", "cleaningup"),
    ("transition_success", "cleaningup", "unconfigured"),
    ("shutdown", "unconfigured", "shuttingdown"),
    ("shutdown", "inactive", "shuttingdown"),
    ("shutdown", "active", "shuttingdown"),
    ("transition_success", "shuttingdown", "finalized"),
    ("transition_failure", "configuring", "unconfigured"),
    ("transition_failure", "activating", "inactive"),
    ("transition_failure", "deactivating", "active"),
    ("transition_error", "configuring", "errorprocessing"),
    ("transition_error", "activating", "errorprocessing"),
    ("transition_error", "deactivating", "errorprocessing"),
    ("transition_error", "cleaningup", "errorprocessing"),
    ("transition_error", "shuttingdown", "errorprocessing"),
    ("transition_success", "errorprocessing", "unconfigured"),
    ("transition_failure", "errorprocessing", "finalized"),
)


class OnStateTransition(EventHandler):
    """Fires when everything that is given equals what the event says; ``matcher`` replaces all of it.

    Raises ``RuntimeError`` for a target that is no lifecycle node.
    """

    def __init__(
        self,
        *,
        entities: SomeEntitiesType,
        target_lifecycle_node: LifecycleNode | None = None,
        transition: str | None = None,
        start_state: str | None = None,
        goal_state: str | None = None,
        matcher: Callable[[Event], bool] | None = None,
        **kwargs: Any,
    ):
        if not isinstance(target_lifecycle_node, (LifecycleNode, type(None))):
            raise RuntimeError("OnStateTransition requires a 'LifecycleNode' action as the target")
        self.__target = target_lifecycle_node
        self.__asked = (transition, start_state, goal_state)
        super().__init__(matcher=matcher or self.__given_values_match, entities=entities, **kwargs)

    def __given_values_match(self, event: Event) -> bool:
        if not isinstance(event, StateTransition) or self.__target not in (None, event.action):
            return False
        told = (event.transition, event.start_state, event.goal_state)
        return all(asked in (None, value) for asked, value in zip(self.__asked, told, strict=True))

    def foresee(self, started: Sequence[Any]) -> Event | None:
        """The first transition of a started lifecycle node that this handler would answer."""
        nodes = [action for action in started if isinstance(action, LifecycleNode)]
        if self.__target is not None:
            nodes = [self.__target] if self.__target in nodes else []
        return next(filter(self.matches, _possible_events(nodes)), None)

    @property
    def target_lifecycle_node(self) -> LifecycleNode | None:
        return self.__target

    @property
    def handler_description(self) -> str:
        return "<actions>"

    @property
    def matcher_description(self) -> str:
        if self.__target is None:
            return "event == StateTransition"
        return f"event == StateTransition and event.action == LifecycleNode({hex(id(self.__target))})"


def _possible_events(nodes: Sequence[LifecycleNode]) -> Iterator[StateTransition]:
    for node in nodes:
        for label, start, goal in _TRANSITIONS:
            message = TransitionEvent(0, Transition(label=label), State(label=start), State(label=goal))
            yield StateTransition(action=node, msg=message)
