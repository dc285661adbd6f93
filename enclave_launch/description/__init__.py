"""Our own ``launch``, ``launch_ros``, ``launch_xml``, ``launch_yaml`` and ``ament_index_python``: upstream's API.

XML, YAML and Python launch files all build these objects; ``visit`` walks over them."""

from __future__ import annotations

from collections.abc import Callable
from operator import attrgetter
from typing import TypeVar

_Class = TypeVar("_Class")


def read_only(*names: str) -> Callable[[type[_Class]], type[_Class]]:
    """Make attributes of a class properties, as upstream's are: a launch file cannot set them, and its own subclass may
    have properties of those names. The class itself keeps the values under private names (``self.__name``)."""

    def of(cls: type[_Class]) -> type[_Class]:
        for name in names:
            private = f"_{cls.__name__.lstrip('_')}__{name}"
            if name in vars(cls):
                setattr(cls, private, vars(cls)[name])
            setattr(cls, name, property(attrgetter(private)))
        return cls

    return of
