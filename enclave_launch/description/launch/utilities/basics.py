"""The small functions that nearly every action and substitution uses."""

from __future__ import annotations

import collections.abc
import inspect
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.launch_description_entity import LaunchDescriptionEntity
from enclave_launch.description.launch.substitution import Substitution
from enclave_launch.description.launch.substitutions.text_substitution import TextSubstitution
from enclave_launch.host.current import current_release
from enclave_launch.ros_rules.distro import Feature

if TYPE_CHECKING:
    import pathlib

    from enclave_launch.description.launch.launch_context import LaunchContext
    from enclave_launch.description.launch.some_entities_type import SomeEntitiesType
    from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType


def perform_substitutions(context: LaunchContext, subs: Iterable[Substitution]) -> str:
    """Perform each and concatenate. Raises ``TypeError`` where one does not give text."""
    if type(subs) is list and len(subs) == 1:
        text = subs[0].perform(context)
        return text if type(text) is str else "".join((text,))
    return "".join([sub.perform(context) for sub in subs])


def normalize_to_list_of_substitutions(subs: SomeSubstitutionsType | pathlib.Path) -> list[Substitution]:
    """Text becomes a ``TextSubstitution``, one substitution a list. Raises ``TypeError`` for anything else."""
    if isinstance(subs, str):
        return [TextSubstitution(text=subs)]
    if type(subs) is list:
        return [item if isinstance(item, Substitution) else _normalize(item) for item in subs]
    if is_a_subclass(subs, Substitution):
        return [subs]  # type: ignore[list-item]
    if _is_path(subs):
        return [TextSubstitution(text=str(subs))]
    return [_normalize(item) for item in subs]  # type: ignore[union-attr]


def _normalize(item: object) -> Substitution:
    if isinstance(item, Substitution):
        return item
    if isinstance(item, str) or _is_path(item):
        return TextSubstitution(text=str(item))
    raise TypeError(
        f"Failed to normalize given item of type '{type(item)}', when only "
        "'str' or 'launch.Substitution' were expected."
    )


def _is_path(value: object) -> bool:
    """Is it a ``pathlib`` path, on a distribution that takes one for text?"""
    return hasattr(value, "joinpath") and current_release().has(Feature.PATHLIB_IS_TEXT)


def normalize_to_list_of_entities(entities: Iterable[SomeEntitiesType]) -> list[LaunchDescriptionEntity]:
    """Flatten one level of nesting."""
    flat: list[LaunchDescriptionEntity] = []
    for entity in entities:
        if isinstance(entity, LaunchDescriptionEntity):
            flat.append(entity)
        else:
            flat.extend(entity)
    return flat


def isclassinstance(obj: object) -> bool:
    return hasattr(obj, "__class__")


def is_a(obj: object, entity_type: type) -> bool:
    """Is ``obj`` an instance of the class ``entity_type``?"""
    if not inspect.isclass(entity_type):
        raise RuntimeError(f"entity_type '{obj}' is not a class")
    return isinstance(obj, entity_type)


def is_a_subclass(obj: object, entity_type: type) -> bool:
    """Is ``obj`` an instance or a subclass of ``entity_type``?"""
    if isinstance(obj, entity_type):
        return True
    return isinstance(obj, type) and issubclass(obj, entity_type)


_ARGUMENT_ERROR = "{}xpected '{}' to be one of [{}], but got '{}' of type '{}'"


def ensure_argument_type(
    argument: Any, types: type | Iterable[type], argument_name: str, caller: str | None = None
) -> None:
    """Raise a ``TypeError``, in upstream's words, unless ``argument`` is of one of ``types``."""
    if isinstance(types, (type, tuple)) and isinstance(argument, types):
        return
    own = "'ensure_argument_type()' e"
    if not isinstance(types, (collections.abc.Iterable, type)):
        wanted = "type, collections.abc.Iterable of type"
        raise TypeError(_ARGUMENT_ERROR.format(own, "types", wanted, types, type(types)))
    if not isinstance(argument_name, str):
        raise TypeError(
            _ARGUMENT_ERROR.format(own, "argument_name", "str", argument_name, type(argument_name))
        )
    if caller is not None and not isinstance(caller, str):
        raise TypeError(_ARGUMENT_ERROR.format(own, "caller", "str, None", caller, type(caller)))
    allowed = list(types) if isinstance(types, collections.abc.Iterable) else [types]
    if not any(isinstance(argument, allowed_type) for allowed_type in allowed):
        start = "E" if caller is None else f"'{caller}' e"
        names = ", ".join(str(allowed_type) for allowed_type in allowed)
        raise TypeError(_ARGUMENT_ERROR.format(start, argument_name, names, argument, type(argument)))
