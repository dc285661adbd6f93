"""``set_use_sim_time``: the clock of launch's own node (for ``ros_timer``), not of the nodes it starts."""

from __future__ import annotations

from typing import Any

from enclave_launch.description.launch.action import Action
from enclave_launch.description.launch.frontend import Entity, Parser, expose_action
from enclave_launch.description.launch.launch_context import LaunchContext


@expose_action("set_use_sim_time")
class SetUseSimTime(Action):
    """Only ``True`` succeeds; launched nodes get ``use_sim_time`` through ``SetParameter``."""

    def __init__(self, value: bool, **kwargs: Any):
        super().__init__(**kwargs)
        self.__value = value

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[SetUseSimTime], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        kwargs["value"] = parser.parse_substitution(entity.get_attr("value"))
        return cls, kwargs

    @property
    def value(self) -> bool:
        return self.__value

    def execute(self, context: LaunchContext) -> None:
        """Raises ``ValueError`` for anything but a bool (the front ends pass text unevaluated)."""
        if not isinstance(self.__value, bool):
            raise ValueError(f"Type 'Type.BOOL' and value '{self.__value}' do not agree")
        if not self.__value:
            raise RuntimeError("Failed to set use_sim_time parameter")
