"""point_cloud_transport: a publisher for each transport, a subscription by the transport that a parameter names.

Source: ros-perception/point_cloud_transport humble 756c41f, rolling 37d4b68: point_cloud_transport/src/publisher.cpp,
subscriber.cpp, include/point_cloud_transport/point_cloud_transport.hpp, transport_hints.hpp, subscriber_filter.hpp,
simple_publisher_plugin.hpp. The name is expanded, but not remapped, before a transport is put behind it.
"""

from __future__ import annotations

from nodl.infer.cpp.findings import AllocatedNode
from nodl.infer.cpp.libraries import Call, library_class, library_function, library_method
from nodl.infer.cpp.models.images import chosen_transport, hinted, only_if
from nodl.infer.cpp.models.interfaces import PUB, SUB, node_of, owner_in, texts_in
from nodl.infer.cpp.models.parameters import read
from nodl.infer.cpp.reading.type_names import Type
from nodl.infer.cpp.running.machine import Machine
from nodl.infer.cpp.running.values import Obj, Param, Text, Value, concatenated, literal, plain, unknown

_CLOUD, _COMPRESSED = "sensor_msgs/msg/PointCloud2", "point_cloud_interfaces/msg/CompressedPointCloud2"
_TRANSPORTS = ("draco", "zlib", "zstd")
"""Of point_cloud_transport_plugins; the publishers of others need a manifest."""


def _made(run: Machine, call: Call, owner: Obj | None, transport: Value | None) -> Value:
    """``transport``: of a subscription; ``None`` for a publisher."""
    what = "publisher" if transport is None else "subscription"
    if owner is None or owner.node is None:
        run.gap(call.node, call.frame, f"the node that point_cloud_transport makes a {what} on is not known")
        return unknown("a point cloud interface")
    texts = texts_in(call.values)
    base = texts[0] if texts else unknown("a topic that is not given")
    run.later(call.values, call.frame)
    for plugin in ("raw", *_TRANSPORTS) if transport is None else ():
        name, kind = _topic(base, plugin)
        run.endpoint(owner.node, PUB, name, kind, call)
    for atom in transport or ():
        _subscribed(run, owner.node, base, atom, call)
    made = Type(f"point_cloud_transport::{'Publisher' if transport is None else 'Subscriber'}")
    return (run.obj(call.key("cloud"), made, heap=True),)


def _topic(base: Value, transport: str) -> tuple[Value, str]:
    """Name and type for a transport."""
    raw = transport == "raw"
    return (base, _CLOUD) if raw else (concatenated(base, literal(f"/{transport}")), _COMPRESSED)


def _subscribed(run: Machine, record: AllocatedNode, base: Value, transport: object, call: Call) -> None:
    known = plain(transport) if isinstance(transport, Text) else None
    if known is not None:
        name, kind = _topic(base, known)
        run.endpoint(record, SUB, name, kind, call)
        return
    every = ("raw", *_TRANSPORTS)
    default = chosen_transport(run, transport, every) if isinstance(transport, Param) else None
    if not isinstance(transport, Param) or default is None:
        why = (
            "the transport of this point cloud subscription is not known; "
            "its topic is BASE for raw, BASE/TRANSPORT else"
        )
        run.gap(call.node, call.frame, why, record)
        return
    for each in every:
        name, kind = _topic(base, each)
        run.endpoint(record, SUB, concatenated(name, only_if(transport.name, default, each)), kind, call)


@library_class("point_cloud_transport::PointCloudTransport")
def _transport(run: Machine, call: Call) -> None:
    node_of(run, call, "point_cloud_transport::PointCloudTransport")
    call.this.data["owner"] = owner_in(call.values)


@library_class("point_cloud_transport::TransportHints")
def _hints(run: Machine, call: Call) -> None:
    """(node, default, parameter name), or the transport itself."""
    owner, texts = owner_in(call.values), texts_in(call.values)
    default = texts[0] if texts else literal("raw")
    name = texts[1] if len(texts) > 1 else literal("point_cloud_transport")
    record = owner.node if owner is not None else None
    call.this.data["transport"] = read(run, record, name, default) if record is not None else default


def _hinted(run: Machine, call: Call, owner: Obj | None) -> Value:
    if found := hinted(call):
        return found
    if owner is None or owner.node is None:
        return literal("raw")
    return read(run, owner.node, literal("point_cloud_transport"), literal("raw"))


@library_method("point_cloud_transport::PointCloudTransport", "advertise")
def _advertise(run: Machine, call: Call) -> Value:
    return _made(run, call, call.this.data.get("owner"), None)


@library_method("point_cloud_transport::PointCloudTransport", "subscribe")
def _subscribe(run: Machine, call: Call) -> Value:
    owner = call.this.data.get("owner")
    return _made(run, call, owner, _hinted(run, call, owner))


@library_function("point_cloud_transport::create_publisher")
def _publisher(run: Machine, call: Call) -> Value:
    return _made(run, call, owner_in(call.values), None)


@library_function("point_cloud_transport::create_subscription")
def _subscription(run: Machine, call: Call) -> Value:
    """(node, topic, callback, transport)"""
    return _made(run, call, owner_in(call.values), call.value(3) or unknown("a transport"))


@library_class("point_cloud_transport::SubscriberFilter")
def _filter(run: Machine, call: Call) -> None:
    """(node, topic, transport)"""
    if call.values:
        _filtered(run, call)


@library_method("point_cloud_transport::SubscriberFilter", "subscribe")
def _filtered(run: Machine, call: Call) -> Value:
    return _made(run, call, owner_in(call.values), call.value(2) or unknown("a transport"))
