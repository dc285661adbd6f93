"""Find the place of an entity in the launch files, and the includes that lead there."""

from __future__ import annotations

from typing import TYPE_CHECKING

from enclave_common.source_location import SourceLocation
from enclave_launch.frontend import error_location

if TYPE_CHECKING:
    from enclave_launch.description.launch_context import LaunchContext


OUTSIDE = "<launch>"
"""The file of what no file contains: the description that stands for the command line."""

_MARK = "_enclave_launch_place"


def location_of(entity: object, context: LaunchContext) -> SourceLocation:
    """Return the place of ``entity``; the file being evaluated if it is not known itself."""
    place: SourceLocation | None = getattr(entity, "source_location", None)
    if place is None:
        file = context.open_files[-1][0] if context.open_files else OUTSIDE
        return SourceLocation(file, 0, type(entity).__name__, context.includes)
    return SourceLocation(place.file, place.line, place.element, context.includes)


def includes_below(include: object, context: LaunchContext) -> tuple[str, ...]:
    """Return the chain of includes below ``include``. The one that stands for the command line does not count."""
    place = getattr(include, "source_location", None)
    return context.includes if place is None else (*context.includes, str(place))


def annotate(error: BaseException, entity: object, context: LaunchContext) -> None:
    """Record on ``error`` which entity raised it; one in a file that an include was loading is in that file."""
    if place_of(error) is not None:
        return
    place = location_of(entity, context)
    inside = error_location.location_of(error)
    if inside is not None:
        is_step = inside.file not in (place.file, OUTSIDE) and place.file != OUTSIDE
        includes = (*context.includes, str(place)) if is_step else context.includes
        place = SourceLocation(inside.file, inside.line, inside.element, includes)
    setattr(error, _MARK, place)


def place_of(error: BaseException) -> SourceLocation | None:
    """Return what ``annotate`` recorded."""
    place: SourceLocation | None = getattr(error, _MARK, None)
    return place
