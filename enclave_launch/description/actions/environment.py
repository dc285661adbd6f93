"""Environment variables: ``set_env``, ``append_env``, ``unset_env``, ``reset_env``, ``set_ros_log_dir``; groups push
and pop their scope.
"""

from __future__ import annotations

import os
from typing import Any

from enclave_launch.description.action import Action
from enclave_launch.description.launch_context import LaunchContext
from enclave_launch.description.markup.entity import Entity
from enclave_launch.description.markup.expose import expose_action
from enclave_launch.description.markup.parser import Parser
from enclave_launch.description.substitution import (
    SomeSubstitutionsType,
    Substitution,
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.description.typed_values import normalize_typed_substitution, perform_typed_substitution
from enclave_launch.ros_rules.distro import Feature


@expose_action("set_env")
class SetEnvironmentVariable(Action):
    """Set an environment variable, for the rest of the scope it is in."""

    def __init__(self, name: SomeSubstitutionsType, value: SomeSubstitutionsType, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.__name = normalize_to_list_of_substitutions(name)
        self.__value = normalize_to_list_of_substitutions(value)

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        kwargs["name"] = parser.parse_substitution(entity.get_attr("name"))
        kwargs["value"] = parser.parse_substitution(entity.get_attr("value"))
        return cls, kwargs

    @property
    def name(self) -> list[Substitution]:
        return self.__name

    @property
    def value(self) -> list[Substitution]:
        return self.__value

    def execute(self, context: LaunchContext) -> None:
        value = perform_substitutions(context, self.__value)
        context.environment[perform_substitutions(context, self.__name)] = value


@expose_action("append_env")
class AppendEnvironmentVariable(Action):
    """Join a value to an environment variable, at its end or front; an unset one is simply set.

    A variable that is set but empty still gets the separator.
    """

    def __init__(
        self,
        name: SomeSubstitutionsType,
        value: SomeSubstitutionsType,
        prepend: bool | SomeSubstitutionsType = False,
        separator: SomeSubstitutionsType = os.pathsep,
        **kwargs: Any,
    ) -> None:
        super().__init__(**kwargs)
        self.__name = normalize_to_list_of_substitutions(name)
        self.__value = normalize_to_list_of_substitutions(value)
        self.__prepend: Any = normalize_typed_substitution(prepend, bool)
        self.__separator = normalize_to_list_of_substitutions(separator)

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        kwargs["name"] = parser.parse_substitution(entity.get_attr("name"))
        kwargs["value"] = parser.parse_substitution(entity.get_attr("value"))
        prepend = entity.get_attr("prepend", optional=True, data_type=bool, can_be_str=True)
        if prepend is not None:
            kwargs["prepend"] = parser.parse_if_substitutions(prepend)
        separator = entity.get_attr("separator", optional=True)
        if separator is not None:
            kwargs["separator"] = parser.parse_substitution(separator)
        return cls, kwargs

    @property
    def name(self) -> list[Substitution]:
        return self.__name

    @property
    def value(self) -> list[Substitution]:
        return self.__value

    @property
    def prepend(self) -> Any:
        return self.__prepend

    @property
    def separator(self) -> list[Substitution]:
        return self.__separator

    def execute(self, context: LaunchContext) -> None:
        name = perform_substitutions(context, self.__name)
        value = perform_substitutions(context, self.__value)
        prepend = perform_typed_substitution(context, self.__prepend, bool)
        separator = perform_substitutions(context, self.__separator)
        present = context.environment.get(name)
        if present is not None:
            value = value + separator + present if prepend else present + separator + value
        context.environment[name] = value


@expose_action("unset_env")
class UnsetEnvironmentVariable(Action):
    """Remove an environment variable; absent ones are fine."""

    def __init__(self, name: SomeSubstitutionsType, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.__name = normalize_to_list_of_substitutions(name)

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        kwargs["name"] = parser.parse_substitution(entity.get_attr("name"))
        return cls, kwargs

    @property
    def name(self) -> list[Substitution]:
        return self.__name

    def execute(self, context: LaunchContext) -> None:
        context.environment.pop(perform_substitutions(context, self.__name), None)


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


# ``set_ros_log_dir``: where processes started from here on write their logs. Not in humble.


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
