"""Dates that Cyclone DDS, Fast DDS and X.509 all understand."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone

import pytest

from keystore import InvalidInputError, Validity
from keystore.formats.validity import LATEST, iso, parse_duration, parse_end, parse_time, utc_now
from tests.keystore.kit import DAY, NOW


def test_the_default_is_sros2s_day_of_back_dating() -> None:
    validity = Validity.starting(NOW, 90 * DAY)
    assert validity == Validity(NOW - DAY, NOW + 90 * DAY)


@pytest.mark.parametrize("lifetime", [timedelta(days=365 * 300), timedelta(days=365 * 9000)])
def test_nothing_ends_after_what_cyclone_can_count(lifetime: timedelta) -> None:
    assert Validity.starting(NOW, lifetime).not_after == LATEST


def test_a_leaf_is_cut_to_its_ca() -> None:
    ca = Validity.starting(NOW, 10 * DAY)
    assert Validity.starting(NOW, 90 * DAY).within(ca) == ca


def test_seconds_are_whole_and_zones_become_utc() -> None:
    late = datetime(2031, 1, 1, 2, 0, 0, 123456, tzinfo=timezone(timedelta(hours=2)))
    assert iso(Validity(late, late + DAY).not_before) == "2031-01-01T00:00:00Z"


SECOND = timedelta(seconds=1)


def test_the_bounds_themselves() -> None:
    assert Validity(NOW, NOW + SECOND).not_after == NOW + SECOND
    with pytest.raises(InvalidInputError, match="before it begins"):
        Validity(NOW, NOW)
    assert Validity.starting(NOW, until=NOW + SECOND).not_after == NOW + SECOND
    with pytest.raises(InvalidInputError, match="already have expired"):
        Validity.starting(NOW, until=NOW)
    assert Validity(NOW, datetime(2300, 1, 1, tzinfo=timezone.utc)).not_after == datetime(
        2262, 4, 10, 10, tzinfo=timezone.utc
    )


def test_fractions_of_a_second_are_cut() -> None:
    late = NOW.replace(microsecond=999_999)
    assert Validity(late, late + DAY) == Validity(NOW, NOW + DAY)
    assert utc_now().microsecond == 0


@pytest.mark.parametrize(
    ("now", "covered"),
    [(NOW - SECOND, False), (NOW, True), (NOW + DAY, True), (NOW + DAY + SECOND, False)],
)
def test_what_is_not_yet_valid_is_not_covered_nor_what_has_ended(now: datetime, covered: bool) -> None:
    assert Validity(NOW, NOW + DAY).covers(now) is covered


@pytest.mark.parametrize(
    ("text", "expected"),
    [("90d", 90 * DAY), ("10y", 3650 * DAY), ("2w", 14 * DAY), ("12h", DAY / 2), ("45m", DAY / 32)],
)
def test_durations(text: str, expected: timedelta) -> None:
    assert parse_duration(text) == expected


@pytest.mark.parametrize("text", ["", "90", "d", "-1d", "1.5d", "99999999d", "1d2h", "²d"])
def test_no_durations(text: str) -> None:
    with pytest.raises(InvalidInputError):
        parse_duration(text)


def test_iso_dates_are_utc_unless_they_say_otherwise() -> None:
    assert iso(parse_time("2030-12-31")) == "2030-12-31T00:00:00Z"
    assert iso(parse_time("2030-12-31T10:00:00+02:00")) == "2030-12-31T08:00:00Z"
    assert iso(parse_end("2035-01-01", NOW)) == "2035-01-01T00:00:00Z"
    assert parse_end("1d", NOW) == NOW + DAY
    with pytest.raises(InvalidInputError, match="ISO date"):
        parse_time("next year")
