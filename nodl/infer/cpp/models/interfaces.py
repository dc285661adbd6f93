"""Publishers, subscriptions, services and clients of rclcpp: as methods of a node and as functions that get one.

Source: rclcpp/node.hpp, create_publisher.hpp, create_subscription.hpp, create_service.hpp, create_client.hpp,
create_generic_*.hpp, generic_*.hpp, wait_for_message.hpp (humble to rolling).
"""

from __future__ import annotations

from nodl.infer.cpp.libraries import Call, library_function, library_method, node_method
from nodl.infer.cpp.reading.type_names import NO_TYPE, Type, ros_type
from nodl.infer.cpp.running.contents import nodes_in
from nodl.infer.cpp.running.machine import Machine
from nodl.infer.cpp.running.values import (
    BOTTOM,
    Obj,
    Param,
    Text,
    Value,
    concatenated,
    literal,
    plain,
    unknown,
)
from nodl.node_interface import EndpointKind

KINDS = {
    "publisher": EndpointKind.PUBLISHER,
    "subscription": EndpointKind.SUBSCRIPTION,
    "service": EndpointKind.SERVICE_SERVER,
    "client": EndpointKind.SERVICE_CLIENT,
}


def add(run: Machine, owner: Obj, kind: EndpointKind, name: Value, type_name: str, call: Call) -> Value:
    """The interface of one call, under the sub-namespace of a sub-node; the object it gives."""
    record = owner.node
    assert record is not None
    prefix = owner.data.get("prefix")
    if prefix:
        name = _below(prefix, name)
    run.endpoint(record, kind, name, type_name, call.node, call.frame)
    made = run.obj(
        ("interface", call.frame.file.file, call.node.start_byte, call.frame.path),
        Type(f"rclcpp::{kind.value}"),
    )
    made.heap = True
    made.data.update(name=name, kind=kind, type=type_name, record=record)
    for value in call.values:
        for atom in value:
            run.later(atom, call.frame)
    return (made,)


def _introspection(run: Machine, call: Call) -> Value:
    """rcl/src/rcl/service_event_publisher.c: a publisher beside the service, made when introspection is switched on."""
    made = call.receiver
    if made is not None and made.data.get("record") is not None:
        name = concatenated(made.data["name"], literal("/_service_event"))
        kind = f"{made.data['type']}_Event" if made.data["type"] else ""
        run.endpoint(made.data["record"], EndpointKind.PUBLISHER, name, kind, call.node, call.frame)
    return BOTTOM


for _made in (EndpointKind.SERVICE_SERVER, EndpointKind.SERVICE_CLIENT):
    library_method(f"rclcpp::{_made.value}", "configure_introspection")(_introspection)


def _below(prefix: Value, name: Value) -> Value:
    found: list[object] = []
    for atom in name:
        written = plain(atom)
        relative = written is not None and not written.startswith(("/", "~"))
        found += concatenated(prefix, literal("/"), (atom,)) if relative or written is None else (atom,)
    return tuple(found)


def _typed(kind: EndpointKind) -> None:
    word = next(name for name, each in KINDS.items() if each is kind)

    def method(run: Machine, call: Call) -> Value:
        assert call.receiver is not None
        kind_type = call.types[0] if call.types else NO_TYPE
        found = add(run, call.receiver, kind, call.value(0), interface_type(kind_type, call), call)
        if word == "subscription":
            _statistics(run, call.receiver, call)
        return found

    def function(run: Machine, call: Call) -> Value:
        owner, position = owner_and_name(run, call)
        if owner is None:
            return _homeless(run, call, f"create_{word}")
        name = call.value(position)
        return add(
            run, owner, kind, name, interface_type(call.types[0] if call.types else NO_TYPE, call), call
        )

    node_method(f"create_{word}")(method)
    library_function(f"rclcpp::create_{word}")(function)


def interface_type(kind: Type, call: Call) -> str:
    """The type of an interface; that of a type adapter is its second argument."""
    if kind.last in ("TypeAdapter", "as") and kind.arguments:
        return ros_type(kind.arguments[-1])
    return ros_type(kind)


def owner_and_name(run: Machine, call: Call) -> tuple[Obj | None, int]:
    """The node among the first arguments, and where the name stands: behind the last of them."""
    owner: Obj | None = None
    position = 0
    for index, value in enumerate(call.values[:4]):
        found = nodes_in(run, value)
        if not found:
            break
        owner, position = owner or found[0], index + 1
    return owner, position


def _homeless(run: Machine, call: Call, what: str) -> Value:
    run.gap(call.node, call.frame, f"the node that {what}() makes an interface on is not known")
    return unknown(f"the result of {what}()")


def _statistics(run: Machine, owner: Obj, call: Call) -> None:
    """Topic statistics, when the options of the subscription ask for them (rclcpp/subscription_options.hpp)."""
    record = owner.node
    assert record is not None
    for value in call.values[2:]:
        for atom in value:
            if not isinstance(atom, Obj) or not atom.type.last.startswith("SubscriptionOptions"):
                continue
            inner = [o for o in run.store.get((atom, "topic_stats_options")) or BOTTOM if isinstance(o, Obj)]
            state = [a for o in inner for a in run.store.get((o, "state")) or BOTTOM]
            topic = [a for o in inner for a in run.store.get((o, "publish_topic")) or BOTTOM]
            if any("Disable" not in str(getattr(a, "why", a)) for a in state):
                run.endpoint(
                    record,
                    EndpointKind.PUBLISHER,
                    tuple(topic) or literal("/statistics"),
                    "statistics_msgs/msg/MetricsMessage",
                    call.node,
                    call.frame,
                )


for _kind in KINDS.values():
    _typed(_kind)


def _generic(word: str, kind: EndpointKind) -> None:
    def method(run: Machine, call: Call) -> Value:
        assert call.receiver is not None
        return add(run, call.receiver, kind, call.value(0), _text_type(call.value(1)), call)

    def function(run: Machine, call: Call) -> Value:
        owner, position = owner_and_name(run, call)
        if owner is None:
            return _homeless(run, call, f"create_generic_{word}")
        return add(run, owner, kind, call.value(position), _text_type(call.value(position + 1)), call)

    node_method(f"create_generic_{word}")(method)
    library_function(f"rclcpp::create_generic_{word}")(function)


def _text_type(value: Value) -> str:
    texts = [plain(atom) for atom in value if isinstance(atom, Text)]
    return texts[0] if len(texts) == 1 == len(value) and texts[0] and texts[0].count("/") == 2 else ""


for _word, _kind in KINDS.items():
    _generic(_word, _kind)


def _of_rcl(name: str, kind: EndpointKind, node_at: int, name_at: int) -> None:
    """rcl/publisher.h, subscription.h, service.h, client.h, rcl_action/action_server.h, action_client.h, in C. The
    type stands in a structure that is not followed."""

    def function(run: Machine, call: Call) -> Value:
        owners = nodes_in(run, call.value(node_at))
        if not owners:
            return _homeless(run, call, name)
        return add(run, owners[0], kind, call.value(name_at), "", call)

    library_function(name)(function)


for _word, _kind in KINDS.items():
    _of_rcl(f"rcl_{_word}_init", _kind, 1, 3)
_of_rcl("rcl_action_server_init", EndpointKind.ACTION_SERVER, 1, 4)
_of_rcl("rcl_action_client_init", EndpointKind.ACTION_CLIENT, 1, 3)


@library_function("rclcpp::wait_for_message")
def _wait_for_message(run: Machine, call: Call) -> Value:
    owners = [obj for value in call.values for obj in nodes_in(run, value)]
    names = [value for value in call.values if any(isinstance(atom, Text | Param) for atom in value)]
    if not owners:
        return _homeless(run, call, "wait_for_message")
    kind = ros_type(call.types[0]) if call.types else ""
    return add(
        run, owners[0], EndpointKind.SUBSCRIPTION, names[0] if names else unknown("a topic"), kind, call
    )
