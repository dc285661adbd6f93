"""What a message on a key is about, in ROS words: ``key_expressions`` and ``rules`` the other way round.

For whoever reads a router's rules or its log. A key is untrusted text: what is not shaped as ROS makes it has no
meaning, which is printed unchanged.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from keystore.formats.policy import Operation
from keystore.zenoh.grants import PLAIN_USES, Use
from keystore.zenoh.rules import GRAPH_KINDS

_TYPE = re.compile(r"([A-Za-z][A-Za-z0-9_]*)::(msg|srv|action)::dds_::([A-Za-z][A-Za-z0-9_]*)_\Z")
_DOMAIN = re.compile(r"(?:[0-9]{1,10}|\*{1,2})\Z")
_ACTION_SERVICE = re.compile(r"(/.+)/_action/(?:send_goal|get_result|cancel_goal)\Z")
_ACTION_TOPIC = re.compile(r"(/.+)/_action/(?:feedback|status)\Z")
_OPERATIONS = {use: operation for operation, use in PLAIN_USES.items()}
_USES = {
    ("ingress", "put"): Use.PUBLISH,
    ("ingress", "delete"): Use.PUBLISH,
    ("ingress", "declare_subscriber"): Use.SUBSCRIBE,
    ("ingress", "query"): Use.CALL,
    ("ingress", "declare_queryable"): Use.SERVE,
    ("egress", "put"): Use.SUBSCRIBE,
    ("egress", "delete"): Use.SUBSCRIBE,
    ("egress", "declare_subscriber"): Use.PUBLISH,
    ("egress", "query"): Use.SERVE,
    ("egress", "declare_queryable"): Use.CALL,
}
_REPLIES = {"ingress": (Use.SERVE, Use.PUBLISH), "egress": (Use.CALL, Use.SUBSCRIBE)}
"""Of a service, and of the history of a topic."""
_HISTORY = {
    **dict.fromkeys((("ingress", one) for one in ("put", "declare_queryable")), Use.PUBLISH),
    **dict.fromkeys((("egress", one) for one in ("query", "declare_subscriber")), Use.PUBLISH),
    **dict.fromkeys((("egress", one) for one in ("put", "declare_queryable")), Use.SUBSCRIBE),
    **dict.fromkeys(
        (("ingress", one) for one in ("query", "declare_subscriber", "declare_liveliness_subscriber")),
        Use.SUBSCRIBE,
    ),
}


class Meaning(NamedTuple):
    """``use``: None for a node itself and for looking at the graph; ``name``: absolute, with ``*`` for what a key
    leaves open, "" without; ``type``: such as ``std_msgs/msg/String``, "" for any; ``domain``: ``*`` for all.

    Of a token also who it says is there: ``node`` (its final name) and ``enclave``.
    """

    use: Use | None
    name: str
    type: str
    domain: str
    node: str = ""
    enclave: str = ""

    def __str__(self) -> str:
        if self.use is None:
            who = f"node {self.node} is" if "*" not in self.node else f"nodes of enclave {self.enclave} are"
            what = f"say that {who} there" if self.node else "look at the graph"
        else:
            what = f"{self.use.value} {self.name}" + (f" ({self.type})" if self.type else " (any type)")
        return what if self.domain == "0" else f"{what} in {_domain_words(self.domain)}"


def meaning(flow: str, message: str, key: str) -> Meaning | None:
    """Return the meaning of a message (``put``, ``declare_subscriber`` ...); None for what ROS has nothing like.

    The message arrives at the router (``ingress``) or leaves it (``egress``).
    """
    if key.startswith("@"):
        return _of_graph(key)
    data, _, history = key.partition("/@adv/")
    chunks = data.split("/")
    if len(chunks) < 2 or not _DOMAIN.match(chunks[0]):
        return None
    name, chunk = _name_and_type(chunks)
    ros_type = type_name(chunk)
    if history:
        sent = "sub" if history.startswith("sub") else "pub"
        token = Use.PUBLISH if (sent == "pub") is (flow == "ingress") else Use.SUBSCRIBE
        use = token if message == "liveliness_token" else _HISTORY.get((flow, message))
    elif message == "reply":
        use = _REPLIES[flow][not _is_service(ros_type)]
    else:
        use = _USES.get((flow, message))
    return None if use is None else Meaning(use, name, ros_type, chunks[0])


def operation_of(use: Use, name: str) -> tuple[Operation, str]:
    """Return the operation as a policy says it: a part of an action counts for the action."""
    service, topic = _ACTION_SERVICE.match(name), _ACTION_TOPIC.match(name)
    if service is not None and use in (Use.CALL, Use.SERVE):
        return Operation.CALL if use is Use.CALL else Operation.EXECUTE, service[1]
    if topic is not None and use in (Use.PUBLISH, Use.SUBSCRIBE):
        return Operation.EXECUTE if use is Use.PUBLISH else Operation.CALL, topic[1]
    return _OPERATIONS[use], name


def type_name(chunk: str) -> str:
    """Return ``std_msgs::msg::dds_::String_`` as ``std_msgs/msg/String``; "" for a chunk that leaves it open."""
    match = _TYPE.match(chunk)
    return f"{match[1]}/{match[2]}/{match[3]}" if match else ""


def _name_and_type(chunks: list[str]) -> tuple[str, str]:
    """Split into name and type; ``0/**`` has neither: it is about all names."""
    if len(chunks) < 4 or "**" in chunks[-2:]:
        return _ros_name("/".join(chunks[1:])), ""
    return _ros_name("/".join(chunks[1:-2])), chunks[-2]


def _ros_name(expression: str) -> str:
    whole = expression.replace("$*/**/$*", "*")
    return "/" + re.sub(r"(?:\*\*?|\$\*)(?:/(?:\*\*?|\$\*)(?=/|\Z))*", "*", whole)


def _is_service(ros_type: str) -> bool:
    return "/srv/" in ros_type or ros_type.endswith(("_SendGoal", "_GetResult"))


def _of_graph(key: str) -> Meaning | None:
    chunks = key.split("/")
    if chunks[0] != "@ros2_lv" or len(chunks) < 2:
        return None
    domain = chunks[1]
    if len(chunks) < 9:
        return Meaning(None, "", "", domain)
    kind, enclave, namespace, node = chunks[5:9]
    fqn = f"{_unmangled(namespace).rstrip('/')}/{node}"
    if kind == "NN":
        return Meaning(None, "", "", domain, fqn, _unmangled(enclave))
    use = GRAPH_KINDS.get(kind)
    if use is None or len(chunks) < 11:
        return None
    name = _ros_name(_unmangled(chunks[9])[1:])
    return Meaning(use, name, type_name(chunks[10]), domain, fqn, _unmangled(enclave))


def _unmangled(chunk: str) -> str:
    return chunk.replace("%", "/")


def _domain_words(domain: str) -> str:
    return "all domains" if "*" in domain else f"domain {domain}"
