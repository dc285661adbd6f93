"""``log_info`` and its siblings, and ``log`` with a level (launch 3.9)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.action import Action
from enclave_launch.description.launch.actions.log_info import LogInfo
from enclave_launch.description.launch.frontend.expose import expose_action
from enclave_launch.description.launch.utilities import (
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.diagnostics import log_level_missing
from enclave_launch.host.current import current_host
from enclave_launch.ros_rules.distro import Feature

if TYPE_CHECKING:
    from enclave_launch.description.launch.frontend.entity import Entity
    from enclave_launch.description.launch.frontend.parser import Parser
    from enclave_launch.description.launch.launch_context import LaunchContext
    from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType
    from enclave_launch.description.launch.substitution import Substitution

_LEVELS = ("NOTSET", "DEBUG", "INFO", "WARN", "WARNING", "ERROR", "FATAL", "CRITICAL")


class Log(LogInfo):
    """Log a message at a level that may be a substitution."""

    def __init__(self, *, msg: SomeSubstitutionsType, level: SomeSubstitutionsType, **kwargs: Any) -> None:
        super().__init__(msg=msg, **kwargs)
        self.__level = normalize_to_list_of_substitutions(level)

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        level = entity.get_attr("level", optional=True)
        host = current_host()
        if level is None and host.release.has(Feature.LOG_NEEDS_LEVEL):
            host.warn(log_level_missing())
        kwargs["level"] = parser.parse_substitution("INFO" if level is None else level)
        return cls, kwargs

    @property
    def level(self) -> list[Substitution]:
        return self.__level

    def log_level(self, context: LaunchContext) -> str:
        level = perform_substitutions(context, self.__level).upper()
        if level not in _LEVELS:
            raise KeyError(f"Invalid log level '{level}', expected: {list(_LEVELS)}")
        return level


class LogDebug(LogInfo):
    """Log a message at level DEBUG."""

    level_name = "DEBUG"


class LogWarning(LogInfo):
    """Log a message at level WARNING."""

    level_name = "WARNING"


class LogError(LogInfo):
    """Log a message at level ERROR."""

    level_name = "ERROR"


expose_action("log_info", feature=Feature.LOG_LEVEL_ACTIONS)(LogInfo)
expose_action("log_debug", feature=Feature.LOG_LEVEL_ACTIONS)(LogDebug)
expose_action("log_warning", feature=Feature.LOG_LEVEL_ACTIONS)(LogWarning)
expose_action("log_error", feature=Feature.LOG_LEVEL_ACTIONS)(LogError)
