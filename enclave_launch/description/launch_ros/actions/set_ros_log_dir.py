"""``set_ros_log_dir``: where processes started from here on write their logs. Not in humble."""

from __future__ import annotations

import os
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
from enclave_launch.ros_rules.distro import Feature


@expose_action("set_ros_log_dir", feature=Feature.SET_ROS_LOG_DIR)
class SetROSLogDir(Action):
    """Joins the value to the log directory in force and puts it into ``ROS_LOG_DIR``."""

    def __init__(self, new_log_dir: SomeSubstitutionsType, **kwargs: Any):
        super().__init__(**kwargs)
        self.__log_dir = normalize_to_list_of_substitutions(new_log_dir)

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[SetROSLogDir], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        kwargs["new_log_dir"] = parser.parse_substitution(entity.get_attr("new_log_dir"))
        return cls, kwargs

    @property
    def log_dir(self) -> list[Substitution]:
        return self.__log_dir

    def execute(self, context: LaunchContext) -> None:
        directory = perform_substitutions(context, self.__log_dir)
        current = context.environment.get("ROS_LOG_DIR", _default_log_directory(context.environment))
        joined = os.path.join(current, directory)
        if not os.path.isabs(joined):
            raise AssertionError(f"the log directory must be absolute, got '{joined}'")
        context.environment["ROS_LOG_DIR"] = joined


def _default_log_directory(environment: Any) -> str:
    """What ``rcl_logging_get_logging_directory`` answers while ``ROS_LOG_DIR`` is unset."""
    home = environment.get("ROS_HOME") or os.path.join(os.path.expanduser("~"), ".ros")
    return os.path.join(os.path.expanduser(home), "log")
