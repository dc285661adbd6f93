"""``set_parameters_from_file``: a parameter file for every node and component launched in this scope."""

from __future__ import annotations

from typing import Any

from enclave_launch.description.launch.action import Action
from enclave_launch.description.launch.frontend import Entity, Parser, expose_action
from enclave_launch.description.launch.launch_context import LaunchContext
from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType
from enclave_launch.description.launch.utilities import (
    normalize_to_list_of_substitutions,
    perform_substitutions,
)


@expose_action("set_parameters_from_file")
class SetParametersFromFile(Action):
    """Appends the path to ``global_params``. Whether the file exists is checked where it is used."""

    def __init__(self, filename: SomeSubstitutionsType, **kwargs: Any):
        super().__init__(**kwargs)
        self._input_file = normalize_to_list_of_substitutions(filename)

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[SetParametersFromFile], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        kwargs["filename"] = parser.parse_substitution(entity.get_attr("filename"))
        return cls, kwargs

    def execute(self, context: LaunchContext) -> None:
        path = perform_substitutions(context, self._input_file)
        context.launch_configurations.setdefault("global_params", []).append(path)
