"""``log`` and its siblings with a fixed level."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

from enclave_launch.description.entity import Action
from enclave_launch.description.logging import get_logger
from enclave_launch.description.markup.expose import expose_action
from enclave_launch.description.substitution import normalize_to_list_of_substitutions, perform_substitutions
from enclave_launch.description.templates import TemplateAction, template
from enclave_launch.diagnostics.evaluation import log_level_missing
from enclave_launch.host.current import current_host, current_release
from enclave_launch.ros_rules.distro import Feature

if TYPE_CHECKING:
    from enclave_launch.description.launch_context import LaunchContext
    from enclave_launch.description.markup.entity import Entity, Parser
    from enclave_launch.description.substitution import SomeSubstitutionsType


class LogInfo(TemplateAction):
    """Log a message as ``launch.user``."""

    level_name = "INFO"

    msg = template(attribute="message", keyword_only=True)

    def log_level(self, context: LaunchContext) -> str:
        """Return the name of the level, upper case."""
        return self.level_name

    def execute(self, context: LaunchContext) -> None:
        level = logging.getLevelName(self.log_level(context))
        get_logger("launch.user").log(level, "%s", perform_substitutions(context, self.msg))


@expose_action("log")
def parse_log(entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
    """Return the action for ``log``: level INFO, or from launch 3.9 on the one that it names."""
    if not current_release().has(Feature.LOG_LEVEL_ACTIONS):
        return LogInfo.parse(entity, parser)

    return Log.parse(entity, parser)


_LEVELS = ("NOTSET", "DEBUG", "INFO", "WARN", "WARNING", "ERROR", "FATAL", "CRITICAL")


class Log(LogInfo):
    """Log a message at a level that may be a substitution."""

    def __init__(self, *, level: SomeSubstitutionsType, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.level = normalize_to_list_of_substitutions(level)

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        level = entity.get_attr("level", optional=True)
        host = current_host()
        if level is None and host.release.has(Feature.LOG_LEVEL_ACTIONS):
            host.warn(log_level_missing())
        kwargs["level"] = parser.parse_substitution("INFO" if level is None else level)
        return cls, kwargs

    def log_level(self, context: LaunchContext) -> str:
        level = perform_substitutions(context, self.level).upper()
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
