"""The bases: of everything that can stand in a launch description, and of all actions."""

from __future__ import annotations

import collections.abc
import sys
from collections.abc import Iterable
from enum import Enum
from types import FrameType
from typing import TYPE_CHECKING, Any

from enclave_common.source_location import SourceLocation
from enclave_launch.description import read_only
from enclave_launch.description.conditions import Condition, IfCondition, UnlessCondition
from enclave_launch.description.events.event import ExecutionComplete
from enclave_launch.description.location import location_of
from enclave_launch.description.substitution import OpaqueValueUsed
from enclave_launch.host.user_code import executed_once, is_users
from enclave_launch.process import Unforeseeable

if TYPE_CHECKING:
    from enclave_launch.description.launch_context import LaunchContext
    from enclave_launch.description.markup.entity import Entity, Parser


_OURS = "enclave_launch."
_BUILDERS = (
    "enclave_launch.description.markup",
    "enclave_launch.description.visit",
    "enclave_launch.description.argument_scan",
    "enclave_launch.evaluation",
)


class ScanRole(Enum):
    """The role of an entity in the scan of a description's arguments."""

    ARGUMENT = "argument"
    INCLUDE = "include"
    RESET = "reset"


class LaunchDescriptionEntity:
    """Visited when launching; described when only printed.

    ``source_location`` is where it was written: the element of an XML or YAML file (set by the front end), or
    the statement of a Python file that created the object.
    """

    source_location: SourceLocation | None = None
    scan_role: ScanRole | None = None
    built_by_front_end = False  # built for each evaluation, unlike what a Python file builds

    def describe(self) -> str:
        raise NotImplementedError()

    def describe_sub_entities(self) -> list[LaunchDescriptionEntity]:
        """Return the entities that a visit will always give, as far as known without a context."""
        return []

    def describe_conditional_sub_entities(self) -> list[tuple[str, Iterable[LaunchDescriptionEntity]]]:
        """Return entities that a visit may give: the condition in words, and what depends on it."""
        return []

    def visit(self, context: LaunchContext) -> list[LaunchDescriptionEntity] | None:
        """Do it, and give the entities to visit next. Must not block."""
        return None

    def get_asyncio_future(self) -> Any:
        """Return a future that is done when what the visit began has ended; None if nothing goes on."""
        return None


def creation_location(element: str) -> SourceLocation | None:
    """Return the nearest calling frame outside of our own code; None if a front end or a visit builds the object."""
    frame: FrameType | None = sys._getframe(2)
    while frame is not None:
        name: str = frame.f_globals.get("__name__", "")
        if not name.startswith(_OURS):
            return SourceLocation(frame.f_code.co_filename, frame.f_lineno, element)
        if name.startswith(_BUILDERS):
            return None
        frame = frame.f_back
    return None


SomeEntitiesType = LaunchDescriptionEntity | collections.abc.Iterable[LaunchDescriptionEntity]
SomeEntitiesType_types_tuple = (LaunchDescriptionEntity, collections.abc.Iterable)
SomeActionsType = SomeEntitiesType  # humble's names
SomeActionsType_types_tuple = SomeEntitiesType_types_tuple


def normalize_to_list_of_entities(entities: Iterable[SomeEntitiesType]) -> list[LaunchDescriptionEntity]:
    """Flatten one level of nesting."""
    flat: list[LaunchDescriptionEntity] = []
    for entity in entities:
        if isinstance(entity, LaunchDescriptionEntity):
            flat.append(entity)
        else:
            flat.extend(entity)
    return flat


@read_only("condition")
class Action(LaunchDescriptionEntity):
    """An intention, carried out by ``execute`` when its condition holds; else no substitution is performed."""

    condition: Condition | None

    def __init_subclass__(cls, **kwargs: Any) -> None:
        """Remember results of the user's classes: the start that follows a plan does not call ``execute`` again."""
        super().__init_subclass__(**kwargs)
        execute = vars(cls).get("execute")
        if execute is not None and is_users(execute):
            cls.execute = executed_once(execute)  # type: ignore[method-assign]

    def __init__(self, *, condition: Condition | None = None) -> None:
        self.__condition = condition
        self.source_location = creation_location(type(self).__name__)

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        """Parse the constructor arguments that every element has: ``if`` and ``unless``."""
        given = entity.given
        if "if" not in given and "unless" not in given:
            return Action, {}
        if_text = entity.get_attr("if", optional=True)
        unless_text = entity.get_attr("unless", optional=True)
        if if_text is None and unless_text is None:
            return Action, {}
        if if_text is not None and unless_text is not None:
            raise RuntimeError("if and unless conditions can't be used simultaneously")
        if if_text is not None:
            return Action, {"condition": IfCondition(parser.parse_substitution(if_text))}
        return Action, {"condition": UnlessCondition(parser.parse_substitution(unless_text or ""))}

    def describe(self) -> str:
        return repr(self)

    def get_sub_entities(self) -> list[LaunchDescriptionEntity]:
        """Return the entities that ``execute`` will give, as far as known without a context."""
        return []

    def describe_sub_entities(self) -> list[LaunchDescriptionEntity]:
        return self.get_sub_entities() if self.condition is None else []

    def describe_conditional_sub_entities(self) -> list[tuple[str, Iterable[LaunchDescriptionEntity]]]:
        if self.condition is None:
            return []
        return [(f"Conditionally included by {self.describe()}", self.get_sub_entities())]

    def visit(self, context: LaunchContext) -> list[LaunchDescriptionEntity] | None:
        if not self.__holds(context):
            return None
        try:
            return self.execute(context)
        finally:
            if context.awaits_completion():
                _report_completion(self, context)

    def __holds(self, context: LaunchContext) -> bool:
        """Evaluate the condition. One that is not known does not hold, and is reported."""
        try:
            return self.__condition is None or self.__condition.evaluate(context)
        except OpaqueValueUsed as error:
            what = f"whether this {type(self).__name__} is executed, which depends on {error.value}"
            text = f"{what}: the Python module '{error.module}' is not installed"
            context.host.unforeseeable(Unforeseeable(text, location_of(self, context)))
            return False

    def execute(self, context: LaunchContext) -> list[LaunchDescriptionEntity] | None:
        """Execute the action and return the entities to visit next. The base does nothing."""
        return None


def _report_completion(action: Action, context: LaunchContext) -> None:
    """Emit ``ExecutionComplete`` once the action is done, only if a handler registered by now would take it."""
    event = ExecutionComplete(action=action)
    if not context.would_handle_event(event):
        return
    future = action.get_asyncio_future()
    if future is None:
        context.emit_event_sync(event)
    else:
        future.add_done_callback(lambda _: context.emit_event_sync(event))
