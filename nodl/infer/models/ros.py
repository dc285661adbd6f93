"""rclpy and its companions at work: calls of the tables in ``signatures`` become findings."""

from __future__ import annotations

import functools
from collections.abc import Callable

from nodl.infer.findings import FoundEndpoint, NodeRecord
from nodl.infer.interpreter.conditions import truth
from nodl.infer.interpreter.frames import Call
from nodl.infer.interpreter.iterate import elements
from nodl.infer.interpreter.operators import as_texts, text_value
from nodl.infer.interpreter.run import Run
from nodl.infer.models.endpoints import endpoint_object
from nodl.infer.models.library_nodes import library_node
from nodl.infer.models.ros_arguments import ros_arguments
from nodl.infer.models.signatures import (
    ENDPOINT_CALLS,
    HELPERS,
    NODE_CALLBACKS,
    NODE_ENDPOINTS,
    PARAMETER_SERVICES,
    Argument,
    EndpointCall,
    FixedEndpoint,
    Helper,
)
from nodl.infer.text import Input, NodePart, Text, concatenate, make_text, with_edit
from nodl.infer.values import (
    ABSENT,
    ANY,
    BOTTOM,
    NONE,
    OTHER,
    OTHER_KEYS,
    RESULT,
    Dictionary,
    External,
    Instance,
    Items,
    Key,
    Unknown,
    Value,
    constant_strings,
    external,
    join,
    present,
    unknown,
)
from nodl.node_interface import EndpointKind

NODE_CLASS = "rclpy.node.Node"
LOGGER_SERVICES = {  # rclpy/logging_service.py
    "~/get_logger_levels": "rcl_interfaces/srv/GetLoggerLevels",
    "~/set_logger_levels": "rcl_interfaces/srv/SetLoggerLevels",
}
LIFECYCLE_CLASS = "rclpy.lifecycle.Node"
PARAMETER_CLASS = "rclpy.parameter.Parameter"
_INTERFACE_FOLDERS = ("msg", "srv", "action")

NodeMethod = Callable[[Run, NodeRecord, Call], Value]


def argument(call: Call, where: Argument) -> Value | None:
    return call.args.at(where.position, where.keyword)


# --- nodes --------------------------------------------------------------------------------------------------


def is_lifecycle(path: str) -> bool:
    return ".lifecycle" in path or path.endswith("LifecycleNode")


def initialise_node(run: Run, instance: Instance, path: str, call: Call) -> None:
    """``Node.__init__``: the instance becomes a node."""
    record = record_of_instance(run, instance, call)
    run.understood.add(call.node)
    record.created = True
    record.source = call.source
    library = library_node(path)
    default: Value = (library.name,) if library else unknown("a node without a name")
    record.names = join(record.names, call.args.at(0, "node_name") or default)
    namespace = call.args.at(1 if library else -1, "namespace")
    for fixed in library.endpoints if library else ():
        record.add_endpoint(FoundEndpoint(fixed.kind, fixed.name, fixed.type, call.source))
    record.namespaces = join(record.namespaces, namespace or NONE)
    record.lifecycle = record.lifecycle or is_lifecycle(path)
    local = call.args.at(-1, "cli_args")
    record.arguments = join(record.arguments, _strings_in(run, local, call) if local else BOTTOM)
    use_global = call.args.at(-1, "use_global_arguments")
    if use_global is not None:
        record.use_global_arguments = use_global
    if record.lifecycle:
        enabled = call.args.at(-1, "enable_communication_interface")
        record.communication_interface = enabled is None or truth(enabled) is not False
    overrides = call.args.at(-1, "parameter_overrides")
    given = (
        record.arguments if use_global == (False,) else join(record.arguments, run.findings.global_arguments)
    )
    _override_parameters(run, record, given)
    if overrides:
        _assign_parameters(run, record, overrides, call)
    if truth(call.args.at(-1, "enable_logger_service") or (False,)) is not False:
        for service, service_type in LOGGER_SERVICES.items():
            record.add_endpoint(
                FoundEndpoint(EndpointKind.SERVICE_SERVER, service, service_type, call.source)
            )


def _override_parameters(run: Run, record: NodeRecord, arguments: Value) -> None:
    """``-p name:=value`` among the arguments that the program gives itself: stronger than what launch sets."""
    for words in arguments:
        if not isinstance(words, tuple):
            continue
        given = ros_arguments(words)
        names = [rule.removeprefix("__node:=") for rule in given.rules if rule.startswith("__node:=")]
        for parameter in given.parameters:
            meant = parameter.node.rpartition("/")[2]
            if parameter.node in ("", "/**"):
                run.state.write(record.cells, parameter.name, _yaml_value(parameter.value))
            elif not names or meant == names[0] or "*" in meant:  # launch decides on the namespace at least
                why = f"the parameter {parameter.name} is given in code to a node called {parameter.node}"
                record.gaps.setdefault((record.source, why))
        if given.files:
            record.gaps.setdefault((record.source, "a parameter file is named in code"))


def _yaml_value(text: str) -> Value:
    import yaml

    if text in ("y", "Y", "n", "N"):
        return ANY  # rcl takes them for truth values, YAML 1.2 and PyYAML for texts
    try:
        value = yaml.safe_load(text)
    except yaml.YAMLError:
        return ANY
    return (value,) if isinstance(value, str | int | float | bool) else ANY


def _strings_in(run: Run, value: Value, call: Call) -> Value:
    """A list of command line arguments as one atom per known list (a tuple of texts), else unknown."""
    items = elements(run, tuple(atom for atom in value if atom is not None), call.node, call.frame)
    if all(atom is None for atom in value):
        return BOTTOM
    if items.exact is None:
        return unknown("arguments made at run time")
    words = [constant_strings(element) for element in items.exact]
    if any(len(word) != 1 for word in words):
        return unknown("arguments made at run time")
    return (tuple(word[0] for word in words),)


def record_of_instance(run: Run, instance: Instance, call: Call) -> NodeRecord:
    if instance.node is None:
        instance.node = run.findings.add_node(NodeRecord(call.source))
        instance.node.class_key = instance.cls
    return instance.node


def create_node(run: Run, path: str, call: Call) -> Value:
    """``rclpy.create_node(...)`` or ``Node(...)`` used as it is."""
    instance = run.allocate(
        call.node, "node", lambda: Instance(External(path), (call.source.file, call.source.line))
    )
    assert isinstance(instance, Instance)
    initialise_node(run, instance, path, call)
    return (instance,)


def records_of(run: Run, value: Value | None, call: Call) -> list[NodeRecord]:
    """The nodes that ``value`` may be; what is not a known node becomes a gap."""
    records: list[NodeRecord] = []
    for atom in value or ANY:
        if isinstance(atom, Instance):
            records.append(record_of_instance(run, atom, call))
        elif isinstance(atom, Unknown | External):
            why = atom.why if isinstance(atom, Unknown) else f"a result of {atom.path.removesuffix(RESULT)}"
            run.findings.gap(call.source, f"the node of this endpoint is not known: {why}")
            records.append(run.findings.unknown_node(call.source))
    return records


# --- endpoints ----------------------------------------------------------------------------------------------


def add_endpoints(run: Run, made: EndpointCall, records: list[NodeRecord], call: Call) -> None:
    names = argument(call, made.name) or unknown("a name that is not given")
    types = argument(call, made.type) or ANY
    run.understood.add(call.node)
    for record in records:
        for name in names_of(names):
            for interface_type in types_of(types):
                endpoint = FoundEndpoint(made.kind, name, interface_type, call.source)
                record.add_endpoint(endpoint)
    for callback in made.callbacks:
        value = argument(call, callback.argument)
        if value:
            run.register_callback(value, callback.arity)


def names_of(value: Value) -> list[object]:
    """The names that ``value`` may be: texts and unknowns; other values are errors in the program."""
    names: list[object] = []
    for atom in value:
        if isinstance(atom, str | Text | Unknown):
            names.append(atom)
        elif isinstance(atom, Instance) and "_value_" in atom.cells:
            names.extend(as_texts((atom,)))
        elif atom is not None and not isinstance(atom, int | float):
            names.append(unknown("a name that is made by an object")[0])
    return names or [unknown("the name is never set to a text")[0]]


def types_of(value: Value) -> list[str]:
    """ROS names of interface types; the empty string when a type is not known."""
    types = list(dict.fromkeys(interface_type(atom.path) for atom in value if isinstance(atom, External)))
    known = [name for name in types if name]
    return known or [""]


@functools.lru_cache(maxsize=4096)
def interface_type(path: str) -> str:
    """``std_msgs.msg.String`` or ``std_msgs.msg._string.String`` -> ``std_msgs/msg/String``."""
    steps = path.split(".")
    if len(steps) >= 3 and steps[1] in _INTERFACE_FOLDERS:
        return f"{steps[0]}/{steps[1]}/{steps[-1]}"
    return ""


def _helper(run: Run, helper: Helper, call: Call) -> None:
    node = argument(call, helper.node)
    run.understood.add(call.node)
    if node is None or node == NONE:
        return  # tf2_ros.Buffer without a node makes nothing
    for record in records_of(run, node, call):
        for fixed in helper.endpoints:
            if fixed.unless is not None:
                switch = argument(call, fixed.unless)
                if switch is not None and truth(switch) is True:
                    continue
            for name in _fixed_names(fixed, call):
                record.add_endpoint(FoundEndpoint(fixed.kind, name, fixed.type, call.source))


def _fixed_names(fixed: FixedEndpoint, call: Call) -> Value:
    if fixed.below is None:
        return (fixed.name,)
    above = argument(call, fixed.below) or unknown("a namespace that is not given")
    return text_value(concatenate(text, fixed.name) for text in as_texts(above))


# --- methods of a node --------------------------------------------------------------------------------------


def _endpoint_method(name: str) -> NodeMethod:
    def method(run: Run, record: NodeRecord, call: Call) -> Value:
        made = NODE_ENDPOINTS[name]
        add_endpoints(run, made, [record], call)
        names = argument(call, made.name) or ANY
        return endpoint_object(
            run, made.kind, record, names, types_of(argument(call, made.type) or ANY), call
        )

    return method


def _callback_method(name: str) -> NodeMethod:
    def method(run: Run, record: NodeRecord, call: Call) -> Value:
        callback = NODE_CALLBACKS[name]
        value = argument(call, callback.argument)
        if value:
            run.register_callback(value, callback.arity)
        return external(f"rclpy.{name}()")

    return method


def _own_name(what: str) -> NodeMethod:
    return lambda run, record, call: (make_text((NodePart(what),)),)


def _resolved_name(run: Run, record: NodeRecord, call: Call) -> Value:
    return call.args.at(0) or ANY  # expanding and remapping a resolved name again changes nothing


def parameter_object(run: Run, call: Call, value: Value, key: str = "parameter") -> Value:
    instance = run.allocate(
        call.node, key, lambda: Instance(External(PARAMETER_CLASS), (call.source.file, call.source.line))
    )
    run.state.store(instance, "value", value)
    return (instance,)


def _names_or_gap(run: Run, call: Call, position: int = 0) -> list[str]:
    value = call.args.at(position, "name") or ANY
    return constant_strings(value)


def _declare_parameter(run: Run, record: NodeRecord, call: Call) -> Value:
    default = call.args.at(1, "value")
    names = _names_or_gap(run, call)
    for name in names:
        record.declare(name, _default_value(default))
    return parameter_object(run, call, _inputs(run, record, names))


def _default_value(default: Value | None) -> Value:
    """A declared default; a parameter type or ``None`` declares none."""
    if default is None or all(atom is None or isinstance(atom, External) for atom in default):
        return BOTTOM
    return tuple(atom for atom in default if atom is not None)


def _inputs(run: Run, record: NodeRecord, names: list[str]) -> Value:
    """The values of parameters: what the program set them to, else what launch and the defaults say."""
    if not names:
        return unknown("a parameter whose name is not known")
    result: Value = BOTTOM
    for name in names:
        held = record.cells.get(name, ABSENT)
        result = join(result, present(held))
        if ABSENT[0] in held:
            result = join(result, (make_text((Input(name, record),)),))
    return result


def _declare_parameters(run: Run, record: NodeRecord, call: Call) -> Value:
    prefixes = constant_strings(call.args.at(0, "namespace") or ANY) or [""]
    listed = call.args.at(1, "parameters") or ANY
    found: Value = BOTTOM
    for entry in _each(run, listed, call):
        parts = elements(run, entry, call.node, call.frame)
        if parts.exact is None or not parts.exact:
            run.findings.gap(call.source, "the list of declared parameters is not known")
            continue
        default = parts.exact[1] if len(parts.exact) > 1 else None
        for name in constant_strings(parts.exact[0]):
            for prefix in prefixes:
                full = f"{prefix}.{name}" if prefix else name
                record.declare(full, _default_value(default))
                found = join(found, parameter_object(run, call, _inputs(run, record, [full]), full))
    return run.sequence(call.node, "list", Items(None, found or ANY))


def _each(run: Run, value: Value, call: Call) -> list[Value]:
    items = elements(run, value, call.node, call.frame)
    return list(items.exact) if items.exact is not None else [items.any_element()]


def _get_parameter(run: Run, record: NodeRecord, call: Call) -> Value:
    return parameter_object(run, call, _inputs(run, record, _names_or_gap(run, call)))


def _get_parameters(run: Run, record: NodeRecord, call: Call) -> Value:
    names = _each(run, call.args.at(0, "names") or ANY, call)
    found = tuple(
        parameter_object(run, call, _inputs(run, record, constant_strings(name)), f"parameter {index}")
        for index, name in enumerate(names)
    )
    return run.sequence(call.node, "list", Items(found))


def _get_parameters_by_prefix(run: Run, record: NodeRecord, call: Call) -> Value:
    """A dictionary of the parameters below a prefix, under the rest of their names."""
    found = run.allocate(call.node, "by prefix", Dictionary)
    assert isinstance(found, Dictionary)
    for prefix in constant_strings(call.args.at(0, "prefix") or ANY):
        start = f"{prefix}." if prefix else ""
        everything = Input(f"{start}**", record)
        value = parameter_object(run, call, (make_text((everything,)),), f"below {prefix}")
        keys: Value = (with_edit(everything, "key", (start,)),)
        run.state.store(found, OTHER, join(found.cells.get(OTHER, BOTTOM), value))
        run.state.store(found, OTHER_KEYS, join(found.cells.get(OTHER_KEYS, BOTTOM), keys))
        for name in record.parameters:
            if name.startswith(start):
                held = parameter_object(run, call, _inputs(run, record, [name]), name)
                run.state.store(found, Key(name.removeprefix(start)), held)
    return (found,) if OTHER in found.cells else unknown("parameters below a prefix that is not known")


def _get_parameter_or(run: Run, record: NodeRecord, call: Call) -> Value:
    names = _names_or_gap(run, call)
    other = call.args.at(1, "alternative_value") or BOTTOM
    default: Value = BOTTOM
    for atom in other:
        if isinstance(atom, Instance):
            default = join(default, atom.cells.get("value", BOTTOM))
    for name in names:
        record.declare(name, _default_value(default or None))
    return parameter_object(run, call, _inputs(run, record, names))


def _set_parameters(run: Run, record: NodeRecord, call: Call) -> Value:
    _assign_parameters(run, record, call.args.at(0, "parameter_list") or ANY, call)
    return ANY


def _assign_parameters(run: Run, record: NodeRecord, listed: Value, call: Call) -> None:
    for entry in _each(run, listed, call):
        for atom in entry:
            if isinstance(atom, Instance):
                for name in constant_strings(atom.cells.get("name", BOTTOM)):
                    value = atom.cells.get("value", ANY)
                    record.assigned[name] = join(record.assigned.get(name, BOTTOM), value)
                    run.state.write(record.cells, name, value)
            elif isinstance(atom, Unknown):
                run.findings.gap(call.source, f"parameters set in code are not known: {atom.why}")


def _set_parameter(run: Run, record: NodeRecord, call: Call) -> Value:
    run.findings.gap(call.source, "parameters are set by a method that is not modelled")
    return ANY


def _wait_until_active(run: Run, record: NodeRecord, call: Call) -> Value:
    """``BasicNavigator.waitUntilNav2Active(navigator, localizer)`` asks both for their lifecycle state."""
    for index, (keyword, default) in enumerate((("navigator", "bt_navigator"), ("localizer", "amcl"))):
        for name in as_texts(call.args.at(index, keyword) or (default,)):
            service = concatenate(name, "/get_state")
            record.add_endpoint(
                FoundEndpoint(
                    EndpointKind.SERVICE_CLIENT, service, "lifecycle_msgs/srv/GetState", call.source
                )
            )
    return NONE


def _manage_lifecycle(run: Run, record: NodeRecord, call: Call) -> Value:
    """``BasicNavigator`` calls every lifecycle manager that it finds while it runs."""
    name = unknown("the services of lifecycle managers that are found at run time")[0]
    service_type = "nav2_msgs/srv/ManageLifecycleNodes"
    record.add_endpoint(FoundEndpoint(EndpointKind.SERVICE_CLIENT, name, service_type, call.source))
    return NONE


NODE_METHODS: dict[str, NodeMethod] = {
    **{name: _endpoint_method(name) for name in NODE_ENDPOINTS},
    **{name: _callback_method(name) for name in NODE_CALLBACKS},
    "declare_parameter": _declare_parameter,
    "declare_parameters": _declare_parameters,
    "get_parameter": _get_parameter,
    "get_parameters": _get_parameters,
    "get_parameter_or": _get_parameter_or,
    "get_parameters_by_prefix": _get_parameters_by_prefix,
    "waitUntilNav2Active": _wait_until_active,
    "lifecycleStartup": _manage_lifecycle,
    "lifecycleShutdown": _manage_lifecycle,
    "set_parameters": _set_parameters,
    "set_parameters_atomically": _set_parameters,
    "get_name": _own_name("name"),
    "get_namespace": _own_name("namespace"),
    "get_fully_qualified_name": _own_name("fqn"),
    "resolve_topic_name": _resolved_name,
    "resolve_service_name": _resolved_name,
}


# --- functions and classes of the libraries ---------------------------------------------------------------


def call_library(run: Run, path: str, call: Call) -> Value | None:
    """``path(...)`` for what the tables know; ``None`` for the rest."""
    key = _table_key(path)
    made = ENDPOINT_CALLS.get(key)
    if made is not None:
        assert made.node is not None
        add_endpoints(run, made, records_of(run, argument(call, made.node), call), call)
        return instance_of(run, path, call)
    helper = HELPERS.get(key)
    if helper is not None:
        _helper(run, helper, call)
        return instance_of(run, path, call)
    function = _FUNCTIONS.get(key)
    if function:
        run.understood.add(call.node)
    return function(run, path, call) if function else None


@functools.lru_cache(maxsize=4096)
def _table_key(path: str) -> tuple[str, str]:
    """The top package and the last name of ``path``, under which tables of libraries know it."""
    return path.partition(".")[0], path.rpartition(".")[2]


def makes_interfaces(path: str) -> bool:
    """Whether a call of this library function or class is among those that make nodes or interfaces."""
    key = _table_key(path)
    return key in ENDPOINT_CALLS or key in HELPERS or key in _MAKING


def instance_of(run: Run, path: str, call: Call) -> Value:
    site = (call.source.file, call.source.line)
    return (run.allocate(call.node, "library", lambda: Instance(External(path), site)),)


def _init(run: Run, path: str, call: Call) -> Value:
    given = call.args.at(0, "args")
    if given is not None:
        known = tuple(atom for atom in given if not isinstance(atom, Unknown | External | Text))
        if known and len(known) == len(given):
            words = _strings_in(run, known, call)
            run.findings.global_arguments = join(run.findings.global_arguments, words)
    return ANY


def _parameter(run: Run, path: str, call: Call) -> Value:
    found = parameter_object(run, call, call.args.at(2, "value") or NONE)
    instance = found[0]
    assert isinstance(instance, Instance)
    run.state.store(instance, "name", call.args.at(0, "name") or ANY)
    return found


def _parameter_client(run: Run, path: str, call: Call) -> Value:
    remote = call.args.at(1, "remote_node_name") or ANY
    for record in records_of(run, call.args.at(0, "node"), call):
        for service, interface in PARAMETER_SERVICES.items():
            for text in text_value(concatenate(name, f"/{service}") for name in as_texts(remote)):
                endpoint = FoundEndpoint(EndpointKind.SERVICE_CLIENT, text, interface, call.source)
                record.add_endpoint(endpoint)
    return instance_of(run, path, call)


def _interface_by_name(run: Run, path: str, call: Call) -> Value:
    """``rosidl_runtime_py.utilities.get_message('std_msgs/msg/String')``."""
    found: Value = BOTTOM
    for name in constant_strings(call.args.at(0) or ANY):
        found = join(found, external(name.replace("/", ".")))
    return found or ANY


def _image_transport(run: Run, path: str, call: Call) -> Value:
    """``ImageTransport(node_name, ...)`` of image_transport_py makes a node of its own."""
    return create_node(run, "image_transport_py.ImageTransport", call)


def _buffer_client(run: Run, path: str, call: Call) -> Value:
    names = call.args.at(1, "ns") or ANY
    for record in records_of(run, call.args.at(0, "node"), call):
        for name in names_of(names):
            record.add_endpoint(
                FoundEndpoint(
                    EndpointKind.ACTION_CLIENT, name, "tf2_msgs/action/LookupTransform", call.source
                )
            )
    return instance_of(run, path, call)


def _node_class(run: Run, path: str, call: Call) -> Value:
    return create_node(run, LIFECYCLE_CLASS if is_lifecycle(path) else NODE_CLASS, call)


_FUNCTIONS: dict[tuple[str, str], Callable[[Run, str, Call], Value]] = {
    ("rclpy", "create_node"): _node_class,
    ("rclpy", "Node"): _node_class,
    ("rclpy", "LifecycleNode"): _node_class,
    ("nav2_simple_commander", "BasicNavigator"): lambda run, path, call: create_node(run, path, call),
    ("rclpy", "init"): _init,
    ("rclpy", "Parameter"): _parameter,
    ("rclpy", "AsyncParameterClient"): _parameter_client,
    ("rosidl_runtime_py", "get_message"): _interface_by_name,
    ("rosidl_runtime_py", "get_service"): _interface_by_name,
    ("rosidl_runtime_py", "get_action"): _interface_by_name,
    ("image_transport_py", "ImageTransport"): _image_transport,
    ("tf2_ros", "BufferClient"): _buffer_client,
}


_MAKING = frozenset(_FUNCTIONS) - {
    ("rclpy", "init"), ("rclpy", "Parameter"),
    ("rosidl_runtime_py", "get_message"), ("rosidl_runtime_py", "get_service"), ("rosidl_runtime_py", "get_action"),
}  # fmt: skip


CREATING_NAMES = frozenset(name for _, name in (*ENDPOINT_CALLS, *HELPERS, *_MAKING))


def image_transport_method(run: Run, record: NodeRecord, name: str, call: Call) -> Value:
    """``advertise`` publishes the image and one topic per transport plugin below it."""
    base = call.args.at(0, "base_topic") or ANY
    kind = EndpointKind.PUBLISHER if name.startswith("advertise") else EndpointKind.SUBSCRIPTION
    for text in names_of(base):
        record.add_endpoint(FoundEndpoint(kind, text, "sensor_msgs/msg/Image", call.source))
        if isinstance(text, str):
            below = concatenate(text, "/compressed")
            record.add_endpoint(FoundEndpoint(kind, below, "sensor_msgs/msg/CompressedImage", call.source))
    if name.startswith("subscribe"):
        run.register_callback(call.args.at(2, "callback") or BOTTOM, 1)
    return ANY
