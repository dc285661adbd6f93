"""The access-control rules of one enclave, as the router sees its sessions. Performs no I/O.

Each message stands here because something planned fails without it. The table is measured, one message removed at a
time (``tests/addons/zenoh``). All rules allow, since denials do not hold.
``ingress`` arrives at the router, ``egress`` leaves it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any, NamedTuple

from enclave_addons.zenoh import key_expressions
from enclave_addons.zenoh.grants import Grants, Use
from enclave_addons.zenoh.key_expressions import cache, data_keys, domain_chunks, endpoint_tokens, history
from keystore.formats.domains import Domains

GRAPH_KINDS = {"MP": Use.PUBLISH, "MS": Use.SUBSCRIBE, "SC": Use.CALL, "SS": Use.SERVE}
"""Content of an endpoint's token (liveliness_utils.cpp)."""


class AccessRule(NamedTuple):
    """A rule of the router. ``name`` is unique within its enclave; ``flow`` is ``ingress`` or ``egress``."""

    name: str
    flow: str
    messages: tuple[str, ...]
    keys: tuple[str, ...]

    def block(self, subject: str) -> dict[str, Any]:
        """Return the entry of ``access_control.rules``."""
        return {
            "id": f"{subject} {self.name}",
            "permission": "allow",
            "flows": [self.flow],
            "messages": list(self.messages),
            "key_exprs": list(self.keys),
        }


class _Row(NamedTuple):
    name: str
    use: Use
    flow: str
    messages: tuple[str, ...]
    below: Callable[[str], str] = str


TABLE = (
    # ``reply``: the history of a transient local publisher comes back on the key of its messages. Its heartbeats, by
    # which a subscription finds out that it missed the last message, are sent only to a subscriber of them.
    _Row("publish", Use.PUBLISH, "ingress", ("put", "reply")),
    _Row("learn of subscriptions", Use.PUBLISH, "egress", ("declare_subscriber",)),
    _Row("offer history", Use.PUBLISH, "ingress", ("put", "declare_queryable", "liveliness_token"), cache),
    _Row("be asked for history", Use.PUBLISH, "egress", ("query", "declare_subscriber"), history),
    _Row("subscribe", Use.SUBSCRIBE, "ingress", ("declare_subscriber",)),
    _Row("receive", Use.SUBSCRIBE, "egress", ("put", "reply")),
    _Row(
        "ask for history", Use.SUBSCRIBE, "ingress",
        ("query", "declare_subscriber", "declare_liveliness_subscriber"), history,
    ),
    _Row("learn of history", Use.SUBSCRIBE, "egress", ("put", "liveliness_token"), cache),
    _Row("call", Use.CALL, "ingress", ("query",)),
    # rmw_zenoh_cpp declares a querier for each client (since 0.2.6 on jazzy): it sends nothing to a service that its
    # session does not know yet.
    _Row("be answered", Use.CALL, "egress", ("reply", "declare_queryable")),
    _Row("serve", Use.SERVE, "ingress", ("declare_queryable", "reply")),
    _Row("be called", Use.SERVE, "egress", ("query",)),
)  # fmt: skip


def access_rules(enclave: str, grants: Grants, domains: Domains) -> tuple[AccessRule, ...]:
    """Return what the sessions with the certificate of ``enclave`` may send and get; none without a grant."""
    if not any(grants.names.values()):
        return ()
    chunks = domain_chunks(domains)
    keys = {
        use: tuple(
            key for name in grants.of(use) for key in data_keys(chunks, name, grants.types_of(use, name))
        )
        for use in Use
    }
    rows = ((row, tuple(map(row.below, keys[row.use]))) for row in TABLE)
    found = [AccessRule(row.name, row.flow, row.messages, below) for row, below in rows if below]
    return (*found, *_graph(enclave, grants, chunks))


def _graph(enclave: str, grants: Grants, chunks: tuple[str, ...]) -> Iterator[AccessRule]:
    """Return tokens of what its nodes are and may do, in the name of the enclave, and the graph of its domains.

    rmw_zenoh requests the graph as a whole (``ros_discovery_info`` is granted to everyone on DDS, too).
    """
    own = (*key_expressions.node_tokens(chunks, enclave), *_endpoints(enclave, grants, chunks))
    everything = tuple(key_expressions.graph(chunks))
    yield AccessRule("be seen", "ingress", ("liveliness_token",), own)
    looking = ("liveliness_query", "declare_liveliness_subscriber")
    yield AccessRule("look at the graph", "ingress", looking, everything)
    yield AccessRule("see the graph", "egress", ("liveliness_token",), everything)


def _endpoints(enclave: str, grants: Grants, chunks: Iterable[str]) -> Iterator[str]:
    for kind, use in GRAPH_KINDS.items():
        for name in grants.of(use):
            yield from endpoint_tokens(chunks, kind, enclave, name, grants.types_of(use, name))
