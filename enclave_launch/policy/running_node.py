"""A node as it will run: its interface under the final name, in its enclave.

Takes a ``NodeInterface`` and the process or component that launch starts; gives a ``RunningNode``; next is the
derivation of the policy. Reads the parameter files on the command line.

Final names follow rcl (``rcl/src/rcl/remap.c``, ``node.c``): the program's own name and namespace, then the first
``__node`` and ``__ns`` rule that applies. A component has its own rule list from the load request and does not see
the container's command line (rclcpp_components/component_manager.cpp), unless ``forward_global_arguments`` says so.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, NamedTuple

from enclave_common.source_location import SourceLocation
from enclave_launch.errors import LaunchFileError
from enclave_launch.policy.program_inputs import ProgramInputs, environment_inputs, program_inputs
from enclave_launch.process import ResolvedComponent, ResolvedProcess
from enclave_launch.ros_rules.parameter_value import ParameterValue
from enclave_launch.ros_rules.rcl_parameters import parameters_of_text, resolve_parameters
from nodl.names import join
from nodl.node_interface import RANDOM_ENDING, Gap, NodeInterface
from nodl.remap import InvalidRemapRuleError, ParsedRule, RemapRules, parse_rule
from nodl.ros_arguments import parse_ros_arguments, remap_arguments

_UNDECIDED = "whether the node listens to what the launch gives it (use_global_arguments) is not known"
_NO_CONTAINER = "the node obeys the arguments of its container, which this launch does not start"

Role = Literal["node", "lifecycle_node", "container", "component", "launcher"]


class UnknownNodeName(LaunchFileError):
    """A program with a random or unknown node name. The services below that name cannot be signed."""


class RunningNode(NamedTuple):
    """A node that runs. ``name`` and ``namespace`` are final; ``original_name`` is what the program calls itself."""

    interface: NodeInterface
    original_name: str
    name: str
    namespace: str
    rules: RemapRules
    parameters: Mapping[str, ParameterValue]
    enclave: str
    location: SourceLocation
    role: Role = "node"
    inputs: ProgramInputs = ProgramInputs()
    process_namespace: str = "/"  # of the nodes that its process makes by itself

    @property
    def fqn(self) -> str:
        return join(self.namespace, self.name)

    @property
    def fixed_name(self) -> str:
        """Return the name, with ``*`` for the part that the program makes up at each start."""
        return self.name.removesuffix(RANDOM_ENDING)  # no rule of a launch file can hold a "*"


def node_of_process(
    process: ResolvedProcess, interface: NodeInterface, enclave: str, role: Role
) -> RunningNode:
    """Return one node of ``process``; raises LaunchFileError if rcl would refuse to start."""
    given = _rules_of_command(process)
    inputs = program_inputs(process)
    if interface.global_arguments is False:  # rcl_node_options_t.use_global_arguments
        rules = RemapRules(local=_own_rules(interface), process=())
        return _named(interface, rules, enclave, process.location, role, inputs)
    rules = RemapRules(local=_own_rules(interface), process=given)
    node = _named(interface, rules, enclave, process.location, role, inputs)
    parameters = {**process.parameters, **parameters_of_node(process, node.namespace, node.name)}
    if interface.global_arguments is None and (given or parameters):
        interface = interface._replace(gaps=(*interface.gaps, Gap(interface.source, _UNDECIDED)))
    return node._replace(interface=interface, parameters=parameters, process_namespace=_namespace(process))


def parameters_of_node(process: ResolvedProcess, namespace: str, name: str) -> Mapping[str, ParameterValue]:
    """Return what the command line of ``process`` gives the node of this final name.

    ``process.parameters`` has less where launch does not know the name: no section of a file that names the node."""
    tokens = [token for token in (*namespace.split("/"), name) if token]
    written = process.parameter_files
    return resolve_parameters(
        tokens,
        parse_ros_arguments(process.cmd).parameters,
        lambda path: parameters_of_text(written[path], path) if path in written else None,
        process.cwd,
    ).values


def node_of_component(
    component: ResolvedComponent, container: ResolvedProcess | None, interface: NodeInterface, enclave: str
) -> RunningNode:
    """Return a node of ``component``: its main one obeys the load request, one with options of its own the
    container's command line.

    :raises LaunchFileError: rcl would refuse to start because of a remap rule."""
    forwarded: tuple[ParsedRule, ...] = ()
    forwards = component.extra_arguments.get("forward_global_arguments") is True
    further = bool(interface.own_rules) or interface.of_process
    if container is not None and (forwards or further) and interface.global_arguments is not False:
        forwarded = _rules_of_command(container)
    local = _own_rules(interface) if further else _rules_of_load_request(component)
    if container is None and interface.of_process:
        interface = interface._replace(gaps=(*interface.gaps, Gap(interface.source, _NO_CONTAINER)))
    rules = RemapRules(local=local, process=forwarded)
    inputs = environment_inputs(container) if container is not None else ProgramInputs()
    node = _named(interface, rules, enclave, component.location, "component", inputs)
    if not further:
        node = node._replace(parameters=component.parameters)
    elif container is not None:
        node = node._replace(parameters=parameters_of_node(container, node.namespace, node.name))
    return node._replace(process_namespace=_namespace(container)) if container is not None else node


def _namespace(process: ResolvedProcess) -> str:
    rules = parse_ros_arguments(process.cmd).remaps
    return next((rule.partition(":=")[2] for rule in rules if rule.startswith("__ns:=")), "/")


def _own_rules(interface: NodeInterface) -> tuple[ParsedRule, ...]:
    """Return the rules in the node's own options; one of them may give it a name that ends at random."""
    rules: list[ParsedRule] = []
    for text in interface.own_rules:
        rule = parse_rule(text.removesuffix(RANDOM_ENDING), str(interface.source))
        ending = RANDOM_ENDING if text.endswith(RANDOM_ENDING) else ""
        rules.append(rule._replace(replacement=rule.replacement + ending))
    return tuple(rules)


def _named(
    interface: NodeInterface,
    rules: RemapRules,
    enclave: str,
    location: SourceLocation,
    role: Role,
    inputs: ProgramInputs,
) -> RunningNode:
    original = interface.name or ""
    name = rules.node_name(original).name
    if not name:
        raise UnknownNodeName(
            f"the name of node {interface.package}/{interface.executable or interface.plugin} is not known: neither "
            f"launch nor {interface.source} gives one",
            location,
        )
    namespace = rules.namespace(interface.namespace or "/", name).name
    return RunningNode(
        interface, original or name, name, namespace, rules, {}, enclave, location, role, inputs
    )


def _rules_of_command(process: ResolvedProcess) -> tuple[ParsedRule, ...]:
    # A rule that no ``remap`` wrote (``args``, the name) counts as written with the process.
    places = {rule.word: rule.location for rule in process.remaps}
    rules = remap_arguments(process.cmd).items()
    return tuple(_parse(text, places.get(word), process.location) for word, text in rules)


def _rules_of_load_request(component: ResolvedComponent) -> tuple[ParsedRule, ...]:
    rules = [(f"{rule.source}:={rule.target}", rule.location) for rule in component.remaps]
    if component.name:
        rules.append((f"__node:={component.name}", None))
    if component.namespace:
        rules.append((f"__ns:={component.namespace}", None))
    return tuple(_parse(text, place, component.location) for text, place in rules)


def _parse(text: str, place: SourceLocation | None, started_at: SourceLocation) -> ParsedRule:
    try:
        return parse_rule(text, str(place or started_at))
    except InvalidRemapRuleError as error:
        what = str(error).removeprefix(f"{started_at}: ")
        raise LaunchFileError(f"{what}; rcl would refuse to start this process", started_at, error) from error
