"""The base of everything that can stand in a launch description."""

from __future__ import annotations

import collections.abc
import sys
from collections.abc import Iterable
from types import FrameType

from enclave_launch.boundary.light import TYPE_CHECKING, Any
from enclave_launch.source_location import SourceLocation

if TYPE_CHECKING:
    pass

    from enclave_launch.description.launch_context import LaunchContext


_OURS = "enclave_launch."
_BUILDERS = (
    "enclave_launch.description.markup",
    "enclave_launch.description.visit",
    "enclave_launch.description.argument_scan",
    "enclave_launch.evaluation",
)


class LaunchDescriptionEntity:
    """Visited when launching; described when only looked at.

    ``source_location`` is where it was written: the element of an XML or YAML file (set by the front end), or
    the statement of a Python file that created the object.
    """

    source_location: SourceLocation | None = None
    built_by_front_end = False  # built anew for each evaluation, unlike what a Python file builds

    def describe(self) -> str:
        raise NotImplementedError()

    def describe_sub_entities(self) -> list[LaunchDescriptionEntity]:
        """The entities that a visit will always give, as far as known without a context."""
        return []

    def describe_conditional_sub_entities(self) -> list[tuple[str, Iterable[LaunchDescriptionEntity]]]:
        """Entities that a visit may give: the condition in words, and what depends on it."""
        return []

    def visit(self, context: LaunchContext) -> list[LaunchDescriptionEntity] | None:
        """Do it, and give the entities to visit next. Must not block."""
        return None

    def get_asyncio_future(self) -> Any:
        """A future that is done when what the visit began has ended; ``None``: nothing goes on."""
        return None


def creation_location(element: str) -> SourceLocation | None:
    """The nearest calling frame outside of our own code; ``None`` when a front end or a visit builds the object."""
    frame: FrameType | None = sys._getframe(2)
    while frame is not None:
        name: str = frame.f_globals.get("__name__", "")
        if not name.startswith(_OURS):
            return SourceLocation(frame.f_code.co_filename, frame.f_lineno, element)
        if name.startswith(_BUILDERS):
            return None
        frame = frame.f_back
    return None


SomeEntitiesType = LaunchDescriptionEntity | collections.abc.Iterable[LaunchDescriptionEntity]
SomeEntitiesType_types_tuple = (LaunchDescriptionEntity, collections.abc.Iterable)
SomeActionsType = SomeEntitiesType  # humble's names
SomeActionsType_types_tuple = SomeEntitiesType_types_tuple


def normalize_to_list_of_entities(entities: Iterable[SomeEntitiesType]) -> list[LaunchDescriptionEntity]:
    """Flatten one level of nesting."""
    flat: list[LaunchDescriptionEntity] = []
    for entity in entities:
        if isinstance(entity, LaunchDescriptionEntity):
            flat.append(entity)
        else:
            flat.extend(entity)
    return flat
