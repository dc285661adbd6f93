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
from nodl.node_interface import EndpointKind, QosPolicies

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


def _keep_last(depth: int, reliability: str = "RELIABLE") -> QosPolicies:
    return (
        ("depth", depth),
        ("durability", "VOLATILE"),
        ("history", "KEEP_LAST"),
        ("reliability", reliability),
    )


_PROFILES = {
    "sensor_data": _keep_last(5, "BEST_EFFORT"),
    "services_default": _keep_last(10),
    "parameters": _keep_last(1000),
}
_BY_PATH = {
    path: quality
    for name, quality in _PROFILES.items()
    for path in (f"rclpy.qos.qos_profile_{name}", f"rclpy.qos.QoSPresetProfiles.{name.upper()}.value")
}


def known_quality(call: Call, position: int) -> QosPolicies:
    """Policies by NoDL v2's names, sorted; empty where they are not certain."""
    value = call.args.at(position, "qos_profile")
    if value is None or len(value) != 1 or call.args.at(-1, "qos_overriding_options") is not None:
        return ()
    (given,) = value
    if isinstance(given, External):
        return _BY_PATH.get(given.path, ())
    return _keep_last(given) if type(given) is int and given > 0 else ()
