"""image_transport: publishers with their transports, subscriptions, cameras; camera_info_manager."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from enclave_addons.inference.cpp.engine.launch_values import text_of
from enclave_addons.inference.cpp.engine.machine import Machine
from enclave_addons.inference.cpp.engine.values import (
    Atom,
    Obj,
    Param,
    Text,
    Value,
    concatenated,
    join,
    literal,
    unknown,
)
from enclave_addons.inference.cpp.findings import AllocatedNode, Follows
from enclave_addons.inference.cpp.libraries import Call, library_class, library_function, library_method
from enclave_addons.inference.cpp.models.interfaces import PUB, SRV, SUB, node_of, owner_in, texts_in
from enclave_addons.inference.cpp.models.parameters import parameter_names
from enclave_addons.inference.cpp.reading.type_names import Type
from nodl.dependence import When

_IMAGE, _INFO = "sensor_msgs/msg/Image", "sensor_msgs/msg/CameraInfo"


# image_transport_plugins: the transports that ros-<distro>-image-transport-plugins brings, with their types.
_TRANSPORTS = {
    "compressed": "sensor_msgs/msg/CompressedImage",
    "compressedDepth": "sensor_msgs/msg/CompressedImage",
    "theora": "theora_image_transport/msg/Packet",
    "zstd": "sensor_msgs/msg/CompressedImage",
    "ffmpeg": "ffmpeg_image_transport_msgs/msg/FFMPEGPacket",
}


def _image_publisher(run: Machine, record: AllocatedNode, base: Value, call: Call) -> None:
    """Model image_transport/src/publisher.cpp: one publisher for each installed plugin, below the image's
    final name.
    """
    run.endpoint(record, PUB, base, _IMAGE, call)
    for topic in concatenated(base):
        for plugin, kind in list(_TRANSPORTS.items())[:3]:
            follows = Follows("remapped", topic, f"/{plugin}")
            run.endpoint(record, PUB, concatenated((topic,), literal(f"/{plugin}")), kind, call, follows)


def _info_topic(base: Value) -> Value:
    """Model image_transport/src/camera_common.cpp, getCameraInfoTopic: the last part of the name replaced."""
    found: list[object] = []
    for atom in base:
        parts = atom.parts if isinstance(atom, Text) else ()
        if parts and isinstance(parts[-1], str) and "/" in parts[-1]:
            head = parts[-1].rpartition("/")[0]
            found += concatenated((Text((*parts[:-1], head + "/")),), literal("camera_info"))
        elif isinstance(atom, Text) and all(isinstance(part, str) for part in parts):
            found += literal("camera_info")
        else:
            found += unknown("the camera_info beside a topic that is not known")
    return tuple(found)


def _owner_of(call: Call) -> Obj | None:
    """Return the node among the arguments, else that of the object, or that the object was made with."""
    this = call.receiver
    owner = owner_in(call.values) or (this if this is not None and this.node else None)
    return owner or (this.data.get("owner") if this is not None else None)


def _image(what: str, run: Machine, call: Call, place: int = 3) -> Value:
    """Make the interface of an image. ``place``: of the transport among the arguments of a subscription."""
    owner, texts = _owner_of(call), texts_in(call.values)
    if owner is None or owner.node is None:
        run.gap(call.node, call.frame, f"the node that image_transport makes a {what} on is not known")
        return unknown("an image interface")
    base = texts[0] if texts else unknown("a topic that is not given")
    run.later(call.values)
    if what in ("publisher", "camera publisher"):
        _image_publisher(run, owner.node, base, call)
    else:
        for transport in _transports_of(run, owner.node, call, place):
            _image_subscription(run, owner.node, base, call, transport)
    if what.startswith("camera"):
        kind = PUB if what.endswith("publisher") else SUB
        for topic in concatenated(base):
            info = _info_topic((topic,))
            run.endpoint(owner.node, kind, info, _INFO, call, Follows("camera_info", topic))
    name = what.replace("subscription", "subscriber").title().replace(" ", "")
    return (run.object(call.key("image"), Type(f"image_transport::{name}"), heap=True),)


def _image_subscription(
    run: Machine, record: AllocatedNode, base: Value, call: Call, transport: object
) -> None:
    """Model image_transport/src/subscriber.cpp: one topic, by the transport."""
    known = text_of(run, transport) or ""
    if known in _TRANSPORTS:
        for topic in concatenated(base):
            name = concatenated((topic,), literal(f"/{known}"))
            run.endpoint(record, SUB, name, _TRANSPORTS[known], call, Follows("remapped", topic, f"/{known}"))
        return
    run.endpoint(record, SUB, base, _IMAGE, call)
    if known != "raw":
        run.gap(
            call.node, call.frame,
            "the transport of this image subscription is chosen at run time (not known); its topic is BASE for raw, "
            "BASE/TRANSPORT else",
            record,
        )  # fmt: skip


def _transports_of(run: Machine, record: AllocatedNode, call: Call, place: int) -> Value:
    """Return the transports as given, else ``raw``; for methods of ``ImageTransport`` those of the hints.

    Source: image_transport/src/image_transport.cpp, ``getTransportOrDefault``.
    """
    if call.receiver is None:
        return (call.values[place] or unknown("a transport")) if len(call.values) > place else literal("raw")
    hints = [a for v in call.values for a in v if isinstance(a, Obj) and a.type.last == "TransportHints"]
    if not hints:
        return _hinted(run, record, literal("raw"), literal("image_transport"))
    return join(*(each.data.get("transport", unknown("a transport")) for each in hints))


def _hinted(run: Machine, record: AllocatedNode, default: Value, parameter: Value) -> Value:
    """Return the transport that a parameter selects, with the default if the program does not declare the parameter.

    A parameter that is not declared has a value only if the node's options declare what the launch sets.
    """
    found: list[Atom] = []
    for name in parameter_names(run, parameter):
        if name is None:
            found += [*default, *unknown("a transport")]
        elif name in record.parameters:
            found.append(Param(record, name))
        else:
            found += [*default, Param(record, name, known=default)]
    return tuple(dict.fromkeys(found))


@library_class("image_transport::TransportHints")
def _hints(run: Machine, call: Call) -> None:
    """Model image_transport/transport_hints.hpp: (node, default, name of the parameter)."""
    owner, texts = owner_in(call.values), texts_in(call.values)
    if owner is not None and owner.node is not None:
        default = texts[0] if texts else literal("raw")
        parameter = texts[1] if len(texts) > 1 else literal("image_transport")
        call.this.data["transport"] = _hinted(run, owner.node, default, parameter)


@library_method("image_transport::TransportHints", "getTransport")
def _hinted_transport(run: Machine, call: Call) -> Value:
    return call.this.data.get("transport") or unknown("a transport")


@library_class("image_transport::ImageTransport")
def _image_transport(run: Machine, call: Call) -> None:
    node_of(run, call, "image_transport::ImageTransport")
    call.this.data["owner"] = owner_in(call.values)


for _what, _function, _method in (
    ("publisher", "create_publisher", "advertise"),
    ("subscription", "create_subscription", "subscribe"),
    ("camera publisher", "create_camera_publisher", "advertiseCamera"),
    ("camera subscription", "create_camera_subscription", "subscribeCamera"),
):
    library_function(f"image_transport::{_function}")(partial(_image, _what))
    library_method("image_transport::ImageTransport", _method)(partial(_image, _what))


@library_function("image_transport::getCameraInfoTopic")
def _beside(run: Machine, call: Call) -> Value:
    """Leave the topic as it is: what is beside it follows from its name after remapping."""
    return unknown("the camera_info beside a topic")


@library_class("image_transport::SubscriberFilter")
def _subscriber_filter(run: Machine, call: Call) -> None:
    """Model image_transport/subscriber_filter.hpp: (node, topic, transport)."""
    if call.values:
        _filter(run, call)


@library_method("image_transport::SubscriberFilter", "subscribe")
def _filter(run: Machine, call: Call) -> Value:
    return _image("subscription", run, replace(call, receiver=None), 2)


def _handle(what: str, run: Machine, call: Call) -> Value | None:
    """Model image_transport/publisher.hpp and its siblings: default, copied, or (node, topic, ...) as the functions."""
    same = tuple(
        a for v in call.values for a in v if isinstance(a, Obj) and a.type.name == call.this.type.name
    )
    if same or not call.values:
        return same or None
    return _image(what, run, replace(call, receiver=None))


for _what in ("publisher", "camera publisher", "subscriber", "camera subscriber"):
    library_class(f"image_transport::{_what.title().replace(' ', '')}")(partial(_handle, _what))


@library_class("camera_info_manager::CameraInfoManager")
def _manager(run: Machine, call: Call) -> None:
    """Model (node, camera, url): ``set_camera_info`` until humble, ``~/set_camera_info`` since iron.

    In rolling a further text is the namespace. Source:
    ros-perception/image_common humble d118138, jazzy d04d2c8, rolling f6e4ab6:
    camera_info_manager/src/camera_info_manager.cpp.
    """
    record = node_of(run, call, "camera_info_manager::CameraInfoManager")
    if record is None:
        return
    texts = [v for v in texts_in(call.values) if any(isinstance(atom, Text) for atom in v)]
    kind = "sensor_msgs/srv/SetCameraInfo"
    if len(texts) > 2:
        run.endpoint(record, SRV, concatenated(texts[2], literal("/set_camera_info")), kind, call)
        return
    run.endpoint(record, SRV, literal("~/set_camera_info"), kind, call, when=When(since="iron"))
    run.endpoint(record, SRV, literal("set_camera_info"), kind, call, when=When(until="humble"))
