"""Objects become nodes: ``Node.__init__`` with its names, arguments and services."""

from __future__ import annotations

from nodl.builtin_interfaces import LOGGER_SERVICES
from nodl.infer.findings import NodeRecord
from nodl.infer.interpreter.conditions import truth
from nodl.infer.interpreter.elements import elements
from nodl.infer.interpreter.frames import Call
from nodl.infer.interpreter.run import Run
from nodl.infer.models.library_nodes import library_node
from nodl.infer.models.ros_parameters import assign_parameters
from nodl.infer.values import (
    ANY,
    BOTTOM,
    NONE,
    RESULT,
    External,
    Instance,
    Unknown,
    Value,
    constant_strings,
    join,
    unknown,
)
from nodl.node_interface import EndpointKind

NODE_CLASS = "rclpy.node.Node"


LIFECYCLE_CLASS = "rclpy.lifecycle.Node"


def is_lifecycle(path: str) -> bool:
    """Return True if the path of a node class says that its nodes are lifecycle nodes."""
    return ".lifecycle" in path or path.endswith("LifecycleNode")


def initialise_node(run: Run, instance: Instance, path: str, call: Call) -> None:
    """Model ``Node.__init__``: the instance becomes a node."""
    record = record_of_instance(run, instance, call)
    run.understood.add(call.node)
    record.created = True
    record.source = call.source
    library = library_node(path)
    default: Value = (library.name,) if library else unknown("a node without a name")
    record.names = join(record.names, call.args.at(0, "node_name") or default)
    for fixed in library.endpoints if library else ():
        record.add_endpoint(fixed.kind, fixed.name, fixed.type, call.source)
    record.namespaces = join(record.namespaces, call.args.at(1 if library else -1, "namespace") or NONE)
    record.lifecycle = record.lifecycle or is_lifecycle(path)
    local = call.args.at(-1, "cli_args")
    record.arguments = join(record.arguments, strings_in(run, local, call) if local else BOTTOM)
    use_global = call.args.at(-1, "use_global_arguments")
    if use_global is not None:
        record.use_global_arguments = use_global
    if record.lifecycle:
        enabled = call.args.at(-1, "enable_communication_interface")
        record.communication_interface = enabled is None or truth(enabled) is not False
    overrides = call.args.at(-1, "parameter_overrides")
    if overrides:
        assign_parameters(run, record, overrides, call)
    if truth(call.args.at(-1, "enable_logger_service") or (False,)) is not False:
        for service, service_type in LOGGER_SERVICES.items():
            record.add_endpoint(EndpointKind.SERVICE_SERVER, f"~/{service}", service_type, call.source)


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
    if instance.node is None:
        instance.node = run.findings.add_node(NodeRecord(call.source))
    return instance.node


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
            records.append(record_of_instance(run, atom, call))
        elif isinstance(atom, Unknown | External):
            why = atom.why if isinstance(atom, Unknown) else f"a result of {atom.path.removesuffix(RESULT)}"
            run.findings.gap(call.source, f"the node of this endpoint is not known: {why}")
            records.append(run.findings.unknown_node(call.source))
    return records
