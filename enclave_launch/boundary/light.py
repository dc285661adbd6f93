"""What every dry run uses of ``typing``, ``enum`` and ``re``, at a fraction of what it costs to import and to define.

* ``typing`` takes a twentieth of a small dry run to import. Our annotations stay text and nobody evaluates them, so
  that its names need to be there only, and a ``Protocol`` is a plain class.
* ``typing.NamedTuple`` compiles each annotation and the constructor when a class is defined. Here the constructor is
  compiled for a class with many instances, which few of the hundred classes have.
* An ``Enum`` takes as long to define as three modules of its size to import; members of ours are texts and no more.
* A pattern takes as long to compile as a small module to import, and a launch meets the texts for a few only.

Type checkers see the real things, whose interface these have. ``bench/resolve.py`` shows what start-up costs,
docs/speed.md what this saves. Modules that no dry run loads import ``typing`` itself. Pure.
"""

from __future__ import annotations

import re

TYPE_CHECKING = False

if TYPE_CHECKING:
    from enum import Enum
    from typing import Any as Any
    from typing import ClassVar as ClassVar
    from typing import Literal as Literal
    from typing import NamedTuple as NamedTuple
    from typing import NoReturn as NoReturn
    from typing import Protocol as Protocol
    from typing import TextIO as TextIO
    from typing import TypeAlias as TypeAlias
    from typing import TypeVar as TypeVar
    from typing import cast as cast
    from typing import overload as overload

    class TextEnum(str, Enum):
        """An enumeration of texts; a member is its text, also when written."""

    def late_pattern(text: str, flags: int = 0) -> re.Pattern[str]:
        """As ``re.compile`` when something is searched with it; errors of ``text`` come then."""

else:
    from collections import namedtuple

    class _Name:
        """A name of annotations, also with something in brackets; or a type variable."""

        def __init__(self, *described, **more):
            pass

        def __getitem__(self, described):
            return self

    Any = ClassVar = Literal = NoReturn = TextIO = TypeAlias = _Name()
    TypeVar = _Name

    class Protocol:
        """What has these methods; nothing asks whether an object is one."""

    def cast(kind, value):
        """``value``."""
        return value

    def overload(function):
        """``function``, which the last of its name replaces."""
        return function

    class _Texts(type):
        """Makes the texts that a class names its members, as ``enum.EnumType`` does."""

        def __new__(mcs, name, bases, members):
            texts = {key: text for key, text in members.items() if key.isupper()}
            made = super().__new__(mcs, name, bases, {**members, "_member_of": {}})
            for key, text in texts.items():
                member = made.__new__(made, *(text if isinstance(text, tuple) else (text,)))
                member.name, member.value = key, str.__str__(member)
                setattr(made, key, made._member_of.setdefault(member.value, member))
            return made

        def __call__(cls, text):
            if text not in cls._member_of:
                raise ValueError(f"{text!r} is not a valid {cls.__qualname__}")
            return cls._member_of[text]

        def __getitem__(cls, name):
            return cls.__members__[name]

        def __contains__(cls, text):
            return isinstance(text, cls) or (isinstance(text, str) and text in cls._member_of)

        def __iter__(cls):
            return iter(cls._member_of.values())

        @property
        def __members__(cls):
            return {member.name: member for member in cls}

        def __len__(cls):
            return len(cls._member_of)

    class TextEnum(str, metaclass=_Texts):
        """An enumeration of texts; a member is its text, also when written."""

        def __repr__(self):
            return f"<{type(self).__name__}.{self.name}: {self.value!r}>"

        def __reduce_ex__(self, protocol):
            return type(self), (self.value,)

    class late_pattern:
        """What ``re.compile`` gives, as soon as it is asked for anything."""

        def __init__(self, text, flags=0):
            self._given = text, flags

        def __getattr__(self, name):
            found = vars(self)[name] = getattr(re.compile(*vars(self)["_given"]), name)
            return found

        def __reduce__(self):  # for copies
            return re.compile, self._given

    _FEW = 20  # instances that are made sooner than a constructor is compiled
    _Field = type(namedtuple("_One", "field").field)

    def _constructor(cls):
        """What ``collections.namedtuple`` would compile for the fields of ``cls``."""
        names = "".join(f"{field}, " for field in cls._fields)
        code = f"lambda _cls, {names}: _tuple_new(_cls, ({names}))"
        constructor = eval(code, {"_tuple_new": tuple.__new__, "__builtins__": {}})
        constructor.__defaults__ = tuple(cls._field_defaults.values())
        return constructor

    def _values(home, args, given):
        """The fields of an instance from the arguments; ``None`` for what the constructor refuses."""
        rest = home._fields[len(args) :]
        if not rest and not given:
            return args if len(args) == len(home._fields) else None
        values = {**home._field_defaults, **given} if given else home._field_defaults
        if len(args) > len(home._fields) or not given.keys() <= {*rest} or not values.keys() >= {*rest}:
            return None
        return (*args, *[values[name] for name in rest])

    class _Definition(type):
        """Makes the annotated names of a class its fields."""

        def __new__(mcs, name, bases, members):
            if isinstance(bases[0], _Definition) and not hasattr(bases[0], "_fields"):
                fields = tuple(members["__annotations__"])
                members["_field_defaults"] = {field: members[field] for field in fields if field in members}
                members.update((field, _Field(index, "")) for index, field in enumerate(fields))
                members["_fields"] = members["__match_args__"] = fields
                members["__slots__"] = ()
            made = super().__new__(mcs, name, bases, members)
            if "_fields" in members:
                made._home, made._instances = made, 0
            return made

        @property
        def __signature__(cls):
            import inspect

            _cls, *fields = inspect.signature(_constructor(cls)).parameters.values()
            types = vars(cls._home)["__annotations__"]
            return inspect.Signature([each.replace(annotation=types.get(each.name)) for each in fields])

    class NamedTuple(tuple, metaclass=_Definition):
        """A tuple whose fields are the annotated names of the class."""

        __slots__ = ()

        def __new__(cls, /, *args, **given):
            home = cls._home
            home._instances += 1
            values = _values(home, args, given) if home._instances < _FEW else None
            if values is not None:
                return tuple.__new__(cls, values)
            home.__new__ = staticmethod(_constructor(home))
            return home.__new__(cls, *args, **given)

        @classmethod
        def _make(cls, values):
            made = tuple.__new__(cls, values)
            if len(made) != len(cls._fields):
                raise TypeError(f"Expected {len(cls._fields)} arguments, got {len(made)}")
            return made

        def _replace(self, /, **changed):
            made = self._make(map(changed.pop, self._fields, self))
            if changed:
                raise ValueError(f"Got unexpected field names: {list(changed)!r}")
            return made

        def _asdict(self):
            return dict(zip(self._fields, self, strict=True))

        def __repr__(self):
            shown = ", ".join(f"{name}={value!r}" for name, value in self._asdict().items())
            return f"{type(self).__name__}({shown})"

        def __getnewargs__(self):
            return tuple(self)
