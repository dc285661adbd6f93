"""``node_container`` and ``load_composable_node``: containers, and what is loaded into them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from enclave_common.source_location import SourceLocation
from enclave_launch.description.actions.components import (
    ComposableLifecycleNode,
    ComposableNode,
    parse_lifecycle_components,
)
from enclave_launch.description.actions.lifecycle import autostarted_component
from enclave_launch.description.actions.nodes import Node
from enclave_launch.description.argument_types import ensure_argument_type
from enclave_launch.description.entity import Action, LaunchDescriptionEntity
from enclave_launch.description.launch_context import LaunchContext
from enclave_launch.description.location import location_of
from enclave_launch.description.markup.entity import Entity, Parser
from enclave_launch.description.markup.expose import expose_action
from enclave_launch.description.node_names import performed_remaps, placed, warn_about_repeats
from enclave_launch.description.parameters.descriptions import ParameterFile
from enclave_launch.description.parameters.evaluate import evaluate_parameters
from enclave_launch.description.parameters.normalize import normalize_parameter_dict
from enclave_launch.description.parameters.of_node import to_parameters_list
from enclave_launch.description.substitution import (
    SomeSubstitutionsType,
    SomeSubstitutionsType_types_tuple,
    Substitution,
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.process import (
    LauncherCall,
    ProcessKind,
    RemapRule,
    ResolvedComponent,
    Unforeseeable,
    UnknownParameters,
)
from enclave_launch.ros_rules.distro import Feature
from enclave_launch.ros_rules.namespaces import make_namespace_absolute, prefix_namespace
from enclave_launch.ros_rules.parameter_value import ParameterValue

if TYPE_CHECKING:
    from enclave_launch.description.parameters.types import EvaluatedParameters


@expose_action("node_container")
class ComposableNodeContainer(Node):
    """Executes as a node, then gives a ``LoadComposableNodes`` for the components whose condition holds."""

    process_kind: ProcessKind = "container"

    def __init__(
        self,
        *,
        name: SomeSubstitutionsType,
        namespace: SomeSubstitutionsType,
        composable_node_descriptions: Sequence[ComposableNode] | None = None,
        **kwargs: Any,
    ):
        super().__init__(name=name, namespace=namespace, **kwargs)
        self.__descriptions = composable_node_descriptions or ()

    @classmethod
    def parse(
        cls, entity: Entity, parser: Parser, ignore: list[str] | None = None
    ) -> tuple[type[ComposableNodeContainer], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser, ignore)
        components = parse_components(entity, parser, optional=True)
        if components is not None:
            kwargs["composable_node_descriptions"] = components
        return cls, kwargs

    def execute(self, context: LaunchContext) -> list[LaunchDescriptionEntity] | None:

        wanted = [item for item in self.__descriptions if _condition_holds(item, context)]
        actions = super().execute(context)
        if not wanted:
            return actions
        load = LoadComposableNodes(composable_node_descriptions=wanted, target_container=self)
        load.source_location = self.source_location
        return [*(actions or ()), load]


def parse_components(entity: Entity, parser: Parser, *, optional: bool) -> list[ComposableNode] | None:
    """Parse the ``composable_node`` children, of newer distributions also ``composable_lifecycle_node``."""
    lifecycle = parse_lifecycle_components(entity, parser)
    children = entity.get_attr(
        "composable_node",
        data_type=list[Entity],
        optional=optional or bool(lifecycle),
    )
    if children is None:
        return lifecycle or None
    return [ComposableNode.from_entity(child, parser) for child in children] + lifecycle


def _condition_holds(description: ComposableNode, context: LaunchContext) -> bool:
    condition = description.condition()
    return condition is None or condition.evaluate(context)


# ``load_composable_node``: load components into a container that runs, or soon will.

_LOAD_NODE = "composition_interfaces/srv/LoadNode"


@expose_action("load_composable_node")
class LoadComposableNodes(Action):
    """The requests are made when this executes; they are sent once the container's service is there.

    A target given as text is used as it is: no namespace is added. A container object must have been
    executed before.
    """

    def __init__(
        self,
        *,
        composable_node_descriptions: Sequence[ComposableNode],
        target_container: SomeSubstitutionsType | ComposableNodeContainer,
        **kwargs: Any,
    ):
        ensure_argument_type(
            target_container,
            [*SomeSubstitutionsType_types_tuple, ComposableNodeContainer],
            "target_container",
            "LoadComposableNodes",
        )
        super().__init__(**kwargs)
        self.__descriptions = composable_node_descriptions
        self.__target: ComposableNodeContainer | list[Substitution]
        if isinstance(target_container, ComposableNodeContainer):
            self.__target = target_container
        else:
            self.__target = normalize_to_list_of_substitutions(target_container)

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[LoadComposableNodes], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        kwargs["target_container"] = parser.parse_substitution(entity.get_attr("target"))
        kwargs["composable_node_descriptions"] = parse_components(entity, parser, optional=False)
        return cls, kwargs

    def execute(self, context: LaunchContext) -> list[LaunchDescriptionEntity] | None:
        """Load the components; raises ``RuntimeError`` if the container was not executed yet, and as components do."""
        container = self.__container_name(context)
        service = f"{container}/_container/load_node"
        context.host.launcher_call(LauncherCall(service, _LOAD_NODE, location_of(self, context)))
        wanted = [item for item in self.__descriptions if self.__is_wanted(item, context)]
        components = [self.__resolve(item, container, context) for item in wanted]
        if components:
            context.host.load_components(components, context)
        for component in components:
            if component.name:  # else the container reports a name that only the plugin knows
                warn_about_repeats(context, component.fqn, container)
        return [
            autostarted_component(component.fqn, context, component.location)
            for description, component in zip(wanted, components, strict=True)
            if isinstance(description, ComposableLifecycleNode)
            and description.node_autostart
            and _has_name(component, context)
        ]

    def __container_name(self, context: LaunchContext) -> str:
        if isinstance(self.__target, ComposableNodeContainer):
            return self.__target.node_name
        return perform_substitutions(context, self.__target)

    def __is_wanted(self, description: ComposableNode, context: LaunchContext) -> bool:
        condition = description.condition()
        if condition is None or not context.host.release.has(Feature.LOAD_CONDITIONS):
            return True
        return condition.evaluate(context)

    def __resolve(
        self, description: ComposableNode, container: str, context: LaunchContext
    ) -> ResolvedComponent:
        place = location_of(self if description.source_location is None else description, context)
        package = perform_substitutions(context, description.package)
        plugin = perform_substitutions(context, description.node_plugin)
        name = _performed(context, description.node_name) or ""
        namespace = make_namespace_absolute(
            prefix_namespace(
                context.launch_configurations.get("ros_namespace"),
                _performed(context, description.node_namespace),
            )
        )
        remaps = tuple(_remap_rules(description, context, place))
        parameters = [*_global_parameters(context), *(description.parameters or ())]
        evaluated = evaluate_parameters(context, parameters)
        extra_arguments = evaluate_parameters(context, description.extra_arguments or ())
        return ResolvedComponent(
            container=container,
            package=package,
            plugin=plugin,
            name=name,
            namespace=namespace or "",
            remaps=remaps,
            parameters=_values(context, name, namespace, evaluated),
            extra_arguments=_values(context, name, namespace, extra_arguments),
            location=place,
            on_event=context.on_event,
            unknown_parameters=tuple(
                item for item in (*evaluated, *extra_arguments) if isinstance(item, UnknownParameters)
            ),
        )


def _has_name(component: ResolvedComponent, context: LaunchContext) -> bool:
    """Return whether launch knows which node to take through its states; one without a name is reported."""
    if not component.name:
        what = f"autostart of {component.program}, whose name only the plugin knows: give it name="
        context.host.unforeseeable(Unforeseeable(what, component.location))
    return bool(component.name)


def _performed(context: LaunchContext, substitutions: list[Substitution] | None) -> str | None:
    return None if substitutions is None else perform_substitutions(context, substitutions)


def _remap_rules(
    description: ComposableNode, context: LaunchContext, place: SourceLocation
) -> Iterator[RemapRule]:
    own = performed_remaps(description.remappings or (), context)
    for rule in (*(context.launch_configurations.get("ros_remaps") or ()), *own):
        yield placed(rule, place)


def _global_parameters(context: LaunchContext) -> Iterator[Any]:
    """Yield values as normalized dicts and files by absolute path; raises AssertionError for a missing file."""
    for item in context.launch_configurations.get("global_params") or ():
        if isinstance(item, tuple):
            yield normalize_parameter_dict({item[0]: item[1]})
            continue
        path = Path(item).resolve()
        if not path.is_file() and not context.host.allow_missing_packages:
            raise AssertionError(f"the file of set_parameters_from_file does not exist: {path}")
        yield ParameterFile(path)


def _values(
    context: LaunchContext, name: str, namespace: str | None, evaluated: EvaluatedParameters
) -> dict[str, ParameterValue]:
    return {
        item.name: tuple(item.value) if isinstance(item.value, list) else item.value  # type: ignore[misc]
        for item in to_parameters_list(context, name, namespace, evaluated)
    }
