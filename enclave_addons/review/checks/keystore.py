"""A plan held against a keystore: what is missing there, granted beyond it or less, and what ends. Performs no I/O."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from typing import NamedTuple

from enclave_addons.review.checks.rules import finding
from enclave_addons.review.document import GrantedName, PlanDocument
from enclave_addons.review.signed import as_signed
from enclave_common.words import counted, some_of
from enclave_launch.dry_run import Diagnostic
from keystore.verification.finding import Finding

_NAMED = 4
_MISSING = "the {} has no permissions for enclave {}"


class Ending(NamedTuple):
    """Something of the keystore that ends: ``enclave`` is ``None`` for what all share. ``ends`` as ISO 8601,
    ``days_left`` negative when it has ended."""

    subject: str
    enclave: str | None
    ends: str
    days_left: int


def against_keystore(
    plan: PlanDocument, signed: Mapping[str, frozenset[GrantedName]], endings: Iterable[Ending]
) -> list[Diagnostic]:
    """Compare the plan with a keystore.

    :param endings: what expires soon in the whole keystore; enclaves of other plans are ignored"""
    found = [diagnostic for path in sorted(plan.enclaves) for diagnostic in _enclave(plan, path, signed)]
    return [*found, *_expiring(plan, endings)]


def against_router(
    plan: PlanDocument, served: Collection[str], findings: Iterable[Finding]
) -> list[Diagnostic]:
    """Compare the enclaves on Zenoh with the configuration of the keystore's router.

    :param served: the enclaves that the keystore has on Zenoh
    :param findings: of the files for Zenoh, which all enclaves on Zenoh share"""
    found = [
        finding("keystore-enclave-missing", enclave, _MISSING.format("keystore's Zenoh router", enclave))
        for enclave in sorted(plan.on_zenoh & plan.enclaves.keys())
        if enclave not in served
    ]
    for one in findings:
        text = f"{one.place}: {one.message}"
        found.append(finding("keystore-zenoh", one.place, text, fails=one.severity.fails, remedy=one.repair))
    return found


def _enclave(
    plan: PlanDocument, enclave: str, signed: Mapping[str, frozenset[GrantedName]]
) -> Iterator[Diagnostic]:
    if enclave not in signed:
        yield finding("keystore-enclave-missing", enclave, _MISSING.format("keystore", enclave))
        return
    wanted = as_signed(plan.enclaves[enclave])
    for code, grants, words in (
        ("keystore-grants-more", signed[enclave] - wanted, "beyond the plan the keystore lets"),
        ("keystore-grants-less", wanted - signed[enclave], "the keystore does not let"),
    ):
        if grants:
            text = f"{words} enclave {enclave} {some_of(sorted(grants), _NAMED)}"
            yield finding(code, enclave, text)


def _expiring(plan: PlanDocument, endings: Iterable[Ending]) -> Iterator[Diagnostic]:
    for one in endings:
        if one.enclave is None or one.enclave in plan.enclaves:
            over = one.days_left < 0
            when = (
                f"expired on {one.ends}"
                if over
                else f"expires on {one.ends}, in {counted(one.days_left, 'day')}"
            )
            yield finding("keystore-expires", one.enclave or one.subject, f"{one.subject} {when}", fails=over)
