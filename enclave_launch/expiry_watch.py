"""Warn in time, while a launch runs, that what its processes use is about to expire.

Cyclone DDS peers stop receiving at the second in which a writer's certificate or permissions end; Fast DDS 2.9 reads
the dates at start and handshake only. Neither says anything, so the supervisor does.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from datetime import datetime, timedelta
from typing import NamedTuple

from enclave_common.words import counted, some_of
from enclave_launch.options import Deadline
from enclave_launch.secured import ProvisionedLaunch
from keystore.errors import KeystoreError
from keystore.formats.validity import utc_now
from keystore.steps.expiry import Expiry, expires_soon

MARGINS = (timedelta(days=7), timedelta(days=1), timedelta(hours=1), timedelta(minutes=5), timedelta(0))
_LONGEST_SLEEP = timedelta(hours=1)
"""A clock that is set is noticed after that."""
_USED = 0.8  # of what is left; provisioning renews what has used two thirds of its life
_SHORTEST_RUN = timedelta(seconds=5)
_FOREVER = timedelta(days=36500)


class Notice(NamedTuple):
    """A warning, and when to give it."""

    at: datetime
    text: str


def notices(ends: Iterable[Expiry], keystore: str, after: datetime) -> list[Notice]:
    """Return the notices in order: one at each of ``MARGINS`` still ahead for what expires together."""
    together: dict[datetime, list[str]] = {}
    for one in ends:
        together.setdefault(one.not_after, []).append(one.subject)
    found = [
        Notice(end - margin, _text(subjects, end, margin, keystore))
        for end, subjects in together.items()
        for margin in MARGINS
        if end - margin > after
    ]
    return sorted(found)


def _text(subjects: list[str], end: datetime, margin: timedelta, keystore: str) -> str:
    what = some_of(subjects, 3)
    if not margin:
        return (
            f"{what} has expired: Cyclone DDS peers receive nothing more from these processes, and no process can "
            f"start with it; renew with: secure-keystore renew {keystore}, then restart the launch"
        )
    verb = "ends" if len(subjects) == 1 else "end"
    return (
        f"{what} {verb} in {_span(margin)}, at {end:%Y-%m-%d %H:%M:%S} UTC; renew with: secure-keystore renew "
        f"{keystore} --within {_span(margin + timedelta(days=1), short=True)}, and restart the launch before then"
    )


def _span(span: timedelta, *, short: bool = False) -> str:
    for name, unit in (("day", 86400), ("hour", 3600), ("minute", 60)):
        count, rest = divmod(int(span.total_seconds()), unit)
        if count and (not rest or short):
            return f"{count}{name[0]}" if short else counted(count, name)
    return f"{int(span.total_seconds())} s"


@contextmanager
def watched(
    launch: ProvisionedLaunch, say: Callable[[str], None], now: Callable[[], datetime] = utc_now
) -> Iterator[None]:
    """Call ``say`` with each notice when its time has come, while inside; it runs in a thread of its own."""
    over = threading.Event()
    watch = threading.Thread(target=_watch, args=(launch, say, now, over), name="expiry-watch", daemon=True)
    watch.start()
    try:
        yield
    finally:
        over.set()


def _watch(
    launch: ProvisionedLaunch, say: Callable[[str], None], now: Callable[[], datetime], over: threading.Event
) -> None:
    due = notices(_ends(launch), launch.settings.keystore, now())
    while due:
        left = min(due[0].at - now(), _LONGEST_SLEEP)
        if left > timedelta(0):
            if over.wait(left.total_seconds()):
                return
            continue
        say(due.pop(0).text)


def renewal_deadline(launch: ProvisionedLaunch, now: datetime) -> Deadline | None:
    """Return when to end ``launch`` so that it is provisioned again before anything of its enclaves expires."""
    return deadline_before(_ends(launch), now)


def deadline_before(ends: Iterable[Expiry], now: datetime) -> Deadline | None:
    """Return five minutes before the first end of an enclave's; if less than 25 are left, their last fifth.

    ``None`` if a new start would not help: nothing was renewed by the one before, or what expires is a CA.
    """
    of_enclaves = [one for one in ends if one.enclave is not None]
    if not of_enclaves:
        return None
    first = min(of_enclaves, key=lambda one: one.not_after)
    at = max(first.not_after - MARGINS[-2], now + (first.not_after - now) * _USED)
    if at < now + _SHORTEST_RUN:
        return None
    return Deadline(
        at, f"{first.subject} expires at {first.not_after:%Y-%m-%d %H:%M:%S} UTC: renewing, starting again"
    )


def _ends(launch: ProvisionedLaunch) -> list[Expiry]:
    keystore = launch.settings.keystore
    enclaves = [enclave.path for enclave in launch.plan.derived.policy.enclaves]
    try:
        return list(expires_soon(keystore, _FOREVER, enclaves=enclaves, known=launch.report.validities))
    except KeystoreError:
        return []  # whatever is wrong with it is reported where it is used
