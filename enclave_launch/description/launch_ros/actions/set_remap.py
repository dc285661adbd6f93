"""``set_remap``: a remap rule for every node and component launched in this scope."""

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
from enclave_launch.description.launch_ros.utilities.remap_rules import PlacedRule
from enclave_launch.evaluation.location import location_of


@expose_action("set_remap")
class SetRemap(Action):
    """Appends to the list in the launch configuration ``ros_remaps``.

    A scope copies the dictionary, not the list: a rule set in a group leaks out of it when the list
    existed before, exactly as in launch.
    """

    def __init__(self, src: SomeSubstitutionsType, dst: SomeSubstitutionsType, **kwargs: Any):
        super().__init__(**kwargs)
        self.__src = normalize_to_list_of_substitutions(src)
        self.__dst = normalize_to_list_of_substitutions(dst)

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[SetRemap], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        kwargs["src"] = parser.parse_substitution(entity.get_attr("from"))
        kwargs["dst"] = parser.parse_substitution(entity.get_attr("to"))
        return cls, kwargs

    @property
    def src(self) -> list[Substitution]:
        return self.__src

    @property
    def dst(self) -> list[Substitution]:
        return self.__dst

    def execute(self, context: LaunchContext) -> None:
        rule = PlacedRule.at(
            location_of(self, context),
            perform_substitutions(context, self.__src),
            perform_substitutions(context, self.__dst),
        )
        context.launch_configurations.setdefault("ros_remaps", []).append(rule)
