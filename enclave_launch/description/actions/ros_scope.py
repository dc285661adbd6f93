"""Actions that hold for every node and component of the scope: ``push_ros_namespace``, ``push_ros_enclave``,
``set_remap``, ``set_parameter``, ``set_parameters_from_file``; and ``set_use_sim_time`` of launch's own node.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from enclave_launch.description.entity import Action
from enclave_launch.description.launch_context import LaunchContext
from enclave_launch.description.location import location_of
from enclave_launch.description.markup.entity import Entity, Parser
from enclave_launch.description.markup.expose import expose_action
from enclave_launch.description.node_names import PlacedRule
from enclave_launch.description.parameters.evaluate import evaluate_parameter_dict
from enclave_launch.description.parameters.normalize import normalize_parameter_dict
from enclave_launch.description.substitution import (
    SomeSubstitutionsType,
    SubstitutionFailure,
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.description.templates import TemplateAction, template
from enclave_launch.description.typed_values import normalize_typed_substitution, perform_typed_substitution
from enclave_launch.ros_rules.distro import Feature
from enclave_launch.ros_rules.namespaces import make_namespace_absolute, prefix_namespace, push_enclave_scope
from nodl.names import InvalidNameError, validate_namespace

if TYPE_CHECKING:
    from enclave_launch.description.parameters.types import ParameterName, ParameterValue, SomeParameterValue


@expose_action("push_ros_namespace")
@expose_action("push-ros-namespace")
class PushROSNamespace(TemplateAction):
    """Joins ``namespace`` to the launch configuration ``ros_namespace``; only a scoped group pops it.

    ``enclave`` goes to the enclave scope instead of the namespace (Security Enclaves article,
    ``<push_ros_namespace namespace="foo" enclave="bar"/>``).
    """

    namespace = template()
    enclave = template(default=None, keyword_only=True)

    def execute(self, context: LaunchContext) -> None:
        """Push the namespace; raises ``SubstitutionFailure`` if the joined namespace is not valid."""
        pushed = perform_substitutions(context, self.namespace)
        enclave = None if self.enclave is None else perform_substitutions(context, self.enclave)
        previous = context.launch_configurations.get("ros_namespace")
        namespace = make_namespace_absolute(prefix_namespace(previous, pushed))
        try:
            validate_namespace(namespace or "")
        except InvalidNameError as error:
            raise SubstitutionFailure(
                "The resulting namespace is invalid: "
                f"[previous_namespace='{previous}', pushed_namespace='{pushed}']"
            ) from error
        push_enclave_scope(context.launch_configurations, enclave, pushed)
        context.launch_configurations["ros_namespace"] = namespace


PushRosNamespace = PushROSNamespace  # the older name, the only one in humble


@expose_action("push_ros_enclave")
@expose_action("push-ros-enclave")
class PushRosEnclave(TemplateAction):
    """The enclave scope of what follows: a relative ``enclave`` nests in the one in force, an absolute one replaces it.

    The namespace stays. Not in upstream's launch_ros: the second alternative in the Security Enclaves article.
    """

    enclave = template()

    def execute(self, context: LaunchContext) -> None:
        push_enclave_scope(context.launch_configurations, perform_substitutions(context, self.enclave))


@expose_action("set_remap")
class SetRemap(TemplateAction):
    """Appends to the list in the launch configuration ``ros_remaps``.

    A scope copies the dictionary, not the list: a rule set in a group leaks out of it when the list
    existed before, exactly as in launch.
    """

    src = template(attribute="from")
    dst = template(attribute="to")

    def execute(self, context: LaunchContext) -> None:
        rule = PlacedRule.at(
            location_of(self, context),
            perform_substitutions(context, self.src),
            perform_substitutions(context, self.dst),
        )
        context.launch_configurations.setdefault("ros_remaps", []).append(rule)


@expose_action("set_parameter")
class SetParameter(Action):
    """Appends to the list in the configuration ``global_params``, scoped as ``SetRemap`` is, leak included."""

    def __init__(self, name: SomeSubstitutionsType, value: SomeParameterValue, **kwargs: Any):
        super().__init__(**kwargs)
        self.__parameters = normalize_parameter_dict({tuple(normalize_to_list_of_substitutions(name)): value})

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[SetParameter], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        kwargs["name"] = parser.parse_substitution(entity.get_attr("name"))
        kwargs["value"] = parser.parse_substitution(entity.get_attr("value"))
        return cls, kwargs

    @property
    def name(self) -> ParameterName:
        return next(iter(self.__parameters))

    @property
    def value(self) -> ParameterValue:
        return next(iter(self.__parameters.values()))

    def execute(self, context: LaunchContext) -> None:
        evaluated = evaluate_parameter_dict(context, self.__parameters)
        context.launch_configurations.setdefault("global_params", []).extend(evaluated.items())


@expose_action("set_parameters_from_file")
class SetParametersFromFile(TemplateAction):
    """Appends the path to ``global_params``. Whether the file exists is checked where it is used."""

    filename = template()

    def execute(self, context: LaunchContext) -> None:
        path = perform_substitutions(context, self.filename)
        context.launch_configurations.setdefault("global_params", []).append(path)


@expose_action("set_use_sim_time")
class SetUseSimTime(TemplateAction):
    """The clock of launch's own node (for ``ros_timer``). Launched nodes get ``use_sim_time`` by ``SetParameter``."""

    value: bool | SomeSubstitutionsType = template(read=lambda value: value)

    def execute(self, context: LaunchContext) -> None:
        """Set it; older releases pass text on unevaluated, and refuse to switch it off (``RuntimeError``)."""
        value = self.value
        if context.host.release.has(Feature.SIM_TIME_IN_FRONTENDS):
            context.simulated_time = perform_typed_substitution(
                context, normalize_typed_substitution(value, bool), bool
            )
            return
        if not isinstance(value, bool):
            raise ValueError(f"Type 'Type.BOOL' and value '{value}' do not agree")
        if not value:
            raise RuntimeError("Failed to set use_sim_time parameter")
        context.simulated_time = True
