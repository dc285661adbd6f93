"""``push_ros_enclave``: the enclave scope of what follows, without touching the namespace.

Not part of upstream's launch_ros: the second of the two alternatives in the Security Enclaves article.
"""

from __future__ import annotations

from typing import Any

from enclave_launch.description.launch.action import Action
from enclave_launch.description.launch.frontend import Entity, Parser, expose_action
from enclave_launch.description.launch.launch_context import LaunchContext
from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType
from enclave_launch.description.launch.substitution import Substitution
from enclave_launch.description.launch.utilities import (
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.ros_rules.namespaces import push_enclave_scope


@expose_action("push_ros_enclave")
@expose_action("push-ros-enclave")
class PushRosEnclave(Action):
    """A relative ``enclave`` nests in the scope in force, an absolute one replaces it."""

    def __init__(self, enclave: SomeSubstitutionsType, **kwargs: Any):
        super().__init__(**kwargs)
        self.__enclave = normalize_to_list_of_substitutions(enclave)

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[PushRosEnclave], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        kwargs["enclave"] = parser.parse_substitution(entity.get_attr("enclave"))
        return cls, kwargs

    @property
    def enclave(self) -> list[Substitution]:
        return self.__enclave

    def execute(self, context: LaunchContext) -> None:
        push_enclave_scope(context.launch_configurations, perform_substitutions(context, self.__enclave))
