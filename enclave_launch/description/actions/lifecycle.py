"""``lifecycle_node``: nodes whose state launch can watch and change."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar

from enclave_common.source_location import SourceLocation
from enclave_launch.description import read_only
from enclave_launch.description.actions.events import EmitEvent, RegisterEventHandler
from enclave_launch.description.actions.flow import OpaqueFunction
from enclave_launch.description.actions.nodes import Node
from enclave_launch.description.entity import Action, LaunchDescriptionEntity, SomeEntitiesType
from enclave_launch.description.events.event import Event
from enclave_launch.description.events.handlers import EventHandler
from enclave_launch.description.events.lifecycle import ChangeState, StateTransition
from enclave_launch.description.launch_context import LaunchContext
from enclave_launch.description.lifecycle_msgs import State, Transition, TransitionEvent
from enclave_launch.description.location import location_of
from enclave_launch.description.markup.entity import Entity, Parser
from enclave_launch.description.markup.expose import expose_action
from enclave_launch.description.node_names import matches_node_name
from enclave_launch.description.substitution import (
    SomeSubstitutionsType,
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.description.typed_values import normalize_typed_substitution, perform_typed_substitution
from enclave_launch.host.current import current_release
from enclave_launch.process import UNSPECIFIED_NODE_NAME, LauncherCall, ProcessKind
from enclave_launch.ros_rules.distro import Feature

_CHANGE_STATE = "lifecycle_msgs/srv/ChangeState"


@expose_action("lifecycle_node", feature=Feature.LIFECYCLE_NODE_TAG)
@read_only("node_autostart")
class LifecycleNode(Node):
    """Answers ``ChangeState`` events; ``autostart`` (newer distributions) configures and activates."""

    process_kind: ProcessKind = "lifecycle_node"
    node_autostart: bool = False

    def __init__(
        self,
        *,
        name: SomeSubstitutionsType,
        namespace: SomeSubstitutionsType,
        autostart: bool | SomeSubstitutionsType | None = None,
        **kwargs: Any,
    ):
        if autostart is not None and not current_release().has(Feature.LIFECYCLE_AUTOSTART):
            kwargs["autostart"] = autostart  # the base class refuses it, as upstream does
        super().__init__(name=name, namespace=namespace, **kwargs)
        self.__node_autostart: Any = autostart or False

    @classmethod
    def parse(
        cls, entity: Entity, parser: Parser, ignore: list[str] | None = None
    ) -> tuple[type[LifecycleNode], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser, ignore)
        autostart = entity.get_attr("autostart", data_type=bool, optional=True, can_be_str=True)
        if autostart is not None:
            kwargs["autostart"] = parser.parse_if_substitutions(autostart)
        return cls, kwargs

    def execute(self, context: LaunchContext) -> list[LaunchDescriptionEntity] | None:
        """Start the node; raises ``RuntimeError`` without a node name, and as ``Node.execute``."""
        self._perform_substitutions(context)
        if UNSPECIFIED_NODE_NAME in self.node_name:
            raise RuntimeError("node_name unexpectedly incomplete for lifecycle node")
        _follow_states(self, context, location_of(self, context))
        actions = super().execute(context)
        if not self.__wants_autostart(context):
            return actions

        return [*(actions or ()), autostart_transition(self.node_name)]

    def __wants_autostart(self, context: LaunchContext) -> bool:
        """Releases before the tag ``lifecycle_node`` keep what was given: substitutions count as true there."""
        value = self.__node_autostart
        if isinstance(value, bool) or not context.host.release.has(Feature.LIFECYCLE_NODE_TAG):
            return bool(value)
        return bool(perform_typed_substitution(context, normalize_typed_substitution(value, bool), bool))


@dataclass(frozen=True)
class LifecycleComponent:
    """A component that launch takes through its states, as the events of lifecycle nodes see it."""

    node_name: str


def autostarted_component(name: str, context: LaunchContext, place: SourceLocation) -> LifecycleTransition:
    """Let launch follow the states of a loaded component; return what configures and activates it."""
    component = LifecycleComponent(name)
    _follow_states(component, context, place)
    context.host.watch_states(component, context)
    transition = autostart_transition(name)
    transition.source_location = place
    return transition


def _follow_states(
    node: LifecycleNode | LifecycleComponent, context: LaunchContext, place: SourceLocation
) -> None:
    """Make launch a client of the node's transitions."""
    context.host.launcher_call(LauncherCall(f"{node.node_name}/change_state", _CHANGE_STATE, place))
    context.register_event_handler(_ChangeStateHandler(node))


class _ChangeStateHandler(EventHandler):
    event_class: type[Event] | None = ChangeState
    internal = True

    def __init__(self, node: LifecycleNode | LifecycleComponent):
        def change_state(context: LaunchContext) -> None:
            request = context.locals.event
            if request.lifecycle_node_matcher(node):
                context.host.change_state(node, request.transition_id, context)

        super().__init__(
            matcher=lambda event: isinstance(event, ChangeState),
            entities=[OpaqueFunction(function=change_state)],
        )


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


@read_only("target_lifecycle_node")
class OnStateTransition(EventHandler):
    """Fires when everything that is given equals what the event says; raises ``RuntimeError`` for other targets."""

    target_lifecycle_node: LifecycleNode | None = None

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
        self.__target_lifecycle_node = target_lifecycle_node
        self.__wanted = (transition, start_state, goal_state)
        super().__init__(matcher=matcher or self.__given_values_match, entities=entities, **kwargs)

    def __given_values_match(self, event: Event) -> bool:
        if not isinstance(event, StateTransition) or self.__target_lifecycle_node not in (None, event.action):
            return False
        happened = (event.transition, event.start_state, event.goal_state)
        return all(wanted in (None, value) for wanted, value in zip(self.__wanted, happened, strict=True))

    def foresee(self, started: Sequence[Any]) -> Event | None:
        """Return the first transition of a started lifecycle node that this handler would answer."""
        nodes = [action for action in started if isinstance(action, LifecycleNode | LifecycleComponent)]
        if self.__target_lifecycle_node is not None:
            nodes = [self.__target_lifecycle_node] if self.__target_lifecycle_node in nodes else []
        return next(filter(self.matches, _possible_events(nodes)), None)

    @property
    def handler_description(self) -> str:
        return "<actions>"

    @property
    def matcher_description(self) -> str:
        if self.__target_lifecycle_node is None:
            return "event == StateTransition"
        return f"event == StateTransition and event.action == LifecycleNode({hex(id(self.__target_lifecycle_node))})"


def _possible_events(nodes: Sequence[LifecycleNode | LifecycleComponent]) -> Iterator[StateTransition]:
    for node in nodes:
        for label, start, goal in _TRANSITIONS:
            message = TransitionEvent(0, Transition(label=label), State(label=start), State(label=goal))
            yield StateTransition(action=node, msg=message)


# ``LifecycleTransition``: take nodes through a sequence of lifecycle transitions. Not in humble.


def _passing(start_state: str, goal_state: str) -> dict[str, str]:
    return {"start_state": start_state, "goal_state": goal_state}


class LifecycleTransition(Action):
    """Requests the first transition of each node; each goal state that is reached requests the next one."""

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
        """Register handlers for every reached goal state, then send the first request to every node.

        Raises ``ValueError`` for an id that is not a number, ``KeyError`` for one without a goal state.
        """
        names = [perform_substitutions(context, name) for name in self.__names]
        ids = [_transition_id(perform_substitutions(context, item)) for item in self.__ids]
        requests = {name: [_request(name, transition) for transition in ids] for name in names}
        self.__handlers = {name: [] for name in names}
        registrations: list[LaunchDescriptionEntity] = [
            RegisterEventHandler(self.__after(name, transition, requests[name][step:]))
            for step, transition in enumerate(ids, start=1)
            for name in names
        ]
        for name in names:
            self.__register_failure(context, name)
        for registration in registrations:
            registration.source_location = self.source_location
        return [*registrations, *(requests[name][0] for name in names)]

    def __after(self, name: str, transition: int, remaining: Sequence[Action]) -> EventHandler:
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
    """Return the handler of ``autostart``: configure, then activate."""
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
