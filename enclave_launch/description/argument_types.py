"""Checks of constructor arguments, with upstream's messages."""

from __future__ import annotations

import collections.abc
import os
from collections.abc import Iterable
from typing import Any


def isclassinstance(obj: object) -> bool:
    """Return True if ``obj`` has a class, as every object has; upstream's name for it."""
    return hasattr(obj, "__class__")


def is_a(obj: object, entity_type: type) -> bool:
    """Return True if ``obj`` is an instance of the class ``entity_type``."""
    if not isinstance(entity_type, type):
        raise RuntimeError(f"entity_type '{obj}' is not a class")
    return isinstance(obj, entity_type)


def is_a_subclass(obj: object, entity_type: type) -> bool:
    """Return True if ``obj`` is an instance or a subclass of ``entity_type``."""
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


FilePath = str | bytes | os.PathLike[str] | os.PathLike[bytes]
