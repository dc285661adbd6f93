"""``bool_arg``: an argument that is true or false (launch 3.9)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.action import Action
from enclave_launch.description.launch.actions.declare_launch_argument import DeclareLaunchArgument
from enclave_launch.description.launch.frontend.expose import expose_action
from enclave_launch.ros_rules.distro import Feature

if TYPE_CHECKING:
    from enclave_launch.description.launch.frontend.entity import Entity
    from enclave_launch.description.launch.frontend.parser import Parser
    from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType

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
