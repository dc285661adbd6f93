"""rclpy and its companions at work: objects become nodes, calls of the table interfaces, parameters inputs."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator

from enclave_addons.inference.kernel.findings import FoundEndpoint, FoundNode
from enclave_addons.inference.kernel.texts import Input, OwnName, Text, concatenations
from enclave_addons.inference.kernel.values import (
    ABSENT,
    ANY,
    BOTTOM,
    CONSTANTS,
    NONE,
    External,
    Items,
    Key,
    Obj,
    Unknown,
    Value,
    external,
    join,
    join_all,
    present,
    sole,
    strings,
    unknown,
)
from enclave_addons.inference.models.rclpy import (
    CLIENT,
    COMMON_CALLBACKS,
    ENDPOINT_CALLS,
    HELPERS,
    NODE_CALLBACKS,
    NODE_ENDPOINTS,
    SUBSCRIPTION,
    Argument,
    CallbackArgument,
    EndpointCall,
    FixedEndpoint,
    Helper,
    library_node,
)
from enclave_addons.inference.python.conditions import truth
from enclave_addons.inference.python.containers import elements, plain
from enclave_addons.inference.python.formatting import as_texts, text_value
from enclave_addons.inference.python.objects import Arguments, Call
from enclave_addons.inference.python.run import FOREIGN_FIELDS, OF_PROCESS, Run
from enclave_addons.inference.start import LaunchedNode
from nodl.builtin_interfaces import LOGGER_SERVICES, PARAMETER_SERVICES
from nodl.node_interface import EndpointKind, QosPolicies

NODE_CLASS = "rclpy.node.Node"
PARAMETER = "rclpy.parameter.Parameter"
UNKNOWN_NODE = "an unknown node"
NodeMethod = Callable[[Run, FoundNode, Call], Value]


@functools.lru_cache(maxsize=4096)
def is_node_class(path: str) -> bool:
    """Return whether ``path`` is a node class of rclpy or of a library in the table."""
    if path.startswith("rclpy."):
        return path.endswith(("Node", ".LifecycleNode"))
    return library_node(path) is not None


def is_lifecycle(path: str) -> bool:
    """Return whether a node class makes lifecycle nodes."""
    return ".lifecycle" in path or path.endswith("LifecycleNode")


# --- nodes --------------------------------------------------------------------------------------------------


def initialise_node(run: Run, obj: Obj, path: str, call: Call) -> None:
    """Model ``Node.__init__``."""
    node = run.findings.node_of(obj, call.source)
    node.created = True
    node.source = call.source
    library = library_node(path)
    names = call.at(0, "node_name") or ((library.name,) if library else unknown("a node without a name"))
    node.names = join(node.names, names)
    node.namespaces = join(node.namespaces, call.at(1 if library else -1, "namespace") or NONE)
    for fixed in library.endpoints if library else ():
        run.endpoint(node, fixed.kind, fixed.name, fixed.type, call.source)
    enabled = call.at(-1, "enable_communication_interface")
    node.lifecycle = node.lifecycle or (
        is_lifecycle(path) and (enabled is None or truth(enabled) is not False)
    )
    node.hears_launch = call.at(-1, "use_global_arguments") or (True,)
    node.undeclared_allowed = truth(call.at(-1, "allow_undeclared_parameters") or (False,)) is not False
    automatic = call.at(-1, "automatically_declare_parameters_from_overrides") or (False,)
    node.declares_given = truth(automatic) is not False
    words = call.at(-1, "cli_args")
    if words not in (None, NONE):
        node.words.append(words_in(run, words))
    overrides = call.at(-1, "parameter_overrides")
    for name, value in _parameters_in(run, overrides, call) if overrides else ():
        _assign(run, node, name, value, call)
    if truth(call.at(-1, "enable_logger_service") or (False,)) is not False:
        for service, service_type in LOGGER_SERVICES.items():
            run.endpoint(node, EndpointKind.SERVICE_SERVER, f"~/{service}", service_type, call.source)


def words_in(run: Run, value: Value) -> tuple[str, ...] | None:
    """Return a list of command line arguments that the program writes."""
    exact = elements(run, value).exact
    words = [sole(each) for each in exact or ()]
    return (
        None if exact is None or not all(isinstance(each, str) for each in words) else tuple(map(str, words))
    )


def create_node(run: Run, path: str, call: Call) -> Value:
    """Model ``rclpy.create_node(...)``, or a node class used as it is."""
    obj = run.library_object(call, path, "node")
    initialise_node(run, obj, path, call)
    return (obj,)


def nodes_of(run: Run, value: Value | None, call: Call) -> list[FoundNode]:
    """Return the nodes that ``value`` may be. What is not a known node is a gap."""
    found: list[FoundNode] = []
    for atom in value or ANY:
        if isinstance(atom, Obj) and atom.kind == "instance":
            found.append(run.findings.node_of(atom, call.source))
        elif atom is not None:
            why = atom.why if isinstance(atom, Unknown) else "something of a library"
            node = run.findings.node_of(UNKNOWN_NODE, call.source)
            node.gaps.add(call.source, f"the node of this interface is not known: {why}")
            found.append(node)
    return found


def is_node(run: Run, atom: object) -> bool:
    """Return whether ``atom`` is a node that was made."""
    node = run.findings.nodes.get(atom) if isinstance(atom, Obj) else None
    return node is not None and node.created


# --- interfaces ---------------------------------------------------------------------------------------------

_CLASS_OF = {
    EndpointKind.PUBLISHER: "rclpy.publisher.Publisher",
    EndpointKind.SUBSCRIPTION: "rclpy.subscription.Subscription",
    EndpointKind.SERVICE_SERVER: "rclpy.service.Service",
    EndpointKind.SERVICE_CLIENT: "rclpy.client.Client",
}


def argument(call: Call, where: Argument) -> Value | None:
    """Return the argument at ``where``; ``None`` if it is not given."""
    return call.at(where.position, where.keyword)


def add_endpoints(run: Run, made: EndpointCall, nodes: list[FoundNode], call: Call) -> list[FoundEndpoint]:
    """Add the interface of a call to each node, once for each name."""
    names = argument(call, made.name) or unknown("a name that is not given")
    kinds = types_of(argument(call, made.type) or ANY)
    qos = known_quality(call, made.qos) if made.qos else ()
    for callback in made.callbacks:
        register(run, callback, call)
    return [
        run.endpoint(node, made.kind, name, kinds[0] if len(kinds) == 1 else "", call.source, qos)
        for node in nodes
        for name in names_of(names)
    ]


def register(run: Run, callback: CallbackArgument, call: Call) -> None:
    """Have the callback that is given to the call called later, if there is one."""
    made = unknown("an argument given by code that is not analysed")
    args = Arguments(more=made) if callback.arity is None else Arguments([made] * callback.arity)
    run.call_later(argument(call, callback.argument) or BOTTOM, args, call)


def names_of(value: Value) -> list[object]:
    """Return the names that ``value`` may be. ``None`` and numbers are errors of the program."""
    value = tuple(map(plain, value))
    names: list[object] = [atom for atom in value if isinstance(atom, (str, Text, Unknown))]
    if any(not isinstance(atom, (*CONSTANTS, Text, Unknown)) for atom in value):
        names.append(unknown("a name that is made by an object")[0])
    return names or [unknown("the name is never set to a text")[0]]


def types_of(value: Value) -> list[str]:
    """Return the ROS names of interface types; an empty text where none is known."""
    found = dict.fromkeys(interface_type(atom.path) for atom in value if isinstance(atom, External))
    return [name for name in found if name] or [""]


@functools.lru_cache(maxsize=4096)
def interface_type(path: str) -> str:
    """Return ``std_msgs.msg.String`` as ``std_msgs/msg/String``."""
    steps = path.split(".")
    if len(steps) >= 3 and steps[1] in ("msg", "srv", "action") and "(" not in path:
        return f"{steps[0]}/{steps[1]}/{steps[-1]}"
    return ""


def _keep_last(depth: int, reliability: str = "RELIABLE") -> QosPolicies:
    policies = (("depth", depth), ("durability", "VOLATILE"), ("history", "KEEP_LAST"))
    return (*policies, ("reliability", reliability))


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
    """Return policies by NoDL v2's names; none if they are not certain."""
    given = sole(call.at(position, "qos_profile"))
    if call.at(-1, "qos_overriding_options") is not None:
        return ()
    if isinstance(given, External):
        return _BY_PATH.get(given.path, ())
    return _keep_last(given) if type(given) is int and given > 0 else ()


def _endpoint_method(name: str) -> NodeMethod:
    def method(run: Run, node: FoundNode, call: Call) -> Value:
        made = NODE_ENDPOINTS[name]
        found = add_endpoints(run, made, [node], call)
        obj = run.library_object(call, _CLASS_OF[made.kind], f"{name} {id(node)}")
        run.store.store(obj, "name", argument(call, made.name) or ANY)
        run.interfaces.setdefault(obj, []).extend((node, each) for each in found)
        return (obj,)

    return method


def _endpoint_field(run: Run, obj: Obj, name: str) -> Value | None:
    return obj.cells.get("name", ANY) if name in ("topic", "topic_name", "srv_name") else None


def call_interface(run: Run, obj: Obj, name: str, call: Call) -> Value:
    """Model a method of a publisher, subscription, service or client."""
    if name == "configure_introspection":
        state = sole(call.at(2, "introspection_state"))
        if not (isinstance(state, External) and state.path.endswith(".OFF")):
            for node, found in run.interfaces.get(obj, ()):
                node.endpoints.pop(found, None)
                node.endpoints.setdefault(found._replace(introspected=True))
    if name in COMMON_CALLBACKS:
        register(run, COMMON_CALLBACKS[name], call)
    return external("rclpy.()")


def _callback_method(name: str) -> NodeMethod:
    def method(run: Run, node: FoundNode, call: Call) -> Value:
        register(run, NODE_CALLBACKS[name], call)
        return external(f"rclpy.{name}()")

    return method


def _own_name(what: str) -> NodeMethod:
    def method(run: Run, node: FoundNode, call: Call) -> Value:
        launched = launched_node(run, node)
        if launched is None or launched.name is None or launched.namespace is None or node.namespaces != NONE:
            return run.of_launch(OwnName(what))
        full = f"{launched.namespace.rstrip('/')}/{launched.name}"
        return ({"name": launched.name, "namespace": launched.namespace}.get(what, full),)

    return method


def _resolved_name(run: Run, node: FoundNode, call: Call) -> Value:
    return call.at(0) or ANY  # to expand and remap a resolved name again changes nothing


def _wait_until_active(run: Run, node: FoundNode, call: Call) -> Value:
    for index, (keyword, default) in enumerate((("navigator", "bt_navigator"), ("localizer", "amcl"))):
        for name in concatenations([as_texts(call.at(index, keyword) or (default,)), ["/get_state"]]):
            run.endpoint(node, CLIENT, name, "lifecycle_msgs/srv/GetState", call.source)
    return NONE


def _manage_lifecycle(run: Run, node: FoundNode, call: Call) -> Value:
    name = unknown("the services of lifecycle managers that are found at run time")[0]
    run.endpoint(node, CLIENT, name, "nav2_msgs/srv/ManageLifecycleNodes", call.source)
    return NONE


# --- parameters ---------------------------------------------------------------------------------------------


def parameter_object(run: Run, call: Call, name: Value, value: Value, tag: str = "") -> Value:
    """Return an rclpy ``Parameter`` that holds ``value``."""
    obj = run.library_object(call, PARAMETER, f"parameter {tag}")
    obj.summary = False
    run.store.write(obj.cells, "name", name)
    run.store.write(obj.cells, "value", value)
    return (obj,)


def _parameter_field(run: Run, obj: Obj, name: str) -> Value | None:
    return obj.cells.get("value", ANY) if name.endswith("_value") and name != "get_parameter_value" else None


def launched_node(run: Run, node: FoundNode) -> LaunchedNode | None:
    """Return what the launch makes of the node; nothing of one that does not obey it; ``None`` if that is open."""
    name = sole(node.names)
    if not run.launch.nodes or not isinstance(name, str) or node.words or run.findings.global_words:
        return None
    if node.hears_launch == (False,):
        return LaunchedNode({}, None, None)
    return run.launch.nodes.get(name) if node.hears_launch == (True,) else None


def _name(call: Call) -> Value:
    return call.at(0, "name") or ANY


def _default_value(default: Value | None) -> Value:
    """Return a declared default; a type of a parameter, or ``None``, declares none."""
    return tuple(atom for atom in default or () if atom is not None and not isinstance(atom, External))


def _declare(
    run: Run, node: FoundNode, name: str, default: Value | None, ignored: Value | None, *, plain: bool = False
) -> None:
    """Declare a parameter. ``plain``: without a descriptor, which may permit other types."""
    value = _default_value(default)
    node.declare(name, value)
    typed = plain and value == default and not ignored and not node.declares_given
    node.typed[name] = node.typed.get(name, True) and typed
    if ignored and truth(ignored) is not False:  # what launch says does not count
        _assign(run, node, name, join(value or NONE, BOTTOM if truth(ignored) else ABSENT), None)


def _value_of(run: Run, node: FoundNode, name: str, call: Call, otherwise: Value = BOTTOM) -> Value:
    """Return the value of a parameter: what the program sets, else what launch and the default say."""
    held = run.store.read(node.cells, name, ABSENT)
    result = present(held)
    if ABSENT[0] not in held:
        return result
    launched = launched_node(run, node)
    if launched is None:
        if otherwise and name not in node.defaults:
            node.declare(name, _default_value(otherwise))
        return join(result, run.of_launch(Input(name, node)))
    if name in launched.parameters:
        return join(result, _constant(run, launched.parameters[name], name, call))
    default = node.default(name) or otherwise or (NONE if node.undeclared_allowed else BOTTOM)
    return join(result, default or run.of_launch(Input(name, node)))  # without a value rclpy raises an error


def _constant(run: Run, given: object, name: str, call: Call) -> Value:
    if isinstance(given, (list, tuple)):
        return run.sequence(call.node, "list", Items(tuple((each,) for each in given)), f"parameter {name}")
    return (given,) if isinstance(given, CONSTANTS) else ANY


def _values_of(run: Run, node: FoundNode, names: Value, call: Call, otherwise: Value = BOTTOM) -> Value:
    known = strings(names)
    found = join_all(_value_of(run, node, name, call, otherwise) for name in known)
    return found if len(known) == len(names) else join(found, unknown("a parameter whose name is not known"))


def _declare_parameter(run: Run, node: FoundNode, call: Call) -> Value:
    names = _name(call)
    for name in strings(names):
        _declare(
            run, node, name, call.at(1, "value"), call.at(3, "ignore_override"),
            plain=call.at(2, "descriptor") is None,
        )  # fmt: skip
    return parameter_object(run, call, names, _values_of(run, node, names, call))


def _declare_parameters(run: Run, node: FoundNode, call: Call) -> Value:
    prefix = sole(call.at(0, "namespace"))
    items = elements(run, call.at(1, "parameters") or ANY)
    found: list[Value] = []
    for index, entry in enumerate(items.exact if items.exact is not None else (items.rest,)):
        parts = elements(run, entry).exact
        if not parts or not isinstance(prefix, str):
            found.append(unknown("a parameter whose name is not known"))
            continue
        names: Value = tuple(f"{prefix}.{name}" if prefix else name for name in strings(parts[0]))
        for name in strings(names):
            _declare(run, node, name, parts[1] if len(parts) > 1 else None, call.at(2, "ignore_override"))
        found.append(parameter_object(run, call, names, _values_of(run, node, names, call), str(index)))
    exact = items.exact is not None
    return run.sequence(call.node, "list", Items(tuple(found)) if exact else Items(None, join_all(found)))


def _get_parameter(run: Run, node: FoundNode, call: Call) -> Value:
    return parameter_object(run, call, _name(call), _values_of(run, node, _name(call), call))


def _get_parameters(run: Run, node: FoundNode, call: Call) -> Value:
    names = elements(run, call.at(0, "names") or ANY).exact
    if names is None:
        return ANY
    found = (
        parameter_object(run, call, each, _values_of(run, node, each, call), str(index))
        for index, each in enumerate(names)
    )
    return run.sequence(call.node, "list", Items(tuple(found)))


def _get_parameter_or(run: Run, node: FoundNode, call: Call) -> Value:
    others = (atom for atom in call.at(1, "alternative_value") or BOTTOM if isinstance(atom, Obj))
    default = join_all(present(other.cells.get("value", BOTTOM)) for other in others)
    names = _name(call)
    undeclared = not node.declares_given and not any(name in node.defaults for name in strings(names))
    if undeclared and len(strings(names)) == len(names):
        return parameter_object(run, call, names, default or NONE)  # rclpy does not look at what launch sets
    return parameter_object(run, call, names, _values_of(run, node, names, call, default or NONE))


def _get_parameters_by_prefix(run: Run, node: FoundNode, call: Call) -> Value:
    launched, prefix = launched_node(run, node), sole(call.at(0, "prefix"))
    run.has_inputs = True
    if launched is None or not isinstance(prefix, str):
        return unknown("parameters by a prefix, which only a launch decides")
    found = run.allocate(call.node, "dict", tag="by prefix")
    start = f"{prefix}." if prefix else ""
    for name in dict.fromkeys((*node.defaults, *launched.parameters)):
        if name.startswith(start):
            held = parameter_object(run, call, (name,), _value_of(run, node, name, call), name)
            run.store.store(found, Key(name.removeprefix(start)), held)
    return (found,)


def _has_parameter(run: Run, node: FoundNode, call: Call) -> Value:
    name = sole(_name(call))
    return (True,) if name in node.defaults and name not in run.undeclared else (True, False)


def _undeclare(run: Run, node: FoundNode, call: Call) -> Value:
    run.undeclared.update(strings(_name(call)))
    return NONE


def _set_parameters(run: Run, node: FoundNode, call: Call) -> Value:
    """Set parameters. The program may refuse a value, so that the one before stays possible."""
    for name, value in _parameters_in(run, call.at(0, "parameter_list") or ANY, call):
        _assign(run, node, name, value if node not in run.refusing else join(value, ABSENT), call)
    return ANY


def _may_refuse(name: str) -> NodeMethod:
    registered = _callback_method(name)

    def method(run: Run, node: FoundNode, call: Call) -> Value:
        run.refusing.add(node)
        return registered(run, node, call)

    return method


def _parameters_in(run: Run, listed: Value, call: Call) -> Iterator[tuple[str, Value]]:
    """Return name and value of each ``Parameter`` in a list."""
    items = elements(run, tuple(atom for atom in listed if atom is not None))
    for entry in items.exact if items.exact is not None else (items.rest,):
        for atom in entry:
            names = present(atom.cells.get("name", ANY)) if isinstance(atom, Obj) else ANY
            if isinstance(atom, Unknown) or len(strings(names)) < len(names):
                run.gap(call.source, "which parameter is set in code is not known")
            for name in strings(names):
                yield name, present(atom.cells.get("value", ANY)) if isinstance(atom, Obj) else ANY


def _assign(run: Run, node: FoundNode, name: str, value: Value, call: Call | None) -> None:
    node.set_in_code.setdefault(name)
    run.store.write(node.cells, name, value)
    if call is not None and name == "use_sim_time" and truth(present(value)) is not False:
        run.endpoint(node, SUBSCRIPTION, "/clock", "rosgraph_msgs/msg/Clock", call.source)


NODE_METHODS: dict[str, NodeMethod] = {
    **{name: _endpoint_method(name) for name in NODE_ENDPOINTS},
    **{name: _callback_method(name) for name in NODE_CALLBACKS},
    **{
        name: _may_refuse(name)
        for name in ("add_on_set_parameters_callback", "add_pre_set_parameters_callback")
    },
    "declare_parameter": _declare_parameter,
    "declare_parameters": _declare_parameters,
    "get_parameter": _get_parameter,
    "get_parameters": _get_parameters,
    "get_parameter_or": _get_parameter_or,
    "get_parameters_by_prefix": _get_parameters_by_prefix,
    "has_parameter": _has_parameter,
    "set_parameters": _set_parameters,
    "set_parameters_atomically": _set_parameters,
    "undeclare_parameter": _undeclare,
    "waitUntilNav2Active": _wait_until_active,
    "lifecycleStartup": _manage_lifecycle,
    "lifecycleShutdown": _manage_lifecycle,
    "get_name": _own_name("name"),
    "get_namespace": _own_name("namespace"),
    "get_fully_qualified_name": _own_name("fqn"),
    "resolve_topic_name": _resolved_name,
    "resolve_service_name": _resolved_name,
}


def call_node_method(run: Run, receiver: Obj, path: str, name: str, call: Call) -> Value:
    """Call a method that a node has from rclpy."""
    if name == "__init__":
        initialise_node(run, receiver, path, call)
        return NONE
    model = NODE_METHODS.get(name)
    if model is not None:
        return model(run, run.findings.node_of(receiver, call.source), call)
    return external("rclpy.()")


# --- functions and classes of the libraries -----------------------------------------------------------------


@functools.lru_cache(maxsize=4096)
def _key(path: str) -> tuple[str, str]:
    """Return the top package and the last name of ``path``, under which the tables know it."""
    return path.partition(".")[0], path.rpartition(".")[2]


def call_library(run: Run, path: str, call: Call) -> Value | None:
    """Call what the tables know; ``None`` for the rest."""
    key = _key(path)
    made = ENDPOINT_CALLS.get(key)
    if made is not None and made.node is not None:
        add_endpoints(run, made, nodes_of(run, argument(call, made.node), call), call)
        return (run.library_object(call, path),)
    helper = HELPERS.get(key)
    if helper is not None:
        _help(run, helper, call)
        return (run.library_object(call, path),)
    function = _FUNCTIONS.get(key)
    return function(run, path, call) if function else None


def _help(run: Run, helper: Helper, call: Call) -> None:
    node = argument(call, helper.node)
    if node is None or node == NONE:
        return  # tf2_ros.Buffer without a node makes nothing
    for found in nodes_of(run, node, call):
        for fixed in helper.endpoints:
            switch = argument(call, fixed.unless) if fixed.unless is not None else None
            if switch is None or truth(switch) is not True:
                for name in _fixed_names(fixed, call):
                    run.endpoint(found, fixed.kind, name, fixed.type, call.source)


def _fixed_names(fixed: FixedEndpoint, call: Call) -> Value:
    if fixed.below is None:
        return (fixed.name,)
    above = argument(call, fixed.below) or unknown("a namespace that is not given")
    return text_value(concatenations([as_texts(above), [fixed.name]]))


def _init(run: Run, path: str, call: Call) -> Value:
    given = call.at(0, "args")
    lists = tuple(atom for atom in given or () if isinstance(atom, Obj))
    own = all(isinstance(atom, (Obj, External)) or atom is None for atom in given or ())
    if lists or not own:
        words = words_in(run, lists) if len(lists) == len(given or ()) else None
        process = any(isinstance(atom, Unknown) and atom.why in OF_PROCESS for atom in given or ())
        if not process and (words is None or words != run.launched_words):
            run.findings.global_words.append(words)
    return NONE


def _parameter(run: Run, path: str, call: Call) -> Value:
    return parameter_object(run, call, call.at(0, "name") or ANY, call.at(2, "value") or NONE)


def _parameter_client(run: Run, path: str, call: Call) -> Value:
    for node in nodes_of(run, call.at(0, "node"), call):
        for service, interface in PARAMETER_SERVICES.items():
            remote = as_texts(call.at(1, "remote_node_name") or ANY)
            for text in text_value(concatenations([remote, [f"/{service}"]])):
                run.endpoint(node, CLIENT, text, interface, call.source)
    return (run.library_object(call, path),)


def _node_class(run: Run, path: str, call: Call) -> Value:
    return create_node(run, path if is_lifecycle(path) else NODE_CLASS, call)


_FUNCTIONS: dict[tuple[str, str], Callable[[Run, str, Call], Value]] = {
    **{("rclpy", name): _node_class for name in ("create_node", "Node", "LifecycleNode")},
    ("nav2_simple_commander", "BasicNavigator"): create_node,
    ("rclpy", "init"): _init,
    ("rclpy", "Parameter"): _parameter,
    ("rclpy", "AsyncParameterClient"): _parameter_client,
}
_MAKING = frozenset(_FUNCTIONS) - {("rclpy", "init"), ("rclpy", "Parameter")}
CREATING_NAMES = frozenset({*NODE_ENDPOINTS, *(name for _, name in (*ENDPOINT_CALLS, *HELPERS, *_MAKING))})


def makes_interfaces(path: str) -> bool:
    """Return whether a call of this function or class of a library makes a node or an interface."""
    key = _key(path)
    return key in ENDPOINT_CALLS or key in HELPERS or key in _MAKING


for _path in _CLASS_OF.values():
    FOREIGN_FIELDS[_path] = _endpoint_field
FOREIGN_FIELDS[PARAMETER] = _parameter_field
INTERFACE_CLASSES = frozenset(_CLASS_OF.values())
