"""What only events start: found in a dry run, marked, in the state it would find."""

from __future__ import annotations

from typing import Any

import pytest

from enclave_launch.evaluation.evaluate import EvaluationError


def test_newer_releases_keep_the_state_of_the_timers_position(launch_xml: Any, started: Any) -> None:
    found = launch_xml(
        '<let name="g" value="there"/><timer period="1"><executable cmd="late $(var g)"/></timer>'
        '<let name="g" value="end"/>',
        distro="kilted",
    )
    assert started(found) == [("late there", "timer 1")]


def test_what_a_started_process_triggers_is_certain_and_comes_first(launch_py: Any, started: Any) -> None:
    found = launch_py("""
        p = EP(cmd=["talker"])
        entities = [
            p,
            RegisterEventHandler(OnProcessExit(target_action=p, on_exit=[EP(cmd=["after"])])),
            RegisterEventHandler(OnProcessStart(target_action=p, on_start=[EP(cmd=["with"])])),
        ]
    """)
    assert started(found) == [
        ("talker", None),
        ("with", "OnProcessStart talker-1"),
        ("after", "OnProcessExit talker-1"),
    ]


def test_chains_of_exits_are_followed(launch_py: Any, started: Any) -> None:
    found = launch_py("""
        a, b, c = EP(cmd=["a"]), EP(cmd=["b"]), EP(cmd=["c"])
        entities = [
            RegisterEventHandler(OnProcessExit(target_action=a, on_exit=[b])),
            RegisterEventHandler(OnProcessExit(target_action=b, on_exit=[TimerAction(period=2.0, actions=[c])])),
            a,
        ]
    """)
    assert started(found) == [
        ("a", None),
        ("b", "OnProcessExit a-1"),
        ("c", "OnProcessExit b-2, then timer 2"),
    ]


ENDLESS = {
    "a timer that starts itself anew": """
        def again(context):
            return [EP(cmd=["x"]), TimerAction(period=1.0, actions=[OpaqueFunction(function=again)])]
        entities = [OpaqueFunction(function=again)]
    """,
    "a process started anew at each exit": """
        def again(context):
            p = EP(cmd=["x"])
            return [p, RegisterEventHandler(OnProcessExit(target_action=p, on_exit=[OpaqueFunction(function=again)]))]
        entities = [OpaqueFunction(function=again)]
    """,
    "an event that emits itself": """
        class Tick(Event):
            pass
        handler = EventHandler(matcher=lambda event: isinstance(event, Tick), entities=[EmitEvent(event=Tick())])
        entities = [RegisterEventHandler(handler), EmitEvent(event=Tick()), EP(cmd=["x"])]
    """,
}


@pytest.mark.parametrize("case", ENDLESS)
def test_events_without_end_are_followed_for_a_while_and_then_left_open(case: str, launch_py: Any) -> None:
    found = launch_py(ENDLESS[case])
    assert {process.cmd for process in found.processes} == {("x",)} and len(found.processes) < 110
    assert [each.what for each in found.unforeseeable] == [
        "what comes after 100 events that each led to the next"
    ]


def test_a_long_chain_with_an_end_is_followed_to_it(launch_py: Any, started: Any) -> None:
    found = launch_py("""
        actions = [EP(cmd=["last"])]
        for number in range(60):
            actions = [TimerAction(period=1.0, actions=actions)]
        entities = actions
    """)
    assert [cmd for cmd, _ in started(found)] == ["last"] and not found.unforeseeable


def test_one_supposition_does_not_colour_the_next(launch_py: Any, started: Any) -> None:
    found = launch_py("""
        a, b = EP(cmd=["a"]), EP(cmd=["b"])
        entities = [
            a, b, SetLaunchConfiguration("x", "visit"),
            RegisterEventHandler(OnProcessExit(target_action=a, on_exit=[
                SetLaunchConfiguration("x", "changed"), SetEnvironmentVariable("E", "1"),
                EP(cmd=["after_a", LC("x")])])),
            RegisterEventHandler(OnProcessExit(target_action=b, on_exit=[EP(cmd=["after_b", LC("x")])])),
        ]
    """)
    assert started(found)[2:] == [
        ("after_a changed", "OnProcessExit a-1"),
        ("after_b visit", "OnProcessExit b-2"),
    ]
    assert [dict(process.environment) for process in found.processes[2:]] == [{"E": "1"}, {}]


def test_on_exit_of_a_process_and_shutdown_handlers_behind_it(launch_py: Any, started: Any) -> None:
    found = launch_py("""
        entities = [
            EP(cmd=["a"], on_exit=[Shutdown()]),
            EP(cmd=["b"], on_exit=[Shutdown()]),
            RegisterEventHandler(OnShutdown(on_shutdown=[EP(cmd=["last"])])),
        ]
    """)
    assert started(found) == [("a", None), ("b", None), ("last", "OnProcessExit a-1, then OnShutdown")]


def test_an_explicit_shutdown_cancels_timers_and_what_would_come_later(launch_py: Any, started: Any) -> None:
    found = launch_py("""
        a = EP(cmd=["a"])
        entities = [
            a, TimerAction(period=1.0, actions=[EP(cmd=["timer"])]), Shutdown(), EP(cmd=["b"]),
            RegisterEventHandler(OnProcessExit(target_action=a, on_exit=[EP(cmd=["exit"])])),
            RegisterEventHandler(OnShutdown(on_shutdown=[EP(cmd=["bye"])])),
        ]
    """)
    assert started(found) == [("a", None), ("b", None), ("bye", "OnShutdown")]


def test_exits_before_a_shutdown_by_timer_are_supposed(launch_py: Any, started: Any) -> None:
    found = launch_py("""
        a = EP(cmd=["a"])
        entities = [
            a, RegisterEventHandler(OnProcessExit(target_action=a, on_exit=[EP(cmd=["exit"])])),
            TimerAction(period=9.0, actions=[Shutdown()]), TimerAction(period=10.0, actions=[EP(cmd=["never"])]),
        ]
    """)
    assert started(found) == [("a", None), ("exit", "OnProcessExit a-1")]


@pytest.mark.parametrize(
    "handler",
    [
        "OnProcessExit(target_action=p, on_exit=lambda event, context: [EP(cmd=['x'])])",
        "OnProcessStart(target_action=p, on_start=lambda event, context: [EP(cmd=['x'])])",
        "OnProcessIO(target_action=p, on_stdout=lambda event: [EP(cmd=['x'])])",
    ],
)
def test_what_a_callback_computes_is_not_foreseeable(launch_py: Any, started: Any, handler: str) -> None:
    found = launch_py(f"p = EP(cmd=['p'])\nentities = [p, RegisterEventHandler({handler})]\n")
    assert started(found) == [("p", None)]
    (unforeseen,) = found.unforeseeable
    assert "p-1" in unforeseen.what
    assert unforeseen.location.file.endswith("main.launch.py")


def test_a_handler_that_would_fail_is_a_warning_not_the_end(launch_py: Any, started: Any) -> None:
    found = launch_py("""
        p = EP(cmd=["p"])
        entities = [p, RegisterEventHandler(OnProcessExit(target_action=p, on_exit=[EP(cmd=[LC("unset")])]))]
    """)
    assert started(found) == [("p", None)]
    assert "launch configuration 'unset' does not exist" in found.unforeseeable[0].what
    assert not found.warnings  # the plan tells what cannot be foreseen, once


def test_a_missing_package_in_a_handler_ends_it_before_anything_starts(launch_py: Any) -> None:
    with pytest.raises(EvaluationError, match="no_such_package"):
        launch_py("""
            from launch_ros.actions import Node
            p = EP(cmd=["p"])
            late = Node(package="no_such_package", executable="e")
            entities = [p, RegisterEventHandler(OnProcessExit(target_action=p, on_exit=[late]))]
        """)


def test_a_plain_handler_of_process_events_is_supposed(launch_py: Any, started: Any) -> None:
    found = launch_py("""
        from launch.events.process import ProcessExited
        entities = [EP(cmd=["p"]), RegisterEventHandler(EventHandler(
            matcher=lambda event: isinstance(event, ProcessExited), entities=[EP(cmd=["then"])]))]
    """)
    assert started(found)[1:] == [("then", "launch.events.process.ProcessExited p-1")]


def test_a_handler_that_nothing_reaches_is_reported(launch_py: Any) -> None:
    found = launch_py("""
        from launch.event_handlers import event_named
        entities = [RegisterEventHandler(EventHandler(matcher=event_named("from.outside"), entities=[EP(cmd=["x"])]))]
    """)
    assert [item.what for item in found.unforeseeable] == [
        "entities of EventHandler, whose event is not known"
    ]
