"""Zenoh, an add-on: everything that the rest of the package calls of it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import AbstractContextManager
from importlib import import_module
from typing import TYPE_CHECKING, NamedTuple, Protocol

from enclave_launch.admission.middleware import zenoh_absence

if TYPE_CHECKING:
    from enclave_launch.plan import LaunchPlan
    from keystore.steps.options import ProvisionOptions

_ROOM = "enclave_addons.zenoh"


class LaunchRouter(Protocol):
    """The router of a launch, as configured in its keystore."""

    @property
    def gaps(self) -> tuple[str, ...]:
        """Report what it cannot grant, and which enclaves are shut out."""

    def differences(self, enclave: str) -> tuple[str, ...]:
        """Return why the session file of ``enclave`` is not what was written; empty if it is."""

    def serve(
        self, environment: Mapping[str, str], say: Callable[[str], None]
    ) -> AbstractContextManager[object]:
        """Return a context within which a router with the present rules answers; raises RuntimeFailure."""

    def wait(self) -> None:
        """Wait until the router that serves has the present rules. Raises ``RuntimeFailure``."""


class ZenohPlanning(NamedTuple):
    """The part of the Zenoh add-on in planning. ``report`` returns the plan with what to know of its processes on
    Zenoh; ``explain`` yields what a subject of ``--explain`` means there. Neither performs I/O."""

    report: Callable[[LaunchPlan, Mapping[str, str]], LaunchPlan]
    explain: Callable[[LaunchPlan, str], Iterator[str]]


class ZenohStart(NamedTuple):
    """The part of the Zenoh add-on in the start of a launch. ``check`` raises ``RuntimeFailure``, before keys are
    made, if no router can be started and none answers.

    ``types`` returns the types of what each enclave communicates (``ProvisionOptions.types``); ``configure`` writes the
    files of the enclaves and of their router, and raises ``KeystoreError``.
    """

    check: Callable[[LaunchPlan, str], None]
    types: Callable[[LaunchPlan, Collection[str]], Mapping[str, tuple[tuple[str, tuple[str, ...]], ...]]]
    configure: Callable[[LaunchPlan, str, Collection[str], ProvisionOptions], LaunchRouter]


def zenoh_planning() -> ZenohPlanning | None:
    """Import what the add-on knows of plans; None if it is not installed."""
    if zenoh_absence():
        return None
    found: ZenohPlanning = import_module(f"{_ROOM}.planning").ADD_ON
    return found


def zenoh_start() -> ZenohStart:
    """Import what the add-on does when a launch starts; only called for a plan that it reported on."""
    found: ZenohStart = import_module(f"{_ROOM}.start").ADD_ON
    return found
