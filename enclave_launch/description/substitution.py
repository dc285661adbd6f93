"""Substitutions: what stands for a text that is only known when it is performed."""

from __future__ import annotations

import collections.abc
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from enclave_common.files import MEBIBYTE
from enclave_launch.host.current import current_release
from enclave_launch.host.user_code import is_users, once
from enclave_launch.ros_rules.distro import Feature

if TYPE_CHECKING:
    import pathlib

    from enclave_launch.description.launch_context import LaunchContext


class Substitution:
    """Performed against a context, gives text. Third parties subclass it; only ``perform`` is required."""

    def __init_subclass__(cls, **kwargs: Any) -> None:
        """Remember results of the user's classes: the start that follows a plan does not call ``perform`` again."""
        super().__init_subclass__(**kwargs)
        perform = vars(cls).get("perform")
        if perform is not None and is_users(perform):
            cls.perform = once(perform)  # type: ignore[method-assign]

    def describe(self) -> str:
        return repr(self)

    def perform(self, context: LaunchContext) -> str:
        raise NotImplementedError("perform() not implemented for Substitution base class.")


class TextSubstitution(Substitution):
    """Stands for itself."""

    def __init__(self, *, text: str) -> None:
        if not isinstance(text, str):
            raise TypeError(f"TextSubstitution expected Text object got '{type(text)}' instead.")
        self.__text = text

    @property
    def text(self) -> str:
        return self.__text

    def describe(self) -> str:
        return f"'{self.__text}'"

    def perform(self, context: LaunchContext) -> str:
        return self.__text


MAX_TEXT = 4 * MEBIBYTE
"""Characters that substitutions may give together. Values can double with each ``let``; no process takes more."""


class SubstitutionFailure(RuntimeError):
    """The message says why."""


class OpaqueValueUsed(TypeError):
    """A launch file needs the value of something that a module which is not installed would have given.

    A ``TypeError``: ``list()`` asks for a length first, and goes on without.
    """

    def __init__(self, value: str, module: str, use: str) -> None:
        self.value = value
        self.module = module
        super().__init__(
            f"{value} is used as {use}, and is not known: the Python module '{module}' is not installed; install it, "
            "for dry runs go on only where such a value is handed on"
        )


# What an action accepts where text is expected: text, a substitution, or a sequence of both to concatenate.

SomeSubstitutionsType = str | Substitution | collections.abc.Iterable[str | Substitution]
SomeSubstitutionsType_types_tuple = (str, Substitution, collections.abc.Iterable)


def perform_substitutions(context: LaunchContext, subs: Iterable[Substitution], limit: int = MAX_TEXT) -> str:
    """Perform each and concatenate; raises ``SubstitutionFailure`` for more than ``limit`` characters."""
    if type(subs) is list and len(subs) == 1:
        text = subs[0].perform(context)
        text = text if type(text) is str else "".join((text,))
    else:
        text = "".join([sub.perform(context) for sub in subs])
    if len(text) > limit:
        raise SubstitutionFailure(f"substitutions give a text of more than {limit} characters")
    return text


def normalize_to_list_of_substitutions(subs: SomeSubstitutionsType | pathlib.Path) -> list[Substitution]:
    """Return text as a ``TextSubstitution``, one substitution as a list, an iterable item by item.

    Raises ``TypeError`` for anything else.
    """
    if isinstance(subs, str):
        return [TextSubstitution(text=subs)]
    if type(subs) is list:
        return [item if isinstance(item, Substitution) else _normalize(item) for item in subs]
    if _is_substitution(subs):
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
    """Return True for a ``pathlib`` path, on a distribution that takes one for text."""
    return hasattr(value, "joinpath") and current_release().has(Feature.PATHLIB_IS_TEXT)


def _is_substitution(value: object) -> bool:
    """Return True for a substitution, or a class of substitutions, which upstream takes as well."""
    return isinstance(value, Substitution) or (isinstance(value, type) and issubclass(value, Substitution))
