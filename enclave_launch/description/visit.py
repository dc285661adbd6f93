"""Visit a description depth-first, without recursion, and let handlers answer events, one at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, Any

from enclave_launch.description.absent_modules import OpaqueValue
from enclave_launch.description.actions.includes import IncludeLaunchDescription, opened
from enclave_launch.description.entity import LaunchDescriptionEntity
from enclave_launch.description.location import annotate, includes_below
from enclave_launch.frontend import error_location

if TYPE_CHECKING:
    from enclave_launch.description.events.event import Event
    from enclave_launch.description.events.queue import Handler
    from enclave_launch.description.launch_context import LaunchContext, OpenFile


AND_THEN = ", then "  # between an event and the one that it led to

Surroundings = tuple[tuple[str, ...], "tuple[OpenFile, ...]"]


def visit_all(entity: LaunchDescriptionEntity, context: LaunchContext) -> list[Any]:
    """Visit ``entity`` and everything below it; give the futures of what was begun, with their entities."""
    futures: list[Any] = []
    outside = context.includes, context.open_files
    before = context.unfolded
    stack: list[tuple[Iterator[LaunchDescriptionEntity], Surroundings]] = [(iter((entity,)), outside)]
    current: LaunchDescriptionEntity | None = entity
    results = context.host.user_code_results
    try:
        while stack:
            siblings, (context.includes, context.open_files) = stack[-1]
            current = next(siblings, None)
            if current is None:
                stack.pop()
                continue
            context.count_unfolded(1)
            if results is not None and not current.built_by_front_end:
                results.remember_state(current)
            sub_entities = current.visit(context)
            future = current.get_asyncio_future()
            if future is not None:
                futures.append((current, future))
            if isinstance(sub_entities, OpaqueValue):  # which a function of the launch file returned
                sub_entities = [sub_entities]
            if sub_entities is not None:
                stack.append((iter(sub_entities), _surroundings_below(current, context)))
    except error_location.RAISED_BY_USER_CODE as error:  # noted where it happened, and raised again
        annotate(error, current, context)
        raise
    finally:
        context.includes, context.open_files = outside
        context.unfolded = before
    return futures


def _surroundings_below(entity: LaunchDescriptionEntity, context: LaunchContext) -> Surroundings:
    if isinstance(entity, IncludeLaunchDescription):
        return includes_below(entity, context), opened(entity, context)
    return context.includes, context.open_files


def visit_all_entities_and_collect_futures(
    entity: LaunchDescriptionEntity, context: LaunchContext
) -> list[tuple[LaunchDescriptionEntity, Any]]:
    """Visit ``entity`` and all below; give each entity that goes on, with its future."""
    return visit_all(entity, context)


def handle_next(context: LaunchContext, describe: Callable[[Handler, Event], str | None]) -> list[Any]:
    """Take one event through all its handlers; give the futures of what was begun."""
    event, mark = context._event_queue.get_nowait()
    futures: list[Any] = []
    for handler in context._event_handlers.matching(event):
        futures.extend(run_handler(context, handler, event, chain(mark, describe(handler, event))))
    return futures


def run_handler(context: LaunchContext, handler: Handler, event: Event, mark: str | None) -> list[Any]:
    """Let one handler answer ``event``: its entities are visited with the event's own locals."""
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
    is_several = isinstance(result, Iterable) and not isinstance(result, OpaqueValue)
    for entity in result if is_several else (result,):
        if entity is None:
            continue
        if not isinstance(entity, LaunchDescriptionEntity):
            raise RuntimeError(f"expected a LaunchDescriptionEntity from event_handler, got '{entity}'")
        yield entity


def chain(mark: str | None, next_mark: str | None) -> str | None:
    """Join two marks: ``timer 2`` inside ``OnProcessExit a-1`` is ``OnProcessExit a-1, then timer 2``."""
    if mark is None or next_mark is None:
        return mark or next_mark
    return f"{mark}{AND_THEN}{next_mark}"
