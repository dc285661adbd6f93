"""Record the results of the user's code in a dry run, so that the live run that follows need not run it again.

The first visit of the file records what each piece of user code returned and changed, in order; the second replays it:

- a Python launch file is run once; its description is restored to its state before the first visit, and visited again;
- a function of the visit (``OpaqueFunction``, an action or a substitution of the user's own class) is called once;
  what it changed of the context and the environment is changed again;
- ``$(command)``, ``$(eval)`` and random names are computed once.

What an event or a timer calls is not recorded: it is called again at its event. A function that itself started
something runs again, too. Used once: a further run evaluates again.
"""

from __future__ import annotations

import logging
import os
import sys
from collections import deque
from collections.abc import Callable, Hashable, Iterable, Iterator
from logging import getLogger
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from enclave_launch.description.entity import LaunchDescriptionEntity
from enclave_launch.description.substitution import Substitution
from enclave_launch.host.environment import changed, environment_snapshot

if TYPE_CHECKING:
    import logging

    from enclave_launch.description.launch_context import ContextState, LaunchContext

T = TypeVar("T")
_OURS = "enclave_launch."


class RecordedResult(NamedTuple):
    """The result of one call, or what it raised, and what it changed.

    ``call_again``: it cannot stand for another call.
    """

    value: Any = None
    error: Exception | None = None
    effects: Effects | None = None
    call_again: bool = False
    logged: tuple[logging.LogRecord, ...] = ()

    def get(self) -> Any:
        """Return the value, or raise what the call raised."""
        if self.error is not None:
            raise self.error
        return _fresh(self.value)


_CALL_AGAIN = RecordedResult(call_again=True)


class RecordedResults:
    """Records results at first; replays them after ``rewind``."""

    def __init__(self) -> None:
        self._recorded: dict[Hashable, deque[RecordedResult]] = {}
        self._kept_alive: list[object] = []  # keeps the ids in keys unique
        self._states: dict[int, _ObjectState] = {}
        self._replaying = False
        self._inside = False
        self._logged: list[logging.LogRecord] = []
        self._listeners: list[tuple[logging.Logger, logging.Handler, int]] = []

    def rewind(self) -> bool:
        """Restore all objects and replay from now on; False if done before: one run can have the results."""
        if self._replaying:
            return False
        for state in self._states.values():
            state.restore()
        self._states.clear()
        self._replaying = True
        return True

    def call(self, key: Hashable, function: Callable[[], T], context: LaunchContext | None = None) -> T:
        """Call ``function``, or return what it returned when it was called with ``key`` before.

        ``context`` is what it may change.
        """
        if self._inside:
            return function()
        if self._replaying:
            return self._replay(key, function, context)
        value: T = self._record(key, function, context)
        return value

    def keep(self, *objects: object) -> tuple[int, ...]:
        """Return the ids of the objects, as part of a key; the objects are held, so that ids stay unique."""
        self._kept_alive.extend(objects)
        return tuple(map(id, objects))

    def remember_state(self, entity: object) -> None:
        """Record the state of an object that is about to be visited, and of what it holds, once."""
        if not self._replaying:
            _record_states(entity, self._states)

    def listen(self, logger: logging.Logger) -> None:
        """Record what user code logs; it is logged when the result is replayed: once, in the log of the launch."""
        if not self._replaying and all(known is not logger for known, *_ in self._listeners):
            listener = _listener(self._hear)
            logger.addHandler(listener)
            self._listeners.append((logger, listener, logger.level))
            logger.setLevel(1)  # what is shown is decided when it is replayed

    def stop_listening(self) -> None:
        """End the recording of logs, after the dry run."""
        for logger, listener, level in self._listeners:
            logger.removeHandler(listener)
            logger.setLevel(level)
        self._listeners.clear()

    def _hear(self, record: logging.LogRecord) -> None:
        if self._inside and record not in self._logged:
            self._logged.append(record)

    def _record(self, key: Hashable, function: Callable[[], Any], context: LaunchContext | None) -> Any:
        result = self._observed(function, context)
        self._add(key, result)
        return result.get()

    def _observed(self, function: Callable[[], Any], context: LaunchContext | None) -> RecordedResult:
        before = _Before(context)
        self._logged = []
        self._inside = True
        try:
            value = _reusable(function())
        except Exception as error:  # whatever user code raises: it raises it again
            return RecordedResult(error=error, effects=before.effects(), logged=tuple(self._logged))
        finally:
            self._inside = False
        if before.something_started():
            return RecordedResult(value, call_again=True)
        return RecordedResult(value, effects=before.effects(), logged=tuple(self._logged))

    def _add(self, key: Hashable, result: RecordedResult) -> None:
        self._recorded.setdefault(key, deque()).append(_CALL_AGAIN if result.call_again else result)

    def _replay(self, key: Hashable, function: Callable[[], T], context: LaunchContext | None) -> T:
        recorded = self._recorded.get(key)
        result = recorded.popleft() if recorded else None
        if result is None or result.call_again:
            return function()
        if result.effects is not None:
            result.effects.apply(context)
        _log(result.logged)
        value: T = result.get()
        return value


class _Items(NamedTuple):
    items: list[Any]


def _reusable(result: Any) -> Any:
    return _Items(list(result)) if isinstance(result, Iterator) else result


def _fresh(result: Any) -> Any:
    if isinstance(result, _Items):
        return iter(list(result.items))
    return list(result) if type(result) is list else result


def _log(records: Iterable[logging.LogRecord]) -> None:
    for record in records:
        logger = getLogger(record.name)
        if logger.isEnabledFor(record.levelno):
            logger.handle(record)


def _listener(hear: Callable[[logging.LogRecord], None]) -> logging.Handler:
    class LogCollector(logging.Handler):
        """Collects records, which are logged later and not now."""

        def emit(self, record: logging.LogRecord) -> None:
            hear(record)

    return LogCollector()


class Effects(NamedTuple):
    """The changes made by a call. Values that were added to a list are added again."""

    environment: dict[str, str]
    environment_removed: frozenset[str]
    path: tuple[str, ...]  # folders added to ``sys.path``
    configurations: dict[str, tuple[Any, Any]]  # before and after
    configurations_removed: frozenset[str]
    locals: dict[str, Any]
    registered: tuple[Any, ...]
    unregistered: tuple[Any, ...]
    emitted: tuple[tuple[Any, str | None], ...]

    def apply(self, context: LaunchContext | None) -> None:
        os.environ.update(self.environment)
        for name in self.environment_removed:
            os.environ.pop(name, None)
        sys.path.extend(folder for folder in self.path if folder not in sys.path)
        if context is not None:
            self._apply_to(context)

    def _apply_to(self, context: LaunchContext) -> None:
        configurations = context.launch_configurations
        for name, (before, after) in self.configurations.items():
            _set(configurations, name, before, after)
        for name in self.configurations_removed:
            configurations.pop(name, None)
        context.extend_locals(self.locals)
        for handler in self.unregistered:
            context.unregister_event_handler(handler)
        for handler in self.registered:
            context.register_event_handler(handler)
        for event, _ in self.emitted:
            context.emit_event_sync(event)


def _set(configurations: dict[str, Any], name: str, before: Any, after: Any) -> None:
    """Set a configuration; to a list, which scopes share, add in place what was added."""
    present = configurations.get(name)
    if isinstance(present, list) and isinstance(before, list) and after[: len(before)] == before:
        present.extend(after[len(before) :])
    else:
        configurations[name] = list(after) if isinstance(after, list) else after


class _Before:
    def __init__(self, context: LaunchContext | None) -> None:
        self._context = context
        self._environment = environment_snapshot()
        self._path = tuple(sys.path)
        self._state: ContextState | None = None if context is None else context.save()
        self._registered = () if context is None else tuple(context._event_handlers.all())
        self._started = self._count()

    def _count(self) -> tuple[int, ...]:
        if self._context is None:
            return ()
        return self._context.host.started_so_far(), len(self._context._completion_futures)

    def something_started(self) -> bool:
        return self._count() != self._started

    def effects(self) -> Effects:
        now = environment_snapshot()
        configurations, gone = self._changed_configurations()
        return Effects(
            environment=changed(self._environment, now),
            environment_removed=frozenset(self._environment.keys() - now.keys()),
            path=tuple(folder for folder in sys.path if folder not in self._path),
            configurations=configurations,
            configurations_removed=gone,
            locals=self._changed_locals(),
            registered=self._handlers(added=True),
            unregistered=self._handlers(added=False),
            emitted=self._emitted(),
        )

    def _changed_configurations(self) -> tuple[dict[str, tuple[Any, Any]], frozenset[str]]:
        if self._context is None or self._state is None:
            return {}, frozenset()
        before, after = self._state.configurations, self._context.save().configurations
        different = {
            name: (before.get(name), value)
            for name, value in after.items()
            if name not in before or before[name] != value
        }
        return different, frozenset(before.keys() - after.keys())

    def _changed_locals(self) -> dict[str, Any]:
        if self._context is None or self._state is None:
            return {}
        before, after = self._state.locals, self._context.save().locals
        return {
            name: value for name, value in after.items() if name not in before or before[name] is not value
        }

    def _handlers(self, *, added: bool) -> tuple[Any, ...]:
        if self._context is None or self._state is None:
            return ()
        before = self._registered
        after = tuple(self._context._event_handlers.all())
        more, fewer = (after, before) if added else (before, after)
        known = {id(handler) for handler in fewer}
        return tuple(handler for handler in more if id(handler) not in known)

    def _emitted(self) -> tuple[tuple[Any, str | None], ...]:
        if self._context is None or self._state is None:
            return ()
        return tuple(self._context.save().queue)[len(self._state.queue) :]


class _ObjectState(NamedTuple):
    subject: object
    attributes: dict[str, Any]
    contents: tuple[tuple[Any, Any], ...]

    def restore(self) -> None:
        for container, content in self.contents:
            container.clear()
            container.extend(content) if isinstance(container, list) else container.update(content)
        vars(self.subject).clear()
        vars(self.subject).update(
            {
                name: _fresh(value) if isinstance(value, _Items) else value
                for name, value in self.attributes.items()
            }
        )


def _record_states(subject: object, known: dict[int, _ObjectState]) -> None:
    """Record ``subject`` and the objects of ours that it holds. Other entities are recorded when they are visited."""
    if id(subject) in known:
        return
    attributes: dict[str, Any] = {}
    contents: list[tuple[Any, Any]] = []
    for name, value in list(vars(subject).items()):
        attributes[name] = value
        if isinstance(value, (list, dict, set)):
            contents.append((value, value.copy()))
        elif isinstance(value, Iterator):
            attributes[name] = _Items(list(value))
            vars(subject)[name] = _fresh(attributes[name])
    known[id(subject)] = _ObjectState(subject, attributes, tuple(contents))
    for value in attributes.values():
        for item in _held(value, 0):
            _record_states(item, known)


_DEPTH = 4  # list of components -> tuple of parameters -> mapping -> value


def _held(value: Any, depth: int) -> Iterator[object]:
    if isinstance(value, (LaunchDescriptionEntity, Substitution, str)) or depth > _DEPTH:
        return
    if isinstance(value, (list, tuple, set, dict)):
        for item in value.values() if isinstance(value, dict) else value:
            yield from _held(item, depth + 1)
    elif type(value).__module__.startswith(f"{_OURS}description.") and hasattr(value, "__dict__"):
        yield value
