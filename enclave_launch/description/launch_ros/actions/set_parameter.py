"""``set_parameter``: a parameter for every node and component launched in this scope."""

from __future__ import annotations

from typing import Any

from enclave_launch.description.launch.action import Action
from enclave_launch.description.launch.frontend import Entity, Parser, expose_action
from enclave_launch.description.launch.launch_context import LaunchContext
from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType
from enclave_launch.description.launch.utilities import normalize_to_list_of_substitutions
from enclave_launch.description.launch_ros.parameters_type import (
    ParameterName,
    ParameterValue,
    SomeParameterValue,
)
from enclave_launch.description.launch_ros.utilities.evaluate_parameters import evaluate_parameter_dict
from enclave_launch.description.launch_ros.utilities.normalize_parameters import normalize_parameter_dict


@expose_action("set_parameter")
class SetParameter(Action):
    """Appends ``(name, value)`` to the list in the launch configuration ``global_params``.

    Scoped as ``SetRemap`` is, leak included.
    """

    def __init__(self, name: SomeSubstitutionsType, value: SomeParameterValue, **kwargs: Any):
        super().__init__(**kwargs)
        self.__parameters = normalize_parameter_dict({tuple(normalize_to_list_of_substitutions(name)): value})

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[SetParameter], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        kwargs["name"] = parser.parse_substitution(entity.get_attr("name"))
        kwargs["value"] = parser.parse_substitution(entity.get_attr("value"))
        return cls, kwargs

    @property
    def name(self) -> ParameterName:
        return next(iter(self.__parameters))

    @property
    def value(self) -> ParameterValue:
        return next(iter(self.__parameters.values()))

    def execute(self, context: LaunchContext) -> None:
        evaluated = evaluate_parameter_dict(context, self.__parameters)
        context.launch_configurations.setdefault("global_params", []).extend(evaluated.items())
