"""The state that a visit reads and changes."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterable, MutableMapping
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from enclave_launch.description import read_only
from enclave_launch.description.events.queue import Buckets, EventQueue, Handler, HandlerTable, QueuedEvent
from enclave_launch.host.current import current_host
from enclave_launch.host.environment import Environment
from enclave_launch.host.host import Host

if TYPE_CHECKING:
    from enclave_launch.description.events.event import Event

OpenFile = tuple[str, dict[str, Any], dict[str, str]]
"""A file that is being visited, with the launch configurations and the environment in which it was entered."""


class _Substitution(Protocol):
    def perform(self, context: LaunchContext, /) -> str: ...


class ContextState(NamedTuple):
    """The state that ``LaunchContext.save`` saves; it shares nothing with the context but the values themselves."""

    configurations: dict[str, Any]
    configurations_stack: list[dict[str, Any]]
    locals: dict[str, Any]
    locals_stack: list[dict[str, Any]]
    environment: dict[str, str]
    handlers: Buckets
    queue: deque[QueuedEvent]
    is_shutdown: bool
    on_event: str | None


class Locals:
    """Read-only attribute access to the locals of the event being handled."""

    def __init__(self, values: dict[str, Any]) -> None:
        self.__dict__["_values"] = values

    def __getattr__(self, key: str) -> Any:
        values: dict[str, Any] = self.__dict__["_values"]
        if key not in values:
            raise AttributeError(
                f"context.locals does not contain attribute '{key}', it contains: [{', '.join(values)}]"
            )
        return values[key]

    def __setattr__(self, key: str, value: object) -> None:
        raise AttributeError(f"can't set attribute '{key}', locals are read-only")


MAX_UNFOLDED = 250_000
"""Entities of one walk over a launch file: loops and includes can multiply without end."""


@read_only("noninteractive", "is_shutdown", "argv", "launch_configurations")
class LaunchContext:
    """Launch configurations, environment, locals, events. Upstream's class, plus:

    ``host`` the way to the world; ``on_event`` what is being handled, ``None`` during the visit of the file;
    ``includes`` the "file:line" of each include that we are in; ``open_files`` the files themselves.
    """

    noninteractive: bool = False
    is_shutdown: bool = False
    argv: Iterable[str]
    launch_configurations: dict[str, Any]

    def __init__(
        self, *, argv: Iterable[str] | None = None, noninteractive: bool = False, host: Host | None = None
    ) -> None:
        self.__argv = argv if argv is not None else []
        self.__noninteractive = noninteractive
        self.__host = host
        self.__loop: Any = None
        self.__globals: dict[str, Any] = {}
        self.__locals: dict[str, Any] = {}
        self.__locals_stack: list[dict[str, Any]] = []
        self.__combined: dict[str, Any] | None = None
        self.configurations_read: set[str] = set()
        self.__launch_configurations: dict[str, Any] = WatchedConfigurations(self.configurations_read)
        self.__configurations_stack: list[dict[str, Any]] = []
        self.process_environment = Environment()
        self._event_queue = EventQueue()
        self._event_handlers = HandlerTable()
        self._completion_futures: list[Any] = []
        self.on_event: str | None = None
        self.includes: tuple[str, ...] = ()
        self.open_files: tuple[OpenFile, ...] = ()
        self.unfolded = 0  # entities visited and copied in the walk in progress
        self.simulated_time = False  # requested by set_use_sim_time, for launch's own clock
        self._timer_handler_installed = False

    @property
    def host(self) -> Host:
        if self.__host is None:
            self.__host = current_host()
        return self.__host

    def count_unfolded(self, entities: int) -> None:
        """Count the entities that the walk in progress visits or copies. Raises ``RuntimeError`` for too many."""
        self.unfolded += entities
        if self.unfolded > MAX_UNFOLDED:
            raise RuntimeError(
                f"the launch file unfolds to more than {MAX_UNFOLDED} actions: look for loops with a huge 'len' "
                "and for files that include each other"
            )

    # Shutdown and the loop

    def _set_is_shutdown(self, state: bool) -> None:
        self.__is_shutdown = state

    @property
    def asyncio_loop(self) -> Any:
        return self.__loop if self.__loop is not None else self.host.loop

    def _set_asyncio_loop(self, loop: Any) -> None:
        self.__loop = loop

    def add_completion_future(self, completion_future: Any) -> None:
        """Keep the launch from being idle before this future is done."""
        self._completion_futures.append(completion_future)

    # Locals

    def _push_locals(self) -> None:
        self.__locals_stack.append(dict(self.__locals))

    def _pop_locals(self) -> None:
        if not self.__locals_stack:
            raise RuntimeError("locals stack unexpectedly empty")
        self.__locals = self.__locals_stack.pop()
        self.__combined = None

    def extend_globals(self, extensions: dict[str, Any]) -> None:
        """Add to the locals for good; real locals of the same name win."""
        self.__globals.update(extensions)
        self.__combined = None

    def extend_locals(self, extensions: dict[str, Any]) -> None:
        """Add to the locals until the event being handled is done."""
        self.__locals.update(extensions)
        self.__combined = None

    def get_locals_as_dict(self) -> dict[str, Any]:
        if self.__combined is None:
            self.__combined = {**self.__globals, **self.__locals}
        return self.__combined

    @property
    def locals(self) -> Locals:
        return Locals(self.get_locals_as_dict())

    # Environment: ``os.environ`` itself, as Python launch files rely on it

    @property
    def environment(self) -> MutableMapping[str, str]:
        return os.environ

    def _push_environment(self) -> None:
        self.process_environment.push()

    def _pop_environment(self) -> None:
        self.process_environment.pop()

    def _reset_environment(self) -> None:
        self.process_environment.reset()

    # Launch configurations

    def _push_launch_configurations(self) -> None:
        """Keep a *shallow* copy: lists stay shared between the scopes, as upstream."""
        self.__configurations_stack.append(self.__launch_configurations.copy())

    def _pop_launch_configurations(self) -> None:
        if not self.__configurations_stack:
            raise RuntimeError("launch_configurations stack unexpectedly empty")
        self.__launch_configurations = self.__configurations_stack.pop()

    # Events

    def would_handle_event(self, event: Event) -> bool:
        return self._event_handlers.would_match(event)

    def awaits_completion(self) -> bool:
        """Return True if a handler may take an ``ExecutionComplete``: a cheap first answer for each action visited."""
        return self._event_handlers.awaits("launch.events.ExecutionComplete")

    def register_event_handler(self, event_handler: Handler, append: bool = False) -> None:
        """Register a handler. The newest comes first; with ``append`` this one comes last."""
        self._event_handlers.register(event_handler, append)

    def unregister_event_handler(self, event_handler: Handler) -> None:
        """Unregister the handler; raises ``ValueError`` if it is not registered."""
        self._event_handlers.unregister(event_handler)

    def emit_event_sync(self, event: Event) -> None:
        self._event_queue.put_nowait(event, self.on_event)

    async def emit_event(self, event: Event) -> None:
        self.emit_event_sync(event)

    def perform_substitution(self, substitution: _Substitution) -> str:
        return substitution.perform(self)

    # Hypothetical events: what a dry run tries out leaves no trace

    def save(self) -> ContextState:
        """Save everything that an event could change, for ``restore``."""
        configurations = {
            name: list(value) if isinstance(value, list) else value
            for name, value in dict(self.__launch_configurations).items()
        }
        return ContextState(
            configurations=configurations,
            configurations_stack=list(self.__configurations_stack),
            locals=dict(self.__locals),
            locals_stack=list(self.__locals_stack),
            environment=self.process_environment.snapshot(),
            handlers=self._event_handlers.save(),
            queue=self._event_queue.save(),
            is_shutdown=self.__is_shutdown,
            on_event=self.on_event,
        )

    def restore(self, saved: ContextState) -> None:
        self.__launch_configurations = WatchedConfigurations(self.configurations_read)
        self.__launch_configurations.update(saved.configurations)
        self.__configurations_stack = saved.configurations_stack
        self.__locals = saved.locals
        self.__locals_stack = saved.locals_stack
        self.__combined = None
        self.process_environment.assign(saved.environment)
        self._event_handlers.restore(saved.handlers)
        self._event_queue.restore(saved.queue)
        self.__is_shutdown = saved.is_shutdown
        self.on_event = saved.on_event


class WatchedConfigurations(dict[str, Any]):
    """Launch configurations that note which of them are read. ``names_read`` gets each name that is read or tested,
    found or not; who goes through all has seen all."""

    def __init__(self, names_read: set[str]) -> None:
        super().__init__()
        self._names_read = names_read

    def __contains__(self, name: object) -> bool:
        if isinstance(name, str):
            self._names_read.add(name)
        return super().__contains__(name)

    def __getitem__(self, name: str) -> Any:
        self._names_read.add(name)
        return super().__getitem__(name)

    def get(self, name: str, default: Any = None) -> Any:
        self._names_read.add(name)
        return super().get(name, default)

    def keys(self) -> Any:
        self._names_read.update(dict(self))
        return super().keys()

    def values(self) -> Any:
        self._names_read.update(dict(self))
        return super().values()

    def items(self) -> Any:
        self._names_read.update(dict(self))
        return super().items()

    def copy(self) -> WatchedConfigurations:
        same = WatchedConfigurations(self._names_read)
        same.update(self)
        return same
