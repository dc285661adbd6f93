"""A host without the CA keys: what would have to be signed is reported, by enclave, before anything is tried."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from keystore.disk.view import KeystoreView
from keystore.errors import SigningUnavailableError, printable
from keystore.formats.role import Role
from keystore.steps.enclave_state import (
    OTHER_PERMISSIONS,
    EnclaveState,
    PermissionsSource,
    Reissue,
    beyond_and_missing,
)

_SHOWN = 10


def refuse_without_keys(
    view: KeystoreView, states: list[EnclaveState], wanted: Mapping[str, PermissionsSource]
) -> None:
    """Raise SigningUnavailableError with every enclave that differs, and how, if the key it needs is not here."""
    lines = []
    for state in states:
        needs = {Role.IDENTITY: state.reissue is not Reissue.NOTHING, Role.PERMISSIONS: state.permissions}
        if any(needed and view.key_file(role) is None for role, needed in needs.items()):
            lines.append(f"{state.enclave}: {'; '.join(_reasons(view, state, wanted[state.enclave]))}")
    if not lines:
        return
    more = f"\n  and {len(lines) - _SHOWN} more" if len(lines) > _SHOWN else ""
    listed = "".join(f"\n  {line}" for line in lines[:_SHOWN]) + more
    raise SigningUnavailableError(
        f"{printable(view.root)} has no CA keys, so nothing can be signed here, but these enclaves differ from what "
        f"is needed:{listed}\nBring them up to date where the CA keys are (start or apply-policy there), "
        "then export again"
    )


def _reasons(view: KeystoreView, state: EnclaveState, wanted: PermissionsSource) -> Iterator[str]:
    for reason in state.reasons:
        yield reason
        if reason == OTHER_PERMISSIONS:
            yield from _permission_differences(view, state, wanted)


def _permission_differences(
    view: KeystoreView, state: EnclaveState, wanted: PermissionsSource
) -> Iterator[str]:
    beyond, missing = beyond_and_missing(view, state, wanted)
    for words, found in (("lacks", missing), ("has beyond it", beyond)):
        if found:
            yield f"{words} {', '.join(found[:4])}{' ...' if len(found) > 4 else ''}"
