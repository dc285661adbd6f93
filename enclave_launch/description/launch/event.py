"""Base of the events that handlers match."""

from __future__ import annotations


class Event:
    """Something that happened. ``name`` identifies the kind."""

    name = "launch.Event"

    def subject(self) -> str:
        """Whom it is about, for the marks of a dry run (``OnProcessExit talker-1``); empty when nobody."""
        return ""
