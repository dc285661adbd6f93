"""``set_use_sim_time``: the clock of launch's own node (for ``ros_timer``), not of the nodes it starts."""

from __future__ import annotations

from typing import Any

from enclave_launch.description.launch.action import Action
from enclave_launch.description.launch.frontend import Entity, Parser, expose_action
from enclave_launch.description.launch.launch_context import LaunchContext
from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType
from enclave_launch.description.launch.utilities.type_utils import (
    normalize_typed_substitution,
    perform_typed_substitution,
)
from enclave_launch.ros_rules.distro import Feature


@expose_action("set_use_sim_time")
class SetUseSimTime(Action):
    """Launched nodes get ``use_sim_time`` through ``SetParameter`` instead."""

    def __init__(self, value: bool | SomeSubstitutionsType, **kwargs: Any):
        super().__init__(**kwargs)
        self.__value = value

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[SetUseSimTime], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        kwargs["value"] = parser.parse_substitution(entity.get_attr("value"))
        return cls, kwargs

    @property
    def value(self) -> bool | SomeSubstitutionsType:
        return self.__value

    def execute(self, context: LaunchContext) -> None:
        """Older releases pass the text of the front ends on unevaluated, and refuse to switch it off.

        Raises ``ValueError`` for what is no bool, ``RuntimeError`` for ``False``.
        """
        value = self.__value
        if context.host.release.has(Feature.SIM_TIME_IN_FRONTENDS):
            perform_typed_substitution(context, normalize_typed_substitution(value, bool), bool)
            return
        if not isinstance(value, bool):
            raise ValueError(f"Type 'Type.BOOL' and value '{value}' do not agree")
        if not value:
            raise RuntimeError("Failed to set use_sim_time parameter")
