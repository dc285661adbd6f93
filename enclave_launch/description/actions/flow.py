"""Actions that decide what is visited next: ``group``, ``for``, ``for_each``, and functions of Python launch files."""

from __future__ import annotations

import collections.abc
import inspect
from collections.abc import Awaitable, Callable, Iterable, Mapping
from copy import deepcopy
from typing import TYPE_CHECKING, Any

from enclave_common.yaml_reader import load_yaml
from enclave_launch.description.actions.configurations import (
    PopLaunchConfigurations,
    PushLaunchConfigurations,
    ResetLaunchConfigurations,
    SetLaunchConfiguration,
    parse_keeps,
)
from enclave_launch.description.actions.environment import PopEnvironment, PushEnvironment, ResetEnvironment
from enclave_launch.description.argument_types import ensure_argument_type
from enclave_launch.description.entity import Action, LaunchDescriptionEntity
from enclave_launch.description.events.handlers import OnShutdown
from enclave_launch.description.markup.entity import Entity
from enclave_launch.description.markup.expose import expose_action
from enclave_launch.description.substitution import SomeSubstitutionsType, perform_substitutions
from enclave_launch.description.substitutions.variables import local_name
from enclave_launch.description.templates import TemplateAction, stored, template
from enclave_launch.host.user_code import called_for_entities
from enclave_launch.ros_rules.distro import Feature

if TYPE_CHECKING:
    from enclave_launch.description.events.event import Event
    from enclave_launch.description.launch_context import LaunchContext
    from enclave_launch.description.markup.entity import Parser


class OpaqueFunction(Action):
    """Call ``function(context, *args, **kwargs)`` when visited; it gives ``None`` or the entities to visit."""

    def __init__(
        self,
        *,
        function: Callable[..., list[LaunchDescriptionEntity] | None],
        args: Iterable[Any] | None = None,
        kwargs: dict[str, Any] | None = None,
        **left_over_kwargs: Any,
    ) -> None:
        super().__init__(**left_over_kwargs)
        if not callable(function):
            raise TypeError(f"OpaqueFunction expected a callable for 'function', got '{type(function)}'")
        ensure_argument_type(args, (collections.abc.Iterable, type(None)), "args", "OpaqueFunction")
        ensure_argument_type(kwargs, (dict, type(None)), "kwargs", "OpaqueFunction")
        self.__function = function
        self.__args: Iterable[Any] = [] if args is None else args
        self.__kwargs: dict[str, Any] = {} if kwargs is None else kwargs

    def execute(self, context: LaunchContext) -> list[LaunchDescriptionEntity] | None:
        def call() -> list[LaunchDescriptionEntity] | None:
            return self.__function(context, *self.__args, **self.__kwargs)

        return called_for_entities(self, self.__function, call, context)


class OpaqueCoroutine(Action):
    """Run a coroutine function, with the context unless ``ignore_context``; a dry run does not run it."""

    def __init__(
        self,
        *,
        coroutine: Callable[..., Awaitable[None]],
        args: Iterable[Any] | None = None,
        kwargs: dict[str, Any] | None = None,
        ignore_context: bool = False,
        **left_over_kwargs: Any,
    ) -> None:
        super().__init__(**left_over_kwargs)
        if not inspect.iscoroutinefunction(coroutine):
            raise TypeError(
                f"OpaqueCoroutine expected a coroutine function for 'coroutine', got '{type(coroutine)}'"
            )
        ensure_argument_type(args, (collections.abc.Iterable, type(None)), "args", "OpaqueCoroutine")
        ensure_argument_type(kwargs, (dict, type(None)), "kwargs", "OpaqueCoroutine")
        ensure_argument_type(ignore_context, bool, "ignore_context", "OpaqueCoroutine")
        self.__coroutine = coroutine
        self.__args: Iterable[Any] = [] if args is None else args
        self.__kwargs: dict[str, Any] = {} if kwargs is None else kwargs
        self.__ignore_context = ignore_context
        self.__future: Any = None

    def execute(self, context: LaunchContext) -> None:
        args = self.__args if self.__ignore_context else [context, *self.__args]
        self.__future = context.asyncio_loop.create_task(self.__coroutine(*args, **self.__kwargs))
        context.register_event_handler(OnShutdown(on_shutdown=self.__on_shutdown))

    def __on_shutdown(self, event: Event, context: LaunchContext) -> None:
        if self.__future is not None:
            self.__future.cancel()

    def get_asyncio_future(self) -> Any:
        return self.__future


@expose_action("group")
class GroupAction(Action):
    """Gives its actions, by default inside a scope of launch configurations and environment.

    ``forwarding=False`` starts the scope empty but for ``launch_configurations``. The pushed namespace, remaps
    and global parameters are launch configurations too and so are scoped with them.
    """

    def __init__(
        self,
        actions: Iterable[LaunchDescriptionEntity],
        *,
        scoped: bool = True,
        forwarding: bool = True,
        launch_configurations: Mapping[SomeSubstitutionsType, SomeSubstitutionsType] | None = None,
        **left_over_kwargs: Any,
    ) -> None:
        super().__init__(**left_over_kwargs)
        self.__actions = actions
        self.__scoped = scoped
        self.__forwarding = forwarding
        self.__launch_configurations = launch_configurations or {}
        self.__expanded: list[LaunchDescriptionEntity] | None = None

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        for name in ("scoped", "forwarding"):
            value = entity.get_attr(name, data_type=bool, optional=True)
            if value is not None:
                kwargs[name] = value
        keeps = entity.get_attr("keep", data_type=list[Entity], optional=True)
        if keeps is not None:
            kwargs["launch_configurations"] = parse_keeps(keeps, parser)
        kwargs["actions"] = [
            parser.parse_action(child) for child in entity.children if child.type_name != "keep"
        ]
        return cls, kwargs

    def get_sub_entities(self) -> list[LaunchDescriptionEntity]:
        if self.__expanded is None:
            self.__expanded = self.__expand()
        return self.__expanded

    def __expand(self) -> list[LaunchDescriptionEntity]:
        actions = list(self.__actions)
        keeps = [SetLaunchConfiguration(name, value) for name, value in self.__launch_configurations.items()]
        if not self.__scoped:
            return [*keeps, *actions]
        start: list[LaunchDescriptionEntity] = [PushLaunchConfigurations(), PushEnvironment()]
        if self.__forwarding:
            start += keeps
        else:
            start += [ResetEnvironment(), ResetLaunchConfigurations(self.__launch_configurations)]
        return [*start, *actions, PopEnvironment(), PopLaunchConfigurations()]

    def execute(self, context: LaunchContext) -> list[LaunchDescriptionEntity]:
        return self.get_sub_entities()


Body = Callable[..., "list[LaunchDescriptionEntity] | None"]


@expose_action("for_each", feature=Feature.FOR_EACH)
class ForEach(TemplateAction):
    """Call ``function(**values)`` for each set of values; it gives the entities of that round.

    ``input_values`` performs to YAML mappings separated by semicolons. In XML and YAML the body is the
    children, which read the values with ``$(for-var name)``.
    """

    SEPARATOR = ";"

    input_values = template(attribute="values")
    function: Body = stored()

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        kwargs["function"] = _ParsedBody(entity, parser)
        return cls, kwargs

    def execute(self, context: LaunchContext) -> list[LaunchDescriptionEntity]:
        text = perform_substitutions(context, self.input_values)
        entities: list[LaunchDescriptionEntity] = []
        for item in filter(None, text.strip().split(self.SEPARATOR)):
            values = load_yaml(item.strip())
            if values is not None:
                context.count_unfolded(_size_of(self.function))
                entities.extend(self._round(context, values) or ())
        return entities

    def _round(
        self, context: LaunchContext, values: Mapping[str, Any]
    ) -> list[LaunchDescriptionEntity] | None:
        return called_for_entities(self, self.function, lambda: self.function(**values), context)


@expose_action("for", feature=Feature.FOR_LOOP)
class ForLoop(TemplateAction):
    """Call ``function(i)`` for i from 0 to ``length`` (exclusive); in XML and YAML ``$(index name)`` is i.

    Raises ``ValueError`` when ``length`` does not perform to an integer.
    """

    length = template(attribute="len")
    function: Body = stored()
    name: str | None = stored(default=None)

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        kwargs["name"] = entity.get_attr("name")
        kwargs["function"] = _ParsedBody(entity, parser, index=kwargs["name"])
        return cls, kwargs

    def execute(self, context: LaunchContext) -> list[LaunchDescriptionEntity]:
        entities: list[LaunchDescriptionEntity] = []
        length = int(perform_substitutions(context, self.length))
        context.count_unfolded(_size_of(self.function) * max(length, 0))
        for index in range(length):
            entities.extend(self._round(context, index) or ())
        return entities

    def _round(self, context: LaunchContext, index: int) -> list[LaunchDescriptionEntity] | None:
        return called_for_entities(self, self.function, lambda: self.function(i=index), context)


class _ParsedBody:
    """The children of a loop element, as its function. ``elements`` counts those that each round copies."""

    def __init__(self, entity: Entity, parser: Parser, index: str | None = None) -> None:
        self._children = [parser.parse_action(child) for child in entity.children]
        self._index = index
        self.elements = _count(entity)

    def __call__(self, /, **values: Any) -> list[LaunchDescriptionEntity]:
        return one_round(self._children, values if self._index is None else {self._index: values["i"]})


def _count(entity: Entity) -> int:
    return 1 + sum(_count(child) for child in entity.children)


def _size_of(function: Body) -> int:
    return getattr(function, "elements", 1)


def one_round(children: list[Action], values: Mapping[str, Any]) -> list[LaunchDescriptionEntity]:
    """Copy the children, with the values as locals around them."""
    named = {local_name(name): str(value) for name, value in values.items()}

    def begin(context: LaunchContext) -> None:
        context._push_locals()
        context.extend_locals(named)

    def end(context: LaunchContext) -> None:
        context._pop_locals()

    return [OpaqueFunction(function=begin), *deepcopy(children), OpaqueFunction(function=end)]
