"""``for_each`` and ``for`` (launch 3.8)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from copy import deepcopy
from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.action import Action
from enclave_launch.description.launch.actions.opaque_function import OpaqueFunction
from enclave_launch.description.launch.frontend.expose import expose_action
from enclave_launch.description.launch.substitutions.for_loop_var import local_name
from enclave_launch.description.launch.utilities import (
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.ros_rules.distro import Feature

if TYPE_CHECKING:
    from enclave_launch.description.launch.frontend.entity import Entity
    from enclave_launch.description.launch.frontend.parser import Parser
    from enclave_launch.description.launch.launch_context import LaunchContext
    from enclave_launch.description.launch.launch_description_entity import LaunchDescriptionEntity
    from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType
    from enclave_launch.description.launch.substitution import Substitution

Body = Callable[..., "list[LaunchDescriptionEntity] | None"]


@expose_action("for_each", feature=Feature.FOR_EACH)
class ForEach(Action):
    """Call ``function(**values)`` for each set of values; it gives the entities of that round.

    ``input_values`` performs to YAML mappings separated by semicolons. In XML and YAML the body is the
    children, which read the values with ``$(for-var name)``.
    """

    SEPARATOR = ";"

    def __init__(self, input_values: SomeSubstitutionsType, *, function: Body, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self._input_values = normalize_to_list_of_substitutions(input_values)
        self._function = function

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        children = [parser.parse_action(child) for child in entity.children]
        kwargs["function"] = lambda **values: one_round(children, values)
        kwargs["input_values"] = parser.parse_substitution(entity.get_attr("values"))
        return cls, kwargs

    @property
    def input_values(self) -> list[Substitution]:
        return self._input_values

    @property
    def function(self) -> Body:
        return self._function

    def execute(self, context: LaunchContext) -> list[LaunchDescriptionEntity]:
        import yaml

        text = perform_substitutions(context, self._input_values)
        entities: list[LaunchDescriptionEntity] = []
        for item in filter(None, text.strip().split(self.SEPARATOR)):
            values = yaml.safe_load(item.strip())
            if values is not None:
                entities.extend(self._function(**values) or ())
        return entities


@expose_action("for", feature=Feature.FOR_LOOP)
class ForLoop(Action):
    """Call ``function(i)`` for i from 0 to ``length`` (exclusive); in XML and YAML ``$(index name)`` is i.

    Raises ``ValueError`` when ``length`` does not perform to an integer.
    """

    def __init__(
        self, length: SomeSubstitutionsType, *, function: Body, name: str | None = None, **kwargs: Any
    ) -> None:
        super().__init__(**kwargs)
        self._length = normalize_to_list_of_substitutions(length)
        self._function = function
        self._name = name

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        name = entity.get_attr("name")
        children = [parser.parse_action(child) for child in entity.children]
        kwargs["name"] = name
        kwargs["function"] = lambda i: one_round(children, {name: i})
        kwargs["length"] = parser.parse_substitution(entity.get_attr("len"))
        return cls, kwargs

    @property
    def length(self) -> list[Substitution]:
        return self._length

    @property
    def function(self) -> Body:
        return self._function

    @property
    def name(self) -> str | None:
        return self._name

    def execute(self, context: LaunchContext) -> list[LaunchDescriptionEntity]:
        entities: list[LaunchDescriptionEntity] = []
        for index in range(int(perform_substitutions(context, self._length))):
            entities.extend(self._function(i=index) or ())
        return entities


def one_round(children: list[Action], values: Mapping[str, Any]) -> list[LaunchDescriptionEntity]:
    """Copies of the children, with the values as locals around them."""
    named = {local_name(name): str(value) for name, value in values.items()}

    def begin(context: LaunchContext) -> None:
        context._push_locals()
        context.extend_locals(named)

    def end(context: LaunchContext) -> None:
        context._pop_locals()

    return [OpaqueFunction(function=begin), *deepcopy(children), OpaqueFunction(function=end)]
