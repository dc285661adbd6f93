"""The ROS 2 Python API as tables: which call makes which endpoint, and which argument holds what.

Sources (branches humble to rolling): rclpy ``node.py``, ``lifecycle``, ``action``, ``parameter_client.py``; tf2_ros_py;
message_filters; diagnostic_updater; interactive_markers; image_transport_py. Positions count without ``self``.
"""

from __future__ import annotations

from typing import NamedTuple

from nodl.node_interface import EndpointKind

PUBLISHER = EndpointKind.PUBLISHER
SUBSCRIPTION = EndpointKind.SUBSCRIPTION
SERVER = EndpointKind.SERVICE_SERVER
CLIENT = EndpointKind.SERVICE_CLIENT
ACTION_SERVER = EndpointKind.ACTION_SERVER
ACTION_CLIENT = EndpointKind.ACTION_CLIENT


class Argument(NamedTuple):
    """Where an argument stands: position (-1: keyword only) and keyword."""

    position: int
    keyword: str


class CallbackArgument(NamedTuple):
    """An argument that is called later, with ``arity`` arguments (``None``: any number)."""

    argument: Argument
    arity: int | None


class EndpointCall(NamedTuple):
    """A call that makes one endpoint; ``node`` is ``None`` for methods of the node itself; ``qos``: position of
    ``qos_profile``, 0 where there is none."""

    kind: EndpointKind
    type: Argument
    name: Argument
    node: Argument | None = None
    callbacks: tuple[CallbackArgument, ...] = ()
    qos: int = 0


class FixedEndpoint(NamedTuple):
    """An endpoint whose name and type are fixed by the library."""

    kind: EndpointKind
    name: str
    type: str
    unless: Argument | None = None  # not made when this argument is certainly true
    below: Argument | None = None  # what this argument gives stands before the name


class Helper(NamedTuple):
    """A class or function of a library that makes endpoints with fixed names on the node it is given."""

    node: Argument
    endpoints: tuple[FixedEndpoint, ...]
    callbacks: tuple[CallbackArgument, ...] = ()


_CALLBACK = Argument(2, "callback")
_MESSAGES = Argument(0, "msg_type"), Argument(1, "topic")

NODE_ENDPOINTS: dict[str, EndpointCall] = {
    "create_publisher": EndpointCall(PUBLISHER, *_MESSAGES, qos=2),
    "create_lifecycle_publisher": EndpointCall(PUBLISHER, *_MESSAGES, qos=2),
    "create_subscription": EndpointCall(
        SUBSCRIPTION, *_MESSAGES, callbacks=(CallbackArgument(_CALLBACK, 1),), qos=3
    ),
    "create_service": EndpointCall(
        SERVER, Argument(0, "srv_type"), Argument(1, "srv_name"), callbacks=(CallbackArgument(_CALLBACK, 2),)
    ),
    "create_client": EndpointCall(CLIENT, Argument(0, "srv_type"), Argument(1, "srv_name")),
}

_NODE = Argument(0, "node")
_ACTION_TYPE, _ACTION_NAME = Argument(1, "action_type"), Argument(2, "action_name")

# Keyed by (top package, last name): ``rclpy.action.ActionClient`` and ``rclpy.action.client.ActionClient``.
ENDPOINT_CALLS: dict[tuple[str, str], EndpointCall] = {
    ("rclpy", "ActionClient"): EndpointCall(ACTION_CLIENT, _ACTION_TYPE, _ACTION_NAME, _NODE),
    ("rclpy", "ActionServer"): EndpointCall(
        ACTION_SERVER,
        _ACTION_TYPE,
        _ACTION_NAME,
        _NODE,
        callbacks=tuple(
            CallbackArgument(Argument(position, f"{name}_callback"), 1)
            for position, name in ((3, "execute"), (-1, "goal"), (-1, "handle_accepted"), (-1, "cancel"))
        ),
    ),
    ("message_filters", "Subscriber"): EndpointCall(
        SUBSCRIPTION, Argument(1, "msg_type"), Argument(2, "topic"), node=_NODE
    ),
    ("rclpy", "wait_for_message"): EndpointCall(
        SUBSCRIPTION, Argument(0, "msg_type"), Argument(2, "topic"), node=Argument(1, "node")
    ),
}

_TF = FixedEndpoint(SUBSCRIPTION, "/tf", "tf2_msgs/msg/TFMessage", unless=Argument(-1, "static_only"))
_TF_STATIC = FixedEndpoint(SUBSCRIPTION, "/tf_static", "tf2_msgs/msg/TFMessage")

HELPERS: dict[tuple[str, str], Helper] = {
    ("tf2_ros", "TransformListener"): Helper(Argument(1, "node"), (_TF, _TF_STATIC)),
    ("tf2_ros", "TransformBroadcaster"): Helper(
        _NODE, (FixedEndpoint(PUBLISHER, "/tf", "tf2_msgs/msg/TFMessage"),)
    ),
    ("tf2_ros", "StaticTransformBroadcaster"): Helper(
        _NODE, (FixedEndpoint(PUBLISHER, "/tf_static", "tf2_msgs/msg/TFMessage"),)
    ),
    ("tf2_ros", "Buffer"): Helper(
        Argument(1, "node"), (FixedEndpoint(SERVER, "tf2_frames", "tf2_msgs/srv/FrameGraph"),)
    ),
    ("diagnostic_updater", "Updater"): Helper(
        _NODE, (FixedEndpoint(PUBLISHER, "/diagnostics", "diagnostic_msgs/msg/DiagnosticArray"),)
    ),
    ("interactive_markers", "InteractiveMarkerServer"): Helper(
        _NODE,
        tuple(
            FixedEndpoint(kind, name, f"visualization_msgs/{type_name}", below=Argument(1, "namespace"))
            for kind, name, type_name in (
                (SERVER, "/get_interactive_markers", "srv/GetInteractiveMarkers"),
                (PUBLISHER, "/update", "msg/InteractiveMarkerUpdate"),
                (SUBSCRIPTION, "/feedback", "msg/InteractiveMarkerFeedback"),
            )
        ),
    ),
    ("rclpy", "ParameterEventHandler"): Helper(
        _NODE, (FixedEndpoint(SUBSCRIPTION, "/parameter_events", "rcl_interfaces/msg/ParameterEvent"),)
    ),
}

# Node methods that only take callbacks.
NODE_CALLBACKS: dict[str, CallbackArgument] = {
    "create_timer": CallbackArgument(Argument(1, "callback"), 0),
    "create_guard_condition": CallbackArgument(Argument(0, "callback"), 0),
    **{
        f"{before}set_parameters_callback": CallbackArgument(Argument(0, "callback"), 1)
        for before in ("add_on_", "add_pre_", "add_post_", "")
    },
    "add_waitable": CallbackArgument(Argument(0, "waitable"), None),
}

# Methods of objects whose class is not known that take a callback.
COMMON_CALLBACKS: dict[str, CallbackArgument] = {
    "add_done_callback": CallbackArgument(Argument(0, "callback"), 1),
    "send_goal_async": CallbackArgument(Argument(1, "feedback_callback"), 1),
}

# Transitions that a lifecycle node's class overrides (rclpy/lifecycle/node.py).
LIFECYCLE_HOOKS = frozenset(
    {"on_configure", "on_activate", "on_deactivate", "on_cleanup", "on_shutdown", "on_error"}
)
