"""image_transport: publishers with their transports, subscriptions, cameras."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from nodl.infer.cpp.findings import Follows
from nodl.infer.cpp.libraries import LIBRARY_METHODS, Call, library_class, library_function
from nodl.infer.cpp.models.table import PUB, SUB, owner_in, texts_in
from nodl.infer.cpp.reading.type_names import Type
from nodl.infer.cpp.running.frames import Frame
from nodl.infer.cpp.running.launch_values import given_by_launch
from nodl.infer.cpp.running.machine import Machine
from nodl.infer.cpp.running.values import (
    DerivedName,
    Obj,
    Param,
    Text,
    Value,
    concatenated,
    join,
    literal,
    plain,
    unknown,
)
from nodl.name_template import ParameterPart

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
    """image_transport/src/publisher.cpp: one publisher for each transport plugin that is installed, below the final
    name of the image."""
    assert owner.node is not None
    run.endpoint(owner.node, PUB, base, _IMAGE, node, frame)
    for topic in concatenated(base):
        for plugin, kind in list(_TRANSPORTS.items())[:3]:
            follows = Follows("remapped", topic, f"/{plugin}")
            run.endpoint(owner.node, PUB, _transported((topic,), plugin), kind, node, frame, follows)


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


def _image(run: Machine, call: Call, what: str, place: int = 3) -> Value:
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
        _image_subscriber(run, owner, base, call, place)
    if what.startswith("camera"):
        kind = PUB if what.endswith("publisher") else SUB
        for topic in concatenated(base):
            follows = Follows("camera_info", topic)
            info = _info_topic((topic,))
            run.endpoint(owner.node, kind, info, _INFO, call.node, call.frame, follows)
    made = run.obj(
        ("image", call.frame.file.file, call.node.start_byte, call.frame.path),
        Type(f"image_transport::{what.replace('subscription', 'subscriber').title().replace(' ', '')}"),
        heap=True,
    )
    return (made,)


def _image_subscriber(run: Machine, owner: Obj, base: Value, call: Call, place: int) -> None:
    """image_transport/src/subscriber.cpp: one topic, by the transport. ``place``: of it among the arguments."""
    assert owner.node is not None
    transports = _transports_of(run, owner, call, place)
    for atom in transports:
        if isinstance(atom, Text) and atom.parts == ("raw",):
            run.endpoint(owner.node, SUB, base, _IMAGE, call.node, call.frame)
        elif isinstance(atom, Text) and plain(atom) in _TRANSPORTS:
            _transported_subscription(run, owner, base, call, str(plain(atom)), "", "")
        elif isinstance(atom, Param) and atom.item is None and _only_text(atom) is not None:
            _chosen_by(run, owner, base, call, atom)
        else:
            run.endpoint(owner.node, SUB, base, _IMAGE, call.node, call.frame)
            run.gap(
                call.node, call.frame,
                "the transport of this image subscription is chosen at run time (not known); "
                "its topic is BASE for raw, BASE/TRANSPORT else",
                owner.node,
            )  # fmt: skip


def _transports_of(run: Machine, owner: Obj, call: Call, place: int) -> Value:
    """As given, else ``raw``; for the methods of ``ImageTransport`` the hints decide, else the parameter that they read
    (image_transport/src/image_transport.cpp, ``getTransportOrDefault``)."""
    if call.receiver is None:
        return (call.values[place] or unknown("a transport")) if len(call.values) > place else literal("raw")
    hints = [
        a for value in call.values for a in value if isinstance(a, Obj) and a.type.last == "TransportHints"
    ]
    if hints:
        return join(*(each.data.get("transport", unknown("a transport")) for each in hints))
    if owner.node is not None and "image_transport" in owner.node.parameters:
        return (Param(owner.node, "image_transport"),)
    return literal("raw")


def _only_text(atom: Param) -> str | None:
    texts = [plain(each) for each in atom.default]
    return texts[0] if len(texts) == 1 else None


def _chosen_by(run: Machine, owner: Obj, base: Value, call: Call, chosen: Param) -> None:
    """A parameter names the transport: of all its topics the one with its value is subscribed."""
    assert owner.node is not None
    default = _only_text(chosen) or ""
    for topic in concatenated(base):
        raw = Follows("remapped", topic, "", chosen.name, "raw", default)
        name = concatenated((topic,), only_if(chosen.name, default, "raw"))
        run.endpoint(owner.node, SUB, name, _IMAGE, call.node, call.frame, raw)
    for transport in _TRANSPORTS:
        _transported_subscription(run, owner, base, call, transport, chosen.name, default)
    given = given_by_launch(run, chosen.record, chosen.name)
    if (default if given is None else given) not in ("raw", *_TRANSPORTS):
        why = f"the image transport {given or default} (parameter {chosen.name}) is not in the table"
        run.gap(call.node, call.frame, why, owner.node)
    run.from_default.pop(chosen.name, None)  # its values are all listed


def _transported_subscription(
    run: Machine, owner: Obj, base: Value, call: Call, transport: str, parameter: str, default: str
) -> None:
    assert owner.node is not None
    for topic in concatenated(base):
        wanted = transport if parameter else ""
        follows = Follows("remapped", topic, f"/{transport}", parameter, wanted, default)
        condition = only_if(parameter, default, transport) if parameter else literal("")
        name = concatenated((topic,), literal(f"/{transport}"), condition)
        run.endpoint(owner.node, SUB, name, _TRANSPORTS[transport], call.node, call.frame, follows)


def chosen_transport(run: Machine, chosen: Param, known: Sequence[str]) -> str | None:
    """The default of a parameter that names a transport; ``None`` unless it, and what launch gives, is in the table."""
    default = _only_text(chosen) or ""
    given = given_by_launch(run, chosen.record, chosen.name)
    run.from_default.pop(chosen.name, None)  # its values are all listed
    return default if (default if given is None else given) in known else None


def only_if(parameter: str, default: str, value: str) -> Value:
    """An empty ending for a name, which drops the name unless the parameter has this ``value``."""
    return (Text((ParameterPart(parameter, default, None, (("only if equal", (value,)),)),)),)


@library_class("image_transport::TransportHints")
def _transport_hints(
    run: Machine, this: Obj, arguments: list[Value], node: Node, frame: Frame
) -> Value | None:
    """image_transport/transport_hints.hpp: (node, default, parameter name), read by ``get_parameter_or``."""
    owner = owner_in(run, arguments)
    texts = texts_in(arguments, run)
    name = plain(texts[1][0]) if len(texts) > 1 and len(texts[1]) == 1 else "image_transport"
    fallback = texts[0] if texts else literal("raw")
    if owner is not None and owner.node is not None and name is not None:
        this.data["transport"] = (Param(owner.node, name, None, owner.node.default(name) or fallback),)
    return None


LIBRARY_METHODS[("image_transport::TransportHints", "getTransport")] = lambda run, call: (
    call.receiver.data.get("transport", unknown("a transport"))
    if call.receiver is not None
    else unknown("a transport")
)


@library_function("image_transport::getCameraInfoTopic")
def _camera_info_topic(run: Machine, call: Call) -> Value:
    """image_transport/camera_common.hpp. Callers give it the name that launch has remapped, which it follows then."""
    found: list[object] = []
    for image in call.value(0):
        for atom in _info_topic((image,)):
            known = isinstance(atom, Text) and isinstance(image, Text)
            found.append(Text((*atom.parts[:-1], DerivedName(atom.parts[-1], image))) if known else atom)
    return tuple(found)


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
        _image(run, Call(node, frame, arguments, []), "subscription", 2)
    return None


def _filter(run: Machine, call: Call) -> Value:
    return _image(run, Call(call.node, call.frame, call.values, []), "subscription", 2)


LIBRARY_METHODS[("image_transport::SubscriberFilter", "subscribe")] = _filter


def _handle(what: str) -> None:
    """image_transport/publisher.hpp and its siblings: default, copied, or (node, topic, ...) as the functions."""

    def model(run: Machine, this: Obj, arguments: list[Value], node: Node, frame: Frame) -> Value | None:
        same = tuple(
            a for value in arguments for a in value if isinstance(a, Obj) and a.type.name == this.type.name
        )
        if same or not arguments:
            return same or None
        return _image(run, Call(node, frame, arguments, []), what)

    library_class(f"image_transport::{what.title().replace(' ', '')}")(model)


for _what in ("publisher", "camera publisher", "subscriber", "camera subscriber"):
    _handle(_what)
