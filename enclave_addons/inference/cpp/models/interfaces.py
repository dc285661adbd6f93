"""Interfaces of rclcpp and rclcpp_action: as methods of a node, as functions that get one.

Source: rclcpp/node.hpp, create_publisher.hpp, create_subscription.hpp, create_service.hpp, create_client.hpp,
create_generic_*.hpp, generic_*.hpp, wait_for_message.hpp; rclcpp_action/create_server.hpp, create_client.hpp (humble to
rolling).
"""

from __future__ import annotations

from collections.abc import Sequence

from enclave_addons.inference.cpp.engine.machine import Machine
from enclave_addons.inference.cpp.engine.values import (
    BOTTOM,
    Obj,
    Param,
    Text,
    Value,
    concatenated,
    join,
    literal,
    nodes_in,
    plain,
    unknown,
)
from enclave_addons.inference.cpp.findings import AllocatedNode
from enclave_addons.inference.cpp.libraries import (
    Call,
    library_class,
    library_function,
    library_method,
    node_method,
)
from enclave_addons.inference.cpp.reading.type_names import NO_TYPE, Type, ros_type
from nodl.node_interface import EndpointKind

PUB, SUB = EndpointKind.PUBLISHER, EndpointKind.SUBSCRIPTION
SRV, CLI = EndpointKind.SERVICE_SERVER, EndpointKind.SERVICE_CLIENT
ACT, CALL = EndpointKind.ACTION_SERVER, EndpointKind.ACTION_CLIENT
KINDS = {"publisher": PUB, "subscription": SUB, "service": SRV, "client": CLI}


def owner_in(values: Sequence[Value]) -> Obj | None:
    """Return the first node among the arguments or in lists among them; ``None`` if they hold none."""
    return next((obj for value in values for obj in nodes_in(value)), None)


def node_of(run: Machine, call: Call, whose: str = "") -> AllocatedNode | None:
    """Return the node that the object of a library gets; a gap, with the name of its class, if it gets none."""
    owner = owner_in(call.values)
    if owner is None:
        run.gap(call.node, call.frame, f"the node of this {whose or call.this.type.name} is not known")
    return owner.node if owner is not None else None


def texts_in(values: Sequence[Value]) -> list[Value]:
    """Return the arguments that hold something and no node: names and the like."""
    return [value for value in values if value and not nodes_in(value)]


def named_in(values: Sequence[Value]) -> list[Value]:
    """Return the arguments that may be a text."""
    return [value for value in values if any(isinstance(atom, Text | Param) for atom in value)]


def add(run: Machine, owner: Obj, kind: EndpointKind, name: Value, type_name: str, call: Call) -> Value:
    """Add the interface of one call; return the object it gives."""
    record = owner.node
    assert record is not None
    run.endpoint(record, kind, name, type_name, call)
    made = run.object(call.key("interface"), Type(f"rclcpp::{kind.value}"))
    made.heap = True
    made.data.update(name=name, kind=kind, type=type_name, record=record)
    run.later(call.values)
    return (made,)


def owner_and_name(call: Call) -> tuple[Obj | None, int]:
    """Return the node among the first arguments, and where the name stands: behind the last of them."""
    owner: Obj | None = None
    position = 0
    for index, value in enumerate(call.values[:4]):
        found = nodes_in(value)
        if not found:
            break
        owner, position = owner or found[0], index + 1
    return owner, position


def _homeless(run: Machine, call: Call, what: str) -> Value:
    run.gap(call.node, call.frame, f"the node that {what}() makes an interface on is not known")
    return unknown(f"the result of {what}()")


def _typed(word: str, kind: EndpointKind) -> None:
    def method(run: Machine, call: Call) -> Value:
        found = add(run, call.this, kind, call.value(0), _adapted(call), call)
        if kind is SUB:
            _statistics(run, call)
        return found

    def function(run: Machine, call: Call) -> Value:
        owner, position = owner_and_name(call)
        if owner is None:
            return _homeless(run, call, f"create_{word}")
        return add(run, owner, kind, call.value(position), _adapted(call), call)

    node_method(f"create_{word}")(method)
    library_function(f"rclcpp::create_{word}")(function)


def _adapted(call: Call) -> str:
    """Return the type of an interface; that of a type adapter is its second argument."""
    kind = call.types[0] if call.types else NO_TYPE
    return ros_type(kind.arguments[-1] if kind.last in ("TypeAdapter", "as") and kind.arguments else kind)


@library_class("rclcpp::SubscriptionOptions")
def _subscription_options(run: Machine, call: Call) -> Value | None:
    given = next((each for each in call.value(0) if isinstance(each, Obj)), None)
    if given is not None and given.type.name == call.this.type.name:
        return (given,)
    inner = run.object(call.key("statistics"), Type("rclcpp::TopicStatisticsOptions"))
    run.store.set((call.this, "topic_stats_options"), (inner,))
    return None


def _statistics(run: Machine, call: Call) -> None:
    """Add the publisher that the options of a subscription, or of its node, request for topic statistics.

    Source: rclcpp/create_subscription.hpp, topic_statistics_state.hpp, subscription_options.hpp.
    """
    given = (atom for value in call.values[2:] for atom in value if isinstance(atom, Obj))
    options = [each for atom in given for each in run.store.get((atom, "topic_stats_options"))]
    states = [str(getattr(each, "why", "")) for one in options for each in run.store.get((one, "state"))]
    default = "Enable" if call.record.statistics else "Disable"
    ends = {
        default if each.endswith("NodeDefault") else each.rpartition("::")[2] for each in states or [default]
    }
    if ends == {"Disable"}:
        return
    if ends - {"Enable", "Disable"}:
        run.gap(
            call.node, call.frame, "whether the subscription has topic statistics is not known", call.record
        )
    names = join(*(run.store.get((one, "publish_topic")) for one in options)) or literal("/statistics")
    run.endpoint(call.record, PUB, names, "statistics_msgs/msg/MetricsMessage", call)


def _generic(word: str, kind: EndpointKind) -> None:
    def method(run: Machine, call: Call) -> Value:
        return add(run, call.this, kind, call.value(0), _text_type(call.value(1)), call)

    node_method(f"create_generic_{word}")(method)


def _text_type(value: Value) -> str:
    texts = [plain(atom) for atom in value if isinstance(atom, Text)]
    return texts[0] if len(texts) == 1 == len(value) and texts[0] and texts[0].count("/") == 2 else ""


def _action(word: str, kind: EndpointKind) -> None:
    def function(run: Machine, call: Call) -> Value:
        owner, position = owner_and_name(call)
        if owner is None:
            why = f"the node that rclcpp_action::create_{word}() makes an action on is not known"
            run.gap(call.node, call.frame, why)
            return unknown("an action")
        return add(run, owner, kind, call.value(position), call.interface, call)

    library_function(f"rclcpp_action::create_{word}")(function)


for _word, _kind in KINDS.items():
    _typed(_word, _kind)
    _generic(_word, _kind)
_action("server", ACT)
_action("client", CALL)
_action("generic_client", CALL)


@library_method(f"rclcpp::{SRV.value}", "configure_introspection")
@library_method(f"rclcpp::{CLI.value}", "configure_introspection")
def _introspection(run: Machine, call: Call) -> Value:
    """Add the publisher beside a service that is made if introspection is on
    (rcl/src/rcl/service_event_publisher.c).
    """
    data = call.this.data
    if data.get("record") is not None:
        name = concatenated(data["name"], literal("/_service_event"))
        run.endpoint(data["record"], PUB, name, f"{data['type']}_Event" if data["type"] else "", call)
    return BOTTOM
