"""Parameters: what is declared, what is read, and clients of another node's parameters.

Source: rclcpp/node.hpp, parameter_client.hpp, parameter_event_handler.hpp; nav2_util/node_utils.hpp.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from nodl.builtin_interfaces import PARAMETER_SERVICES
from nodl.infer.cpp.libraries import Call, library_class, library_function, library_method, node_method
from nodl.infer.cpp.running.assignments import assign
from nodl.infer.cpp.running.contents import handed_over, nodes_in
from nodl.infer.cpp.running.frames import Frame
from nodl.infer.cpp.running.launch_values import text_of
from nodl.infer.cpp.running.machine import Machine
from nodl.infer.cpp.running.values import (
    BOTTOM,
    Map,
    NodePart,
    Obj,
    Param,
    Seq,
    Text,
    Unknown,
    Value,
    concatenated,
    join,
    literal,
    unknown,
)
from nodl.infer.cpp.syntax import text, unwrapped
from nodl.node_interface import EndpointKind

if TYPE_CHECKING:
    from tree_sitter import Node

    from nodl.infer.cpp.findings import NodeRecord

_TYPES = frozenset({"ParameterType", "PARAMETER_STRING", "PARAMETER_STRING_ARRAY"})


def parameter_names(run: Machine, value: Value) -> list[str | None]:
    """The texts that name a parameter; those made of parameters by what the launch file, else the default, gives."""
    return [text_of(run, atom) for atom in value]


def read(run: Machine, record: NodeRecord, name: Value, default: Value = BOTTOM) -> Value:
    """The value of a parameter: open until launch, with what is known of its default."""
    found: list[object] = []
    for filled in parameter_names(run, name):
        if filled is None:
            found.append(Unknown("a parameter whose name is not known"))
            continue
        if default:
            record.declare(filled, default)
        found.append(Param(record, filled))
    return tuple(dict.fromkeys(found))


def _record(call: Call) -> NodeRecord:
    assert call.receiver is not None and call.receiver.node is not None
    return call.receiver.node


@node_method("declare_parameter", "declare_or_get_parameter")
def _declare(run: Machine, call: Call) -> Value:
    default = call.value(1)
    if default and _is_type_only(default):
        default = BOTTOM
    if not default and len(call.values) < 2:
        for name in parameter_names(run, call.value(0)):
            if name is not None:
                _record(call).declare(name, BOTTOM)
    for value in call.values[2:]:
        for atom in value:
            run.later(atom, call.frame)
    return read(run, _record(call), call.value(0), default)


def _is_type_only(value: Value) -> bool:
    """``declare_parameter("x", rclcpp::PARAMETER_STRING)``."""
    return any("PARAMETER_" in str(getattr(atom, "why", getattr(atom, "name", ""))) for atom in value)


@node_method(
    "get_parameter", "get_parameter_or", "get_parameters", "get_parameter_value", "declare_parameters"
)
def _get(run: Machine, call: Call) -> Value:
    method = text(call.node.child_by_field_name("function"))
    if "get_parameters" in method or "declare_parameters" in method:
        return _several(run, call)
    if len(call.values) >= 2:
        default = call.value(2)
        found = read(run, _record(call), call.value(0), default)
        _write(run, call, 1, found)
        return unknown("whether a parameter is set")
    return read(run, _record(call), call.value(0))


def _write(run: Machine, call: Call, position: int, value: Value) -> None:
    if position >= len(call.given):
        return
    target = unwrapped(call.given[position])
    if target is not None and target.type == "pointer_expression":
        target = target.child_by_field_name("argument")
    if target is not None:
        assign(run, target, value, call.frame)


def _several(run: Machine, call: Call) -> Value:
    items = [item for atom in call.value(0) if isinstance(atom, Seq) for item in atom.items]
    if items:
        return (Seq(tuple(read(run, _record(call), item) for item in items)),)
    if len(call.given) > 1:
        _write(run, call, 1, (Map((), open=True),))
    return unknown("parameters below a prefix")


@node_method("has_parameter", "set_parameter", "set_parameters", "set_parameters_atomically")
def _others(run: Machine, call: Call) -> Value:
    if "has_parameter" not in text(call.node.child_by_field_name("function")):
        _set(run, call)
    return unknown("the result of a parameter call")


def _set(run: Machine, call: Call) -> None:
    """The program sets a parameter itself: one more value that it may have."""
    stack = list(call.values)
    while stack:
        for atom in stack.pop():
            if isinstance(atom, Seq):
                stack += atom.items
            elif isinstance(atom, Obj) and atom.type.name == "rclcpp::Parameter":
                given = atom.data.get("arguments", [])
                for name in parameter_names(run, given[0]) if len(given) > 1 else []:
                    if name is not None:
                        _record(call).declare(name, given[1])


@library_class("rclcpp::Parameter")
def _parameter(run: Machine, this: Obj, arguments: list[Value], node: Node, frame: Frame) -> Value | None:
    this.data["arguments"] = arguments
    return None


@library_class("rclcpp::ParameterValue")
def _parameter_value(
    run: Machine, this: Obj, arguments: list[Value], node: Node, frame: Frame
) -> Value | None:
    return arguments[0] if arguments else None


@library_function("nav2_util::declare_parameter_if_not_declared", "nav2::declare_parameter_if_not_declared")
def _declare_if_not(run: Machine, call: Call) -> Value:
    for owner in nodes_in(run, call.value(0)):
        if owner.node is not None:
            default = BOTTOM if _is_type_only(call.value(2)) else call.value(2)
            read(run, owner.node, call.value(1), default)
    return BOTTOM


@library_function("nav2_util::get_plugin_type_param", "nav2::get_plugin_type_param")
def _plugin_type(run: Machine, call: Call) -> Value:
    """The parameter ``<name>.plugin`` of the node."""
    found = [
        read(run, owner.node, concatenated(call.value(1), literal(".plugin")))
        for owner in nodes_in(run, call.value(0))
        if owner.node
    ]
    return join(*found) if found else unknown("the class of a plugin")


# --- clients of parameters --------------------------------------------------------------------------------------


@library_class("rclcpp::AsyncParametersClient", "rclcpp::SyncParametersClient")
def _client(run: Machine, this: Obj, arguments: list[Value], node: Node, frame: Frame) -> Value | None:
    """Six clients below the name of the remote node; without one, of the node itself."""
    owners = [obj for value in arguments for obj in nodes_in(run, value)]
    texts = [value for value in arguments if any(isinstance(atom, Text | Param) for atom in value)]
    unclear = [v for v in arguments if v and not nodes_in(run, v) and all(isinstance(a, Unknown) for a in v)]
    if not owners or owners[0].node is None:
        run.gap(node, frame, f"the node of this {this.type.last} is not known")
        return None
    record = owners[0].node
    remote = texts[0] if texts else (Text((NodePart(record, "fqn"),)),)
    if not texts and any("name" in a.why or "node" in a.why for v in unclear for a in v):
        remote = unclear[0]
    for service, kind in PARAMETER_SERVICES.items():
        run.endpoint(
            record,
            EndpointKind.SERVICE_CLIENT,
            concatenated(remote, literal(f"/{service}")),
            kind,
            node,
            frame,
        )
    this.data["owner"] = owners[0]
    return None


@library_method("rclcpp::AsyncParametersClient", "on_parameter_event")
@library_method("rclcpp::SyncParametersClient", "on_parameter_event")
def _on_event(run: Machine, call: Call) -> Value:
    owner = call.receiver.data.get("owner") if call.receiver is not None else None
    given = [obj for value in call.values for obj in nodes_in(run, value)]
    for each in given[:1] or ([owner] if owner is not None else []):
        if each.node is None:
            continue
        run.endpoint(
            each.node,
            EndpointKind.SUBSCRIPTION,
            literal("/parameter_events"),
            "rcl_interfaces/msg/ParameterEvent",
            call.node,
            call.frame,
        )
    handed_over(
        run, "on_parameter_event()", [v for v in call.values if not nodes_in(run, v)], call.node, call.frame
    )
    return unknown("a subscription")


def _client_method(run: Machine, call: Call) -> Value:
    handed_over(run, "a parameter client", call.values, call.node, call.frame)
    return unknown("what another node's parameters are")


for _cls in ("rclcpp::AsyncParametersClient", "rclcpp::SyncParametersClient"):
    library_method(_cls, "wait_for_service", "service_is_ready", "get_parameters", "get_parameter", "set_parameters",
                   "list_parameters", "describe_parameters", "has_parameter", "load_parameters", "delete_parameters",
                   "set_parameters_atomically", "get_parameter_types")(_client_method)  # fmt: skip
