"""point_cloud_transport: a publisher for each transport, a subscription by the transport that a parameter names.

Source: ros-perception/point_cloud_transport humble 756c41f, rolling 37d4b68: point_cloud_transport/src/publisher.cpp,
subscriber.cpp, include/point_cloud_transport/point_cloud_transport.hpp, transport_hints.hpp, subscriber_filter.hpp,
simple_publisher_plugin.hpp. The name is expanded, but not remapped, before a transport is put behind it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from nodl.infer.cpp.libraries import LIBRARY_METHODS, Call, library_class, library_function
from nodl.infer.cpp.models.images import chosen_transport, only_if
from nodl.infer.cpp.models.parameters import read
from nodl.infer.cpp.models.table import PUB, SUB, owner_in, texts_in
from nodl.infer.cpp.reading.type_names import Type
from nodl.infer.cpp.running.frames import Frame
from nodl.infer.cpp.running.machine import Machine
from nodl.infer.cpp.running.values import Obj, Param, Text, Value, concatenated, join, literal, plain, unknown

if TYPE_CHECKING:
    from tree_sitter import Node

_CLOUD, _COMPRESSED = "sensor_msgs/msg/PointCloud2", "point_cloud_interfaces/msg/CompressedPointCloud2"
_TRANSPORTS = ("draco", "zlib", "zstd")
"""Of point_cloud_transport_plugins; the publishers of others need a manifest."""


def _made(run: Machine, call: Call, owner: Obj | None, texts: list[Value], transport: Value | None) -> Value:
    """``transport``: of a subscription; ``None`` for a publisher."""
    what = "publisher" if transport is None else "subscription"
    if owner is None or owner.node is None:
        run.gap(call.node, call.frame, f"the node that point_cloud_transport makes a {what} on is not known")
        return unknown("a point cloud interface")
    base = texts[0] if texts else unknown("a topic that is not given")
    for value in call.values:
        for atom in value:
            run.later(atom, call.frame)
    if transport is None:
        run.endpoint(owner.node, PUB, base, _CLOUD, call.node, call.frame)
        for plugin in _TRANSPORTS:
            name = concatenated(base, literal(f"/{plugin}"))
            run.endpoint(owner.node, PUB, name, _COMPRESSED, call.node, call.frame)
    for atom in transport or ():
        _subscribed(run, owner, base, atom, call)
    kind = Type(f"point_cloud_transport::{'Publisher' if transport is None else 'Subscriber'}")
    return (run.obj(("cloud", call.frame.file.file, call.node.start_byte, call.frame.path), kind, heap=True),)


def _subscribed(run: Machine, owner: Obj, base: Value, transport: object, call: Call) -> None:
    assert owner.node is not None
    known = plain(transport) if isinstance(transport, Text) else None
    if known is not None:
        name = base if known == "raw" else concatenated(base, literal(f"/{known}"))
        run.endpoint(owner.node, SUB, name, _CLOUD if known == "raw" else _COMPRESSED, call.node, call.frame)
        return
    if (
        isinstance(transport, Param)
        and (default := chosen_transport(run, transport, ("raw", *_TRANSPORTS))) is not None
    ):
        for each in ("raw", *_TRANSPORTS):
            below = literal("" if each == "raw" else f"/{each}")
            name = concatenated(base, below, only_if(transport.name, default, each))
            run.endpoint(
                owner.node, SUB, name, _CLOUD if each == "raw" else _COMPRESSED, call.node, call.frame
            )
        return
    why = "the transport of this point cloud subscription is not known; its topic is BASE for raw, BASE/TRANSPORT else"
    run.gap(call.node, call.frame, why, owner.node)


@library_class("point_cloud_transport::PointCloudTransport")
def _transport(run: Machine, this: Obj, arguments: list[Value], node: Node, frame: Frame) -> Value | None:
    this.data["owner"] = owner_in(run, arguments)
    if this.data["owner"] is None:
        run.gap(node, frame, "the node of this point_cloud_transport::PointCloudTransport is not known")
    return None


@library_class("point_cloud_transport::TransportHints")
def _hints(run: Machine, this: Obj, arguments: list[Value], node: Node, frame: Frame) -> Value | None:
    """(node, default, parameter name), or the transport itself."""
    owner, texts = owner_in(run, arguments), texts_in(arguments, run)
    default = texts[0] if texts else literal("raw")
    if owner is None or owner.node is None:
        this.data["transport"] = default
    else:
        name = texts[1] if len(texts) > 1 else literal("point_cloud_transport")
        this.data["transport"] = read(run, owner.node, name, default)
    return None


def _hinted(run: Machine, call: Call, owner: Obj | None) -> Value:
    hints = [a for v in call.values for a in v if isinstance(a, Obj) and a.type.last == "TransportHints"]
    if hints:
        return join(*(each.data.get("transport", unknown("a transport")) for each in hints))
    if owner is None or owner.node is None:
        return literal("raw")
    return read(run, owner.node, literal("point_cloud_transport"), literal("raw"))


def _advertise(run: Machine, call: Call) -> Value:
    owner = call.receiver.data.get("owner") if call.receiver is not None else None
    return _made(run, call, owner, texts_in(call.values, run), None)


def _subscribe(run: Machine, call: Call) -> Value:
    owner = call.receiver.data.get("owner") if call.receiver is not None else None
    return _made(run, call, owner, texts_in(call.values, run), _hinted(run, call, owner))


LIBRARY_METHODS[("point_cloud_transport::PointCloudTransport", "advertise")] = _advertise
LIBRARY_METHODS[("point_cloud_transport::PointCloudTransport", "subscribe")] = _subscribe


@library_function("point_cloud_transport::create_publisher")
def _publisher(run: Machine, call: Call) -> Value:
    return _made(run, call, owner_in(run, call.values), texts_in(call.values, run), None)


@library_function("point_cloud_transport::create_subscription")
def _subscription(run: Machine, call: Call) -> Value:
    """(node, topic, callback, transport)"""
    transport = call.value(3) or unknown("a transport")
    return _made(run, call, owner_in(run, call.values), texts_in(call.values, run), transport)


@library_class("point_cloud_transport::SubscriberFilter")
def _filter(run: Machine, this: Obj, arguments: list[Value], node: Node, frame: Frame) -> Value | None:
    """(node, topic, transport)"""
    if arguments:
        _filtered(run, Call(node, frame, arguments, []))
    return None


def _filtered(run: Machine, call: Call) -> Value:
    transport = call.value(2) or unknown("a transport")
    return _made(run, call, owner_in(run, call.values), texts_in(call.values, run), transport)


LIBRARY_METHODS[("point_cloud_transport::SubscriberFilter", "subscribe")] = _filtered
