"""``include``: another launch file or description, with the two ways it can go wrong that are ours to see: a file of a
package that is not installed, and an include that never ends.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from enclave_launch.description import read_only
from enclave_launch.description.actions.configurations import SetLaunchConfiguration
from enclave_launch.description.actions.flow import OpaqueFunction
from enclave_launch.description.argument_scan import check_required_arguments, misspelt
from enclave_launch.description.entity import Action, LaunchDescriptionEntity, ScanRole
from enclave_launch.description.launch_context import LaunchContext, OpenFile
from enclave_launch.description.markup.entity import Entity
from enclave_launch.description.markup.expose import expose_action
from enclave_launch.description.sources import AnyLaunchDescriptionSource, LaunchDescriptionSource
from enclave_launch.description.substitution import normalize_to_list_of_substitutions, perform_substitutions
from enclave_launch.diagnostics.evaluation import include_argument_unknown, include_left_out
from enclave_launch.host.current import current_release
from enclave_launch.ros_rules.distro import Feature

if TYPE_CHECKING:
    from enclave_launch.description.launch_description import LaunchDescription
    from enclave_launch.description.markup.entity import Parser
    from enclave_launch.description.substitution import SomeSubstitutionsType


MAX_DEPTH = 450
"""Nested includes; upstream runs out of stack at about this depth."""


class CyclicIncludeError(RuntimeError):
    """A launch file that includes itself, directly or through others, without end."""


def left_out(include: IncludeLaunchDescription, context: LaunchContext) -> bool:
    """Return True, and warn, if ``include`` names a file that is missing and may be."""
    source = include.launch_description_source
    location = source.expand(context)
    if not context.host.allow_missing_packages or not source.is_file or os.path.exists(location):
        return False
    context.host.warn(include_left_out(location))
    return True


def prepare_include(include: IncludeLaunchDescription, context: LaunchContext) -> LaunchDescription:
    """Return the description to visit: whatever a Python file returned. Raises ``CyclicIncludeError``."""
    source = include.launch_description_source
    _check_cycle(source.expand(context), context)
    return source.get_launch_description(context)


def _check_cycle(location: str, context: LaunchContext) -> None:
    """Raise ``CyclicIncludeError`` if a file is entered again in the same state, or too deep."""
    path = os.path.abspath(location)
    state = (path, context.launch_configurations, context.process_environment.snapshot())
    repeated = state in context.open_files
    if repeated or len(context.open_files) >= MAX_DEPTH:
        cycle = [known for known, *_ in context.open_files]
        if path in cycle:
            cycle = cycle[len(cycle) - 1 - cycle[::-1].index(path) :]
        raise CyclicIncludeError(
            "launch files include each other without end: " + " -> ".join([*cycle, path])
        )


def opened(include: IncludeLaunchDescription, context: LaunchContext) -> tuple[OpenFile, ...]:
    """Return the files open below ``include``."""
    path = os.path.abspath(include.launch_description_source.location)
    return (*context.open_files, (path, *include.entered_with))


_FILE_LOCALS = ("current_launch_file_path", "current_launch_file_directory")
Arguments = Iterable[tuple["SomeSubstitutionsType", "SomeSubstitutionsType"]]


@expose_action("include")
@read_only("launch_description_source", "launch_arguments")
class IncludeLaunchDescription(Action):
    """Loads another description and gives its entities; opens no scope: what the file sets stays set."""

    scan_role = ScanRole.INCLUDE
    launch_description_source: LaunchDescriptionSource
    launch_arguments: tuple[tuple[SomeSubstitutionsType, SomeSubstitutionsType], ...]

    def __init__(
        self,
        launch_description_source: LaunchDescriptionSource | SomeSubstitutionsType,
        *,
        launch_arguments: Arguments | None = None,
        **kwargs: Any,
    ) -> None:
        super().__init__(**kwargs)
        if not isinstance(launch_description_source, LaunchDescriptionSource):
            launch_description_source = AnyLaunchDescriptionSource(launch_description_source)
        self.__launch_description_source: LaunchDescriptionSource = launch_description_source
        self.__launch_arguments = () if launch_arguments is None else tuple(launch_arguments)
        self.entered_with: tuple[dict[str, Any], dict[str, str]] = ({}, {})  # the state when it was executed

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        kwargs["launch_description_source"] = parser.parse_substitution(entity.get_attr("file"))
        given = list(entity.get_attr("arg", data_type=list[Entity], optional=True) or ())
        release = current_release()
        if Feature.LET_IN_INCLUDE in release.features:
            lets = entity.get_attr("let", data_type=list[Entity], optional=True) or ()
            given += lets if lets and release.has(Feature.LET_IN_INCLUDE) else ()
        if given:
            parse = parser.parse_substitution
            kwargs["launch_arguments"] = [
                (parse(child.get_attr("name")), parse(child.get_attr("value"))) for child in given
            ]
            for child in given:
                child.assert_entity_completely_parsed()
        return cls, kwargs

    def get_sub_entities(self) -> list[LaunchDescriptionEntity]:
        description = self.__launch_description_source.try_get_launch_description_without_context()
        return [] if description is None else [description]

    def argument_names_without_context(self) -> list[str] | None:
        """Return the names of the arguments given; None if one needs a context."""
        context = LaunchContext()
        try:
            return self.__argument_names(context)
        except Exception:  # a name may be any substitution, ours or a third party's
            return None

    def __argument_names(self, context: LaunchContext) -> list[str]:
        return [
            perform_substitutions(context, normalize_to_list_of_substitutions(name))
            for name, _ in self.__launch_arguments
        ]

    def execute(self, context: LaunchContext) -> list[LaunchDescriptionEntity]:

        self.entered_with = dict(context.launch_configurations), context.process_environment.snapshot()
        if left_out(self, context):
            return []
        description = prepare_include(self, context)
        before = {name: context.get_locals_as_dict().get(name) for name in _FILE_LOCALS}
        self.__set_file_locals(context)
        names = self.__argument_names(context)
        check_required_arguments(description, list(names))
        for name, question in misspelt(description, names):
            path = self.__launch_description_source.location
            context.host.warn(include_argument_unknown(name, path, question, self.source_location))
        arguments = [SetLaunchConfiguration(name, value) for name, value in self.__launch_arguments]
        for argument in arguments:  # an error in one stands where the include stands
            argument.source_location = self.source_location
        if context.host.release.has(Feature.SCOPED_FILE_LOCALS) and None not in before.values():
            leave = OpaqueFunction(function=lambda context: context.extend_locals(before))
            return [*arguments, description, leave]
        return [*arguments, description]

    def __set_file_locals(self, context: LaunchContext) -> None:
        path = os.path.abspath(self.__launch_description_source.location)
        exists = os.path.exists(path)
        context.extend_locals(
            {
                "current_launch_file_path": path,
                "current_launch_file_directory": os.path.dirname(path)
                if exists
                else self.__launch_description_source.location,
            }
        )
