"""``log``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.action import Action
from enclave_launch.description.launch.frontend.expose import expose_action
from enclave_launch.description.launch.utilities import (
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.host.current import current_release
from enclave_launch.ros_rules.distro import Feature

if TYPE_CHECKING:
    from enclave_launch.description.launch.frontend.entity import Entity
    from enclave_launch.description.launch.frontend.parser import Parser
    from enclave_launch.description.launch.launch_context import LaunchContext
    from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType
    from enclave_launch.description.launch.substitution import Substitution


class LogInfo(Action):
    """Log a message as ``launch.user``."""

    level_name = "INFO"

    def __init__(self, *, msg: SomeSubstitutionsType, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.__msg = normalize_to_list_of_substitutions(msg)

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        kwargs["msg"] = parser.parse_substitution(entity.get_attr("message"))
        return cls, kwargs

    @property
    def msg(self) -> list[Substitution]:
        return self.__msg

    def log_level(self, context: LaunchContext) -> str:
        """The name of the level, upper case."""
        return self.level_name

    def execute(self, context: LaunchContext) -> None:
        import logging

        from enclave_launch.description.launch.logging import get_logger

        level = logging.getLevelName(self.log_level(context))
        get_logger("launch.user").log(level, "%s", perform_substitutions(context, self.__msg))


@expose_action("log")
def parse_log(entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
    """``log`` means level INFO; from launch 3.9 on it may name another."""
    if not current_release().has(Feature.LOG_LEVEL_ACTIONS):
        return LogInfo.parse(entity, parser)
    from enclave_launch.description.launch.actions.log import Log

    return Log.parse(entity, parser)
