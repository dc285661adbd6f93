"""Nodes of rclcpp and rclcpp_lifecycle: their constructors and what they say of themselves.

Source: rclcpp/include/rclcpp/node.hpp, rclcpp_lifecycle/lifecycle_node.hpp, node_options.hpp (humble to rolling).
"""

from __future__ import annotations

from functools import partial

from enclave_addons.inference.cpp.engine.launch_values import settled, text_of
from enclave_addons.inference.cpp.engine.machine import Machine
from enclave_addons.inference.cpp.engine.values import (
    BOTTOM,
    NULL,
    Atom,
    Map,
    NodeNamePart,
    Obj,
    Param,
    Seq,
    Text,
    Unknown,
    Value,
    join,
    literal,
    nodes_in,
    truth,
    unknown,
)
from enclave_addons.inference.cpp.findings import AllocatedNode
from enclave_addons.inference.cpp.libraries import (
    Call,
    library_class,
    library_function,
    library_method,
    node_class,
    node_method,
)
from enclave_addons.inference.cpp.syntax import field_of, text

OPTIONS = "rclcpp::NodeOptions"
OF_CONTAINER = "of the container"
"""The field of node options that a container gives to a component."""


def become_node(run: Machine, call: Call, *, lifecycle: bool = False) -> AllocatedNode:
    """Make the object a node: ``Node(name, options)`` or ``Node(name, namespace, options)``."""
    this = call.this
    record = run.nodes.get(this)
    if record is None:
        record = AllocatedNode(run.place(call.node, call.frame), lifecycle)
        run.nodes[this] = record
        this.node, this.is_node = record, True
    record.names = join(record.names, settled(run, call.value(0)) or unknown("a name that is not given"))
    rest = call.values[1:]
    if rest and not _is_options(rest[0]):
        record.namespaces = join(record.namespaces, settled(run, rest[0]))
        rest = rest[1:]
    for atom in (atom for value in rest for atom in value):
        if isinstance(atom, Obj) and atom.type.name == OPTIONS:
            _read_options(run, record, atom, call)
    if not (rest and rest[0] and all(_without_parameter_services(run, atom) for atom in rest[0])):
        record.parameter_services = True
    if lifecycle and len(rest) > 1 and truth(rest[1]) is False:
        record.lifecycle = False
    return record


def _without_parameter_services(run: Machine, atom: Atom) -> bool:
    """Return whether node options switch off what a node makes for its parameters (rclcpp node_parameters.cpp)."""
    names = ("start_parameter_services", "start_parameter_event_publisher")
    return (
        isinstance(atom, Obj)
        and atom.type.name == OPTIONS
        and all(truth(run.store.get((atom, name)) or BOTTOM) is False for name in names)
    )


def _is_options(value: Value) -> bool:
    return any(isinstance(atom, Obj) and atom.type.name == OPTIONS for atom in value) or any(
        not isinstance(atom, Text | Param | Obj) and "options" in str(getattr(atom, "why", "")).lower()
        for atom in value
    )


def _read_options(run: Machine, record: AllocatedNode, options: Obj, call: Call) -> None:
    for atom in run.store.get((options, "arguments")) or BOTTOM:
        if isinstance(atom, Seq) and not atom.open:
            words = tuple(_word(run, item) for item in atom.items)
            if words not in record.arguments:
                record.arguments.append(words)
            _read_parameters(run, record, words, atom, call)
        else:
            why = "remap rules given in code (NodeOptions.arguments) are not known"
            run.gap(call.node, call.frame, why, record)
    if truth(run.store.get((options, "use_global_arguments")) or BOTTOM) is False:
        record.use_global_arguments = False
    _asked_for(run, record, options, call)
    for atom in run.store.get((options, "overrides")) or BOTTOM:
        entries = [(Seq(entry),) for entry in atom.entries] if isinstance(atom, Map) else []
        for item in atom.items if isinstance(atom, Seq) else entries:
            _override(record, item)


def _read_parameters(
    run: Machine, record: AllocatedNode, words: tuple[str | None, ...], given: Seq, call: Call
) -> None:
    """Read ``-p name:=value`` and files of parameters that the code gives to the node (rcl/src/rcl/arguments.c)."""
    for flag, word, item in zip(words, words[1:], given.items[1:], strict=False):
        names = {_assigned(atom) for atom in item} if flag in ("-p", "--param") else set()
        if len(names) == 1 and None not in names:
            not_known = unknown("a parameter given in code")
            value = not_known if word is None else literal(word.partition(":=")[2])
            record.overrides[str(names.pop())] = value
        elif flag in ("--params-file", "-p", "--param"):
            why = f"parameters given in code ({flag} {word}) are not known"
            run.gap(call.node, call.frame, why, record)


def _assigned(atom: object) -> str | None:
    """Return the name in ``name:=value``, which may be known if the value is not."""
    first = atom.parts[0] if isinstance(atom, Text) and atom.parts else None
    return first.partition(":=")[0] if isinstance(first, str) and ":=" in first else None


def _asked_for(run: Machine, record: AllocatedNode, options: Obj, call: Call) -> None:
    """Note what rclcpp makes if the options request it; what is not known is a gap."""
    record.statistics = truth(run.store.get((options, "enable_topic_statistics")) or BOTTOM) is True
    for name in ("enable_topic_statistics", "enable_logger_service"):
        given = run.store.get((options, name))
        if (
            given
            and truth(given) is not False
            and not (record.statistics and name == "enable_topic_statistics")
        ):
            run.gap(call.node, call.frame, f"what {name} of node options makes is not followed", record)


def _word(run: Machine, item: Value) -> str | None:
    """Return an argument as text; names of other nodes are those of this start."""
    return text_of(run, item[0]) if len(item) == 1 else None


def _override(record: AllocatedNode, item: Value) -> None:
    for atom in item:
        pair = atom.data.get("arguments", []) if isinstance(atom, Obj) else list(getattr(atom, "items", ()))
        if len(pair) == 2:
            for name in pair[0]:
                if isinstance(name, Text) and all(isinstance(p, str) for p in name.parts):
                    record.overrides["".join(str(p) for p in name.parts)] = pair[1]


@node_class("rclcpp::Node")
def _plain_node(run: Machine, call: Call) -> None:
    become_node(run, call).of_process = _has_own_options(run, call)


@node_class("rclcpp_lifecycle::LifecycleNode")
def _lifecycle_node(run: Machine, call: Call) -> None:
    become_node(run, call, lifecycle=True).of_process = _has_own_options(run, call)


def _has_own_options(run: Machine, call: Call) -> bool:
    """Return whether a node gets no options, or options that the program made itself and not the container."""
    given = next((value for value in call.values[1:] if _is_options(value)), None)
    if given is None:
        return all(
            value and not any(isinstance(atom, Unknown) for atom in value) for value in call.values[1:]
        )
    own = (isinstance(atom, Obj) and not run.store.get((atom, OF_CONTAINER)) for atom in given)
    return all(own)


# --- what a node says of itself ---------------------------------------------------------------------------------


@node_method(
    "shared_from_this", "weak_from_this", "get_rcl_node_handle", "get_shared_rcl_node_handle",
    *(f"get_node_{part}_interface" for part in (
        "base", "topics", "services", "parameters", "timers", "graph", "clock", "logging", "waitables", "time_source",
        "type_descriptions")),
)  # fmt: skip
def _self(run: Machine, call: Call) -> Value:
    return (call.this,)


@library_class("rclcpp::node_interfaces::NodeInterfaces", "image_transport::RequiredInterfaces")
def _interfaces(run: Machine, call: Call) -> Value | None:
    """Return the node that the interfaces are of: they stand for it."""
    return tuple(node for value in call.values for node in nodes_in(value)) or None


def _says(what: str, run: Machine, call: Call) -> Value:
    return (Text((NodeNamePart(call.record, what),)),)


for _what, _name in (("name", "get_name"), ("ns", "get_namespace"), ("fqn", "get_fully_qualified_name")):
    node_method(_name)(partial(_says, _what))


@node_method("get_effective_namespace")
def _effective_namespace(run: Machine, call: Call) -> Value:
    return _says("ns", run, call)


@node_method("resolve_topic_name", "resolve_service_name", "resolve_topic_or_service_name")
def _resolved(run: Machine, call: Call) -> Value:
    """Return the final name, which launch gives to the name as written (rclcpp/node_interfaces/node_topics.cpp)."""
    return call.value(0)


def _nothing(run: Machine, call: Call) -> Value:
    run.later(call.values)
    return unknown("a value that rclcpp gives")


# Methods that make no interface: rclcpp/node.hpp, rclcpp_lifecycle/lifecycle_node.hpp. Callbacks are run.
node_method(
    "get_logger", "now", "get_clock", "create_wall_timer", "create_timer", "create_callback_group",
    "for_each_callback_group", "get_graph_event", "wait_for_graph_change", "count_publishers", "count_subscribers",
    "count_clients", "count_services", "get_publishers_info_by_topic", "get_subscriptions_info_by_topic",
    "get_topic_names_and_types", "get_node_names", "get_service_names_and_types", "get_service_names_and_types_by_node",
    "get_node_options", "add_on_set_parameters_callback", "add_pre_set_parameters_callback",
    "add_post_set_parameters_callback", "remove_on_set_parameters_callback", "remove_pre_set_parameters_callback",
    "remove_post_set_parameters_callback", "set_on_parameters_set_callback", "get_clients_info_by_service",
    "get_servers_info_by_service", "assert_liveliness", "get_callback_groups", "callback_group_in_node", "get_context",
    "get_default_callback_group", "get_notify_guard_condition", "get_associated_with_executor_atomic",
    "get_parameter_overrides", "list_parameters", "describe_parameter", "describe_parameters", "get_parameter_types",
    "undeclare_parameter", "trigger_transition", "configure", "activate", "deactivate", "cleanup", "shutdown",
    "get_current_state", "get_available_states", "get_available_transitions", "get_transition_graph",
    "register_on_configure", "register_on_activate", "register_on_deactivate", "register_on_cleanup",
    "register_on_shutdown", "register_on_error", "on_configure", "on_activate", "on_deactivate", "on_cleanup",
    "on_shutdown", "on_error", "get_fully_qualified_node_name", "add_managed_entity", "add_timer_handle",
    "add_publisher_handle", "get_node_names_and_namespaces", "use_count", "expired", "node_name", "get_state",
    "get_subnode_namespace", "get_subscription_names_and_types_by_node",
)(_nothing)  # fmt: skip


# --- options ------------------------------------------------------------------------------------------------------


@library_class(OPTIONS)
def _options(run: Machine, call: Call) -> Value | None:
    return next(((a,) for a in call.value(0) if isinstance(a, Obj) and a.type.name == OPTIONS), None)


@library_method(
    OPTIONS, "arguments", "parameter_overrides", "append_parameter_override", "use_global_arguments", "context",
    "enable_rosout", "use_intra_process_comms", "enable_topic_statistics", "start_parameter_services",
    "start_parameter_event_publisher", "clock_type", "clock_qos", "use_clock_thread", "parameter_event_qos",
    "rosout_qos", "parameter_event_publisher_options", "allow_undeclared_parameters", "enable_logger_service",
    "automatically_declare_parameters_from_overrides", "allocator", "get_rcl_node_options",
)  # fmt: skip
def _setter(run: Machine, call: Call) -> Value:
    """Get or set an option, as ``options.arguments({...})`` and kin do; return the options."""
    function = field_of(call.node, "function")
    name = text(field_of(function, "field"))
    if not call.values:
        known = run.store.get((call.this, name))
        return known or ((Seq(()),) if name == "arguments" else unknown(f"the {name} of node options"))
    if name == "append_parameter_override":
        pair = (Seq((call.value(0), call.value(1))),)
        before = run.store.get((call.this, "overrides")) or BOTTOM
        items = [item for atom in before if isinstance(atom, Seq) for item in atom.items]
        run.store.set((call.this, "overrides"), (Seq((*items, pair)),))
    else:
        key = "overrides" if name == "parameter_overrides" else name
        run.store.set((call.this, key), call.value(0))
    return (call.this,)


ARGUMENT = "an argument of the program"
"""Of what ``main`` is called with."""


@library_function("rclcpp::init", "rclcpp::init_and_remove_ros_arguments")
def _init(run: Machine, call: Call) -> Value:
    """Model rclcpp/utilities.hpp, (argc, argv, ...).

    With arguments of the program's own making those of the launch are not used; they are rules for all nodes.
    """
    for atom in call.value(1) or ((Seq(()),) if call.values else BOTTOM):
        if atom == NULL:
            run.global_arguments.append(())
        elif isinstance(atom, Seq) and not atom.open:
            run.global_arguments.append(tuple(_word(run, item) for item in atom.items))
        elif not _is_of_program(atom):
            why = "the arguments that the program gives to rclcpp::init are not known"
            run.gap(call.node, call.frame, why)
    return unknown("the arguments that are left")


def _is_of_program(atom: object) -> bool:
    return isinstance(atom, Seq) and any(
        isinstance(each, Unknown) and each.why == ARGUMENT for item in atom.items for each in item
    )
