"""When a finding is told: facts at once, the rest when it stands, each once."""

from __future__ import annotations

from enclave_launch.drift.finding import Kind, finding
from enclave_launch.drift.steady import Change, SettlingTimes, Steady

FACT = finding(Kind.UNPLANNED_NODE, "/x", "there")
SETTLED = finding(Kind.UNPLANNED_PROCESS, "p", "there")
LEASE = finding(Kind.REPEATED_NODE, "/x", "twice")
ABSENT = finding(Kind.MISSING_NODE, "/y", "not there")
PATIENCE = SettlingTimes(settle=5, absence=60)


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
        assert steady.standing == (late,)


def test_what_comes_in_time_is_never_told() -> None:
    steady = Steady(PATIENCE)
    assert not steady.at(0, [ABSENT])
    assert not steady.at(59, [])
    assert not steady.at(100, [ABSENT]), "its time begins anew"
    assert steady.at(160, [ABSENT]).new == (ABSENT,)
