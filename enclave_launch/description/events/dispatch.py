"""The event core: queue and handler table, shared by the dry run and the live runtime.

Rules (launch's): events are handled one at a time in the order they were emitted; for each one the handlers
are snapshotted, newest registration first; all entities of a handler are visited before the next is asked.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterable

from enclave_launch.boundary.light import TYPE_CHECKING, Any
from enclave_launch.description.entity import LaunchDescriptionEntity

if TYPE_CHECKING:
    from enclave_launch.description.events.event import Event
    from enclave_launch.description.events.handlers import BaseEventHandler
    from enclave_launch.description.launch_context import LaunchContext


AND_THEN = ", then "  # between an event and the one that it led to

QueuedEvent = tuple["Event", "str | None"]
Buckets = dict[tuple["type[Event] | None", int], dict[int, "BaseEventHandler"]]


class EventQueue:
    """Events with the mark (``on_event``) in force when they were emitted. ``wake`` is told of each."""

    def __init__(self) -> None:
        self._events: deque[QueuedEvent] = deque()
        self.wake: Callable[[], object] | None = None

    def put_nowait(self, event: Event, mark: str | None = None) -> None:
        self._events.append((event, mark))
        if self.wake is not None:
            self.wake()

    def get_nowait(self) -> QueuedEvent:
        return self._events.popleft()

    def empty(self) -> bool:
        return not self._events

    @property
    def next(self) -> Event:
        """The event that ``get_nowait`` would take."""
        return self._events[0][0]

    def save(self) -> deque[QueuedEvent]:
        return self._events.copy()

    def restore(self, saved: deque[QueuedEvent]) -> None:
        self._events = saved


class HandlerTable:
    """Registered handlers, found by the class of an event and the action it is about."""

    def __init__(self) -> None:
        self._buckets: Buckets = {}
        self._of_name: Counter[str] = Counter()  # registrations by the event's name; "" for any event
        self._newest = 0
        self._oldest = 0

    def register(self, handler: BaseEventHandler, append: bool = False) -> None:
        if append:
            self._oldest -= 1
            number = self._oldest
        else:
            self._newest += 1
            number = self._newest
        key = _key(handler)
        self._buckets.setdefault(key, {})[number] = handler
        self._of_name[_event_name(key)] += 1

    def unregister(self, handler: BaseEventHandler) -> None:
        """Remove its newest registration."""
        key = _key(handler)
        bucket = self._buckets.get(key, {})
        numbers = [number for number, known in bucket.items() if known is handler]
        if not numbers:
            raise ValueError(f"{handler!r} is not in deque")
        del bucket[max(numbers)]
        self._of_name[_event_name(key)] -= 1

    def candidates(self, event: Event) -> list[BaseEventHandler]:
        """Those worth asking, newest first."""
        found: list[tuple[int, BaseEventHandler]] = []
        target = id(getattr(event, "action", None))
        for cls in (None, *type(event).__mro__):
            for about in (0, target) if cls is not None else (0,):
                bucket = self._buckets.get((cls, about))
                if bucket:
                    found.extend(bucket.items())
        if len(found) > 1:
            found.sort(key=lambda entry: entry[0], reverse=True)
        return [handler for _, handler in found]

    def matching(self, event: Event) -> Iterable[BaseEventHandler]:
        """A snapshot; each handler is asked when its turn comes."""
        return (handler for handler in self.candidates(event) if handler.matches(event))

    def would_match(self, event: Event) -> bool:
        return any(handler.matches(event) for handler in self.candidates(event))

    def awaits(self, event_name: str) -> bool:
        """Is there a handler of any event, or one of the class with this name?"""
        return bool(self._of_name[event_name] or self._of_name[""])

    def all(self) -> list[BaseEventHandler]:
        """Every registered handler, oldest first."""
        found = [entry for bucket in self._buckets.values() for entry in bucket.items()]
        return [handler for _, handler in sorted(found, key=lambda entry: entry[0])]

    def save(self) -> Buckets:
        return {key: dict(bucket) for key, bucket in self._buckets.items() if bucket}

    def restore(self, saved: Buckets) -> None:
        self._buckets = saved
        self._of_name = Counter()
        for key, bucket in saved.items():
            self._of_name[_event_name(key)] += len(bucket)


def _event_name(key: tuple[type[Event] | None, int]) -> str:
    return "" if key[0] is None else key[0].name


def _key(handler: BaseEventHandler) -> tuple[type[Event] | None, int]:
    event_class = getattr(handler, "event_class", None)
    target = getattr(handler, "target", None)
    return event_class, 0 if target is None or event_class is None else id(target)


def handle_next(
    context: LaunchContext, describe: Callable[[BaseEventHandler, Event], str | None]
) -> list[Any]:
    """Take one event from the queue through all its handlers; give the futures of what was begun.

    ``describe`` names a handler's turn for ``context.on_event`` (``None``: as the event's own mark).
    """
    event, mark = context._event_queue.get_nowait()
    futures: list[Any] = []
    for handler in context._event_handlers.matching(event):
        futures.extend(run_handler(context, handler, event, chain(mark, describe(handler, event))))
    return futures


def run_handler(
    context: LaunchContext, handler: BaseEventHandler, event: Event, mark: str | None
) -> list[Any]:
    """Let one handler answer ``event``: its entities are visited with the event's own locals."""
    from enclave_launch.description.visit import visit_all

    before = context.on_event
    context._push_locals()
    context.on_event = mark
    try:
        futures: list[Any] = []
        for entity in _entities(handler.handle(event, context)):
            futures.extend(visit_all(entity, context))
        return futures
    finally:
        context.on_event = before
        context._pop_locals()


def _entities(result: Any) -> Iterable[Any]:
    for entity in result if isinstance(result, Iterable) else (result,):
        if entity is None:
            continue
        if not isinstance(entity, LaunchDescriptionEntity):
            raise RuntimeError(f"expected a LaunchDescriptionEntity from event_handler, got '{entity}'")
        yield entity


def chain(mark: str | None, next_mark: str | None) -> str | None:
    """``timer 2`` inside ``OnProcessExit a-1`` is ``OnProcessExit a-1, then timer 2``."""
    if mark is None or next_mark is None:
        return mark or next_mark
    return f"{mark}{AND_THEN}{next_mark}"
