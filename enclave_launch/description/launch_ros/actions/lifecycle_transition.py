"""``LifecycleTransition``: take nodes through a sequence of lifecycle transitions. Not in humble."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, ClassVar

from enclave_launch.description.launch.action import Action
from enclave_launch.description.launch.actions.emit_event import EmitEvent
from enclave_launch.description.launch.actions.opaque_function import OpaqueFunction
from enclave_launch.description.launch.actions.register_event_handler import RegisterEventHandler
from enclave_launch.description.launch.event import Event
from enclave_launch.description.launch.event_handler import EventHandler
from enclave_launch.description.launch.launch_context import LaunchContext
from enclave_launch.description.launch.launch_description_entity import LaunchDescriptionEntity
from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType
from enclave_launch.description.launch.utilities import (
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.description.launch_ros.event_handlers.on_state_transition import OnStateTransition
from enclave_launch.description.launch_ros.events.lifecycle.change_state import ChangeState
from enclave_launch.description.launch_ros.events.lifecycle.state_transition import StateTransition
from enclave_launch.description.launch_ros.events.matchers import matches_node_name
from enclave_launch.description.lifecycle_msgs.msg import Transition


def _passing(start_state: str, goal_state: str) -> dict[str, str]:
    return {"start_state": start_state, "goal_state": goal_state}


class LifecycleTransition(Action):
    """Asks each node for the first transition; each reached goal state asks for the next one."""

    transition_targets: ClassVar[dict[int, dict[str, str]]] = {
        Transition.TRANSITION_CONFIGURE: _passing("configuring", "inactive"),
        Transition.TRANSITION_CLEANUP: _passing("cleaningup", "unconfigured"),
        Transition.TRANSITION_ACTIVATE: _passing("activating", "active"),
        Transition.TRANSITION_DEACTIVATE: _passing("deactivating", "inactive"),
        Transition.TRANSITION_UNCONFIGURED_SHUTDOWN: _passing("shuttingdown", "finalized"),
        Transition.TRANSITION_INACTIVE_SHUTDOWN: _passing("shuttingdown", "finalized"),
        Transition.TRANSITION_ACTIVE_SHUTDOWN: _passing("shuttingdown", "finalized"),
    }

    def __init__(
        self,
        *,
        lifecycle_node_names: Sequence[SomeSubstitutionsType],
        transition_ids: Sequence[int | SomeSubstitutionsType],
        **kwargs: Any,
    ):
        super().__init__(**kwargs)
        if not transition_ids:
            raise ValueError("No transition_ids provided.")
        if not lifecycle_node_names:
            raise ValueError("No lifecycle_node_names provided.")
        self.__names = [normalize_to_list_of_substitutions(name) for name in lifecycle_node_names]
        self.__ids = [
            normalize_to_list_of_substitutions(str(item) if isinstance(item, int) else item)
            for item in transition_ids
        ]
        self.__handlers: dict[str, list[EventHandler]] = {}

    def execute(self, context: LaunchContext) -> list[LaunchDescriptionEntity]:
        """Handlers for every reached goal state, then the first request to every node.

        Raises ``ValueError`` for an id that is no number, ``KeyError`` for one without a goal state.
        """
        names = [perform_substitutions(context, name) for name in self.__names]
        ids = [_transition_id(perform_substitutions(context, item)) for item in self.__ids]
        requests = {name: [_request(name, transition) for transition in ids] for name in names}
        self.__handlers = {name: [] for name in names}
        registrations = [
            RegisterEventHandler(self.__after(name, transition, requests[name][step:]))
            for step, transition in enumerate(ids, start=1)
            for name in names
        ]
        for name in names:
            self.__register_failure(context, name)
        return [*registrations, *(requests[name][0] for name in names)]

    def __after(self, name: str, transition: int, remaining: Sequence[Action]) -> EventHandler:
        """Once ``transition`` has reached its goal: the next request, or the end of the sequence."""
        target = self.transition_targets[transition]
        done = OpaqueFunction(function=partial(self.__forget, name=name))
        handler = OnStateTransition(
            matcher=_reaches(name, target["goal_state"], target["start_state"]),
            entities=[remaining[0] if remaining else done],
            handle_once=True,
        )
        self.__handlers[name].append(handler)
        return handler

    def __register_failure(self, context: LaunchContext, name: str) -> None:
        handler = EventHandler(
            matcher=_reaches(name, "errorprocessing"),
            entities=[OpaqueFunction(function=partial(self.__forget, name=name))],
            handle_once=True,
        )
        handler.internal = True
        self.__handlers[name].append(handler)
        context.register_event_handler(handler)

    def __forget(self, context: LaunchContext, *, name: str) -> None:
        for handler in self.__handlers[name]:
            try:
                context.unregister_event_handler(handler)
            except ValueError:
                continue  # has fired already


def autostart_transition(full_name: str) -> LifecycleTransition:
    """What ``autostart`` does: configure, then activate."""
    return LifecycleTransition(
        lifecycle_node_names=[full_name],
        transition_ids=[Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE],
    )


def _transition_id(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise ValueError(f"expected integer for lifecycle transition, got {text}") from None


def _request(name: str, transition: int) -> EmitEvent:
    change = ChangeState(lifecycle_node_matcher=matches_node_name(name), transition_id=transition)
    return EmitEvent(event=change)


def _reaches(name: str, goal_state: str, start_state: str | None = None) -> Callable[[Event], bool]:
    full_name = name if name.startswith("/") else f"/{name}"

    def matches(event: Event) -> bool:
        return (
            isinstance(event, StateTransition)
            and event.action.node_name == full_name
            and event.goal_state == goal_state
            and start_state in (None, event.start_state)
        )

    return matches
