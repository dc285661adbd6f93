"""What an argument of rclpy says of quality of service, where that is certain: a depth, or a profile of rmw. Pure.

An object that the program makes (``QoSProfile(...)``) may be changed before it is used, and overriding options let
parameters decide: of those nothing is said. Sources: rclpy ``qos.py`` (a number is the depth of the default profile),
rmw ``qos_profiles.h``.
"""

from __future__ import annotations

from nodl.infer.interpreter.frames import Call
from nodl.infer.values import External
from nodl.node_interface import QosPolicies


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
