"""Parameters: what is declared, what is read, and clients of another node's parameters.

Source: rclcpp/node.hpp, parameter_client.hpp, parameter_event_handler.hpp; nav2_util/node_utils.hpp.
"""

from __future__ import annotations

from enclave_addons.inference.cpp.engine.calls import handed_over
from enclave_addons.inference.cpp.engine.expressions import assign
from enclave_addons.inference.cpp.engine.launch_values import settled_text, text_of
from enclave_addons.inference.cpp.engine.machine import Machine, registered
from enclave_addons.inference.cpp.engine.values import (
    BOTTOM,
    Atom,
    Map,
    NodeNamePart,
    Obj,
    Param,
    Seq,
    Text,
    Unknown,
    Value,
    concatenated,
    join,
    literal,
    nodes_in,
    unknown,
)
from enclave_addons.inference.cpp.findings import AllocatedNode
from enclave_addons.inference.cpp.libraries import (
    IN_PLACE_OF_SOURCE,
    Call,
    library_class,
    library_function,
    library_method,
    node_method,
)
from enclave_addons.inference.cpp.models.interfaces import CLI, SUB, node_of, owner_in
from enclave_addons.inference.cpp.syntax import field_of, unwrapped
from nodl.builtin_interfaces import PARAMETER_SERVICES


def parameter_names(run: Machine, value: Value) -> list[str | None]:
    """Return the texts that name a parameter; those made of parameters by what the launch file, else the default,
    gives.
    """
    return [text_of(run, atom) for atom in value]


def read(run: Machine, record: AllocatedNode, name: Value, default: Value = BOTTOM) -> Value:
    """Read a parameter: its value is open until launch, with what is known of its default."""
    if len(name) > 1 and len(default) > 1:
        default = unknown("a default, of several, which go with several parameters")
    found: list[object] = []
    for filled in parameter_names(run, name):
        if filled is None:
            found.append(Unknown("a parameter whose name is not known"))
            continue
        if default:
            record.declare(filled, tuple(_with_defaults(run, atom) for atom in default))
        found += record.set_values.get(filled) or [Param(record, filled)]
    return tuple(dict.fromkeys(found))


def _with_defaults(run: Machine, atom: Atom) -> Atom:
    """Return a default that is made of other parameters as a launch makes it."""
    written = settled_text(run, atom) if isinstance(atom, Text) else None
    return atom if written is None else literal(written)[0]


@node_method("declare_parameter", "declare_or_get_parameter", "auto_declare")
def _declare(run: Machine, call: Call) -> Value:
    default = _default(call.value(1))
    if len(call.values) < 2:
        for name in parameter_names(run, call.value(0)):
            if name is not None:
                call.record.declare(name, BOTTOM)
    run.later(call.values[2:])
    return read(run, call.record, call.value(0), default)


def _default(value: Value) -> Value:
    """Return the default; None if only the type is given: ``declare_parameter("x", rclcpp::PARAMETER_STRING)``."""
    typed = any("PARAMETER_" in str(getattr(atom, "why", getattr(atom, "name", ""))) for atom in value)
    return BOTTOM if typed else value


@node_method("get_parameter_or")
def _get_or(run: Machine, call: Call) -> Value:
    """Model both forms: (name, alternative) gives the value, (name, variable, alternative) writes it."""
    if len(call.values) == 2:
        return read(run, call.record, call.value(0), call.value(1))
    return _get(run, call)


@node_method("get_parameter", "get_parameter_value")
def _get(run: Machine, call: Call) -> Value:
    found = read(run, call.record, call.value(0), call.value(2))
    if len(call.values) < 2:
        return found
    _write(run, call, found)
    return unknown("whether a parameter is set")


def _write(run: Machine, call: Call, value: Value) -> None:
    """Write the value to the second argument."""
    target = unwrapped(call.given[1]) if len(call.given) > 1 else None
    if target is not None and target.type == "pointer_expression":
        target = field_of(target, "argument")
    if target is not None:
        assign(run, target, value, call.frame)


@node_method("get_parameters", "declare_parameters")
def _several(run: Machine, call: Call) -> Value:
    items = [item for atom in call.value(0) if isinstance(atom, Seq) for item in atom.items]
    if items:
        return (Seq(tuple(read(run, call.record, item) for item in items)),)
    _write(run, call, (Map((), open=True),))
    return unknown("parameters below a prefix")


@node_method("has_parameter")
def _has(run: Machine, call: Call) -> Value:
    return unknown("the result of a parameter call")


@node_method("set_parameter", "set_parameters", "set_parameters_atomically")
def _set(run: Machine, call: Call) -> Value:
    """Note that a parameter is not known any more, since the program sets it itself."""
    stack = list(call.values)
    while stack:
        for atom in stack.pop():
            given = atom.items if isinstance(atom, Seq) else ()
            if isinstance(atom, Obj) and atom.type.name == "rclcpp::Parameter":
                given = atom.data.get("arguments", [])
            if len(given) != 2 or not all(isinstance(each, Text | Param) for each in given[0]):
                stack += given
                continue
            for name in parameter_names(run, given[0]):
                if name is not None:
                    record = call.record
                    record.declare(name, BOTTOM)
                    record.set_values[name] = unknown(f"parameter {name}, which the program sets")
    return unknown("the result of a parameter call")


@library_class("rclcpp::Parameter")
def _parameter(run: Machine, call: Call) -> None:
    call.this.data["arguments"] = call.values


@library_class("rclcpp::ParameterValue")
def _parameter_value(run: Machine, call: Call) -> Value | None:
    return call.values[0] if call.values else None


@library_function(
    "autoware_utils_rclcpp::get_or_declare_parameter", "autoware_utils::get_or_declare_parameter",
    "autoware::universe_utils::getOrDeclareParameter",
)  # fmt: skip
def _get_or_declare(run: Machine, call: Call) -> Value:
    """Model autoware_utils_rclcpp/parameter.hpp: (node, name)."""
    owner = owner_in(call.values)
    if owner is None or owner.node is None:
        return unknown("a parameter of a node that is not known")
    return read(run, owner.node, call.value(1), call.value(2))


@library_function("nav2_util::declare_parameter_if_not_declared", "nav2::declare_parameter_if_not_declared")
def _declare_if_not(run: Machine, call: Call) -> Value:
    for owner in nodes_in(call.value(0)):
        if owner.node is not None:
            read(run, owner.node, call.value(1), _default(call.value(2)))
    return BOTTOM


@registered(
    IN_PLACE_OF_SOURCE, ("nav2::declare_or_get_parameter", "nav2::LifecycleNode::declare_or_get_parameter")
)
def _declare_or_get(run: Machine, call: Call) -> Value | None:
    """Model ``(node, name, default)``, ``(logger, parameters of the node, name, default)``, and the node's method."""
    rest = call.values
    owners = [call.receiver] if call.receiver is not None else []
    while not owners and len(rest) > 1:
        owners, rest = nodes_in(rest[0]), rest[1:]
    if len(owners) != 1 or owners[0].node is None or not rest:
        return None
    given = rest[1] if len(rest) > 1 else BOTTOM
    default = tuple(
        atom for atom in given if not (isinstance(atom, Obj) and atom.type.last == "ParameterDescriptor")
    )
    record = owners[0].node
    record.declare("warn_on_missing_params", (False,))
    record.declare("strict_param_loading", (False,))
    for name in parameter_names(run, rest[0]) if not default else ():
        if name is not None:
            record.declare(name, BOTTOM)
    return read(run, record, rest[0], _default(default))


@library_function("nav2_util::get_plugin_type_param", "nav2::get_plugin_type_param")
def _plugin_type(run: Machine, call: Call) -> Value:
    """Read the parameter ``<name>.plugin`` of the node."""
    name = concatenated(call.value(1), literal(".plugin"))
    found = [read(run, owner.node, name) for owner in nodes_in(call.value(0)) if owner.node]
    return join(*found) if found else unknown("the class of a plugin")


# --- clients of parameters --------------------------------------------------------------------------------------

_CLIENTS = ("rclcpp::AsyncParametersClient", "rclcpp::SyncParametersClient")


@library_class(*_CLIENTS)
def _client(run: Machine, call: Call) -> None:
    """Model (node or its four interfaces, name of the remote node, ...): six clients below that name.

    They are below the node's own name if it is empty.
    """
    record = node_of(run, call, call.this.type.last)
    if record is None:
        return
    position = 4 if nodes_in(call.value(1)) else 1
    own = Text((NodeNamePart(record, "fqn"),))
    given = call.value(position) or (
        literal("") if position >= len(call.values) else unknown("a name that is not set")
    )
    remote = tuple(own if atom == Text(()) else atom for atom in given)
    for service, kind in PARAMETER_SERVICES.items():
        run.endpoint(record, CLI, concatenated(remote, literal(f"/{service}")), kind, call)
    call.this.data["owner"] = owner_in(call.values)


def _on_event(run: Machine, call: Call) -> Value:
    owner = owner_in(call.values) or call.this.data.get("owner")
    if owner is not None and owner.node is not None:
        kind = "rcl_interfaces/msg/ParameterEvent"
        run.endpoint(owner.node, SUB, literal("/parameter_events"), kind, call)
    others = [v for v in call.values if not nodes_in(v)]
    handed_over(run, "on_parameter_event()", others, call.node, call.frame)
    return unknown("a subscription")


def _client_method(run: Machine, call: Call) -> Value:
    handed_over(run, "a parameter client", call.values, call.node, call.frame)
    return unknown("what another node's parameters are")


library_function(*(f"{cls}::on_parameter_event" for cls in _CLIENTS))(_on_event)
for _cls in _CLIENTS:
    library_method(_cls, "on_parameter_event")(_on_event)
    library_method(_cls, "wait_for_service", "service_is_ready", "get_parameters", "get_parameter", "set_parameters",
                   "list_parameters", "describe_parameters", "has_parameter", "load_parameters", "delete_parameters",
                   "set_parameters_atomically", "get_parameter_types")(_client_method)  # fmt: skip
