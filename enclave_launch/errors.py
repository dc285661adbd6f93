"""All errors that a user of enclave-launch can meet, cut by who must act.

    EnclaveLaunchError
    ├── UsageError              the person at the command line
    ├── LaunchFileError         the author of the launch file (carries file:line, element, include chain)
    ├── ManifestError           the author of the package: no NoDL, bad NoDL, conflicting NoDL
    ├── ProvisionError          the operator of the keystore
    └── RuntimeFailure          a process could not be started or ended badly

``str(error)`` is one message for a person: what, where, and what to do next. Errors of lxml, yaml,
cryptography and the operating system are translated where they enter.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager

from enclave_common.source_location import SourceLocation
from keystore.errors import KeystoreError


class EnclaveLaunchError(Exception):
    """Root of the tree. ``exit_status`` is what the command line returns."""

    exit_status = 1


class UsageError(EnclaveLaunchError):
    """A request that cannot be carried out as it is written."""

    exit_status = 2


class LaunchFileError(EnclaveLaunchError):
    """A launch file that cannot be used. ``cause`` is the exception that real launch would have raised, where it has
    one."""

    def __init__(
        self, message: str, location: SourceLocation | None = None, cause: BaseException | None = None
    ):
        self.message = message
        self.location = location
        self.cause = cause
        super().__init__(message)

    def __str__(self) -> str:
        if self.location is None:
            return self.message
        element = f" <{self.location.element}>" if self.location.element else ""
        steps = [place for place in self.location.includes if place != str(self.location)]
        chain = "".join(f"\n  included from {place}" for place in reversed(steps))
        return f"{self.location}:{element} {self.message}{chain}"


class ManifestError(EnclaveLaunchError):
    """The interfaces of a node are not known, or its NoDL document cannot be used."""


class ProvisionError(EnclaveLaunchError):
    """The keystore cannot be made what the plan wants."""


class RuntimeFailure(EnclaveLaunchError):
    """A process, or what a launch needs to run, could not be started or ended badly."""


@contextmanager
def translated(caught: type[Exception], raised: type[EnclaveLaunchError], before: str = "") -> Iterator[None]:
    """Raise ``raised`` in the place of ``caught``: in its own words, those of the operating system without the rest."""
    try:
        yield
    except caught as error:
        words = error.strerror if isinstance(error, OSError) else error
        raise raised(f"{before}{words}") from error


def keystore_errors() -> AbstractContextManager[None]:
    """Translate each ``KeystoreError`` to a ``ProvisionError``."""
    return translated(KeystoreError, ProvisionError)
