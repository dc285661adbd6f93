"""Launch arguments: ``arg`` and ``bool_arg``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from enclave_launch.description import read_only
from enclave_launch.description.entity import Action, ScanRole
from enclave_launch.description.markup.entity import Entity
from enclave_launch.description.markup.expose import expose_action
from enclave_launch.description.substitution import (
    SomeSubstitutionsType,
    Substitution,
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.ros_rules.distro import Feature

if TYPE_CHECKING:
    from enclave_launch.description.launch_context import LaunchContext
    from enclave_launch.description.markup.entity import Parser


@expose_action("arg")
@read_only("name", "default_value", "description", "choices")
class DeclareLaunchArgument(Action):
    """Declare an argument: its default applies if the launch configuration is not set.

    Raises ``RuntimeError`` for empty choices, and for a default of plain text that is not among them.
    """

    scan_role = ScanRole.ARGUMENT
    name: str = ""
    default_value: list[Substitution] | None = None
    description: str = ""
    choices: list[str] | None = None

    def __init__(
        self,
        name: str,
        *,
        default_value: SomeSubstitutionsType | None = None,
        description: str | None = None,
        choices: list[str] | None = None,
        **kwargs: Any,
    ) -> None:
        super().__init__(**kwargs)
        self.__name = name
        self.__default_value = (
            None if default_value is None else normalize_to_list_of_substitutions(default_value)
        )
        self.__choices = choices
        self._conditionally_included = False  # set by the argument scan
        if choices is not None:
            _check_default(default_value, choices)
        self.__description = _describe(description, choices)

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        kwargs["name"] = parser.escape_characters(entity.get_attr("name"))
        default = entity.get_attr("default", optional=True)
        if default is not None:
            kwargs["default_value"] = parser.parse_substitution(default)
        description = entity.get_attr("description", optional=True)
        if description is not None:
            kwargs["description"] = parser.escape_characters(description)
        choices = entity.get_attr("choice", data_type=list[Entity], optional=True)
        if choices is not None:
            kwargs["choices"] = [parser.escape_characters(choice.get_attr("value")) for choice in choices]
        return cls, kwargs

    def execute(self, context: LaunchContext) -> None:
        configurations = context.launch_configurations
        if self.__name not in configurations:
            if self.__default_value is None:
                raise RuntimeError(f'Required launch argument "{self.__name}" was not provided.')
            configurations[self.__name] = perform_substitutions(context, self.__default_value)
        if self.__choices is not None and configurations[self.__name] not in self.__choices:
            raise RuntimeError(
                f'Argument "{self.__name}" provided value "{configurations[self.__name]}" is not valid. '
                f"Valid options are: {self.__choices}"
            )


def _check_default(default: SomeSubstitutionsType | None, choices: list[str]) -> None:
    if len(choices) == 0:
        raise RuntimeError("Provided choices arg is empty. Use None to ignore the choice list.")
    if default is None or isinstance(default, (Substitution, list)):
        return
    if default not in choices:
        raise RuntimeError(f'Provided default_value "{default}" is not in provided choices "{choices}".')


def _describe(description: str | None, choices: list[str] | None) -> str:
    if description is None:
        return "no description given" if choices is None else f"One of: {choices}"
    if choices is None:
        return description
    stop = "" if description.endswith(".") else "."
    return f"{description}{stop} Valid choices are: {choices}"


_CHOICES = ["true", "false", "True", "False", "TRUE", "FALSE"]


@expose_action("bool_arg", feature=Feature.DECLARE_BOOLEAN)
class DeclareBooleanLaunchArgument(DeclareLaunchArgument):
    """An argument whose choices are the words for true and false; the default may be a bool."""

    def __init__(
        self, name: str, *, default_value: SomeSubstitutionsType | bool | None = None, **kwargs: Any
    ) -> None:
        default = str(default_value) if isinstance(default_value, bool) else default_value
        super().__init__(name, default_value=default, choices=list(_CHOICES), **kwargs)

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        if "choices" in kwargs:
            raise ValueError("Cannot specify choices for bool_arg")
        return cls, kwargs
