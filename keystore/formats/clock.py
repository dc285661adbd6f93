"""Refuse a clock that cannot be right: a robot without a battery clock boots in 1970. Performs no I/O."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import datetime, timezone

from keystore.errors import WrongClockError
from keystore.formats.certificate import CertificateFacts
from keystore.formats.validity import iso

PROGRAM = datetime(2026, 1, 1, tzinfo=timezone.utc)
"""A clock before this date is wrong: this program did not exist."""
_REMEDY = "set the clock (timedatectl shows it) and try again; nothing was changed"


def refuse_clock_before_program(now: datetime, keystore: str) -> None:
    """Raise WrongClockError if ``now`` is before this program was made. ``keystore`` is where one would be created."""
    if now < PROGRAM:
        raise WrongClockError(
            f"the clock says {iso(now)}, which is before this program was made: {_REMEDY}; "
            f"if it is right: secure-keystore create {keystore} --accept-clock"
        )


def refuse_clock_before(now: datetime, authorities: Iterable[CertificateFacts]) -> None:
    """Raise WrongClockError if ``now`` is before one of these CAs begins.

    A certificate that is not yet valid has not expired: nothing of the keystore has to be replaced.
    """
    begins = max((facts.validity.not_before for facts in authorities), default=now)
    if now < begins:
        raise WrongClockError(
            f"the clock says {iso(now)}, and the CAs of this keystore begin at {iso(begins)}: {_REMEDY}"
        )
