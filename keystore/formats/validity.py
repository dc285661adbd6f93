"""From when until when a certificate and its permissions hold: one value for both. Performs no I/O.

The DDS implementations disagree about the dates of permissions: Cyclone DDS reads UTC, Fast DDS the standard local time
of the process. Both read those of certificates as UTC. So a permissions document begins before its certificate and ends
after it, each by ``ZONES``, and the certificate decides in every time zone.
"""

from __future__ import annotations

import re
from datetime import datetime, timedelta, timezone
from typing import NamedTuple

from enclave_common.terminal import quoted
from keystore.errors import InvalidInputError

BACKDATE = timedelta(days=1)
"""As SROS2, for clocks behind ours and Connext 5.3.1; Fast DDS needs at least 14 h."""
DEFAULT_LIFETIME = timedelta(days=3650)
ZONES = timedelta(hours=14)
"""The largest distance of a time zone's standard time from UTC (Pacific/Kiritimati)."""
# Cyclone DDS counts nanoseconds in 64 bits (until 2262-04-11) and refuses later dates as expired.
LATEST = datetime(2262, 4, 11, tzinfo=timezone.utc) - ZONES

_UNITS = {"s": "seconds", "m": "minutes", "h": "hours", "d": "days", "w": "weeks"}
_DURATION = re.compile(r"([0-9]{1,6})([smhdwy])\Z")


class _Ends(NamedTuple):
    not_before: datetime
    not_after: datetime


class Validity(_Ends):
    """Both ends in UTC, whole seconds (X.509 has no fractions), ``not_after`` capped to 2262-04-10.

    Raises InvalidInputError when it would end before it begins.
    """

    __slots__ = ()

    def __new__(cls, not_before: datetime, not_after: datetime) -> Validity:
        begin, end = _whole("not_before", not_before), _whole("not_after", not_after)
        if end <= begin:
            raise InvalidInputError(f"a validity ends ({iso(end)}) before it begins ({iso(begin)})")
        return super().__new__(cls, begin, end)

    @classmethod
    def starting(
        cls,
        now: datetime,
        lifetime: timedelta = DEFAULT_LIFETIME,
        *,
        until: datetime | None = None,
    ) -> Validity:
        """Make a validity from ``now`` minus ``BACKDATE`` for ``lifetime``, or to the absolute date ``until``.

        Raises InvalidInputError if ``until`` is past.
        """
        end = until if until is not None else later(now, lifetime)
        if end <= now:
            raise InvalidInputError(f"the validity would already have expired ({iso(end)})")
        return cls(now - BACKDATE, end)

    def within(self, outer: Validity) -> Validity:
        """Cut to what the issuer itself can promise: no leaf outlives its CA."""
        return Validity(max(self.not_before, outer.not_before), min(self.not_after, outer.not_after))

    def covers(self, now: datetime) -> bool:
        return self.not_before <= now <= self.not_after


def _whole(name: str, time: datetime) -> datetime:
    if time.tzinfo is None:
        raise ValueError(f"{name} needs a time zone")
    return min(time.astimezone(timezone.utc).replace(microsecond=0), LATEST)


def later(now: datetime, span: timedelta) -> datetime:
    """Return ``now + span``, at most the last date that means anything here."""
    try:
        return min(now + span, LATEST)
    except OverflowError:
        return LATEST


def parse_duration(text: str) -> timedelta:
    """Parse ``90d``, ``12h``, ``10y`` (a year is 365 days), ``45m``, ``30s``, ``2w``; raises InvalidInputError."""
    match = _DURATION.match(text.strip())
    if not match:
        raise InvalidInputError(f"{quoted(text)} is not a duration; write for example 90d, 12h or 10y")
    count, unit = int(match[1]), match[2]
    return timedelta(days=365 * count) if unit == "y" else timedelta(**{_UNITS[unit]: count})


def parse_time(text: str) -> datetime:
    """Parse an ISO date or date-time, in UTC unless it says otherwise; raises InvalidInputError."""
    try:
        time = datetime.fromisoformat(text.strip().replace("Z", "+00:00"))
    except ValueError:
        raise InvalidInputError(f"{quoted(text)} is not an ISO date; write for example 2030-12-31") from None
    try:
        return time.astimezone(timezone.utc) if time.tzinfo else time.replace(tzinfo=timezone.utc)
    except OverflowError:
        raise InvalidInputError(f"{quoted(text)} is a date before the year 1 or after 9999") from None


def parse_end(text: str, now: datetime) -> datetime:
    """Parse ``--valid-for``: a duration from now or an ISO date."""
    if _DURATION.match(text.strip()):
        return later(now, parse_duration(text))
    try:
        return parse_time(text)
    except InvalidInputError as error:
        raise InvalidInputError(f"{error}, or a duration such as 90d") from None


def utc_now() -> datetime:
    """Return now in UTC, in whole seconds as certificates count."""
    return datetime.now(timezone.utc).replace(microsecond=0)


def why_not_valid(validity: Validity, now: datetime) -> str:
    """Return in words why ``now`` is outside of ``validity``."""
    if now < validity.not_before:
        return f"not valid before {iso(validity.not_before)}, and this clock says {iso(now)}"
    return f"expired at {iso(validity.not_after)}"


def iso(time: datetime) -> str:
    """Render ``2030-12-31T00:00:00Z``, for reports."""
    return time.astimezone(timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")
