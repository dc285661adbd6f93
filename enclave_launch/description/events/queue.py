"""The event queue and the table of handlers, shared by the dry run and the live runtime.

Rules (launch's): events are handled one at a time in the order they were emitted; for each one the handlers
are snapshotted, newest registration first; all entities of a handler are visited before the next is called.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from enclave_common.source_location import SourceLocation
    from enclave_launch.description.events.event import Event


class Handler(Protocol):
    """The interface that the table needs of a handler."""

    target: object | None
    internal: bool
    source_location: SourceLocation | None

    def matches(self, event: Event, /) -> bool: ...
    def handle(self, event: Event, context: Any, /) -> Any: ...
    def foresee(self, started: Sequence[Any], /) -> Event | None: ...
    def computes(self) -> bool: ...
    def describe(self) -> tuple[str, list[Any]]: ...


QueuedEvent = tuple["Event", "str | None"]
Buckets = dict[tuple["type[Event] | None", int], dict[int, "Handler"]]


class EventQueue:
    """Events with the mark (``on_event``) in force when they were emitted. ``wake`` is called with each."""

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
        """Return the event that ``get_nowait`` would take."""
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

    def register(self, handler: Handler, append: bool = False) -> None:
        if append:
            self._oldest -= 1
            number = self._oldest
        else:
            self._newest += 1
            number = self._newest
        key = _key(handler)
        self._buckets.setdefault(key, {})[number] = handler
        self._of_name[_event_name(key)] += 1

    def unregister(self, handler: Handler) -> None:
        """Remove its newest registration."""
        key = _key(handler)
        bucket = self._buckets.get(key, {})
        numbers = [number for number, known in bucket.items() if known is handler]
        if not numbers:
            raise ValueError(f"{handler!r} is not in deque")
        del bucket[max(numbers)]
        self._of_name[_event_name(key)] -= 1

    def candidates(self, event: Event) -> list[Handler]:
        """Return the handlers that may match, newest first."""
        found: list[tuple[int, Handler]] = []
        target = id(getattr(event, "action", None))
        for cls in (None, *type(event).__mro__):
            for about in (0, target) if cls is not None else (0,):
                bucket = self._buckets.get((cls, about))
                if bucket:
                    found.extend(bucket.items())
        if len(found) > 1:
            found.sort(key=lambda entry: entry[0], reverse=True)
        return [handler for _, handler in found]

    def matching(self, event: Event) -> Iterable[Handler]:
        """Yield the handlers that match, of a snapshot; each is tested when its turn comes."""
        return (handler for handler in self.candidates(event) if handler.matches(event))

    def would_match(self, event: Event) -> bool:
        return any(handler.matches(event) for handler in self.candidates(event))

    def awaits(self, event_name: str) -> bool:
        """Return True if there is a handler of any event, or one of the class with this name."""
        return bool(self._of_name[event_name] or self._of_name[""])

    def all(self) -> list[Handler]:
        """Return every registered handler, oldest first."""
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


def _key(handler: Handler) -> tuple[type[Event] | None, int]:
    event_class = getattr(handler, "event_class", None)
    target = getattr(handler, "target", None)
    return event_class, 0 if target is None or event_class is None else id(target)
