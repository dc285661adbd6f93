"""The parts: environment stack, handler table, virtual clock, table of releases."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from enclave_launch.description.events.event import Event
from enclave_launch.description.events.handlers import EventHandler
from enclave_launch.description.events.queue import HandlerTable
from enclave_launch.description.visit import chain
from enclave_launch.host.environment import Environment, environment_untouched
from enclave_launch.host.plan_host import VirtualLoop
from enclave_launch.ros_rules.distro import Distro, Feature, Since, choose_release, release_of

NAMES = st.text("ABC", min_size=1, max_size=2).map(lambda name: f"ENCLAVE_LAUNCH_TEST_{name}")


@given(st.lists(st.tuples(NAMES, st.none() | st.text("xyz", max_size=3)), max_size=12))
def test_pop_restores_what_push_saw(changes: list[tuple[str, str | None]]) -> None:
    with environment_untouched():
        environment = Environment()
        before = dict(os.environ)
        environment.push()
        for name, value in changes:
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
        assert environment.snapshot() == dict(os.environ)
        environment.pop()
        assert dict(os.environ) == before


def test_snapshots_are_shared_only_while_nothing_changes(monkeypatch: pytest.MonkeyPatch) -> None:
    environment = Environment()
    first = environment.snapshot()
    assert environment.snapshot() is first
    monkeypatch.setenv("ENCLAVE_LAUNCH_TEST", "1")
    assert environment.snapshot()["ENCLAVE_LAUNCH_TEST"] == "1"
    assert environment.changes() == {"ENCLAVE_LAUNCH_TEST": "1"}


def handler() -> EventHandler:
    return EventHandler(matcher=lambda event: True)


def test_the_newest_handler_is_first_and_an_appended_one_last() -> None:
    table = HandlerTable()
    old, new, last = handler(), handler(), handler()
    table.register(old)
    table.register(last, append=True)
    table.register(new)
    assert list(table.matching(Event())) == [new, old, last]
    assert table.all() == [last, old, new]


def test_a_registration_is_taken_back_once() -> None:
    table, one = HandlerTable(), handler()
    table.register(one)
    table.register(one)
    table.unregister(one)
    assert table.all() == [one]
    table.unregister(one)
    with pytest.raises(ValueError, match="not in deque"):
        table.unregister(one)


def test_awaits_counts_handlers_of_any_event() -> None:
    table, one = HandlerTable(), handler()
    assert not table.awaits("launch.events.ExecutionComplete")
    table.register(one)
    saved = table.save()
    assert table.awaits("launch.events.ExecutionComplete")
    table.unregister(one)
    assert not table.awaits("launch.events.ExecutionComplete")
    table.restore(saved)
    assert table.awaits("launch.events.ExecutionComplete")


@pytest.mark.parametrize(
    ("outer", "inner", "whole"),
    [(None, "timer 2", "timer 2"), ("a", None, "a"), (None, None, None), ("a", "b", "a, then b")],
)
def test_marks_chain(outer: str | None, inner: str | None, whole: str | None) -> None:
    assert chain(outer, inner) == whole


@given(st.lists(st.floats(0, 10), max_size=20))
def test_the_virtual_clock_fires_by_due_time_then_creation(delays: list[float]) -> None:
    loop = VirtualLoop()
    fired: list[object] = []
    for number, delay in enumerate(delays):
        loop.call_later(delay, fired.append, number)
    while loop.fire_next():
        pass
    assert fired == sorted(range(len(delays)), key=lambda number: (delays[number], number))


def test_cancelled_timers_do_not_fire_and_a_saved_clock_comes_back() -> None:
    loop = VirtualLoop()
    fired: list[object] = []
    loop.call_later(1, fired.append, "cancelled").cancel()
    loop.call_later(2, fired.append, "kept")
    saved = loop.save()
    assert loop.fire_next()
    assert loop.time() == 2
    loop.restore(saved)
    assert (loop.time(), loop.fire_next(), fired) == (0, True, ["kept", "kept"])


def test_the_distribution_is_asked_for_else_the_environments_else_the_newest() -> None:
    assert choose_release("humble", "jazzy").distro is Distro.HUMBLE
    assert choose_release(None, "jazzy").distro is Distro.JAZZY
    assert choose_release(None, "iron").distro is choose_release(None, None).distro is Distro.LYRICAL
    with pytest.raises(ValueError, match="noetic"):
        choose_release("noetic", None)


def test_an_installed_launch_of_the_same_series_decides_the_version(tmp_path: Path) -> None:
    _install(tmp_path, launch="1.0.8", launch_ros="0.19.13")
    assert choose_release("humble", None).has(Feature.EQUALS_IF)
    installed = choose_release("humble", None, [str(tmp_path)])
    assert not installed.has(Feature.EQUALS_IF) and installed.has(Feature.WILDCARD_SECTIONS)
    assert str(installed) == "humble; installed: launch 1.0.8, launch_ros 0.19.13; assumed: rcl 5.3.13"
    assert choose_release("jazzy", None, [str(tmp_path)]) == release_of(Distro.JAZZY)


def test_an_installed_rolling_of_any_age_decides(tmp_path: Path) -> None:
    _install(tmp_path, launch="3.9.6", launch_ros="0.29.5", rcl="10.3.2")
    installed = choose_release("rolling", None, [str(tmp_path)])
    assert installed.has(Feature.TIMER_CAPTURES_ENVIRONMENT) and not installed.has(Feature.DECLARE_BOOLEAN)
    assert choose_release("kilted", None, [str(tmp_path)]) == release_of(Distro.KILTED)


def test_each_package_decides_for_its_own_features(tmp_path: Path) -> None:
    _install(tmp_path, rcl="9.2.7")
    jazzy = choose_release("jazzy", None, [str(tmp_path)])
    assert jazzy.installed == {"rcl"}
    assert not jazzy.has(Feature.WHOLE_ACTIONS) and jazzy.has(Feature.TIMER_COPIES_CONFIGURATIONS)


@pytest.mark.parametrize(
    ("name", "versions"),
    [
        ("jazzy", ("3.4.12", "0.26.13", "9.2.11")),
        ("jazzy@2025-03", ("3.4.3", "0.26.6", "9.2.4")),
        ("jazzy@2025-06-22", ("3.4.4", "0.26.7", "9.2.6")),
        ("jazzy@2025-06-23", ("3.4.5", "0.26.8", "9.2.7")),
        ("jazzy@2025", ("3.4.9", "0.26.10", "9.2.8")),
    ],
)
def test_a_date_names_the_patch_releases_of_that_time(
    name: str, versions: tuple[str, ...], tmp_path: Path
) -> None:
    _install(tmp_path, launch="3.4.4")
    prefixes = [str(tmp_path)] if "@" in name else []  # a date wins over what is installed
    assert tuple(choose_release(name, None, prefixes).versions.values()) == versions


@pytest.mark.parametrize("name", ["jazzy@", "jazzy@last", "jazzy@2024-01", "lyrical@2025"])
def test_a_date_that_says_nothing_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match=r"day, month or year|no version of launch"):
        choose_release(name, None)


def _install(prefix: Path, **versions: str) -> None:
    for package, version in versions.items():
        folder = prefix / "share" / package
        folder.mkdir(parents=True)
        (folder / "package.xml").write_text(f"<package><version>{version}</version></package>")


@pytest.mark.parametrize("feature", list(Feature))
def test_later_releases_of_a_series_lose_nothing(feature: Since) -> None:
    for distro in Distro:
        old, new = release_of(distro), release_of(distro, (99,), (99,))
        assert new.has(feature) or not old.has(feature)


def test_a_property_of_the_users_own_class_changes_nothing_as_upstream(launch_py: Any) -> None:
    found = launch_py("""
        class Mine(EP):
            @property
            def shell(self):
                return True
        entities = [Mine(cmd=["true"]), EP(cmd=["true"], shell=True)]
    """)
    assert [process.shell for process in found.processes] == [False, True]
