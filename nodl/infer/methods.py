"""What is called or read through something else: bound methods, partial functions, properties."""

from __future__ import annotations

from typing import NamedTuple

from nodl.infer.values import BOTTOM, ClassValue, FunctionValue, Value


class BoundMethod(NamedTuple):
    """A function of the program with the object or class that becomes its first argument."""

    function: FunctionValue
    receiver: object


class NativeMethod(NamedTuple):
    """Attribute ``name`` of a string, container or modelled object."""

    receiver: object
    name: str


class ForeignMethod(NamedTuple):
    """Method ``name`` that ``receiver`` inherits from the foreign class ``path``."""

    path: str
    receiver: object
    name: str


class Partial(NamedTuple):
    """``functools.partial``: a callable with its first arguments and keywords given in advance."""

    function: Value
    positional: tuple[Value, ...]
    keywords: tuple[tuple[str, Value], ...]


class SuperProxy(NamedTuple):
    """``super()`` inside a method of ``owner`` for object ``receiver``."""

    owner: ClassValue
    receiver: object


class PropertyValue(NamedTuple):
    """``cached``: read once, then an attribute of the object."""

    getter: Value
    setter: Value = BOTTOM
    deleter: Value = BOTTOM
    cached: bool = False

    def with_accessor(self, name: str, function: Value) -> PropertyValue:
        """The property after ``@x.setter``, ``@x.deleter`` or ``@x.getter``."""
        if name == "getter":
            return self._replace(getter=function)
        return self._replace(setter=function) if name == "setter" else self._replace(deleter=function)


class ClassMethod(NamedTuple):
    """A function under ``@classmethod``, or under ``@staticmethod`` (``static``)."""

    function: Value
    static: bool
