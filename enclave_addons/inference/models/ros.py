"""rclpy and its companions at work: objects become nodes, calls of ``signatures`` findings, parameters inputs."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from functools import partial

from enclave_addons.inference.findings import DeclaredParameter, NodeRecord
from enclave_addons.inference.interpreter.conditions import truth
from enclave_addons.inference.interpreter.define import program_classes
from enclave_addons.inference.interpreter.elements import elements
from enclave_addons.inference.interpreter.formatting import as_texts, text_value
from enclave_addons.inference.interpreter.run import Call, Run
from enclave_addons.inference.models.signatures import (
    CLIENT,
    COMMON_CALLBACKS,
    ENDPOINT_CALLS,
    HELPERS,
    NODE_CALLBACKS,
    NODE_ENDPOINTS,
    NODE_HOOKS,
    NODE_PRIVATE,
    SUBSCRIPTION,
    Argument,
    CallbackArgument,
    EndpointCall,
    FixedEndpoint,
    Helper,
    library_node,
)
from enclave_addons.inference.start import LaunchedNode
from enclave_addons.inference.text import (
    Input,
    NodePart,
    Text,
    concatenate,
    constant_text,
    pieces_of,
)
from enclave_addons.inference.values import (
    ABSENT,
    ANY,
    BOTTOM,
    CONSTANTS,
    NONE,
    OF_LAUNCH,
    RESULT,
    ClassValue,
    Dictionary,
    External,
    ForeignMethod,
    Instance,
    Items,
    Key,
    Unknown,
    Value,
    constant_strings,
    external,
    join,
    join_all,
    present,
    result_of,
    sole,
    unknown,
)
from nodl.builtin_interfaces import LOGGER_SERVICES, PARAMETER_SERVICES
from nodl.node_interface import EndpointKind, QosPolicies

NODE_CLASS = "rclpy.node.Node"
LIFECYCLE_CLASS = "rclpy.lifecycle.Node"
PARAMETER_CLASS = "rclpy.parameter.Parameter"


def is_lifecycle(path: str) -> bool:
    """Return True if the path of a node class says that its nodes are lifecycle nodes."""
    return ".lifecycle" in path or path.endswith("LifecycleNode")


def initialise_node(run: Run, instance: Instance, path: str, call: Call) -> None:
    """Model ``Node.__init__``: the instance becomes a node."""
    record = record_of_instance(run, instance, call)
    run.understood.add(call.node)
    if record.created:  # another node made here, that has no parameters yet
        for cell, held in list(record.cells.items()):
            run.state.write(record.cells, cell, join(held, ABSENT))
    record.created = True
    record.source = call.source
    library = library_node(path)
    default: Value = (library.name,) if library else unknown("a node without a name")
    names = call.args.at(0, "node_name") or default
    record.names = join(record.names, tuple(map(constant_text, names)))
    for fixed in library.endpoints if library else ():
        add_endpoint(run, record, fixed.kind, fixed.name, fixed.type, call)
    namespaces = call.args.at(1 if library else -1, "namespace") or NONE
    record.namespaces = join(record.namespaces, tuple(map(constant_text, namespaces)))
    record.lifecycle = record.lifecycle or is_lifecycle(path)
    local = call.args.at(-1, "cli_args")
    record.arguments = join(record.arguments, strings_in(run, local, call) if local else BOTTOM)
    use_global = call.args.at(-1, "use_global_arguments")
    if use_global is not None:
        record.use_global_arguments = use_global
    record.allow_undeclared = call.args.at(-1, "allow_undeclared_parameters") or (False,)
    given = call.args.at(-1, "automatically_declare_parameters_from_overrides")
    record.declares_given = given or (False,)
    for declared in ("use_sim_time", "start_type_description_service"):
        run.state.write(record.cells, DeclaredParameter(declared), ("",))
    if record.lifecycle:
        enabled = call.args.at(-1, "enable_communication_interface")
        record.communication_interface = enabled is None or truth(enabled) is not False
    classes = program_classes(instance.cls) if isinstance(instance.cls, ClassValue) else []
    for name in sorted({name for cls in classes for name in NODE_PRIVATE.intersection(cls.cells)}):
        run.findings.gap(call.source, f"the program replaces {name} of rclpy's node, which is not followed")
    for name in sorted(NODE_HOOKS):
        own = _expect_own(run, instance, name, call)
        if own and name == "get_name":
            run.findings.gap(call.source, "rclpy names parameter services by the get_name() of the program")
    overrides = call.args.at(-1, "parameter_overrides")
    if overrides:
        for name, value in _parameters_in(run, overrides, call):
            _assign(run, record, name, value, call)
    if truth(call.args.at(-1, "enable_logger_service") or (False,)) is not False:
        for service, service_type in LOGGER_SERVICES.items():
            add_endpoint(run, record, EndpointKind.SERVICE_SERVER, f"~/{service}", service_type, call)


def _expect_own(run: Run, node: Instance, name: str, call: Call) -> bool:
    """Expect that libraries call this method of the node if it is the program's own; return whether it is."""
    own = run.attribute((node,), name, call.node, call.frame)
    run.register_callback(own, None, run.state.mark())
    return not all(isinstance(atom, ForeignMethod) for atom in own)


def strings_in(run: Run, value: Value, call: Call) -> Value:
    """Return a list of command line arguments as one atom per known list (a tuple of texts), else unknown."""
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
    """Return the node record of ``instance``; if it has none, a new one, not yet marked as created."""
    record = run.findings.node_of.get(instance)
    if record is None:
        record = run.findings.node_of[instance] = run.findings.add_node(NodeRecord(call.source))
    return record


def create_node(run: Run, path: str, call: Call) -> Value:
    """Model ``rclpy.create_node(...)`` or ``Node(...)`` used as it is."""
    instance = run.library_object(call, path, "node")
    initialise_node(run, instance, path, call)
    return (instance,)


def records_of(run: Run, value: Value | None, call: Call) -> list[NodeRecord]:
    """Return the nodes that ``value`` may be; what is not a known node becomes a gap."""
    records: list[NodeRecord] = []
    for atom in value or ANY:
        if isinstance(atom, Instance):
            for name in ("create_publisher", "create_service", "create_subscription"):
                _expect_own(run, atom, name, call)
            records.append(record_of_instance(run, atom, call))
        elif isinstance(atom, (Unknown, External)):
            why = atom.why if isinstance(atom, Unknown) else f"a result of {atom.path.removesuffix(RESULT)}"
            run.findings.gap(call.source, f"the node of this endpoint is not known: {why}")
            records.append(run.findings.unknown_node(call.source))
    return records


_CLASS_OF = {
    EndpointKind.PUBLISHER: "rclpy.publisher.Publisher",
    EndpointKind.SUBSCRIPTION: "rclpy.subscription.Subscription",
    EndpointKind.SERVICE_SERVER: "rclpy.service.Service",
    EndpointKind.SERVICE_CLIENT: "rclpy.client.Client",
}
ENDPOINT_CLASSES = frozenset(_CLASS_OF.values())
ENDPOINT_NAMES = frozenset({"topic", "srv_name"})  # the name as the program gave it


def endpoint_object(run: Run, kind: EndpointKind, record: NodeRecord, names: Value, call: Call) -> Value:
    """Return the object of a publisher, subscription, service or client that ``record`` made."""
    path = _CLASS_OF[kind]
    made = run.fixed_object(call, path, f"{path} {id(record)}")
    run.state.store(made, "name", names)
    return (made,)


def call_endpoint(run: Run, receiver: Instance, name: str, call: Call) -> Value:
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


_INTERFACE_FOLDERS = ("msg", "srv", "action")

NodeMethod = Callable[[Run, NodeRecord, Call], Value]


def argument(call: Call, where: Argument) -> Value | None:
    """Return the value of this argument of the call; ``None`` when it is not given."""
    return call.args.at(where.position, where.keyword)


def add_endpoints(run: Run, made: EndpointCall, records: list[NodeRecord], call: Call) -> None:
    """Add the call's endpoint to each node, once per possible name and type, and register its callbacks."""
    names = argument(call, made.name) or unknown("a name that is not given")
    types = argument(call, made.type) or ANY
    qos = known_quality(call, made.qos) if made.qos else ()
    run.understood.add(call.node)
    kinds = types_of(types)
    if len(kinds) > 1 and len(names_of(names)) > 1:
        kinds, names = [""], unknown("which name goes with which type")
    for record in records:
        for name in names_of(names):
            for interface_type in kinds:
                add_endpoint(run, record, made.kind, name, interface_type, call, qos)
    for callback in made.callbacks:
        register(run, callback, call)


def add_endpoint(
    run: Run,
    record: NodeRecord,
    kind: EndpointKind,
    name: object,
    type_name: str,
    call: Call,
    qos: QosPolicies = (),
) -> None:
    """Add an endpoint to the node, under the conditions on its parameters and the options that hold here."""
    conditions = [guard.piece for guard in run.guards if guard.asked.owner in (record, run.options)]
    if conditions and isinstance(name, (str, Text)):
        pieces = pieces_of(name)
        name = Text((*(each for each in conditions if each not in pieces), *(pieces if name else ())))
    known = len(record.endpoints)
    record.add_endpoint(kind, name, type_name, call.source, qos)
    run.findings.made += len(record.endpoints) - known


def register(run: Run, callback: CallbackArgument, call: Call, at_any_time: bool = False) -> None:
    """Register the callback that is given to the call, if one is."""
    since = run.state.mark() if at_any_time else None
    run.register_callback(argument(call, callback.argument) or BOTTOM, callback.arity, since)


def names_of(value: Value) -> list[object]:
    """Return the names that ``value`` may be: texts and unknowns; other values are errors in the program."""
    names: list[object] = []
    for atom in value:
        if isinstance(atom, (str, Text, Unknown)):
            names.append(atom)
        elif atom is not None and not isinstance(atom, (int, float)):
            names.append(unknown("a name that is made by an object")[0])
    return names or [unknown("the name is never set to a text")[0]]


def types_of(value: Value) -> list[str]:
    """Return ROS names of interface types; the empty string if a type is not known."""
    types = list(dict.fromkeys(interface_type(atom.path) for atom in value if isinstance(atom, External)))
    known = [name for name in types if name]
    return known or [""]


@functools.lru_cache(maxsize=4096)
def interface_type(path: str) -> str:
    """Return ``std_msgs.msg.String`` or ``std_msgs.msg._string.String`` as ``std_msgs/msg/String``."""
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
                add_endpoint(run, record, fixed.kind, name, fixed.type, call)


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
        return endpoint_object(run, made.kind, record, argument(call, made.name) or ANY, call)

    return method


def _callback_method(name: str) -> NodeMethod:
    def method(run: Run, record: NodeRecord, call: Call) -> Value:
        register(run, NODE_CALLBACKS[name], call)
        return external(f"rclpy.{name}()")

    return method


def _own_name(what: str) -> NodeMethod:
    def method(run: Run, record: NodeRecord, call: Call) -> Value:
        launched = _launched(run, record)
        if (
            launched is None
            or launched.name is None
            or launched.namespace is None
            or record.namespaces != NONE
        ):
            return run.of_launch(NodePart(what))
        full = f"{launched.namespace.rstrip('/')}/{launched.name}"
        return ({"name": launched.name, "namespace": launched.namespace}.get(what, full),)

    return method


def _resolved_name(run: Run, record: NodeRecord, call: Call) -> Value:
    return call.args.at(0) or ANY  # expanding and remapping a resolved name again changes nothing


def _wait_until_active(run: Run, record: NodeRecord, call: Call) -> Value:
    """Model ``BasicNavigator.waitUntilNav2Active(navigator, localizer)``: clients for the lifecycle state of both."""
    for index, (keyword, default) in enumerate((("navigator", "bt_navigator"), ("localizer", "amcl"))):
        for name in as_texts(call.args.at(index, keyword) or (default,)):
            service = concatenate(name, "/get_state")
            add_endpoint(run, record, CLIENT, service, "lifecycle_msgs/srv/GetState", call)
    return NONE


def _manage_lifecycle(run: Run, record: NodeRecord, call: Call) -> Value:
    """Model ``BasicNavigator``, which calls every lifecycle manager that it finds while it runs."""
    name = unknown("the services of lifecycle managers that are found at run time")[0]
    add_endpoint(run, record, CLIENT, name, "nav2_msgs/srv/ManageLifecycleNodes", call)
    return NONE


# --- parameters of a node -----------------------------------------------------------------------------------


def parameter_object(
    run: Run, call: Call, name: Value, value: Value, key: str = "parameter"
) -> tuple[Instance]:
    """Return an rclpy ``Parameter`` that holds ``value``; ``key`` tells those made by one call apart."""
    instance = run.fixed_object(call, PARAMETER_CLASS, key)
    run.state.store(instance, "name", name)
    run.state.store(instance, "value", value)
    return (instance,)


def _name(call: Call) -> Value:
    return call.args.at(0, "name") or ANY


def _declare_parameter(run: Run, record: NodeRecord, call: Call) -> Value:
    default = call.args.at(1, "value")
    plain = (call.args.at(2, "descriptor") or NONE) == NONE
    ignored = call.args.at(3, "ignore_override")
    known = constant_strings(_name(call))
    for name in known:
        _declare(run, record, name, default, ignored, plain)
    if len(known) < len(_name(call)):
        run.state.write(record.cells, DeclaredParameter(""), ("",))
    return parameter_object(run, call, _name(call), _inputs(run, record, _name(call), call))


def _declare(
    run: Run, record: NodeRecord, name: str, given: Value | None, ignored: Value | None, plain: bool
) -> None:
    """Declare a parameter. ``plain``: without a descriptor, so that any value of the default's type may be set."""
    default, ignore = _default_value(given), truth(ignored or (False,))
    record.declare(name, default)
    kinds = {type(constant_text(atom)) for atom in default}
    kind = kinds.pop().__name__ if plain and len(kinds) == 1 else ""
    run.state.write(record.cells, DeclaredParameter(name), (kind,))
    if ignore is not False:  # what launch says does not count, or perhaps not
        record.assigned[name] = default
        run.state.write(record.cells, name, join(default or NONE, BOTTOM if ignore else ABSENT))


def _is_declared(run: Run, record: NodeRecord, name: str) -> bool | None:
    """Return whether rclpy knows the parameter, which it needs to see what launch sets; ``None``: perhaps."""
    held = record.cells.get(DeclaredParameter(name), ABSENT)
    if held != ABSENT:
        return None if ABSENT[0] in held else True
    automatic, launched = truth(record.declares_given), _launched(run, record)
    if automatic and launched is not None:
        if name in launched.parameters:
            return True
        automatic = False
    handed = any(run.findings.node_of.get(each) is record for each in run.handed)
    others = handed or not record.created or DeclaredParameter("") in record.cells
    return None if automatic is not False or others or name.startswith(_OF_LIBRARIES) else False


_OF_LIBRARIES = ("qos_overrides.", "diagnostic_updater.")  # parameters that libraries declare


def _undeclare_parameter(run: Run, record: NodeRecord, call: Call) -> Value:
    known = constant_strings(_name(call))
    for cell in (cell for name in known for cell in (name, DeclaredParameter(name))):
        kept = BOTTOM if len(known) == len(_name(call)) == 1 else record.cells.get(cell, BOTTOM)
        run.state.write(record.cells, cell, join(kept, ABSENT))
    if len(known) < len(_name(call)):
        run.findings.gap(call.source, "which parameter is undeclared is not known")
    return NONE


def _default_value(default: Value | None) -> Value:
    """Return a declared default; a parameter type or ``None`` declares none."""
    if default is None or all(atom is None or isinstance(atom, External) for atom in default):
        return BOTTOM
    return tuple(atom for atom in default if atom is not None)


_UNNAMED = unknown("a parameter whose name is not known")


def _inputs(run: Run, record: NodeRecord, names: Value, call: Call, undeclared: Value | None = None) -> Value:
    """Return the values of parameters: what the program set them to, else what launch and the defaults say.

    ``undeclared``: the value of one that is not declared; without it, it is taken for one that is.
    """
    known = constant_strings(names)
    result = _UNNAMED if len(known) < len(names) else BOTTOM
    for name in known:
        if undeclared is not None:
            declared = _is_declared(run, record, name)
            result = join(result, BOTTOM if declared else undeclared)
            if declared is False:
                continue
        held = record.cells.get(name, ABSENT)
        result = join(result, present(held))
        if ABSENT[0] not in held:
            continue
        settled = _settled(run, record, name, call)
        if settled:
            result = join(result, settled)
        else:
            result = join(result, run.of_launch(Input(name, record)))
    return result


def _held(run: Run, record: NodeRecord, names: Value, call: Call) -> Value:
    """Return what ``get_parameter`` gives: without a declaration an error, or ``None`` where that is allowed."""
    allowed = truth(record.allow_undeclared)
    if allowed is None:
        return join(_inputs(run, record, names, call), NONE)
    return _inputs(run, record, names, call, NONE if allowed else None)


def _launched(run: Run, record: NodeRecord) -> LaunchedNode | None:
    """Return what the launch makes of the node, ``None`` if that is open; nothing of one that does not listen."""
    name = sole(record.names)
    if not isinstance(name, str) or record.arguments or run.findings.global_arguments:
        return None
    if run.launch.nodes and record.use_global_arguments == (False,):
        return LaunchedNode({}, None, None)
    return run.launch.nodes.get(name) if record.use_global_arguments == (True,) else None


def _settled(run: Run, record: NodeRecord, name: str, call: Call) -> Value:
    """Return the value of a parameter in this launch, else its default; nothing where it stays open."""
    launched = _launched(run, record)
    if launched is None:
        return BOTTOM
    if name not in launched.parameters:
        return record.default(name)
    given = launched.parameters[name]
    if isinstance(given, list | tuple):
        items = Items(tuple((each,) for each in given))
        return run.sequence(call.node, "list", items, f"parameter {name} of {record.source}")
    return (given,) if isinstance(given, CONSTANTS) else BOTTOM


def _declare_parameters(run: Run, record: NodeRecord, call: Call) -> Value:
    namespace = call.args.at(0, "namespace") or ANY
    prefixes = constant_strings(namespace)
    listed = call.args.at(1, "parameters") or ANY
    known = len(prefixes) == len(namespace) == 1
    ignored = call.args.at(2, "ignore_override")
    found: list[Value] = [] if len(prefixes) == len(namespace) else [_UNNAMED]
    for entry in _entries(run, listed, call):
        parts = elements(run, entry, call.node, call.frame)
        if parts.exact is None or not parts.exact:
            run.findings.gap(call.source, "the list of declared parameters is not known")
            run.state.write(record.cells, DeclaredParameter(""), ("",))
            known = False
            continue
        default = parts.exact[1] if len(parts.exact) > 1 else None
        names = constant_strings(parts.exact[0])
        known = known and len(names) == len(parts.exact[0]) == 1
        if len(names) < len(parts.exact[0]):
            found.append(_UNNAMED)
            run.state.write(record.cells, DeclaredParameter(""), ("",))
        for full in (f"{prefix}.{name}" if prefix else name for name in names for prefix in prefixes):
            _declare(run, record, full, default, ignored, len(parts.exact) < 3)
            value = _inputs(run, record, (full,), call)
            found.append(parameter_object(run, call, (full,), value, full))
    exact = known and elements(run, listed, call.node, call.frame).exact is not None
    items = Items(tuple(found)) if exact else Items(None, join_all(found) or ANY)
    return run.sequence(call.node, "list", items)


def _entries(run: Run, value: Value, call: Call) -> list[Value]:
    items = elements(run, value, call.node, call.frame)
    return list(items.exact) if items.exact is not None else [items.any_element()]


def _get_parameter(run: Run, record: NodeRecord, call: Call) -> Value:
    return parameter_object(run, call, _name(call), _held(run, record, _name(call), call))


def _get_parameters(run: Run, record: NodeRecord, call: Call) -> Value:
    names = elements(run, call.args.at(0, "names") or ANY, call.node, call.frame).exact
    if names is None:
        return ANY
    found = (
        parameter_object(run, call, each, _held(run, record, each, call), f"parameter {index}")
        for index, each in enumerate(names)
    )
    return run.sequence(call.node, "list", Items(tuple(found)))


def _get_parameters_by_prefix(run: Run, record: NodeRecord, call: Call) -> Value:
    """Return a dictionary of the parameters below a prefix, under the rest of their names; only a launch says which."""
    launched = _launched(run, record)
    prefix = sole(call.args.at(0, "prefix"))
    if launched is None or not isinstance(prefix, str):
        run.has_inputs = True
        return OF_LAUNCH
    found = run.allocate(call.node, "by prefix", Dictionary)
    start = f"{prefix}." if prefix else ""
    for name in dict.fromkeys((*record.parameters, *launched.parameters)):
        declared = _is_declared(run, record, name)
        if name.startswith(start) and declared is not False:
            held: Value = parameter_object(run, call, (name,), _inputs(run, record, (name,), call), name)
            run.state.store(found, Key(name.removeprefix(start)), join(held, BOTTOM if declared else ABSENT))
    return (found,)


def _get_parameter_or(run: Run, record: NodeRecord, call: Call) -> Value:
    others = (a for a in call.args.at(1, "alternative_value") or BOTTOM if isinstance(a, Instance))
    default = join_all(present(other.cells.get("value", BOTTOM)) for other in others)
    for name in constant_strings(_name(call)):
        declared = _is_declared(run, record, name)
        by_others = DeclaredParameter("") in record.cells  # with a default that is not known
        if (declared is None and not by_others) or (declared and not record.default(name)):
            record.declare(name, _default_value(default or None))
    # One that may be declared for the launch's sake has the launch's value, or else this default.
    undeclared = None if truth(record.declares_given) else default or NONE
    return parameter_object(run, call, _name(call), _inputs(run, record, _name(call), call, undeclared))


def _set_parameters(run: Run, record: NodeRecord, call: Call, together: bool = False) -> Value:
    """Set parameters; where a callback, a descriptor or a type may refuse a value, the one before stays possible.

    ``together``: all of them or none.
    """
    given = list(_parameters_in(run, call.args.at(0, "parameter_list") or ANY, call))
    taken = [_is_taken(record, name, value) for name, value in given]
    for (name, value), certain in zip(given, taken, strict=True):
        before = BOTTOM if certain and (all(taken) or not together) else record.cells.get(name, ABSENT)
        _assign(run, record, name, join(value, before), call)
        declared = DeclaredParameter(name)
        if record.cells.get(declared, ABSENT) == ABSENT and truth(record.allow_undeclared) is not False:
            run.state.write(record.cells, declared, ("",))
    if _PRE_SET in record.cells:
        run.findings.gap(call.source, "a callback may change the parameters before they are set")
    return ANY


_PRE_SET, _ON_SET = DeclaredParameter("[changed]"), DeclaredParameter("[refused]")  # cells for callbacks


def _is_taken(record: NodeRecord, name: str, value: Value) -> bool:
    """Return whether setting a parameter to ``value`` certainly succeeds."""
    kinds = {type(constant_text(atom)).__name__ for atom in value}
    plain = len(kinds) == 1 and record.cells.get(DeclaredParameter(name)) == (*kinds,)
    return plain and _ON_SET not in record.cells


def _set_callback(name: str, cell: DeclaredParameter) -> NodeMethod:
    registered = _callback_method(name)

    def method(run: Run, record: NodeRecord, call: Call) -> Value:
        run.state.write(record.cells, cell, (True,))
        return registered(run, record, call)

    return method


def _parameters_in(run: Run, listed: Value, call: Call) -> Iterator[tuple[str, Value]]:
    """Return name and value of each ``Parameter`` object in the list; unknown entries become a gap."""
    lists = tuple(atom for atom in listed if atom is not None)
    for entry in _entries(run, lists, call) if lists else ():
        for atom in entry:
            if isinstance(atom, Instance):
                names = present(atom.cells.get("name", ANY))
                known = constant_strings(names)
                if len(known) < len(names):
                    run.findings.gap(call.source, "which parameter is set in code is not known")
                for name in known:
                    yield name, present(atom.cells.get("value", ANY))
            elif isinstance(atom, Unknown):
                run.findings.gap(call.source, f"parameters set in code are not known: {atom.why}")


def _assign(run: Run, record: NodeRecord, name: str, value: Value, call: Call) -> None:
    record.assigned[name] = join(record.assigned.get(name, BOTTOM), present(value))
    run.state.write(record.cells, name, value)
    if name == "use_sim_time" and truth(present(value)) is not False:
        add_endpoint(run, record, SUBSCRIPTION, "/clock", "rosgraph_msgs/msg/Clock", call)


NODE_METHODS: dict[str, NodeMethod] = {
    **{name: _endpoint_method(name) for name in NODE_ENDPOINTS},
    **{name: _callback_method(name) for name in NODE_CALLBACKS},
    "declare_parameter": _declare_parameter,
    "declare_parameters": _declare_parameters,
    "get_parameter": _get_parameter,
    "get_parameters": _get_parameters,
    "get_parameter_or": _get_parameter_or,
    "get_parameters_by_prefix": _get_parameters_by_prefix,
    "set_parameters": _set_parameters,
    "set_parameters_atomically": partial(_set_parameters, together=True),
    "undeclare_parameter": _undeclare_parameter,
    "add_pre_set_parameters_callback": _set_callback("add_pre_set_parameters_callback", _PRE_SET),
    "add_on_set_parameters_callback": _set_callback("add_on_set_parameters_callback", _ON_SET),
    "set_parameters_callback": _set_callback("set_parameters_callback", _ON_SET),
    "waitUntilNav2Active": _wait_until_active,
    "lifecycleStartup": _manage_lifecycle,
    "lifecycleShutdown": _manage_lifecycle,
    "get_name": _own_name("name"),
    "get_namespace": _own_name("namespace"),
    "get_fully_qualified_name": _own_name("fqn"),
    "resolve_topic_name": _resolved_name,
    "resolve_service_name": _resolved_name,
}


# --- functions and classes of the libraries ---------------------------------------------------------------


def call_library(run: Run, path: str, call: Call) -> Value | None:
    """Call ``path(...)`` for what the tables know; ``None`` for the rest."""
    key = _table_key(path)
    made = ENDPOINT_CALLS.get(key)
    if made is not None:
        assert made.node is not None
        add_endpoints(run, made, records_of(run, argument(call, made.node), call), call)
        return _object_of(run, path, call)
    helper = HELPERS.get(key)
    if helper is not None:
        _helper(run, helper, call)
        return _object_of(run, path, call)
    function = _FUNCTIONS.get(key)
    if function:
        run.understood.add(call.node)
    return function(run, path, call) if function else None


@functools.lru_cache(maxsize=4096)
def _table_key(path: str) -> tuple[str, str]:
    """Return the top package and the last name of ``path``, under which tables of libraries know it."""
    return path.partition(".")[0], path.rpartition(".")[2]


def makes_interfaces(path: str) -> bool:
    """Return True if a call of this library function or class is among those that make nodes or interfaces."""
    key = _table_key(path)
    return key in ENDPOINT_CALLS or key in HELPERS or key in _MAKING


def _object_of(run: Run, path: str, call: Call) -> Value:
    return (run.library_object(call, path, "library"),)


def _init(run: Run, path: str, call: Call) -> Value:
    given = call.args.at(0, "args")
    if given is not None:
        known = tuple(atom for atom in given if not isinstance(atom, (Unknown, External, Text)))
        if known and len(known) == len(given):
            words = strings_in(run, known, call)
            run.findings.global_arguments = join(run.findings.global_arguments, words)
    return ANY


def _parameter(run: Run, path: str, call: Call) -> Value:
    name, value = call.args.at(0, "name") or ANY, call.args.at(2, "value") or NONE
    return parameter_object(run, call, name, value)


def _parameter_client(run: Run, path: str, call: Call) -> Value:
    remote = call.args.at(1, "remote_node_name") or ANY
    for record in records_of(run, call.args.at(0, "node"), call):
        for service, interface in PARAMETER_SERVICES.items():
            for text in text_value(concatenate(name, f"/{service}") for name in as_texts(remote)):
                add_endpoint(run, record, CLIENT, text, interface, call)
    return _object_of(run, path, call)


def _node_class(run: Run, path: str, call: Call) -> Value:
    return create_node(run, LIFECYCLE_CLASS if is_lifecycle(path) else NODE_CLASS, call)


_FUNCTIONS: dict[tuple[str, str], Callable[[Run, str, Call], Value]] = {
    **{("rclpy", name): _node_class for name in ("create_node", "Node", "LifecycleNode")},
    ("nav2_simple_commander", "BasicNavigator"): lambda run, path, call: create_node(run, path, call),
    ("rclpy", "init"): _init,
    ("rclpy", "Parameter"): _parameter,
    ("rclpy", "AsyncParameterClient"): _parameter_client,
}


_MAKING = frozenset(_FUNCTIONS) - {("rclpy", "init"), ("rclpy", "Parameter")}


CREATING_NAMES = frozenset(name for _, name in (*ENDPOINT_CALLS, *HELPERS, *_MAKING))
