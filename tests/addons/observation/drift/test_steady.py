"""When a finding is told: facts at once, the rest when it stands, each once."""

from __future__ import annotations

from enclave_addons.observation.drift.finding import DriftFinding, Kind, finding
from enclave_addons.observation.drift_watch import Change, SettlingTimes, Steady

FACT = finding(Kind.UNPLANNED_NODE, "/x", "there")
SETTLED = finding(Kind.UNPLANNED_PROCESS, "p", "there")
LEASE = finding(Kind.REPEATED_NODE, "/x", "twice")
ABSENT = finding(Kind.MISSING_NODE, "/y", "not there")
PATIENCE = SettlingTimes(settle=5, absence=60, longest=200)


def test_a_fact_is_told_at_once_and_once() -> None:
    steady = Steady(PATIENCE)
    assert steady.at(0, [FACT]) == Change(new=(FACT,))
    assert not steady.at(1, [FACT])
    assert steady.at(2, []) == Change(over=(FACT,))
    assert not steady.at(3, [])
    assert steady.at(4, [FACT]).new == (FACT,)


def test_what_discovery_may_take_back_has_to_stand() -> None:
    for late, seconds in ((SETTLED, 5), (LEASE, 5), (ABSENT, 60)):
        steady = Steady(PATIENCE)
        assert not steady.at(0, [late])
        assert not steady.at(seconds - 1, [late])
        assert steady.at(seconds, [late]).new == (late,)


def test_what_comes_in_time_is_never_told() -> None:
    steady = Steady(PATIENCE)
    assert not steady.at(0, [ABSENT])
    assert not steady.at(59, [])
    assert not steady.at(100, [ABSENT]), "its time begins anew"
    assert steady.at(160, [ABSENT]).new == (ABSENT,)


def missing(number: int) -> DriftFinding:
    return finding(Kind.MISSING_NODE, f"/n{number}", "not there")


def test_while_what_is_missing_comes_one_after_another_the_rest_is_waited_for() -> None:
    steady = Steady(PATIENCE)
    for number in range(4):  # one comes every 50 s
        assert not steady.at(50 * number, [missing(n) for n in range(number, 5)])
    assert not steady.at(190, [missing(4)]), "the last but one came just now"
    assert not steady.at(199, [missing(4)])
    assert steady.at(200, [missing(4)]).new == (missing(4),), "the longest that anything is waited for"


def test_when_nothing_comes_any_more_the_time_runs_from_what_came_last() -> None:
    steady = Steady(PATIENCE)
    assert not steady.at(0, [missing(1), missing(2)])
    assert not steady.at(40, [missing(2)])
    assert not steady.at(99, [missing(2)])
    assert steady.at(100, [missing(2)]).new == (missing(2),)


def test_what_comes_and_goes_of_another_kind_delays_nothing() -> None:
    steady = Steady(PATIENCE)
    for second in range(0, 60, 2):
        assert steady.at(second, [ABSENT, FACT]).new in ((FACT,), ())
        assert not steady.at(second + 1, [ABSENT]).new
    assert steady.at(60, [ABSENT]).new == (ABSENT,)
