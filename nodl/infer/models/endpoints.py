"""What ``create_service`` and its like give back: objects that know their name and may be asked for more.

Source: rclpy ``service.py``, ``client.py`` (iron and later): ``configure_introspection`` makes a publisher beside the
service, below its name.
"""

from __future__ import annotations

from nodl.infer.findings import NodeRecord
from nodl.infer.interpreter.frames import Call
from nodl.infer.interpreter.run import Run
from nodl.infer.models.signatures import COMMON_CALLBACKS
from nodl.infer.text import Text, concatenate
from nodl.infer.values import ANY, NONE, External, Instance, Unknown, Value, join, result_of
from nodl.node_interface import EndpointKind

_CLASS_OF = {
    EndpointKind.PUBLISHER: "rclpy.publisher.Publisher",
    EndpointKind.SUBSCRIPTION: "rclpy.subscription.Subscription",
    EndpointKind.SERVICE_SERVER: "rclpy.service.Service",
    EndpointKind.SERVICE_CLIENT: "rclpy.client.Client",
}
CLASSES = frozenset(_CLASS_OF.values())
NAMES = frozenset({"topic", "srv_name"})  # the name as the program gave it
EVENT = "/_service_event"


def endpoint_object(
    run: Run, kind: EndpointKind, record: NodeRecord, names: Value, types: list[str], call: Call
) -> Value:
    """The object of a publisher, subscription, service or client that ``record`` made."""
    path = _CLASS_OF[kind]
    made = run.library_object(call, path, f"{path} {id(record)}")
    made.cells["record"] = (record,)
    run.state.store(made, "name", names)
    run.state.store(made, "types", join(made.cells.get("types", ()), tuple(types)))
    return (made,)


def method(run: Run, receiver: Instance, name: str, call: Call) -> Value:
    """A method of such an object."""
    if name == "configure_introspection":
        _introspect(receiver, call)
        return NONE
    if name in COMMON_CALLBACKS:
        where = COMMON_CALLBACKS[name].argument
        run.register_callback(call.args.at(where.position, where.keyword) or ANY, None)
        return ANY
    run.escape(call.args, opened=False, objects=False)
    return result_of("rclpy")


def _introspect(receiver: Instance, call: Call) -> None:
    states = call.args.at(2, "introspection_state") or ANY
    if all(isinstance(state, External) and state.path.endswith(".OFF") for state in states):
        return
    record = receiver.cells["record"][0]
    assert isinstance(record, NodeRecord)
    types = [
        f"{name}_Event" if name else "" for name in receiver.cells.get("types", ()) if isinstance(name, str)
    ]
    for name in receiver.cells.get("name", ANY):
        if isinstance(name, str | Text | Unknown):
            full = concatenate(name, EVENT) if isinstance(name, str | Text) else name
            for event_type in types or [""]:
                record.add_endpoint(EndpointKind.PUBLISHER, full, event_type, call.source)
