"""Locate an exception in its file: callers catch errors by type, so the place is an attribute of the object."""

from __future__ import annotations

from collections.abc import Iterator
from types import TracebackType

from enclave_common.source_location import SourceLocation

_ATTRIBUTE = "enclave_launch_location"

RAISED_BY_USER_CODE = (Exception, SystemExit)
"""Launch files call ``sys.exit``, and are refused with the place where they do."""


def mark(error: BaseException, entity: object) -> None:
    """Record that ``error`` came from ``entity``; the first, innermost record stays.

    An error in a template knows its text, not its place: the attribute with that text is searched for.
    """
    if hasattr(error, _ATTRIBUTE):
        return
    template = getattr(error, "template", None)
    find_text = getattr(entity, "find_text", None)
    found = find_text(template) if template is not None and find_text is not None else None
    mark_at(error, found or getattr(entity, "source_location", None))


def mark_at(error: BaseException, location: SourceLocation | None) -> None:
    """Record the place of ``error`` unless it has one."""
    if location is not None and not hasattr(error, _ATTRIBUTE):
        setattr(error, _ATTRIBUTE, location)


def location_of(error: BaseException) -> SourceLocation | None:
    """Return the place recorded on ``error``, or on the likeliest of the attempts that it lists."""
    location: SourceLocation | None = getattr(likeliest(error), _ATTRIBUTE, None)
    return location


def likeliest(error: BaseException) -> BaseException:
    """Return the one attempt to show of those that an ``InvalidLaunchFileError`` lists; else ``error`` itself.

    The first, because the file name decides the order, unless it says that the text is no XML at all.
    """
    attempts = [likeliest(attempt) for attempt in getattr(error, "likely_errors", ())]
    if not attempts:
        return error
    is_no_xml = getattr(attempts[0], "code", None) == _XML_ERROR_SYNTAX and isinstance(
        attempts[0], SyntaxError
    )
    return attempts[1] if len(attempts) > 1 and is_no_xml else attempts[0]


def frames(error: BaseException) -> Iterator[TracebackType]:
    """Yield the steps of the traceback of ``error``, outermost first."""
    step = error.__traceback__
    while step is not None:
        yield step
        step = step.tb_next


_XML_ERROR_SYNTAX = 2  # expat's number for it; the module is not imported just for that
