"""The depth-first walk over a description, without recursion so that depth costs no stack.

Each entity is visited, then all that its visit gave, then its next sibling.
"""

from __future__ import annotations

from collections.abc import Iterator

from enclave_launch.boundary.light import TYPE_CHECKING, Any
from enclave_launch.description.actions.includes import IncludeLaunchDescription, OpenFile, opened
from enclave_launch.description.location import annotate, includes_below

if TYPE_CHECKING:
    from enclave_launch.description.entity import LaunchDescriptionEntity
    from enclave_launch.description.launch_context import LaunchContext


Surroundings = tuple[tuple[str, ...], tuple[OpenFile, ...]]


def visit_all(entity: LaunchDescriptionEntity, context: LaunchContext) -> list[Any]:
    """Visit ``entity`` and everything below it; give the futures of what was begun, with their entities.

    An exception ends the walk; it carries the place of the entity that raised it (``location.place_of``).
    """
    futures: list[Any] = []
    outside = context.includes, context.open_files
    before = context.unfolded
    stack: list[tuple[Iterator[LaunchDescriptionEntity], Surroundings]] = [(iter((entity,)), outside)]
    current: LaunchDescriptionEntity | None = entity
    outcomes = context.host.outcomes
    try:
        while stack:
            siblings, (context.includes, context.open_files) = stack[-1]
            current = next(siblings, None)
            if current is None:
                stack.pop()
                continue
            context.count_unfolded(1)
            if outcomes is not None and not current.built_by_front_end:
                outcomes.remember_state(current)
            sub_entities = current.visit(context)
            future = current.get_asyncio_future()
            if future is not None:
                futures.append((current, future))
            if sub_entities is not None:
                stack.append((iter(sub_entities), _surroundings_below(current, context)))
    except Exception as error:  # noted where it happened, and raised again
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
