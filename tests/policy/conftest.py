"""Builders of running nodes for the policy tests: an interface in one line of text per endpoint."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import pytest

from enclave_common.source_location import SourceLocation
from enclave_launch.policy import RunningNode
from enclave_launch.policy.running_node import Role
from nodl.name_template import NameTemplate
from nodl.node_interface import ClientLibrary, Endpoint, EndpointKind, NodeInterface
from nodl.remap import RemapRules, parse_rule

KINDS = {
    "pub": EndpointKind.PUBLISHER,
    "sub": EndpointKind.SUBSCRIPTION,
    "serve": EndpointKind.SERVICE_SERVER,
    "call": EndpointKind.SERVICE_CLIENT,
    "action": EndpointKind.ACTION_SERVER,
    "goal": EndpointKind.ACTION_CLIENT,
}

NodeMaker = Callable[..., RunningNode]


def make_node(
    *endpoints: str | Endpoint,
    name: str = "talker",
    namespace: str = "/",
    original: str = "talker",
    enclave: str = "/",
    remap: tuple[str, ...] = (),
    local: tuple[str, ...] = (),
    parameters: Mapping[str, Any] | None = None,
    role: Role = "node",
    library: ClientLibrary = ClientLibrary.RCLPY,
    **interface: Any,
) -> RunningNode:
    """``endpoints`` such as ``"pub chatter"``; the n-th is on line n of ``demo.nodl.xml``."""
    found = tuple(
        endpoint if isinstance(endpoint, Endpoint) else _endpoint(endpoint, line)
        for line, endpoint in enumerate(endpoints, start=1)
    )
    rules = RemapRules(
        local=tuple(parse_rule(text, "load.launch.xml:9") for text in local),
        process=tuple(parse_rule(text, "demo.launch.xml:7") for text in remap),
    )
    source = SourceLocation("demo.nodl.xml")
    node = NodeInterface("demo", original, None, original, None, found, source, library=library, **interface)
    location = SourceLocation("demo.launch.xml", 5, "node")
    return RunningNode(node, original, name, namespace, rules, parameters or {}, enclave, location, role)


def _endpoint(text: str, line: int) -> Endpoint:
    kind, _, name = text.partition(" ")
    return Endpoint(KINDS[kind], NameTemplate.literal(name), "x/msg/Y", SourceLocation("demo.nodl.xml", line))


@pytest.fixture
def node() -> NodeMaker:
    return make_node
