"""``visit_all_entities_and_collect_futures``: the walk, under upstream's name."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from enclave_launch.evaluation.visit import visit_all

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_context import LaunchContext
    from enclave_launch.description.launch.launch_description_entity import LaunchDescriptionEntity


def visit_all_entities_and_collect_futures(
    entity: LaunchDescriptionEntity, context: LaunchContext
) -> list[tuple[LaunchDescriptionEntity, Any]]:
    """Visit ``entity`` and all below; give each entity that goes on, with its future."""
    return visit_all(entity, context)
