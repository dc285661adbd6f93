"""``push_ros_namespace``: the namespace of what follows in this scope, and its enclave scope."""

from __future__ import annotations

from typing import Any

from enclave_launch.description.launch.action import Action
from enclave_launch.description.launch.frontend import Entity, Parser, expose_action
from enclave_launch.description.launch.launch_context import LaunchContext
from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType
from enclave_launch.description.launch.substitution import Substitution
from enclave_launch.description.launch.substitutions.substitution_failure import SubstitutionFailure
from enclave_launch.description.launch.utilities import (
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.ros_rules.namespaces import (
    make_namespace_absolute,
    prefix_namespace,
    push_enclave_scope,
)
from nodl.names import InvalidNameError, validate_namespace


@expose_action("push_ros_namespace")
@expose_action("push-ros-namespace")
class PushROSNamespace(Action):
    """Joins ``namespace`` to the launch configuration ``ros_namespace``; only a scoped group pops it.

    ``enclave`` goes to the enclave scope instead of the namespace (Security Enclaves article,
    ``<push_ros_namespace namespace="foo" enclave="bar"/>``).
    """

    def __init__(
        self, namespace: SomeSubstitutionsType, *, enclave: SomeSubstitutionsType | None = None, **kwargs: Any
    ):
        super().__init__(**kwargs)
        self.__namespace = normalize_to_list_of_substitutions(namespace)
        self.__enclave = None if enclave is None else normalize_to_list_of_substitutions(enclave)

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[PushROSNamespace], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        kwargs["namespace"] = parser.parse_substitution(entity.get_attr("namespace"))
        enclave = entity.get_attr("enclave", optional=True)
        if enclave is not None:
            kwargs["enclave"] = parser.parse_substitution(enclave)
        return cls, kwargs

    @property
    def namespace(self) -> list[Substitution]:
        return self.__namespace

    @property
    def enclave(self) -> list[Substitution] | None:
        return self.__enclave

    def execute(self, context: LaunchContext) -> None:
        """Raises ``SubstitutionFailure`` when the joined namespace is not valid."""
        pushed = perform_substitutions(context, self.__namespace)
        enclave = None if self.__enclave is None else perform_substitutions(context, self.__enclave)
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
