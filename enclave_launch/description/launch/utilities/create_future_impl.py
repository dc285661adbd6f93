"""Humble's ``create_future``."""

from __future__ import annotations

from typing import Any


def create_future(loop: Any) -> Any:
    """A future of ``loop``, or of the loop that is running."""
    if loop is None:
        import asyncio

        loop = asyncio.get_event_loop()
    return loop.create_future()
