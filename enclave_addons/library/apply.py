"""A described node and one situation of it give the interface that it has there, and the nodes it brings along.

What cannot be decided is a gap of the interface, never a name that was guessed. Reads configuration files that launch
names, and asks ``Documents`` for plugins and further nodes.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import NamedTuple, Protocol

from enclave_addons.library.configuration import read_configuration
from enclave_addons.library.configuration.configured import ConfiguredPlugin
from enclave_addons.library.scope import Filled, Scope
from nodl.dependence import (
    COMPONENT,
    Configuration,
    Dependence,
    FurtherNode,
    PluginList,
    Situation,
    Spawned,
    Transport,
    Variation,
)
from nodl.name_template import NameTemplate
from nodl.names import join
from nodl.node_interface import Certainty, ClientLibrary, Endpoint, EndpointKind, Gap, NodeInterface

TF_LISTENER = "transform_listener_impl_*"
_TF_TOPICS = ("/tf", "/tf_static")
_TF = "tf2_msgs/msg/TFMessage"
_NOTHING = Dependence()
_DEPTH = 8


class Documents(Protocol):
    """Source of the descriptions of plugins and further nodes. ``None`` means that there is no description."""

    def of_class(self, plugin_class: str, instance: str = "") -> NodeInterface | None: ...

    def named(self, name: str) -> NodeInterface | None: ...

    def transports(self) -> tuple[tuple[str, str, NodeInterface], ...]: ...


class Applied(NamedTuple):
    """A description applied to one start. ``further``: nodes of the same process, to be applied in situations of their
    own."""

    interface: NodeInterface
    further: tuple[NodeInterface, ...] = ()


def applied(interface: NodeInterface, situation: Situation, documents: Documents) -> Applied:
    """Return ``interface`` as it is in ``situation``; one that depends on nothing is returned as it is."""
    if interface.depends is None:
        return Applied(interface)
    work = _Application(interface, situation, documents)
    work.describe(interface, "", (), 0)
    result = interface._replace(
        endpoints=tuple(dict.fromkeys(work.endpoints)),
        gaps=tuple(dict.fromkeys(work.gaps)),
        depends=None,
        unused_configuration=tuple(work.unused_configuration),
    )
    return Applied(result, tuple(work.further))


def own_name(interface: NodeInterface, situation: Situation) -> str | None:
    """Return the name that the program gives its node, if that follows the command line or is random (then with
    ``*``).
    """
    depends = interface.depends
    if depends is None:
        return interface.name
    if depends.random_name:
        return f"{interface.name}_*"
    scope = Scope(situation, depends.defaults, depends.options)
    return scope.fill(depends.node_name).text or interface.name


class _Application:
    def __init__(self, interface: NodeInterface, situation: Situation, documents: Documents):
        self._main = interface
        self._situation = situation
        self._documents = documents
        self.endpoints: list[Endpoint] = []
        self.gaps: list[Gap] = []
        self.further: list[NodeInterface] = []
        self.unused_configuration: list[str] = []

    def describe(
        self,
        interface: NodeInterface,
        plugin: str,
        notes: tuple[str, ...],
        depth: int,
        properties: Mapping[str, object] = MappingProxyType({}),
    ) -> None:
        """Add what ``interface``, the node itself or a plugin of it with ``properties`` of its own, has."""
        depends = interface.depends or _NOTHING
        situation = self._situation._replace(parameters={**self._situation.parameters, **properties})
        scope = Scope(situation, depends.defaults, depends.options, plugin)
        self.gaps.extend(gap._replace(why="; ".join((gap.why, *notes))) for gap in interface.gaps)
        for endpoint in interface.endpoints:
            if depends.tf_listener is not None and _is_of_tf_listener(endpoint):
                continue
            variation = depends.variations.get((endpoint.kind, endpoint.name.text))
            self.endpoints.extend(_varied(endpoint, variation or Variation(), scope, notes))
        for gap in depends.gaps:
            for item in _repeated(gap.each, scope):
                if scope.holds(gap.when, item):
                    why = scope.fill(gap.why, item).text or gap.why
                    self._gap(interface, "; ".join((why, *notes)))
        for plugins in depends.plugins:
            self._load(plugins, scope, interface, depth)
        for transport in depends.transports:
            for item in _repeated(transport.each, scope):
                self._transport(transport, item, scope, interface, notes)
        for node in depends.nodes:
            self._further(node, scope, interface)
        for configuration in depends.configurations:
            self._configured(configuration, scope, interface)
        if depends.tf_listener is not None and scope.holds(depends.tf_listener):
            self.further.append(_tf_listener(self._main))

    def _gap(self, by: NodeInterface, why: str) -> None:
        self.gaps.append(Gap(by.source, why))

    def _load(self, plugins: PluginList, scope: Scope, by: NodeInterface, depth: int) -> None:
        if not scope.holds(plugins.when):
            return
        if depth >= _DEPTH:
            self._gap(by, "plugins that load plugins are nested too deep")
            return
        instances = [*plugins.always, *scope.items(plugins.parameter)]
        types = dict(plugins.types)
        if plugins.spawned:
            for spawned in self._spawned():
                instances.append(spawned.controller)
                types |= {spawned.controller: spawned.type} if spawned.type else {}
        if not instances and scope.value(plugins.parameter) is None:
            instances = [scope.fill(name).text or "" for name in plugins.default]
        left_out = set(scope.items(plugins.without)) if plugins.without else set()
        for instance in dict.fromkeys(instances):
            if instance not in left_out:
                self._load_one(instance, plugins._replace(types=types), by, depth)

    def _load_one(self, instance: str, plugins: PluginList, by: NodeInterface, depth: int) -> None:
        inner = Scope(self._situation, (by.depends or _NOTHING).defaults, {}, instance)
        class_parameter = inner.fill(plugins.type).text
        value = inner.value(class_parameter or "", plugins.types.get(instance))
        plugin_class = inner.fill(plugins.plugin_class).text or (None if value is None else str(value.value))
        if plugin_class is None:
            self._gap(by, f"the class of plugin '{instance}' is not known: {class_parameter} is not set")
            return
        described = self._documents.of_class(plugin_class, instance)
        if described is None:
            self._gap(by, f"plugin '{instance}' is of class {plugin_class}, which no document describes")
            return
        if described.depends is not None and described.depends.own_node:
            self.further.append(self._own_node(described, instance))
            return
        self.describe(described, instance, (f"plugin {instance} of class {plugin_class}",), depth + 1)

    def _own_node(self, described: NodeInterface, instance: str) -> NodeInterface:
        """Return a plugin that is a node: a controller, with what its spawner gives it."""
        mine = [item for item in self._spawned() if item.controller == instance]
        return described._replace(
            name=instance,
            own_rules=(f"__node:={instance}", *(rule for item in mine for rule in item.rules)),
            own_parameters=tuple(pair for item in mine for pair in item.parameters.items()),
        )

    def _spawned(self) -> Iterator[Spawned]:
        """Yield the controllers that spawners of the launch load into this node."""
        manager = join(self._situation.namespace, self._situation.node)
        return (item for item in self._situation.launched.spawned if item.manager == manager)

    def _transport(
        self, transport: Transport, item: str, scope: Scope, by: NodeInterface, notes: tuple[str, ...]
    ) -> None:
        if not scope.holds(transport.when, item):
            return
        base = scope.fill(transport.base, item)
        name = base.text
        if not name:
            return
        chosen = scope.value(transport.parameter) if transport.parameter else None
        for short, package, described in self._documents.transports():
            if transport.parameter or transport.side == "subscriptions":
                if chosen is None or str(chosen.value) != short:
                    continue
            elif not (self._is_enabled(short, name, scope) and self._is_installed(package)):
                continue
            kind = EndpointKind.PUBLISHER if transport.side == "publishers" else EndpointKind.SUBSCRIPTION
            for endpoint in described.endpoints:
                full = endpoint.name.text.replace("base", name, 1)
                note = "; ".join((*base.notes, f"image_transport {short}", *notes))
                self.endpoints.append(
                    endpoint._replace(kind=kind, name=NameTemplate.literal(full), source=by.source, note=note)
                )

    @staticmethod
    def _is_enabled(transport: str, base: str, scope: Scope) -> bool:
        wanted = scope.value(f"{base.lstrip('~/').replace('/', '.')}.enable_pub_plugins")
        return wanted is None or any(
            transport in (entry.rpartition("/")[2], entry) for entry in map(str, _sequence(wanted.value))
        )

    def _is_installed(self, package: str) -> bool:
        return self._situation.installed is not None and package in self._situation.installed

    def _further(self, node: FurtherNode, scope: Scope, by: NodeInterface) -> None:
        if not scope.holds(node.when):
            return
        described = self._documents.named(node.document)
        name = scope.fill(node.node).text
        if described is None or name is None:
            self._gap(by, f"no document {node.document} describes its node '{node.node}'")
            return
        rules = [] if node.renamed else [f"__node:={name}"]
        if node.namespace:
            relative = scope.fill(node.namespace).text or ""
            absolute = relative.startswith("/")
            rules.append(f"__ns:={relative if absolute else join(self._situation.namespace, relative)}")
        self.further.append(
            described._replace(
                package=self._main.package,
                executable=self._main.executable,
                plugin=self._main.plugin,
                name=name,
                own_rules=tuple(rules),
            )
        )

    def _configured(self, configuration: Configuration, scope: Scope, by: NodeInterface) -> None:
        if not scope.holds(configuration.when):
            return

        file = scope.fill(configuration.file).text
        found = read_configuration(configuration.kind, file or "", self._situation, by.source)
        self.endpoints.extend(found.endpoints)
        self.gaps.extend(found.gaps)
        self.unused_configuration.extend(found.unused)
        for name in found.nodes:
            described = self._documents.named(configuration.document)
            if described is None:
                self._gap(by, f"no document {configuration.document} describes node '{name}'")
            else:
                self.further.append(described._replace(name=name, own_rules=(f"__node:={name}",)))
        for plugin in found.plugins:
            described = self._documents.of_class(plugin.plugin_class, plugin.node)
            if described is None:
                self.gaps.append(Gap(plugin.place, f"what the {plugin.what} needs is not known"))
            elif described.name == COMPONENT:
                self._on_own_node(plugin, described)
            else:
                self.describe(described, "", (f"{plugin.what}, {plugin.place}",), 1, plugin.properties)

    def _on_own_node(self, plugin: ConfiguredPlugin, described: NodeInterface) -> None:
        """Add what a hardware component makes on the node that ros2_control gives it."""
        for place, node in enumerate(self.further):
            if node.name == plugin.node:
                endpoints = tuple(each._replace(note=plugin.what) for each in described.endpoints)
                self.further[place] = node._replace(
                    endpoints=(*node.endpoints, *endpoints), gaps=(*node.gaps, *described.gaps)
                )
                return
        self.gaps.append(Gap(plugin.place, f"the {plugin.what} has no node in this release, but uses one"))


_LONE = re.compile(r"\$\(param (?:[^ ()$]|\$\([a-z]+\))+\)\Z")
"""A template that is one parameter and nothing else."""


def _varied(
    endpoint: Endpoint, variation: Variation, scope: Scope, notes: tuple[str, ...]
) -> Iterator[Endpoint]:
    if variation.each:
        notes = (f"entry of {variation.each}", *notes)
    if endpoint.note:
        notes = (endpoint.note, *notes)
    for item in _repeated(variation.each, scope):
        if not scope.holds(variation.when, item):
            continue
        if not variation.name:
            yield endpoint._replace(note="; ".join(notes))
            continue
        filled = scope.fill(variation.name, item)
        if filled.text is None and not variation.each and _LONE.match(variation.name):
            yield _default(endpoint, variation.name, notes)
        elif filled.text != "":  # an empty name switches an endpoint off
            yield _named(endpoint, filled, notes)


def _default(endpoint: Endpoint, template: str, notes: tuple[str, ...]) -> Endpoint:
    """Return the listed name, which holds unless the parameter is set."""
    parameter = template.removeprefix("$(param ").removesuffix(")")
    note = "; ".join((f"parameter {parameter}, its default", *notes))
    return endpoint._replace(note=note, certainty=Certainty.FROM_DEFAULT)


def _named(endpoint: Endpoint, filled: Filled, notes: tuple[str, ...]) -> Endpoint:
    return endpoint._replace(name=filled.template, note="; ".join((*filled.notes, *notes)))


def _repeated(each: str, scope: Scope) -> Iterator[str]:
    return scope.items(each) if each else iter(("",))


def _sequence(value: object) -> tuple[object, ...]:
    return tuple(value) if isinstance(value, (list, tuple)) else (value,)


def _tf_listener(interface: NodeInterface) -> NodeInterface:
    """Return the node that ``tf2_ros::TransformListener`` makes if it is given none (transform_listener.cpp).

    It is named by a memory address, in the process's namespace, without parameter services.
    """
    return NodeInterface(
        package=interface.package,
        executable=interface.executable,
        plugin=interface.plugin,
        name=TF_LISTENER,
        namespace=None,
        endpoints=tuple(
            Endpoint(EndpointKind.SUBSCRIPTION, NameTemplate.literal(name), _TF, interface.source)
            for name in _TF_TOPICS
        ),
        source=interface.source,
        library=ClientLibrary.RCLCPP,
        own_rules=(f"__node:={TF_LISTENER}",),
        parameter_services=False,
    )


def _is_of_tf_listener(endpoint: Endpoint) -> bool:
    return endpoint.kind is EndpointKind.SUBSCRIPTION and endpoint.name.text in _TF_TOPICS
