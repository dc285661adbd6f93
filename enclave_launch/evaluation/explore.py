"""Explore what only events would start: the second half of a dry run.

After the visit of the launch file, first comes what happens in every run, in order: events that the file
emitted itself, completions, process starts, timers by due time. Then each remaining handler is given a made-up
event (a process exits, writes, a lifecycle node changes state) in the state at that time, and everything is
put back afterwards: one supposition must not colour the next. What a handler starts is followed further.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from enclave_launch.description.actions.events import EmitEvent
from enclave_launch.description.actions.lifecycle import OnStateTransition
from enclave_launch.description.actions.processes import OnProcessExit
from enclave_launch.description.events.event import (
    Event,
    ProcessStarted,
    Shutdown,
    TimerEvent,
    process_event_arguments,
)
from enclave_launch.description.events.handlers import EventHandler
from enclave_launch.description.events.queue import Handler
from enclave_launch.description.location import location_of, place_of
from enclave_launch.description.visit import AND_THEN, chain, run_handler
from enclave_launch.diagnostics.evaluation import scope_ended
from enclave_launch.evaluation.error_text import error_text
from enclave_launch.frontend import error_location
from enclave_launch.host.user_code import starts_nothing
from enclave_launch.process import Reaction, Unforeseeable
from nodl.ament_index import ExecutableNotInstalledError, PackageNotFoundError

if TYPE_CHECKING:
    from enclave_launch.description.launch_context import LaunchContext
    from enclave_launch.host.plan_host import PlanHost


_LONGEST_CHAIN = 100  # events of which each leads to the next: a timer that restarts itself never ends


class Explorer:
    """Goes through the events of one dry run."""

    def __init__(self, context: LaunchContext, host: PlanHost) -> None:
        self._context = context
        self._host = host
        self._announced = 0  # processes whose start was announced
        self._fired: set[int] = set()  # handlers that have run; each is supposed once
        self._depth = 0
        self._made_up: set[int] = set()  # events that we only suppose
        self._kept_alive: list[object] = []  # keeps ids unique
        self._noted: set[int] = set()  # handlers and timers that are in the host's reactions

    def run(self) -> None:
        self._settle_now()
        ended_at_once = self._context.is_shutdown
        self._settle()
        if not ended_at_once:
            self._context._set_is_shutdown(False)
            self._suppose(known=frozenset(), new_from=0)
        self._report_unreached()

    # What happens in every run

    def _settle(self) -> None:
        """Handle all events and starts; jump to the next timer; until nothing is left."""
        self._settle_now()
        while self._host.loop.fire_next():
            self._settle_now()

    def _settle_now(self) -> None:
        while self._host.loop.fire_due() or self._handle_event() or self._announce_start():
            pass

    def _handle_event(self) -> bool:
        queue = self._context._event_queue
        if queue.empty():
            return False
        event, mark = queue.get_nowait()
        if mark is not None and mark.count(AND_THEN) >= _LONGEST_CHAIN:
            self._leave_open(event.timer_action if isinstance(event, TimerEvent) else event)
            return True
        for handler in self._context._event_handlers.matching(event):
            if self._depth == 0 or handler.internal or id(handler) not in self._fired:
                self._run(handler, event, mark)
        if isinstance(event, Shutdown):
            self._context._set_is_shutdown(True)
        return True

    def _leave_open(self, written: object) -> None:
        """Report that the chain of events is not followed further, since it may have no end."""
        what = f"what comes after {_LONGEST_CHAIN} events that each led to the next"
        self._host.unforeseeable(Unforeseeable(what, location_of(written, self._context)))

    def _announce_start(self) -> bool:
        """Emit ``OnProcessStart`` for each process that was started; False if all were announced."""
        if self._announced >= len(self._host.started):
            return False
        action = self._host.started[self._announced]
        mark = self._host.processes[self._announced].on_event
        self._announced += 1
        event = ProcessStarted(**process_event_arguments(action))
        if self._context.would_handle_event(event):
            self._emit_made_up(event, mark)
        return True

    def _emit_made_up(self, event: Event, mark: str | None) -> None:
        self._made_up.add(id(event))
        self._kept_alive.append(event)
        self._context._event_queue.put_nowait(event, mark)

    def _run(self, handler: Handler, event: Event, mark: str | None) -> None:
        self._remember(handler)
        self._note(handler, event)
        mark = chain(mark, _label(handler, event))
        if id(event) in self._made_up and handler.computes() and not _is_ours(handler):
            if starts_nothing(getattr(handler, "callback", None)):
                return
            self._host.unforeseeable(
                Unforeseeable(f"what a callback returns for {mark}", self._place(handler))
            )
            return
        before = len(self._host.processes)
        run_handler(self._context, handler, event, mark)
        self._note_scope(event.timer_action if isinstance(event, TimerEvent) else handler, before)

    def _note_scope(self, later: object, before: int) -> None:
        """Warn of nodes that ``later`` has started since, outside of the namespace in which it is written."""
        _, namespace = self._host.written_in.get(id(later), (later, ""))
        for process in self._host.processes[before:] if namespace else ():
            own = process.namespace or "/"
            if process.kind != "executable" and not f"{own}/".startswith(f"{namespace}/"):
                name = process.name or process.process_name
                self._host.warn(scope_ended(name, namespace, location_of(later, self._context)))

    def _remember(self, handler: Handler) -> None:
        self._fired.add(id(handler))
        self._kept_alive.append(handler)

    def _note(self, handler: Handler, event: Event | None) -> None:
        # For engines that carry the plan out without launch and know nothing of the file's handlers.
        is_timer = isinstance(event, TimerEvent)
        if handler.internal and not is_timer:
            return
        subject = event if is_timer else handler
        if id(subject) in self._noted:
            return
        self._noted.add(id(subject))
        self._kept_alive.append(subject)
        name = type(handler).__name__
        what = (_label(handler, event) if event is not None else None) or name
        if handler.computes():
            what += ", a Python function"
        if isinstance(event, TimerEvent):
            written: Any = event.timer_action
        else:  # on_exit of a process registers a handler that stands nowhere itself
            written = handler if handler.source_location or handler.target is None else handler.target
        place = location_of(written, self._context)
        self._host.reactions.append(Reaction(what, place, _ends_with(handler)))

    # What may happen

    def _suppose(self, known: frozenset[int], new_from: int) -> None:
        """Suppose an event for each handler that has not run.

        ``known``: handlers that were there before the supposition we are in; of those only events about processes
        started since (from index ``new_from``) are followed here, the others in their own turn.
        """
        for handler in self._context._event_handlers.all():
            if handler.internal or id(handler) in self._fired:
                continue
            started: list[Any] = self._host.started[new_from:] if id(handler) in known else self._host.started
            if isinstance(handler, OnStateTransition) and id(handler) not in known:
                started = [*started, *self._host.lifecycle_components]
            event = handler.foresee(started)
            self._note(handler, event)
            if event is not None and self._depth >= _LONGEST_CHAIN:
                self._leave_open(handler)
            elif event is not None:
                self._try(event)

    def _try(self, event: Event) -> None:
        saved, clock = self._context.save(), self._host.loop.save()
        known = frozenset(map(id, self._context._event_handlers.all()))
        new_from = len(self._host.started)
        self._depth += 1
        try:
            self._emit_made_up(event, None)
            self._settle()
            self._context._set_is_shutdown(False)
            self._suppose(known, new_from)
        except error_location.RAISED_BY_USER_CODE as error:
            if isinstance(_root(error), (PackageNotFoundError, ExecutableNotInstalledError)):
                raise
            self._note_failure(event, error)
        finally:
            self._depth -= 1
            self._context.restore(saved)
            self._host.loop.restore(clock)

    def _note_failure(self, event: Event, error: BaseException) -> None:
        place = place_of(error) or location_of(event, self._context)
        what = f"what {event.name.rpartition('.')[2]} {event.subject()}".rstrip()
        self._host.unforeseeable(Unforeseeable(f"{what} would lead to: {error_text(error)}", place))

    def _report_unreached(self) -> None:
        for handler in self._context._event_handlers.all():
            if handler.internal or id(handler) in self._fired or not isinstance(handler, EventHandler):
                continue
            if handler.entities:
                what = f"entities of {type(handler).__name__}, whose event is not known"
                self._host.unforeseeable(Unforeseeable(what, self._place(handler)))

    def _place(self, handler: Handler) -> Any:
        return location_of(handler, self._context)


def _label(handler: Handler, event: Event) -> str | None:
    if isinstance(event, TimerEvent):
        return f"timer {event.subject()}" if handler.internal else None
    if handler.internal:
        return None
    kind = type(handler).__name__
    name = kind if kind.startswith("On") else event.name
    return f"{name} {event.subject()}".rstrip()


def _ends_with(handler: Handler) -> str | None:
    """Return the process at whose end the handler ends the launch; None if the handler does something else."""
    details = getattr(handler.target, "process_details", None)
    if type(handler) is not OnProcessExit or handler.computes() or not details:
        return None
    entities = handler.describe()[1]
    ends = [
        isinstance(entity, EmitEvent) and isinstance(entity.event, Shutdown) and entity.condition is None
        for entity in entities
    ]
    return str(details["name"]) if ends and all(ends) else None


def _is_ours(handler: Handler) -> bool:
    callback = getattr(handler, "callback", None)
    return getattr(callback, "__module__", "").startswith("enclave_launch.")


def _root(error: BaseException) -> BaseException:
    while error.__cause__ is not None:
        error = error.__cause__
    return error
