"""The host of the evaluation in progress."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING

from enclave_launch.host.plan_host import PlanHost

if TYPE_CHECKING:
    from enclave_launch.host.host import Host
    from enclave_launch.ros_rules.distro import Release

_current: ContextVar[Host | None] = ContextVar("enclave_launch_host", default=None)


def current_host() -> Host:
    """Return the host of the evaluation in progress; without one a new dry-run host (library use of the classes)."""
    host = _current.get()
    if host is None:
        host = PlanHost()
        _current.set(host)
    return host


def current_release() -> Release:
    """Return the release that parsing and construction follow; execution asks ``context.host.release``."""
    return current_host().release


@contextmanager
def active_host(host: Host) -> Iterator[Host]:
    """Make ``host`` the current one within the block; nests."""
    token = _current.set(host)
    try:
        yield host
    finally:
        _current.reset(token)
