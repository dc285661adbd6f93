"""A host without the CA keys: what would have to be signed is reported, by enclave, before anything is tried."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from keystore.disk import layout, safe_files
from keystore.disk.view import KeystoreView
from keystore.errors import KeystoreError, SigningUnavailableError, printable
from keystore.formats.permissions_document import grant_for, taken_away
from keystore.formats.role import Role
from keystore.formats.subject import subject_name
from keystore.signing import smime
from keystore.steps.enclave_state import OTHER_PERMISSIONS, EnclaveState, Reissue

if TYPE_CHECKING:
    from keystore.steps.comparison import WantedEnclave

_SHOWN = 10


def refuse_without_keys(
    view: KeystoreView, states: list[EnclaveState], wanted: Mapping[str, WantedEnclave]
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


def _reasons(view: KeystoreView, state: EnclaveState, wanted: WantedEnclave) -> Iterator[str]:
    for reason in state.reasons:
        yield reason
        if reason == OTHER_PERMISSIONS:
            yield from _permission_differences(view, state, wanted)


def _permission_differences(view: KeystoreView, state: EnclaveState, wanted: WantedEnclave) -> Iterator[str]:
    beyond, missing = beyond_and_missing(view, state, wanted)
    for words, found in (("lacks", missing), ("has beyond it", beyond)):
        if found:
            yield f"{words} {', '.join(found[:4])}{' ...' if len(found) > 4 else ''}"


def beyond_and_missing(
    view: KeystoreView, state: EnclaveState, wanted: WantedEnclave
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return what the signed permissions grant beyond what is wanted, and what they lack; nothing if unreadable."""
    if state.facts is None or state.facts.common_name is None:
        return (), ()
    subject, place = subject_name(state.facts.common_name), layout.PERMISSIONS
    try:
        signed = safe_files.read(view.root, f"{layout.enclave_directory(state.enclave)}/{layout.PERMISSIONS}")
        present = grant_for(smime.read(signed, place).document, subject, place)
        document = wanted.permissions(subject, state.facts.validity)
        requested = grant_for(document, subject, place) if document is not None else None
    except KeystoreError:
        return (), ()
    if present is None or requested is None:
        return (), ()
    return taken_away(present, requested), taken_away(requested, present)
