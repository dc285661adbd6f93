"""Node classes and node variables of C++ sources with their endpoints, under the executables CMake builds."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from nodl.infer.cpp.cmake import Build
from nodl.infer.cpp.evaluate import (
    Parts,
    Scope,
    arguments_of,
    called_name,
    evaluate,
    receiver_of,
    template,
    unknown,
)
from nodl.infer.cpp.source import CppClass, CppUnit, Function, line_of, text, walk
from nodl.infer.models.signatures import HELPERS
from nodl.infer.results import certainty_of
from nodl.name_template import NameTemplate, UnknownPart
from nodl.node_interface import ClientLibrary, Endpoint, EndpointKind, Gap, NodeInterface
from nodl.source_ref import SourceRef

if TYPE_CHECKING:
    from tree_sitter import Node

# call -> kind, position of the name; the type is the template argument
_CREATES = {
    "create_publisher": (EndpointKind.PUBLISHER, 0),
    "create_subscription": (EndpointKind.SUBSCRIPTION, 0),
    "create_service": (EndpointKind.SERVICE_SERVER, 0),
    "create_client": (EndpointKind.SERVICE_CLIENT, 0),
    "create_generic_publisher": (EndpointKind.PUBLISHER, 0),
    "create_generic_subscription": (EndpointKind.SUBSCRIPTION, 0),
}
_ACTIONS = {"create_server": EndpointKind.ACTION_SERVER, "create_client": EndpointKind.ACTION_CLIENT}
_NODE_CLASSES = ("rclcpp::Node", "rclcpp_lifecycle::LifecycleNode", "nav2_util::LifecycleNode")
_TF = {leaf: helper.endpoints for (package, leaf), helper in HELPERS.items() if package == "tf2_ros"}


@dataclass(eq=False)
class _Found:
    """A node under construction."""

    names: list[Parts]
    namespaces: list[Parts]
    source: SourceRef
    lifecycle: bool = False
    cls: CppClass | None = None
    endpoints: dict[Endpoint, None] = field(default_factory=dict)
    parameters: dict[str, list[Parts]] = field(default_factory=dict)
    gaps: dict[Gap, None] = field(default_factory=dict)


def nodes_of_unit(unit: CppUnit, build: Build, package: str | None) -> tuple[list[NodeInterface], list[Gap]]:
    """All nodes of a package's C++ sources, and gaps that belong to none of them."""
    gaps = [Gap(source, "this C++ could not be parsed") for source in unit.errors]
    nodes: list[NodeInterface] = []
    parents = {base.rpartition("::")[2] for cls in unit.classes.values() for base in cls.bases}
    for cls in unit.classes.values():
        if _node_base(cls, unit) and (cls.name not in parents or _is_made(cls, unit)):
            nodes.extend(_interfaces(_class_node(cls, unit), unit, build, package))
    for function in unit.functions:
        for found in _local_nodes(function, unit, gaps):
            nodes.extend(_interfaces(found, unit, build, package))
    return nodes, gaps


def _is_made(cls: CppClass, unit: CppUnit) -> bool:
    """A class that others derive from counts only if the sources make an object of it or register it."""
    return cls.qualified in unit.registered or any(
        call.type == "call_expression" and _template_argument(call).rpartition("::")[2] == cls.name
        for function in unit.functions
        for call in walk(function.node)
    )


def _node_base(cls: CppClass, unit: CppUnit, depth: int = 0) -> str | None:
    """The ROS class that ``cls`` derives from, directly or through classes of the unit."""
    for base in cls.bases:
        name = unit.aliases.get(base, base)
        if name in _NODE_CLASSES or (name in ("Node", "LifecycleNode") and name not in unit.classes):
            return name
        parent = unit.classes.get(name.rpartition("::")[2])
        if parent is not None and parent is not cls and depth < 8:
            found = _node_base(parent, unit, depth + 1)
            if found:
                return found
    return None


def _ancestry(cls: CppClass, unit: CppUnit) -> list[CppClass]:
    order = [cls]
    for base in cls.bases:
        parent = unit.classes.get(base.rpartition("::")[2])
        if parent is not None and parent not in order:
            order.extend(each for each in _ancestry(parent, unit) if each not in order)
    return order


def _class_node(cls: CppClass, unit: CppUnit) -> _Found:
    base = _node_base(cls, unit) or ""
    found = _Found([], [], SourceRef(cls.file, cls.line), "Lifecycle" in base, cls)
    family = _ancestry(cls, unit)
    for member in family:
        for function in member.functions:
            _declared(function, Scope(unit, function, member), found)
    for member in family:
        arguments = _constructor_arguments(member, unit)
        for function in member.functions:
            scope = Scope(unit, function, member, found.parameters, arguments)
            _names_from(function, scope, found)
            _endpoints(function.node, scope, found, {"", "this"})
    return found


def _names_from(function: Function, scope: Scope, found: _Found) -> None:
    """The arguments of the ``Node(...)`` initialiser of a constructor."""
    for base in ("Node", "LifecycleNode"):
        given = function.initialisers.get(base)
        if given is None:
            continue
        arguments = [child for child in given.named_children if child.type != "comment"]
        if arguments:
            found.names += evaluate(arguments[0], scope)
            found.source = SourceRef(function.file, line_of(given))
        if len(arguments) > 1 and "ption" not in text(arguments[1]):
            found.namespaces += evaluate(arguments[1], scope)


def _constructor_arguments(cls: CppClass, unit: CppUnit) -> dict[str, list[Parts]]:
    """What constructor parameters may be: arguments of derived classes and of ``make_shared<C>(...)``."""
    found: dict[str, list[Parts]] = {}
    constructors = [function for function in cls.functions if function.name == cls.name]
    sites = list(_construction_sites(cls, unit))
    for constructor in constructors:
        for index, name in enumerate(constructor.parameters):
            values: list[Parts] = []
            for arguments, scope in sites:
                if index < len(arguments):
                    values += evaluate(arguments[index], scope)
            if name in constructor.defaults:
                values += evaluate(constructor.defaults[name], Scope(unit))
            if values:
                found.setdefault(name, []).extend(values)
    return found


def _construction_sites(cls: CppClass, unit: CppUnit) -> Iterator[tuple[list[Node], Scope]]:
    everywhere = [(None, function) for function in unit.functions]
    everywhere += [(each, function) for each in unit.classes.values() for function in each.functions]  # type: ignore[misc]
    for owner, function in everywhere:
        scope = Scope(unit, function, owner)
        given = function.initialisers.get(cls.name)
        if given is not None and owner is not cls:
            yield list(given.named_children), scope
        for call in walk(function.node):
            made = call.type == "call_expression" and called_name(call) in ("make_shared", "make_unique")
            if made and _template_argument(call).rpartition("::")[2] == cls.name:
                yield arguments_of(call), scope


# --- endpoints ----------------------------------------------------------------------------------------------


def _declared(function: Function, scope: Scope, found: _Found) -> None:
    for call in walk(function.node):
        if call.type == "call_expression" and called_name(call) in ("declare_parameter", "get_parameter_or"):
            arguments = arguments_of(call)
            default = arguments[-1] if len(arguments) > 1 else None
            for parts in evaluate(arguments[0], scope) if arguments else ():
                if len(parts) == 1 and isinstance(parts[0], str):
                    values = evaluate(default, scope) if default is not None else []
                    found.parameters.setdefault(parts[0], []).extend(values)


def _endpoints(body: Node, scope: Scope, found: _Found, receivers: set[str]) -> None:
    for call in walk(body):
        if call.type == "call_expression":
            _endpoint_of_call(call, scope, found, receivers)
        elif call.type == "field_initializer" and len(call.named_children) > 1:
            _member_initialiser(call, scope, found)


def _endpoint_of_call(call: Node, scope: Scope, found: _Found, receivers: set[str]) -> None:
    name = called_name(call)
    arguments = arguments_of(call)
    whole = text(call.child_by_field_name("function"))
    source = SourceRef(_file(scope), line_of(call))
    if whole.startswith("rclcpp_action::") and name in _ACTIONS:
        _add(found, _ACTIONS[name], arguments, 1, _type(call, scope), source, scope)
    elif name in _CREATES and receiver_of(call) in receivers and _has_type(call, name):
        kind, position = _CREATES[name]
        if whole.startswith(("rclcpp::", "image_transport::")):
            position += 1
        _add(found, kind, arguments, position, _type(call, scope), source, scope)
    elif name in ("make_shared", "make_unique"):
        _library_object(_template_argument(call), arguments, source, scope, found)
    elif name == "subscribe" and len(arguments) > 1 and text(arguments[0]) == "this":
        _add(found, EndpointKind.SUBSCRIPTION, arguments, 1, "", source, scope)
    elif name == "add_on_set_parameters_callback" or not any(text(a) in _HANDED for a in arguments):
        return
    elif not whole.startswith(("std::", "rclcpp", "tf2_ros::", "image_transport::")) and name not in _CREATES:
        found.gaps[Gap(source, f"the node is handed to {whole[:80]}, which may create endpoints on it")] = (
            None
        )


_HANDED = frozenset({"this", "*this", "shared_from_this()", "this->shared_from_this()"})


def _has_type(call: Node, name: str) -> bool:
    return bool(_template_argument(call)) or "generic" in name or "image_transport::" in text(call)[:20]


def _library_object(made: str, arguments: list[Node], source: SourceRef, scope: Scope, found: _Found) -> None:
    """``std::make_shared<tf2_ros::TransformListener>(...)`` and ``message_filters::Subscriber<T>``."""
    leaf = made.partition("<")[0].rpartition("::")[2]
    if made.startswith("tf2_ros::") and leaf in _TF and leaf != "Buffer":
        for fixed in _TF[leaf]:
            found.endpoints[Endpoint(fixed.kind, NameTemplate.literal(fixed.name), fixed.type, source)] = None
    elif made.startswith("message_filters::Subscriber"):
        inner = made.partition("<")[2].rpartition(">")[0].split(",")[0]
        if len(arguments) > 1:
            kind = EndpointKind.SUBSCRIPTION
            _add(found, kind, arguments, 1, _ros_type(inner, scope.unit), source, scope)


def _member_initialiser(node: Node, scope: Scope, found: _Found) -> None:
    """``tf_broadcaster_(this)`` for a member whose class makes endpoints."""
    if scope.cls is None:
        return
    member = text(node.named_children[0])
    for declared in _member_types(scope.cls, member):
        arguments = list(node.named_children[-1].named_children)
        source = SourceRef(_file(scope), line_of(node))
        _library_object(declared, arguments, source, scope, found)


def _member_types(cls: CppClass, member: str) -> Iterator[str]:
    for function in cls.functions:
        parent = function.node.parent
        for sibling in parent.named_children if parent is not None else ():
            if (
                sibling.type == "field_declaration"
                and text(sibling.child_by_field_name("declarator")) == member
            ):
                yield text(sibling.child_by_field_name("type"))
        return


def _add(
    found: _Found, kind: EndpointKind, arguments: list[Node], position: int, type_name: str, source: SourceRef,
    scope: Scope,
) -> None:  # fmt: skip
    node = arguments[position] if position < len(arguments) else None
    for parts in evaluate(node, scope) or unknown("a name that is never set"):
        name = template(parts)
        found.endpoints[Endpoint(kind, name, type_name, source, certainty_of(name))] = None


def _template_argument(call: Node) -> str:
    function = call.child_by_field_name("function")
    while function is not None and function.type in ("field_expression", "qualified_identifier"):
        function = function.child_by_field_name("field") or function.child_by_field_name("name")
    arguments = function.child_by_field_name("arguments") if function is not None else None
    return text(arguments.named_children[0]) if arguments is not None and arguments.named_children else ""


def _type(call: Node, scope: Scope) -> str:
    return _ros_type(_template_argument(call), scope.unit)


def _ros_type(name: str, unit: CppUnit) -> str:
    """``std_msgs::msg::String``, through aliases, as ``std_msgs/msg/String``; empty if not known."""
    for _ in range(4):
        first, separator, rest = name.strip().lstrip(":").partition("::")
        if first not in unit.aliases:
            break
        name = unit.aliases[first] + separator + rest
    steps = name.strip().lstrip(":").split("::")
    if len(steps) == 3 and steps[1] in ("msg", "srv", "action"):
        return "/".join(steps)
    return ""


def _file(scope: Scope) -> str:
    return scope.function.file if scope.function is not None else ""


# --- nodes made in functions --------------------------------------------------------------------------------


def _local_nodes(function: Function, unit: CppUnit, gaps: list[Gap]) -> Iterator[_Found]:
    """``auto node = rclcpp::Node::make_shared("n")`` and what is created on it; other receivers are gaps."""
    scope = Scope(unit, function)
    known: set[str] = set()
    for name, values in function.values.items():
        for value in values:
            call = value.child_by_field_name("right") if value.type == "assignment_expression" else value
            if call is None or call.type != "call_expression" or not _makes_node(call):
                continue
            known.add(name.rpartition(" ")[2])
            arguments = arguments_of(call)
            source = SourceRef(function.file, line_of(call))
            namespaces = evaluate(arguments[1], scope) if len(arguments) > 1 else []
            found = _Found(evaluate(arguments[0] if arguments else None, scope), namespaces, source)
            _declared(function, scope, found)
            scope.defaults = found.parameters
            _endpoints(function.node, scope, found, {name, f"(*{name})"})
            yield found
    for call in walk(function.node):
        if call.type != "call_expression" or called_name(call) not in _CREATES:
            continue
        receiver = receiver_of(call)
        if receiver and receiver not in known and _template_argument(call):
            source = SourceRef(function.file, line_of(call))
            gaps.append(Gap(source, f"the node {receiver} of this endpoint is not known"))


def _makes_node(call: Node) -> bool:
    whole = text(call.child_by_field_name("function"))
    return whole in ("rclcpp::Node::make_shared", "rclcpp_lifecycle::LifecycleNode::make_shared") or (
        called_name(call) in ("make_shared", "make_unique") and _template_argument(call) in _NODE_CLASSES
    )


# --- results ------------------------------------------------------------------------------------------------


def _interfaces(found: _Found, unit: CppUnit, build: Build, package: str | None) -> list[NodeInterface]:
    if found.cls is not None and not found.names and not found.endpoints:
        return []  # an abstract base
    gaps = list(found.gaps)
    names = [_plain(parts) for parts in found.names] or [None]
    if names == [None]:
        gaps.append(Gap(found.source, "the name of this node is not known"))
    namespaces = [_plain(parts) for parts in found.namespaces] or ["/"]
    plain = [
        NodeInterface(
            package=package,
            executable=None,
            plugin=None,
            name=name,
            namespace=namespace if namespace is None or namespace.startswith("/") else f"/{namespace}",
            endpoints=tuple(found.endpoints),
            source=found.source,
            library=ClientLibrary.RCLCPP,
            lifecycle=found.lifecycle,
            parameters=tuple(sorted(found.parameters)),
            gaps=tuple(gaps),
        )
        for name in dict.fromkeys(names)
        for namespace in dict.fromkeys(namespaces)
    ]
    keys = _keys(found, unit, build)
    return [node._replace(executable=exe, plugin=plugin) for node in plain for exe, plugin in keys]


def _plain(parts: Parts) -> str | None:
    filled = template(parts).fill({})
    return filled.text if not any(isinstance(part, UnknownPart) for part in filled.parts) else None


def _keys(found: _Found, unit: CppUnit, build: Build) -> list[tuple[str | None, str | None]]:
    """Under which executables and plugins launch can start the node."""
    keys: list[tuple[str | None, str | None]] = []
    if found.cls is not None:
        plugin = found.cls.qualified
        if plugin in unit.registered or plugin in build.plugins:
            keys.append((build.plugins.get(plugin), plugin))
        files = [f.file for f in unit.functions if f.name == "main" and _mentions(f, found.cls.name)]
    else:
        files = [found.source.file]
    for executable, sources in build.executables.items():
        if any(os.path.basename(file) in sources for file in files):
            keys.append((executable, None))
    return list(dict.fromkeys(keys)) or [(None, None)]


def _mentions(function: Function, name: str) -> bool:
    return any(
        child.type in ("type_identifier", "identifier") and text(child) == name
        for child in walk(function.node)
    )
