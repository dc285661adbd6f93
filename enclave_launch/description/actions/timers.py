"""``timer`` and ``ros_timer``: actions that are visited later."""

from __future__ import annotations

import collections.abc
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from enclave_launch.description import read_only
from enclave_launch.description.actions.flow import OpaqueFunction
from enclave_launch.description.argument_types import ensure_argument_type
from enclave_launch.description.entity import Action, LaunchDescriptionEntity, SomeEntitiesType
from enclave_launch.description.events.event import Event, Shutdown, TimerEvent
from enclave_launch.description.events.handlers import BaseEventHandler
from enclave_launch.description.markup.expose import expose_action
from enclave_launch.description.substitution import SomeSubstitutionsType, SomeSubstitutionsType_types_tuple
from enclave_launch.description.typed_values import normalize_typed_substitution, perform_typed_substitution
from enclave_launch.diagnostics.evaluation import ros_timer_on_wall_time
from enclave_launch.ros_rules.distro import Feature

if TYPE_CHECKING:
    from enclave_launch.description.launch_context import LaunchContext
    from enclave_launch.description.markup.entity import Entity, Parser


_PERIOD_TYPES = (*SomeSubstitutionsType_types_tuple, float)


@expose_action("timer")
@read_only("period", "actions")
class TimerAction(Action):
    """Visit ``actions`` once, ``period`` seconds after execution, unless cancelled.

    They find the state at that later time; only the locals are those of the timer's own position. The
    period is performed after the visit in progress.
    """

    period: Any = None
    actions: Iterable[LaunchDescriptionEntity] = ()

    def __init__(
        self,
        *,
        period: float | SomeSubstitutionsType,
        actions: Iterable[LaunchDescriptionEntity],
        cancel_on_shutdown: bool | SomeSubstitutionsType = True,
        **kwargs: Any,
    ) -> None:
        super().__init__(**kwargs)
        ensure_argument_type(period, _PERIOD_TYPES, "period", "TimerAction")
        ensure_argument_type(actions, collections.abc.Iterable, "actions", "TimerAction")
        if isinstance(period, str):
            period = float(period)
        self.__period: Any = normalize_typed_substitution(period, float)
        self.__actions = actions
        self.__cancel_on_shutdown: Any = normalize_typed_substitution(cancel_on_shutdown, bool)
        self.__locals: dict[str, Any] = {}
        self.__configurations: dict[str, Any] | None = None
        self.__environment: dict[str, str] | None = None
        self.__canceled = False
        self._completed_future: Any = None
        self._canceled_future: Any = None
        self.performed_period = 0.0

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        period = entity.get_attr("period", data_type=float, can_be_str=True)
        kwargs["period"] = parser.parse_if_substitutions(period)
        kwargs["actions"] = [parser.parse_action(child) for child in entity.children]
        cancel = entity.get_attr("cancel_on_shutdown", optional=True, data_type=bool, can_be_str=True)
        if cancel is not None:
            kwargs["cancel_on_shutdown"] = parser.parse_if_substitutions(cancel)
        return cls, kwargs

    def describe(self) -> str:
        return f"TimerAction(period={self.__period}, actions=<actions>)"

    def describe_conditional_sub_entities(self) -> list[tuple[str, Iterable[LaunchDescriptionEntity]]]:
        return [(f"{self.__period} seconds pass without being canceled", self.__actions)]

    def get_asyncio_future(self) -> Any:
        return self._completed_future

    def cancel(self) -> None:
        """Cancel the timer; harmless if it has fired or was never started."""
        self.__canceled = True
        for future in (self._canceled_future, self._completed_future):
            if future is not None and not future.done():
                future.set_result(None)

    def execute(self, context: LaunchContext) -> list[LaunchDescriptionEntity] | None:
        loop = context.asyncio_loop
        self._completed_future = loop.create_future()
        self._canceled_future = loop.create_future()
        if self.__canceled:
            self._completed_future.set_result(None)
            return None
        self.__locals = dict(context.get_locals_as_dict())
        self.__keep_state(context)
        context.host.note_namespace(self, context)
        _install_timer_handler(context)
        loop.call_soon(self._start_waiting, context, context.on_event)
        if perform_typed_substitution(context, self.__cancel_on_shutdown, bool):
            context.register_event_handler(_CancelOnShutdown(self))
        return None

    def _start_waiting(self, context: LaunchContext, mark: str | None) -> None:
        self.performed_period = float(perform_typed_substitution(context, self.__period, float))
        self._schedule(context, self.performed_period, mark)

    def _schedule(self, context: LaunchContext, seconds: float, mark: str | None) -> None:
        context.asyncio_loop.call_later(seconds, self._fire, context, mark)

    def _fire(self, context: LaunchContext, mark: str | None) -> None:
        if not self._canceled_future.done():
            context._event_queue.put_nowait(TimerEvent(timer_action=self), mark)
        if not self._completed_future.done():
            self._completed_future.set_result(None)

    def handle(self, context: LaunchContext) -> SomeEntitiesType | None:
        """Return the entities of the timer event; called while it is handled."""
        context.extend_locals(self.__locals)
        if self.__configurations is None and self.__environment is None:
            return self.__actions
        return self.__in_kept_state()

    def __keep_state(self, context: LaunchContext) -> None:
        """Keep the state: newer releases visit the actions in that of the timer's own position."""
        release = context.host.release
        if release.has(Feature.TIMER_COPIES_CONFIGURATIONS):
            self.__configurations = dict(context.launch_configurations)
        if release.has(Feature.TIMER_CAPTURES_ENVIRONMENT):
            self.__environment = context.process_environment.snapshot()

    def __in_kept_state(self) -> list[LaunchDescriptionEntity]:
        def begin(context: LaunchContext) -> None:
            context._push_launch_configurations()
            context._push_environment()
            if self.__configurations is not None:
                context.launch_configurations.clear()
                context.launch_configurations.update(self.__configurations)
            if self.__environment is not None:
                context.process_environment.assign(self.__environment)

        def end(context: LaunchContext) -> None:
            context._pop_environment()
            context._pop_launch_configurations()

        return [OpaqueFunction(function=begin), *self.__actions, OpaqueFunction(function=end)]


class _OnTimerEvent(BaseEventHandler):
    event_class = TimerEvent
    internal = True

    def __init__(self) -> None:
        super().__init__(matcher=lambda event: isinstance(event, TimerEvent))

    def handle(self, event: Event, context: LaunchContext) -> SomeEntitiesType | None:
        super().handle(event, context)
        assert isinstance(event, TimerEvent)
        timer: TimerAction = event.timer_action
        return timer.handle(context)


class _CancelOnShutdown(BaseEventHandler):
    event_class = Shutdown
    internal = True

    def __init__(self, timer: TimerAction) -> None:
        super().__init__(matcher=lambda event: isinstance(event, Shutdown))
        self.__timer = timer

    def handle(self, event: Event, context: LaunchContext) -> SomeEntitiesType | None:
        super().handle(event, context)
        self.__timer.cancel()
        return None


def _install_timer_handler(context: LaunchContext) -> None:
    if not getattr(context, "_timer_handler_installed", False):
        context._timer_handler_installed = True
        context.register_event_handler(_OnTimerEvent())


# ``ros_timer``: a timer on the ROS clock. What it starts, and in which order, is as for ``timer``.


@expose_action("ros_timer")
class ROSTimer(TimerAction):
    """A timer on ROS time. ``period`` is in seconds of ROS time."""

    def __init__(
        self,
        *,
        period: float | SomeSubstitutionsType,
        actions: Iterable[LaunchDescriptionEntity],
        **kwargs: Any,
    ):
        ensure_argument_type(period, (*SomeSubstitutionsType_types_tuple, float), "period", "ROSTimer")
        super().__init__(period=period, actions=actions, **kwargs)
        normalize_typed_substitution(period, float)  # a text is taken by TimerAction only

    def _schedule(self, context: LaunchContext, seconds: float, mark: str | None) -> None:
        """Wait on wall time. Whether launch's clock is simulated is known once the visit in progress has ended."""
        if context.simulated_time:
            context.host.warn(ros_timer_on_wall_time(seconds, self.source_location))
        super()._schedule(context, seconds, mark)


RosTimer = ROSTimer  # the older name, the only one in humble
