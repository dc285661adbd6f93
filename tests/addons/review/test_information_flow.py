"""Who can influence whom: every kind of way, each beside the one that does not exist; and a solver that is not ours."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from enclave_addons.review.document import plan_from_document
from enclave_addons.review.information_flow import (
    flow_graph,
    opened_by_sharing,
    reached_from,
    shortest_paths,
)
from enclave_launch import DryRun
from tests.addons.review.conftest import ROBOT, Asked, document, plan, process


@pytest.mark.parametrize(
    ("one", "two", "there", "back"),
    [
        ({"publish": ["/x"]}, {"subscribe": ["/x"]}, True, False),
        ({"publish": ["/x"]}, {"subscribe": ["/y"]}, False, False),
        ({"publish": ["/x"]}, {"publish": ["/x"]}, False, False),
        ({"call_services": ["/x"]}, {"serve_services": ["/x"]}, True, True),
        ({"call_services": ["/x"]}, {"serve_services": ["/y"]}, False, False),
        ({"call_actions": ["/x"]}, {"serve_actions": ["/x"]}, True, True),
        ({"call_actions": ["/x"]}, {"serve_services": ["/x"]}, False, False),
        ({"call_actions": ["/x"]}, {"serve_services": ["/x/_action/send_goal"]}, True, True),
        ({"subscribe": ["/x/_action/feedback"]}, {"serve_actions": ["/x"]}, False, True),
        ({"publish": ["/a/*"]}, {"subscribe": ["/a/b"]}, True, False),
        ({"publish": ["/a/*"]}, {"subscribe": ["/b/b"]}, False, False),
        ({"publish": ["/a/b"]}, {"subscribe": ["/a/?"]}, True, False),
        ({"publish": ["/a*"]}, {"subscribe": ["*b"]}, True, False),
    ],
)
def test_what_meets_flows(one: Asked, two: Asked, there: bool, back: bool) -> None:
    graph = flow_graph(plan({"/one": {"/n1": one}, "/two": {"/n2": two}}))
    assert ("/two" in graph["/one"], "/one" in graph["/two"]) == (there, back)


def test_what_every_node_has_connects_nobody_unless_asked_to() -> None:
    two = plan({"/one": {"/n1": {}}, "/two": {"/n2": {"subscribe": ["/rosout"]}}})
    assert flow_graph(two)["/one"] == {}
    assert "/two" in flow_graph(two, built_in=True)["/one"]


def test_the_camera_reaches_the_base_over_the_planner_and_the_logger_reaches_nobody() -> None:
    graph = flow_graph(plan(ROBOT))
    (path,) = shortest_paths(graph, "/camera", "/base")
    assert [(step.source, step.target, list(map(str, step.hops))) for step in path] == [
        ("/camera", "/planner", ["topic /image"]),
        ("/planner", "/base", ["action /drive"]),
    ]
    assert reached_from(graph, "/camera") == {"/planner", "/base", "/logger"}
    assert reached_from(graph, "/logger") == frozenset()
    assert shortest_paths(graph, "/logger", "/base") == []


def test_all_shortest_ways_are_told() -> None:
    graph = flow_graph(
        plan(
            {
                "/a": {"/a": {"publish": ["/x", "/y"]}},
                "/b": {"/b": {"subscribe": ["/x"], "publish": ["/z"]}},
                "/c": {"/c": {"subscribe": ["/y"], "publish": ["/z"]}},
                "/d": {"/d": {"subscribe": ["/z"]}},
            }
        )
    )
    assert [[step.target for step in path] for path in shortest_paths(graph, "/a", "/d")] == [
        ["/b", "/d"],
        ["/c", "/d"],
    ]


def test_a_shared_enclave_opens_flows_that_its_nodes_alone_do_not_have() -> None:
    shared = plan({"/box": {"/reader": {"subscribe": ["/image"]}, "/driver": {"publish": ["/cmd_vel"]}}})
    assert opened_by_sharing(shared) == [("/box", "/driver", "/reader"), ("/box", "/reader", "/driver")]
    apart = plan({"/a": {"/reader": {"subscribe": ["/image"]}}, "/b": {"/driver": {"publish": ["/cmd_vel"]}}})
    assert opened_by_sharing(apart) == []


def test_nodes_of_a_shared_enclave_that_talk_anyway_open_nothing_in_that_direction() -> None:
    box = plan({"/box": {"/one": {"publish": ["/x"]}, "/two": {"subscribe": ["/x"]}}})
    assert opened_by_sharing(box) == [("/box", "/two", "/one")]


def test_nodes_of_one_process_open_nothing_for_each_other() -> None:
    """``/tf_listener`` is a helper in the process that the launch file starts as ``/one``."""
    box = document({"/box": {"/one": {"publish": ["/x"]}, "/tf_listener": {"subscribe": ["/tf"]}}})
    assert opened_by_sharing(plan_from_document(DryRun(**box))) != []
    box["processes"] = [process(fqn="/one")]
    assert opened_by_sharing(plan_from_document(DryRun(**box))) == []
    box["nodes"][1]["program"] = "p/another"
    assert opened_by_sharing(plan_from_document(DryRun(**box))) != []


names = st.sampled_from(["/a", "/b", "/c", "/d", "/a/*", "*"])
asked = st.fixed_dictionaries(
    {},
    optional={
        operation: st.lists(names, max_size=2, unique=True)
        for operation in ("publish", "subscribe", "call_services", "serve_services")
    },
)


@given(st.lists(asked, min_size=2, max_size=6))
def test_reachability_is_that_of_the_transitive_closure(nodes: list[Asked]) -> None:
    """Warshall's algorithm over pairs that fnmatch decides: another way to the same answer."""
    enclaves = {f"/e{number}": {f"/n{number}": own} for number, own in enumerate(nodes)}
    graph = flow_graph(plan(enclaves))
    paths = sorted(enclaves)
    reach = {(one, two): _direct(enclaves[one], enclaves[two]) for one in paths for two in paths}
    for middle, one, two in itertools.product(paths, repeat=3):
        reach[one, two] |= reach[one, middle] and reach[middle, two]
    for one, two in itertools.permutations(paths, 2):
        assert (two in reached_from(graph, one)) == reach[one, two]
        assert bool(shortest_paths(graph, one, two)) == reach[one, two]


def _direct(one: dict[str, Asked], two: dict[str, Asked]) -> bool:
    pairs = (
        ("publish", "subscribe"),
        ("call_services", "serve_services"),
        ("serve_services", "call_services"),
    )
    return any(
        _overlap(name, other)
        for here, there in pairs
        for own in one.values()
        for others in two.values()
        for name in own.get(here, ())
        for other in others.get(there, ())
    )


SAMPLES = ["/a", "/b", "/c", "/d", "/a/x"]


def _overlap(one: str, two: str) -> bool:
    from fnmatch import fnmatchcase

    return any(fnmatchcase(sample, one) and fnmatchcase(sample, two) for sample in SAMPLES)
