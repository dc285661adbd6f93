"""image_transport: publishers with their transports, subscriptions, cameras."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from nodl.infer.cpp.libraries import LIBRARY_METHODS, Call, library_class, library_function
from nodl.infer.cpp.models.table import PUB, SUB, owner_in, texts_in
from nodl.infer.cpp.reading.type_names import Type
from nodl.infer.cpp.running.machine import Frame, Machine
from nodl.infer.cpp.running.values import Obj, Param, Text, Value, concatenated, literal, unknown

if TYPE_CHECKING:
    from tree_sitter import Node

_IMAGE, _INFO = "sensor_msgs/msg/Image", "sensor_msgs/msg/CameraInfo"


def _transported(base: Value, plugin: str) -> Value:
    return concatenated(base, literal(f"/{plugin}"))


# image_transport_plugins: the transports that ros-<distro>-image-transport-plugins brings, with their types.
_TRANSPORTS = {
    "compressed": "sensor_msgs/msg/CompressedImage",
    "compressedDepth": "sensor_msgs/msg/CompressedImage",
    "theora": "theora_image_transport/msg/Packet",
    "zstd": "sensor_msgs/msg/CompressedImage",
    "ffmpeg": "ffmpeg_image_transport_msgs/msg/FFMPEGPacket",
}


def _image_publisher(run: Machine, owner: Obj, base: Value, node: Node, frame: Frame) -> None:
    """image_transport/src/publisher.cpp: one publisher for each transport plugin that is installed."""
    assert owner.node is not None
    run.endpoint(owner.node, PUB, base, _IMAGE, node, frame)
    for plugin, kind in list(_TRANSPORTS.items())[:3]:
        run.endpoint(owner.node, PUB, _transported(base, plugin), kind, node, frame)


def _info_topic(base: Value) -> Value:
    """image_transport/src/camera_common.cpp, getCameraInfoTopic: the last part of the name replaced."""
    found: list[object] = []
    for atom in base:
        if (
            isinstance(atom, Text)
            and atom.parts
            and isinstance(atom.parts[-1], str)
            and "/" in atom.parts[-1]
        ):
            head = atom.parts[-1].rpartition("/")[0]
            found += concatenated((Text((*atom.parts[:-1], head + "/")),), literal("camera_info"))
        elif isinstance(atom, Text) and all(isinstance(part, str) for part in atom.parts):
            found += literal("camera_info")
        else:
            found += unknown("the camera_info beside a topic that is not known")
    return tuple(found)


def _image(run: Machine, call: Call, what: str) -> Value:
    owner = owner_in(run, call.values) or (
        call.receiver if call.receiver is not None and call.receiver.node else None
    )
    held = call.receiver.data.get("owner") if call.receiver is not None else None
    owner = owner or held
    texts = texts_in(call.values, run)
    if owner is None or owner.node is None:
        run.gap(call.node, call.frame, f"the node that image_transport makes a {what} on is not known")
        return unknown("an image interface")
    base = texts[0] if texts else unknown("a topic that is not given")
    for value in call.values:
        for atom in value:
            run.later(atom, call.frame)
    if what in ("publisher", "camera publisher"):
        _image_publisher(run, owner, base, call.node, call.frame)
    else:
        _image_subscriber(run, owner, base, call, texts)
    if what.startswith("camera"):
        kind = PUB if what.endswith("publisher") else SUB
        run.endpoint(owner.node, kind, _info_topic(base), _INFO, call.node, call.frame)
    made = run.obj(
        ("image", call.frame.file.file, call.node.start_byte, call.frame.path),
        Type(f"image_transport::{what}"),
        heap=True,
    )
    return (made,)


def _image_subscriber(run: Machine, owner: Obj, base: Value, call: Call, texts: Sequence[Value]) -> None:
    """image_transport/src/subscriber.cpp: the transport is the argument behind the callback, a hint, or ``raw``."""
    assert owner.node is not None
    transports = (
        texts[-1]
        if len(texts) > 1 and any(isinstance(a, Text | Param) for a in texts[-1])
        else literal("raw")
    )
    if call.receiver is not None and len(texts) <= 1:
        transports = literal("raw")
    for atom in transports:
        if isinstance(atom, Text) and atom.parts == ("raw",):
            run.endpoint(owner.node, SUB, base, _IMAGE, call.node, call.frame)
            continue
        run.endpoint(owner.node, SUB, base, _IMAGE, call.node, call.frame)
        run.gap(
            call.node,
            call.frame,
            f"the transport of this image subscription is chosen at run time ({_shown(atom)}); "
            "its topic is BASE for raw, BASE/TRANSPORT else",
            owner.node,
        )


def _shown(atom: object) -> str:
    return f"parameter {atom.name}" if isinstance(atom, Param) else "not known"


for _function, _what in (
    ("create_publisher", "publisher"),
    ("create_subscription", "subscription"),
    ("create_camera_publisher", "camera publisher"),
    ("create_camera_subscription", "camera subscription"),
):
    library_function(f"image_transport::{_function}")(lambda run, call, what=_what: _image(run, call, what))  # type: ignore[misc]


@library_class("image_transport::ImageTransport")
def _image_transport(
    run: Machine, this: Obj, arguments: list[Value], node: Node, frame: Frame
) -> Value | None:
    this.data["owner"] = owner_in(run, arguments)
    if this.data["owner"] is None:
        run.gap(node, frame, "the node of this image_transport::ImageTransport is not known")
    return None


for _method, _what in (
    ("advertise", "publisher"),
    ("advertiseCamera", "camera publisher"),
    ("subscribe", "subscription"),
    ("subscribeCamera", "camera subscription"),
):
    LIBRARY_METHODS[("image_transport::ImageTransport", _method)] = lambda run, call, what=_what: _image(
        run, call, what
    )  # type: ignore[misc]


@library_class("image_transport::SubscriberFilter")
def _subscriber_filter(
    run: Machine, this: Obj, arguments: list[Value], node: Node, frame: Frame
) -> Value | None:
    """image_transport/subscriber_filter.hpp: (node, topic, transport)."""
    if arguments:
        _image(run, Call(node, frame, arguments, []), "subscription")
    return None


def _filter(run: Machine, call: Call) -> Value:
    return _image(run, Call(call.node, call.frame, call.values, []), "subscription")


LIBRARY_METHODS[("image_transport::SubscriberFilter", "subscribe")] = _filter
