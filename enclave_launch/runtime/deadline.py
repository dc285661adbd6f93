"""A moment at which a launch is ended in order, to be started anew by whoever set it."""

from __future__ import annotations

from datetime import datetime


class Deadline:
    """``reached`` once the launch was ended because of it, and for nothing else."""

    def __init__(self, at: datetime, reason: str) -> None:
        self.at = at
        self.reason = reason
        self.reached = False
