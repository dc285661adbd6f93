"""What ``create_service`` and its like give back, and the quality of service that they are given."""

from __future__ import annotations

from nodl.infer.findings import NodeRecord
from nodl.infer.interpreter.frames import Call
from nodl.infer.interpreter.run import Run
from nodl.infer.models.signatures import COMMON_CALLBACKS
from nodl.infer.values import ANY, External, Instance, Value, result_of
from nodl.node_interface import EndpointKind, QosPolicies

_CLASS_OF = {
    EndpointKind.PUBLISHER: "rclpy.publisher.Publisher",
    EndpointKind.SUBSCRIPTION: "rclpy.subscription.Subscription",
    EndpointKind.SERVICE_SERVER: "rclpy.service.Service",
    EndpointKind.SERVICE_CLIENT: "rclpy.client.Client",
}
CLASSES = frozenset(_CLASS_OF.values())
NAMES = frozenset({"topic", "srv_name"})  # the name as the program gave it


def endpoint_object(run: Run, kind: EndpointKind, record: NodeRecord, names: Value, call: Call) -> Value:
    """Return the object of a publisher, subscription, service or client that ``record`` made."""
    path = _CLASS_OF[kind]
    made = run.library_object(call, path, f"{path} {id(record)}")
    run.state.store(made, "name", names)
    return (made,)


def method(run: Run, receiver: Instance, name: str, call: Call) -> Value:
    """Model a method of such an object."""
    if name == "configure_introspection":
        run.findings.gap(
            call.source, "service introspection publishes events below the service, which is not followed"
        )
    if name in COMMON_CALLBACKS:
        where = COMMON_CALLBACKS[name].argument
        run.register_callback(call.args.at(where.position, where.keyword) or ANY, None)
        return ANY
    run.escape(call.args, opened=False, objects=False)
    return result_of("rclpy")


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
    """Return policies by NoDL v2's names, sorted; empty if they are not certain."""
    value = call.args.at(position, "qos_profile")
    if value is None or len(value) != 1 or call.args.at(-1, "qos_overriding_options") is not None:
        return ()
    (given,) = value
    if isinstance(given, External):
        return _BY_PATH.get(given.path, ())
    return _keep_last(given) if type(given) is int and given > 0 else ()
