"""Zenoh, an add-on: everything that the rest of the keystore calls of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import datetime
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from enclave_common.dependencies import absence
from keystore.disk import layout
from keystore.disk.view import KeystoreView
from keystore.errors import KeystoreError, NotInstalledError

if TYPE_CHECKING:
    from keystore.steps.options import ProvisionOptions
    from keystore.verification.finding import Finding

_ROOM = "enclave_addons.zenoh"


class ZenohFiles(NamedTuple):
    """The functions of the add-on.

    ``follow`` writes the files again after a change and returns what to report; ``check`` is its part of ``verify``;
    ``sign`` answers a request in the signing process. All but ``sign`` need a keystore with a router's file.
    """

    follow: Callable[[Path, ProvisionOptions], list[str]]
    check: Callable[[KeystoreView, datetime], Iterator[Finding]]
    sign: Callable[[Path, ProvisionOptions, Any], Any]


def zenoh_files() -> ZenohFiles:
    """Import the add-on. Raises NotInstalledError."""
    if missing := absence(_ROOM):
        raise NotInstalledError(missing)
    found: ZenohFiles = import_module(f"{_ROOM}.add_on").ADD_ON
    return found


def follow(root: Path, options: ProvisionOptions) -> list[str]:
    """Bring the router's files up to date after a change of the keystore; return what to report of it."""
    if not KeystoreView(root).has_zenoh_router:
        return []
    try:
        return zenoh_files().follow(root, options)
    except KeystoreError as error:
        return [
            f"{layout.ZENOH_ROUTER} is not up to date ({error}); the Zenoh router enforces what it was before"
        ]
