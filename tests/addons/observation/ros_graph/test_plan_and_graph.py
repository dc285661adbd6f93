"""What was planned is what real rclpy nodes have: every endpoint, names and types, both ways.

"Seen and not planned" must be empty: each such endpoint would be refused under --secure. "Planned and not seen" is what
is granted without need; the table of what every node has allows for both client libraries.
"""

from __future__ import annotations

import pytest

from tests.addons.observation.ros_graph.conftest import LISTS, Compare, Names

CASES = {
    "a talker with a parameter in a name": '<node pkg="graph_nodes" exec="talker"/>',
    "the parameter set, a remap, a namespace and a new node name": """
        <push_ros_namespace namespace="r1"/>
        <node pkg="graph_nodes" exec="talker" name="speaker">
          <param name="prefix" value="fleet"/>
          <remap from="chatter" to="/conversation"/>
          <remap from="~/state" to="state_of_it"/>
        </node>""",
    "simulated time": '<node pkg="graph_nodes" exec="talker"><param name="use_sim_time" value="true"/></node>',
    "services, actions, logger services": """
        <node pkg="graph_nodes" exec="server" namespace="s"><remap from="start" to="begin"/></node>
        <node pkg="graph_nodes" exec="client" namespace="s"><remap from="start" to="begin"/></node>""",
    "a remap rule that meets an action, which jazzy does not move": """
        <node pkg="graph_nodes" exec="server"><remap from="count" to="moved"/></node>""",
    "two nodes of one process, one of them in a namespace of its own": """
        <node pkg="graph_nodes" exec="pair"><remap from="chatter" to="news"/></node>""",
    "a lifecycle node that nobody configured": """
        <node pkg="graph_nodes" exec="motor" name="m" namespace="arm"/>""",
}


@pytest.mark.parametrize("elements", CASES.values(), ids=CASES.keys())
def test_every_endpoint_of_the_graph_was_planned(compare: Compare, elements: str) -> None:
    compared = compare(elements)
    assert compared.seen.keys() == compared.planned.keys(), compared.shown
    assert _beyond(compared.seen, compared.planned) == []
    assert _other_types(compared.seen, compared.planned) == []
    assert {name for _, _, name in _beyond(compared.planned, compared.seen)} <= ALLOWED_BESIDE


# Granted and not made by rclpy: rclcpp subscribes /parameter_events (a time source), and a lifecycle node's own
# publisher exists once it is configured.
ALLOWED_BESIDE = {"/parameter_events", "/arm/speed"}


def test_the_neighbour_that_is_not_planned_is_told(compare: Compare) -> None:
    """The comparison can fail: a plan under another name has nothing in common with the graph."""
    compared = compare('<node pkg="graph_nodes" exec="talker"><remap from="chatter" to="news"/></node>')
    assert ("/talker", "publish", "/news") not in _beyond(compared.seen, compared.planned)
    del compared.planned["/talker"]["publish"]["/news"]
    assert _beyond(compared.seen, compared.planned) == [("/talker", "publish", "/news")]


def _beyond(these: Names, those: Names) -> list[tuple[str, str, str]]:
    return [
        (node, name, endpoint)
        for node, lists in these.items()
        for name in LISTS
        for endpoint in sorted(lists[name].keys() - those.get(node, {}).get(name, {}).keys())
    ]


def _other_types(seen: Names, planned: Names) -> list[tuple[str, str, str]]:
    """Where the plan knows a type, the graph has the same."""
    return [
        (endpoint, planned_type, seen[node][name][endpoint])
        for node, lists in planned.items()
        for name in LISTS
        for endpoint, planned_type in lists[name].items()
        if planned_type and endpoint in seen.get(node, {}).get(name, {})
        if planned_type != seen[node][name][endpoint]
    ]
