"""Environment variables: ``set_env``, ``append_env``, ``unset_env``, ``reset_env``, ``rep_env``, ``set_ros_log_dir``.

Groups push and pop their scope.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from enclave_launch.description import read_only
from enclave_launch.description.entity import Action
from enclave_launch.description.launch_context import LaunchContext
from enclave_launch.description.markup.entity import Entity, Parser
from enclave_launch.description.markup.expose import expose_action
from enclave_launch.description.substitution import (
    SomeSubstitutionsType,
    Substitution,
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.description.templates import TemplateAction, template
from enclave_launch.description.typed_values import normalize_typed_substitution, perform_typed_substitution
from enclave_launch.ros_rules.distro import Feature


def _read_flag(value: Any) -> Any:
    return normalize_typed_substitution(value, bool)


@expose_action("set_env")
class SetEnvironmentVariable(TemplateAction):
    """Set an environment variable, for the rest of the scope it is in."""

    name = template()
    value = template()

    def execute(self, context: LaunchContext) -> None:
        value = perform_substitutions(context, self.value)
        context.environment[perform_substitutions(context, self.name)] = value


@expose_action("append_env")
class AppendEnvironmentVariable(TemplateAction):
    """Join a value to an environment variable, at its end or front; an unset one is simply set."""

    name = template()
    value = template()
    prepend = template(default=False, read=_read_flag, data_type=bool)
    separator = template(default=os.pathsep)

    def execute(self, context: LaunchContext) -> None:
        name = perform_substitutions(context, self.name)
        value = perform_substitutions(context, self.value)
        prepend = perform_typed_substitution(context, self.prepend, bool)
        separator = perform_substitutions(context, self.separator)
        present = context.environment.get(name)
        if present is not None:
            value = value + separator + present if prepend else present + separator + value
        context.environment[name] = value


@expose_action("unset_env")
class UnsetEnvironmentVariable(TemplateAction):
    """Remove an environment variable; absent ones are fine."""

    name = template()

    def execute(self, context: LaunchContext) -> None:
        context.environment.pop(perform_substitutions(context, self.name), None)


class PushEnvironment(Action):
    """Open an environment scope: what changes from here is undone by the matching pop."""

    def execute(self, context: LaunchContext) -> None:
        context._push_environment()


class PopEnvironment(Action):
    """Close an environment scope."""

    def execute(self, context: LaunchContext) -> None:
        context._pop_environment()


@expose_action("reset_env")
class ResetEnvironment(Action):
    """Make the environment what it was when the launch began."""

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        return cls, super().parse(entity, parser)[1]

    def execute(self, context: LaunchContext) -> None:
        context._reset_environment()


@expose_action("rep_env", feature=Feature.REPLACE_ENVIRONMENT)
@read_only("environment")
class ReplaceEnvironmentVariables(Action):
    """Make the environment exactly the given variables."""

    environment: Mapping[Any, Any] = {}

    def __init__(self, environment: Mapping[Any, Any] | None = None, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.__environment = dict(environment or {})

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        given = entity.get_attr("env", data_type=list[Entity], optional=True) or ()
        parse = parser.parse_substitution
        kwargs["environment"] = {
            tuple(parse(child.get_attr("name"))): parse(child.get_attr("value")) for child in given
        }
        for child in given:
            child.assert_entity_completely_parsed()
        return cls, kwargs

    def execute(self, context: LaunchContext) -> None:
        context.process_environment.assign(
            {
                _performed(context, name): _performed(context, value)
                for name, value in self.__environment.items()
            }
        )


def _performed(context: LaunchContext, text: SomeSubstitutionsType) -> str:
    """Perform a text, a substitution or several."""
    return perform_substitutions(context, normalize_to_list_of_substitutions(text))


@expose_action("set_ros_log_dir", feature=Feature.SET_ROS_LOG_DIR)
class SetROSLogDir(TemplateAction):
    """Join the value to ``ROS_LOG_DIR``: where processes started from here on write their logs. Not in humble."""

    new_log_dir = template()

    @property
    def log_dir(self) -> list[Substitution]:
        return self.new_log_dir  # type: ignore[no-any-return]

    def execute(self, context: LaunchContext) -> None:
        directory = perform_substitutions(context, self.new_log_dir)
        current = context.environment.get("ROS_LOG_DIR", _default_log_directory(context.environment))
        joined = os.path.join(current, directory)
        if not os.path.isabs(joined):
            raise AssertionError(f"the log directory must be absolute, got '{joined}'")
        context.environment["ROS_LOG_DIR"] = joined


def _default_log_directory(environment: Any) -> str:
    """Return what ``rcl_logging_get_logging_directory`` returns while ``ROS_LOG_DIR`` is unset."""
    home = environment.get("ROS_HOME") or os.path.join(os.path.expanduser("~"), ".ros")
    return os.path.join(os.path.expanduser(home), "log")
