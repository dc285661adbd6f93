"""Our ``NamedTuple`` is ``typing``'s, but for what it costs to define."""

from __future__ import annotations

import copy
import inspect
import pickle
import typing
from collections.abc import Callable

import pytest

from enclave_launch.boundary import light


class Ours(light.NamedTuple):
    """A remap rule."""

    source: str
    target: str = "/chatter"
    line: int | None = None

    @property
    def text(self) -> str:
        return f"{self.source}:={self.target}"


class Theirs(typing.NamedTuple):
    """A remap rule."""

    source: str
    target: str = "/chatter"
    line: int | None = None

    @property
    def text(self) -> str:
        return f"{self.source}:={self.target}"


class OursWithMore(Ours):
    def twice(self) -> str:
        return self.text * 2


USES: dict[str, Callable[[type[Ours] | type[Theirs]], object]] = {
    "by position": lambda kind: tuple(kind("a", "b", 3)),
    "by name, defaults for the rest": lambda kind: tuple(kind(source="a", line=3)),
    "a field by name": lambda kind: (kind("a").target, kind("a").text),
    "a field is missing": lambda kind: kind(),  # type: ignore[call-arg]
    "a field is unknown": lambda kind: kind("a", colour="red"),  # type: ignore[call-arg]
    "a field is given twice": lambda kind: kind("a", source="b"),  # type: ignore[misc]
    "one too many": lambda kind: kind("a", "b", 3, 4),  # type: ignore[call-arg]
    "a value cannot be set": lambda kind: setattr(kind("a"), "source", "b"),
    "an attribute cannot be added": lambda kind: setattr(kind("a"), "colour", "red"),
    "shown": lambda kind: repr(kind("a", line=3)).removeprefix(kind.__name__),
    "equal and hashed as a tuple": lambda kind: (kind("a") == ("a", "/chatter", None), hash(kind("a"))),
    "replaced": lambda kind: tuple(kind("a")._replace(line=4)),
    "an unknown field replaced": lambda kind: kind("a")._replace(colour="red"),  # type: ignore[call-arg]
    "made of a list": lambda kind: tuple(kind._make(["a", "b", 1])),
    "made of a list that is too short": lambda kind: kind._make(["a"]),
    "as a dictionary": lambda kind: kind("a")._asdict(),
    "what it tells of itself": lambda kind: (kind._fields, kind._field_defaults, kind.__match_args__, kind.__doc__),
    "its signature": lambda kind: [(each.name, each.default) for each in inspect.signature(kind).parameters.values()],
    "what its annotations are": lambda kind: typing.get_type_hints(kind),
    "copied": lambda kind: tuple(copy.deepcopy(kind("a"))),
    "pickled": lambda kind: type(pickle.loads(pickle.dumps(kind("a")))) is kind,
}  # fmt: skip


def outcome(use: Callable[[type[Ours] | type[Theirs]], object], kind: type[Ours] | type[Theirs]) -> object:
    try:
        return use(kind)
    except (TypeError, ValueError, AttributeError) as error:
        return type(error)


@pytest.mark.parametrize("use", USES)
def test_it_is_used_as_typings(use: str) -> None:
    assert outcome(USES[use], Ours) == outcome(USES[use], Theirs)


@pytest.mark.parametrize("use", USES)
def test_it_is_used_so_when_there_are_many_too(use: str) -> None:
    for number in range(100):
        Ours(str(number))
    assert outcome(USES[use], Ours) == outcome(USES[use], Theirs)


def test_a_pattern_takes_it_apart() -> None:
    match Ours("a", line=3):
        case Ours(source, line=line):
            assert (source, line) == ("a", 3)
        case _:
            raise AssertionError


def test_a_subclass_adds_methods() -> None:
    made = OursWithMore("a")
    assert made.twice() == "a:=/chattera:=/chatter"
    assert type(made._replace(line=1)) is OursWithMore


def test_classes_of_equal_fields_stay_apart() -> None:
    class Other(light.NamedTuple):
        source: str
        target: str

    assert Other("a", "b").target == "b"
    assert Ours("a").target == "/chatter"
    with pytest.raises(TypeError):
        Other("a")  # type: ignore[call-arg]
