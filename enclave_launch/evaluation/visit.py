"""The depth-first walk over a description, without recursion so that depth costs no stack.

Each entity is visited, then all that its visit gave, then its next sibling.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.actions.include_launch_description import IncludeLaunchDescription
from enclave_launch.evaluation.location import annotate, include_step

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_context import LaunchContext
    from enclave_launch.description.launch.launch_description_entity import LaunchDescriptionEntity


def visit_all(entity: LaunchDescriptionEntity, context: LaunchContext) -> list[Any]:
    """Visit ``entity`` and everything below it; give the futures of what was begun, with their entities.

    An exception ends the walk; it carries the place of the entity that raised it (``location.place_of``).
    """
    futures: list[Any] = []
    before = context.includes
    stack: list[tuple[Iterator[LaunchDescriptionEntity], tuple[str, ...]]] = [(iter((entity,)), before)]
    current: LaunchDescriptionEntity = entity
    try:
        while stack:
            siblings, includes = stack[-1]
            context.includes = includes
            current = next(siblings, None)  # type: ignore[assignment]
            if current is None:
                stack.pop()
                continue
            sub_entities = current.visit(context)
            future = current.get_asyncio_future()
            if future is not None:
                futures.append((current, future))
            if sub_entities is not None:
                stack.append((iter(sub_entities), _includes_below(current, context)))
    except Exception as error:
        annotate(error, current, context)
        raise
    finally:
        context.includes = before
    return futures


def _includes_below(entity: LaunchDescriptionEntity, context: LaunchContext) -> tuple[str, ...]:
    if isinstance(entity, IncludeLaunchDescription):
        return (*context.includes, include_step(entity))
    return context.includes
